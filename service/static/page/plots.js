// What the plots share: an SVG that follows its size, axes and ticks, curves, the user's point, pictures for download.

/** An SVG element with attributes and children; null children are left out. */
export function draw(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children.flat().filter((child) => child !== null));
  return element;
}

export const label = (text, x, y, className = "", anchor = "middle") =>
  draw("text", { x, y, class: className, "text-anchor": anchor }, text);
export const line = (x1, y1, x2, y2, className) => draw("path", { d: `M${x1} ${y1}L${x2} ${y2}`, class: className });

const SUPERSCRIPT = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const power = (exponent) =>
  `10${exponent < 0 ? "⁻" : ""}${[...String(Math.abs(exponent))].map((digit) => SUPERSCRIPT[digit]).join("")}`;

/** A linear or logarithmic axis from `low` to `high`, drawn between the pixels `from` and `to`. */
export class Axis {
  constructor(low, high, log, from, to) {
    Object.assign(this, { low, high, log, from, to });
    [this.a, this.b] = log ? [Math.log10(low), Math.log10(high)] : [low, high];
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
    return this.clamp(this.log ? 10 ** x : x);
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

  /** [value, label] of the ticks, with `room` pixels for each. */
  ticks(room) {
    const most = Math.max(2, Math.floor(Math.abs(this.to - this.from) / room));
    const raw = (this.b - this.a) / most;
    const unit = this.log ? 1 : 10 ** Math.floor(Math.log10(raw));
    const nice = [1, 2, 5, 10].find((factor) => factor * unit >= 0.999 * raw);
    const step = this.log ? Math.max(1, Math.ceil(raw)) : unit * nice;
    const found = [];
    for (let i = Math.ceil(this.a / step - 1e-9); i * step <= this.b + 1e-9 * (this.b - this.a); i += 1) {
      const at = i * step;
      found.push(this.log ? [10 ** at, power(at)] : [at, String(Number(at.toPrecision(6)))]);
    }
    return found;
  }
}

/** Both axes with ticks, titles, and with `grid` lines through the plot. */
export function axes(x, y, xTitle, yTitle, grid = true) {
  const [middle, centre] = [(x.from + x.to) / 2, (y.from + y.to) / 2];
  const [left, bottom] = [x.from - 43, y.from + 38];
  return [
    ...x.ticks(56).flatMap(([value, text]) => {
      const at = x.pixel(value);
      return [line(at, y.from, at, grid ? y.to : y.from + 4, "grid"), label(text, at, y.from + 18, "tick")];
    }),
    ...y.ticks(36).flatMap(([value, text]) => {
      const at = y.pixel(value);
      return [line(x.from, at, grid ? x.to : x.from - 4, at, "grid"), label(text, x.from - 7, at + 4, "tick", "end")];
    }),
    label(xTitle, middle, bottom),
    draw("text", { transform: `translate(${left} ${centre}) rotate(-90)`, "text-anchor": "middle" }, yTitle),
  ];
}

/** A curve through points in pixels. */
export const curve = (xs, ys, attributes) =>
  draw("path", { d: `M${xs.map((x, i) => `${x.toFixed(2)} ${ys[i].toFixed(2)}`).join("L")}`, ...attributes });

/** The area between two curves through points in pixels. */
export function band(xs, lows, highs) {
  const points = [...xs.map((x, i) => [x, highs[i]]), ...xs.map((x, i) => [x, lows[i]]).reverse()];
  const places = points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`);
  return draw("path", { d: `M${places.join("L")}Z`, class: "band" });
}

/** What is drawn inside of both axes; nothing of it leaves them. */
export const inside = (x, y, ...children) => {
  const [width, height] = [x.to - x.from, y.from - y.to];
  const box = { x: x.from, y: y.to, width, height, viewBox: `${x.from} ${y.to} ${width} ${height}` };
  return draw("svg", { ...box, overflow: "hidden" }, ...children);
};

/** The user's point; where it is outside, an arrow on the frame that points to it (`out`: -1, 0 or 1 for x and y). */
export function point(x, y, out = [0, 0]) {
  const shape = out[0] || out[1] ? "M0 0L-18 -10L-18 10Z" : "M-7 0a7 7 0 1 0 14 0a7 7 0 1 0 -14 0Z";
  const turn = (Math.atan2(-out[1], out[0]) * 180) / Math.PI;
  return draw("path", { d: shape, class: "point", transform: `translate(${x} ${y}) rotate(${turn})` });
}

const LOOKS = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin",
  "font", "paint-order"];

/** An SVG in CSS pixels, filled by `paint(width, height)` -> elements when its size or what it shows changes. */
export class Plot {
  constructor(svg, paint) {
    Object.assign(this, { svg, paint, waiting: false });
    new ResizeObserver(() => this.redraw()).observe(svg);
  }

  redraw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      const { clientWidth: width, clientHeight: height } = this.svg;
      if (!width || !height) return;
      this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
      this.svg.replaceChildren(...this.paint(width, height).flat().filter((child) => child !== null));
    });
  }

  /** Calls back with the pointer's place: move(x, y), pick(x, y) for click and drag, leave(). */
  follow({ move, pick, leave }) {
    const { svg } = this;
    const place = (event) => {
      const box = svg.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    svg.addEventListener("pointermove", (event) => (event.buttons & 1 ? pick : move)(...place(event)));
    svg.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      if (event.pointerType === "mouse") svg.setPointerCapture(event.pointerId);
      pick(...place(event));
    });
    svg.addEventListener("pointerleave", leave);
  }

  /** The plot as an SVG file on the card's colour, with a line of text below it. */
  picture(text) {
    const { clientWidth: width, clientHeight: height } = this.svg;
    const size = { width, height: height + 24 };
    const looks = getComputedStyle(this.svg);
    const narrow = 7 * text.length > width - 32 ? { textLength: width - 32, lengthAdjust: "spacingAndGlyphs" } : {};
    const words = { x: 16, y: height + 12, fill: looks.color, "font-family": "sans-serif", "font-size": 13, ...narrow };
    const back = draw("rect", { ...size, fill: looks.getPropertyValue("--card") });
    const copy = draw("svg", size, back, [...this.svg.children].map(withLooks), draw("text", words, text));
    return new Blob([new XMLSerializer().serializeToString(copy)], { type: "image/svg+xml" });
  }
}

/** A copy of a drawn element that looks the same without the style sheet. */
function withLooks(element) {
  const copy = element.cloneNode(false);
  const looks = getComputedStyle(element);
  for (const name of LOOKS) copy.style.setProperty(name, looks.getPropertyValue(name));
  copy.append(...[...element.childNodes].map((child) => (child.nodeType === 1 ? withLooks(child) : child.cloneNode())));
  return copy;
}
