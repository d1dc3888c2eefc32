// What both plots share: a canvas that follows its size and the screen's pixels, axes, ticks, colours of the theme.

export const theme = () => {
  const style = getComputedStyle(document.documentElement);
  return (name) => style.getPropertyValue(`--${name}`).trim();
};

const SUPERSCRIPT = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const power = (exponent) =>
  `10${exponent < 0 ? "⁻" : ""}${[...String(Math.abs(exponent))].map((digit) => SUPERSCRIPT[digit]).join("")}`;

/** A linear or logarithmic axis from `low` to `high`, drawn between the pixels `from` and `to`. */
export class Axis {
  constructor(low, high, log, from, to) {
    Object.assign(this, { low, high, log, from, to });
    this.a = log ? Math.log10(low) : low;
    this.b = log ? Math.log10(high) : high;
  }

  share(value) {
    if (this.log && !(value > 0)) return 0;
    return ((this.log ? Math.log10(value) : value) - this.a) / (this.b - this.a);
  }

  pixel(value) {
    return this.from + this.share(value) * (this.to - this.from);
  }

  value(pixel) {
    const x = this.a + ((pixel - this.from) / (this.to - this.from)) * (this.b - this.a);
    return this.log ? 10 ** x : x;
  }

  /** -1 below the axis, 1 above it, 0 on it. */
  side(value) {
    const slack = 1e-9 * (this.b - this.a);
    const place = this.log ? (value > 0 ? Math.log10(value) : -Infinity) : value;
    return place < this.a - slack ? -1 : Number(place > this.b + slack);
  }

  clamp(value) {
    return Math.min(Math.max(value, this.low), this.high);
  }

  /** [value, label] of the ticks, with room for each. */
  ticks(room) {
    const most = Math.max(2, Math.floor(Math.abs(this.to - this.from) / room));
    if (this.log) {
      const step = Math.max(1, Math.ceil((this.b - this.a) / most));
      const found = [];
      for (let e = Math.ceil(this.a - 1e-9); e <= this.b + 1e-9; e += 1) if (e % step === 0) found.push([10 ** e, power(e)]);
      return found;
    }
    const raw = (this.b - this.a) / most;
    const unit = 10 ** Math.floor(Math.log10(raw));
    const step = unit * ([1, 2, 5, 10].find((factor) => factor * unit >= raw) ?? 10);
    const found = [];
    for (let i = Math.ceil(this.a / step); i * step <= this.b * (1 + 1e-12); i += 1) found.push([i * step, String(Number((i * step).toPrecision(6)))]);
    return found;
  }
}

/** A canvas in CSS pixels, redrawn by `draw(context, width, height)` when its size, the screen or the theme changes. */
export class Plot {
  constructor(canvas, draw) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.painter = draw;
    this.waiting = false;
    new ResizeObserver(() => this.redraw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      const { clientWidth: width, clientHeight: height } = this.canvas;
      if (!width || !height) return;
      const scale = devicePixelRatio || 1;
      const [w, h] = [Math.round(width * scale), Math.round(height * scale)];
      if (this.canvas.width !== w || this.canvas.height !== h) Object.assign(this.canvas, { width: w, height: h });
      this.context.setTransform(scale, 0, 0, scale, 0, 0);
      this.context.clearRect(0, 0, width, height);
      this.painter(this.context, width, height);
    });
  }

  /** The plot as a PNG of twice its size, on the card's colour, with rows of { text, style, dash } below it. */
  picture(rows) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const whole = height + 20 * rows.length + 14;
    const canvas = Object.assign(document.createElement("canvas"), { width: 2 * width, height: 2 * whole });
    const context = canvas.getContext("2d");
    const colour = theme();
    context.setTransform(2, 0, 0, 2, 0, 0);
    context.fillStyle = colour("card");
    context.fillRect(0, 0, width, whole);
    this.painter(context, width, height);
    context.font = "13px system-ui, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "middle";
    rows.forEach(({ text, style, dash }, i) => {
      const y = height + 10 + 20 * i;
      if (style) drawSample(context, 16, y, style, dash);
      context.fillStyle = colour("text");
      context.fillText(text, style ? 52 : 16, y, width - 60);
    });
    return new Promise((done) => { canvas.toBlob(done, "image/png"); });
  }

  /** Calls back with the pointer's place: move(x, y), pick(x, y) for click and drag, leave(). */
  follow({ move, pick, leave }) {
    const place = (event) => {
      const box = this.canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    this.canvas.addEventListener("pointermove", (event) => (event.buttons & 1 ? pick : move)(...place(event)));
    this.canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      if (event.pointerType === "mouse") this.canvas.setPointerCapture(event.pointerId);
      pick(...place(event));
    });
    this.canvas.addEventListener("pointerleave", leave);
  }
}

export function drawAxes(context, xAxis, yAxis, xTitle, yTitle, grid = true) {
  const colour = theme();
  context.font = "12px system-ui, sans-serif";
  context.lineWidth = 1;
  context.strokeStyle = colour("grid");
  context.fillStyle = colour("soft");
  const line = (x1, y1, x2, y2) => {
    context.beginPath();
    context.moveTo(x1, y1);
    context.lineTo(x2, y2);
    context.stroke();
  };
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const [value, label] of xAxis.ticks(56)) {
    const x = Math.round(xAxis.pixel(value)) + 0.5;
    if (grid) line(x, yAxis.from, x, yAxis.to);
    else line(x, yAxis.from, x, yAxis.from + 4);
    context.fillText(label, x, yAxis.from + 7);
  }
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const [value, label] of yAxis.ticks(36)) {
    const y = Math.round(yAxis.pixel(value)) + 0.5;
    if (grid) line(xAxis.from, y, xAxis.to, y);
    else line(xAxis.from - 4, y, xAxis.from, y);
    context.fillText(label, xAxis.from - 7, y);
  }
  context.fillStyle = colour("text");
  context.textAlign = "center";
  context.textBaseline = "bottom";
  context.fillText(xTitle, (xAxis.from + xAxis.to) / 2, yAxis.from + 40);
  context.save();
  context.translate(xAxis.from - 42, (yAxis.from + yAxis.to) / 2);
  context.rotate(-Math.PI / 2);
  context.textBaseline = "top";
  context.fillText(yTitle, 0, -10);
  context.restore();
}

/** A short line in a curve's style, for a legend. */
export function drawSample(context, x, y, style, dash) {
  Object.assign(context, { strokeStyle: style, lineWidth: 2.2 });
  context.setLineDash(dash);
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(x + 28, y);
  context.stroke();
  context.setLineDash([]);
}

/** The user's point; outside of the plot, an arrow on its frame that points to it (`out`: -1, 0 or 1 for x and for y). */
export function drawPoint(context, x, y, out = [0, 0]) {
  const colour = theme();
  context.beginPath();
  if (out[0] || out[1]) {
    const turn = Math.atan2(-out[1], out[0]);
    [[0, 0], [-18, -10], [-18, 10]].forEach(([a, b], i) =>
      context[i ? "lineTo" : "moveTo"](x + a * Math.cos(turn) - b * Math.sin(turn), y + a * Math.sin(turn) + b * Math.cos(turn)));
    context.closePath();
  } else context.arc(x, y, 7, 0, 2 * Math.PI);
  context.fillStyle = colour("point");
  context.fill();
  context.lineWidth = 2.5;
  context.strokeStyle = "#ffffff";
  context.stroke();
}
