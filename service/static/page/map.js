// The map of mu~ over (v~, y~): colours, isolines, the border, the user's point.
import { Axis, Plot, drawAxes, drawPoint } from "./plot.js";

const VIRIDIS = ["440154", "482878", "3e4989", "31688e", "26828e", "1f9e89", "35b779", "6ece58", "b5de2b", "fde725"].map((hex) =>
  [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16)));
const LEVELS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99];
// label -> where along v~ it stands, so that labels keep clear of each other and of the border
const LABELS = new Map([[0.01, 0.45], [0.1, 0.55], [0.3, 0.66], [0.5, 0.75], [0.7, 0.83], [0.9, 0.9], [0.99, 0.94]]);

const colourOf = (share) => {
  const x = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
  const i = Math.min(Math.floor(x), VIRIDIS.length - 2);
  return VIRIDIS[i].map((low, channel) => Math.round(low + (x - i) * (VIRIDIS[i + 1][channel] - low)));
};

export class FrictionMap {
  /** `pick(vTilde, yTilde)` when the user moves the point, `hover(vTilde, yTilde, ratio)` or `hover(null)`. */
  constructor(canvas, pick, hover) {
    this.data = null;
    this.point = null;
    this.plot = new Plot(canvas, (...place) => this.draw(...place));
    const at = (x, y) => [this.x.clamp(this.x.value(x)), this.y.clamp(this.y.value(y))];
    this.plot.follow({
      move: (x, y) => {
        if (!this.data) return;
        const inside = x >= this.x.from && x <= this.x.to && y >= this.y.to && y <= this.y.from;
        if (inside) hover(...at(x, y), this.ratio(...at(x, y)));
        else hover(null);
      },
      pick: (x, y) => this.data && pick(...at(x, y)),
      leave: () => hover(null),
    });
  }

  show(data) {
    this.data = data;
    this.image = null;
    this.lines = null;
    this.plot.redraw();
  }

  move(point) {
    this.point = point;
    this.plot.redraw();
  }

  /** Place in the grid, in cells. */
  cell(v, y) {
    const { v_tilde: a, y_tilde: b } = this.data;
    const place = ({ start, stop, n }, value) =>
      ((Math.log10(value) - Math.log10(start)) / (Math.log10(stop) - Math.log10(start))) * (n - 1);
    return [place(a, v), place(b, y)];
  }

  node(i, j) {
    return this.data.mu_ratio[j * this.data.v_tilde.n + i] * this.data.unit;
  }

  interpolate(x, y) {
    const i = Math.min(Math.max(Math.floor(x), 0), this.data.v_tilde.n - 2);
    const j = Math.min(Math.max(Math.floor(y), 0), this.data.y_tilde.n - 2);
    const [s, t] = [x - i, y - j];
    return (1 - t) * ((1 - s) * this.node(i, j) + s * this.node(i + 1, j)) + t * ((1 - s) * this.node(i, j + 1) + s * this.node(i + 1, j + 1));
  }

  ratio(v, y) {
    return this.interpolate(...this.cell(v, y));
  }

  paint() {
    const { v_tilde: { n }, y_tilde: { n: m } } = this.data;
    const [width, height] = [4 * (n - 1), 4 * (m - 1)];
    const image = new ImageData(width, height);
    for (let row = 0; row < height; row += 1) {
      for (let column = 0; column < width; column += 1) {
        const rgb = colourOf(this.interpolate((column + 0.5) / 4, (height - row - 0.5) / 4));
        image.data.set([...rgb, 255], 4 * (row * width + column));
      }
    }
    const canvas = document.createElement("canvas");
    Object.assign(canvas, { width, height });
    canvas.getContext("2d").putImageData(image, 0, 0);
    return canvas;
  }

  /** Segments [x1, y1, x2, y2] in cells where mu~ = level: marching squares, saddles by the mean. */
  isoline(level) {
    const { v_tilde: { n }, y_tilde: { n: m } } = this.data;
    const found = [];
    for (let j = 0; j < m - 1; j += 1) {
      for (let i = 0; i < n - 1; i += 1) {
        const corners = [this.node(i, j), this.node(i + 1, j), this.node(i + 1, j + 1), this.node(i, j + 1)].map((value) => value - level);
        const places = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
        const cuts = [];
        for (let e = 0; e < 4; e += 1) {
          const [a, b] = [corners[e], corners[(e + 1) % 4]];
          if (a >= 0 === b >= 0) continue;
          const t = a / (a - b);
          const [p, q] = [places[e], places[(e + 1) % 4]];
          cuts.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
        }
        for (let c = 0; c + 1 < cuts.length; c += 2) found.push([...cuts[c], ...cuts[c + 1]]);
      }
    }
    return found;
  }

  draw(context, width, height) {
    if (!this.data) return;
    const { v_tilde: a, y_tilde: b, border } = this.data;
    this.x = new Axis(a.start, a.stop, true, 58, width - 14);
    this.y = new Axis(b.start, b.stop, true, height - 46, 10);
    this.image ??= this.paint();
    this.lines ??= LEVELS.map((level) => [level, this.isoline(level)]);
    context.imageSmoothingEnabled = true;
    context.drawImage(this.image, this.x.from, this.y.to, this.x.to - this.x.from, this.y.from - this.y.to);
    drawAxes(context, this.x, this.y, "dimensionless speed ṽ", "dimensionless amplitude ỹ", false);
    const px = (i) => this.x.from + (i / (a.n - 1)) * (this.x.to - this.x.from);
    const py = (j) => this.y.from + (j / (b.n - 1)) * (this.y.to - this.y.from);
    context.save();
    context.beginPath();
    context.rect(this.x.from, this.y.to, this.x.to - this.x.from, this.y.from - this.y.to);
    context.clip();
    context.lineWidth = 1;
    for (const [level, segments] of this.lines) {
      context.strokeStyle = level > 0.75 ? "rgb(0 0 0 / 45%)" : "rgb(255 255 255 / 55%)";
      context.beginPath();
      for (const [x1, y1, x2, y2] of segments) {
        context.moveTo(px(x1), py(y1));
        context.lineTo(px(x2), py(y2));
      }
      context.stroke();
    }
    this.drawLabels(context, px, py);
    for (const [style, lineWidth, dash] of [["rgb(0 0 0 / 60%)", 4, []], ["#ffffff", 2, [9, 6]]]) {
      context.strokeStyle = style;
      context.lineWidth = lineWidth;
      context.setLineDash(dash);
      context.beginPath();
      border.forEach(([v, y], i) => context[i ? "lineTo" : "moveTo"](this.x.pixel(v), this.y.pixel(y)));
      context.stroke();
    }
    context.restore();
    context.font = "600 13px system-ui, sans-serif";
    this.tag(context, "stick–slip", this.x.from + 0.16 * (this.x.to - this.x.from), this.y.pixel(0.3));
    this.tag(context, "continuous", this.x.from + 0.78 * (this.x.to - this.x.from), this.y.pixel(0.06));
    if (this.point) drawPoint(context, this.x.pixel(this.x.clamp(this.point[0])), this.y.pixel(this.y.clamp(this.point[1])));
  }

  drawLabels(context, px, py) {
    context.font = "11px system-ui, sans-serif";
    for (const [level, segments] of this.lines) {
      if (!LABELS.has(level) || !segments.length) continue;
      const target = LABELS.get(level) * this.data.v_tilde.n;
      const [x1, y1] = segments.reduce((best, segment) => (Math.abs(segment[0] - target) < Math.abs(best[0] - target) ? segment : best));
      if (py(y1) > this.y.to + 12 && py(y1) < this.y.from - 12) this.tag(context, String(level), px(x1), py(y1));
    }
  }

  tag(context, text, x, y) {
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineJoin = "round";
    context.lineWidth = 4;
    context.strokeStyle = "rgb(0 0 0 / 55%)";
    context.strokeText(text, x, y);
    context.fillStyle = "#ffffff";
    context.fillText(text, x, y);
  }
}
