// The map of mu~ over (v~, y~): colours between levels, the border, the user's point.
import { Axis, Plot, axes, curve, draw, inside, label, line, point } from "./plots.js";

const LEVELS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99];
// level -> where along v~ its number stands, so that they keep clear of each other
const LABELS = new Map([[0.01, 0.3], [0.1, 0.4], [0.3, 0.5], [0.5, 0.6], [0.7, 0.7], [0.9, 0.82], [0.99, 0.93]]);
const FINE = 8; // painted cells per cell of the grid, along each side
const VIRIDIS = ["440154", "482878", "3e4989", "31688e", "26828e", "1f9e89", "35b779", "6ece58", "b5de2b", "fde725"];

/** [red, green, blue] of a ratio: one colour between two levels. */
function colourOf(ratio) {
  const x = (LEVELS.filter((level) => level <= ratio).length / LEVELS.length) * (VIRIDIS.length - 1);
  const i = Math.min(Math.floor(x), VIRIDIS.length - 2);
  return [0, 2, 4].map((at) => {
    const [low, high] = [i, i + 1].map((shade) => parseInt(VIRIDIS[shade].slice(at, at + 2), 16));
    return Math.round(low + (x - i) * (high - low));
  });
}

export class FrictionMap {
  /** `pick(vTilde, yTilde)` when the user moves the point, `hover(vTilde, yTilde, ratio)` or `hover(null)`. */
  constructor(svg, pick, hover) {
    Object.assign(this, { data: null, point: null });
    this.plot = new Plot(svg, (...size) => this.paint(...size));
    this.plot.follow({
      move: (x, y) => {
        if (!this.x) return;
        const [i, j] = [this.x.share(this.x.value(x)) * this.columns, this.y.share(this.y.value(y)) * this.rows];
        const within = x >= this.x.from && x <= this.x.to && y >= this.y.to && y <= this.y.from;
        if (within) hover(this.x.value(x), this.y.value(y), this.ratio(i, j));
        else hover(null);
      },
      pick: (x, y) => this.x && pick(this.x.value(x), this.y.value(y)),
      leave: () => hover(null),
    });
  }

  /** Takes map.json. */
  show(data) {
    Object.assign(this, { data, columns: data.v_tilde.n - 1, rows: data.y_tilde.n - 1 });
    this.image = this.colours();
    this.plot.redraw();
  }

  /** Marks the user's point: [v~, y~] or null. */
  mark(place) {
    this.point = place;
    this.plot.redraw();
  }

  axis(name, from, to) {
    const { start, stop } = this.data[name];
    return new Axis(start, stop, true, from, to);
  }

  /** [-1 | 0 | 1, ...]: on which sides of the map v~ and y~ are, 0 inside. */
  outside(v, y) {
    return this.data ? [this.axis("v_tilde", 0, 1).side(v), this.axis("y_tilde", 0, 1).side(y)] : [0, 0];
  }

  node(i, j) {
    return this.data.mu_ratio[j * (this.columns + 1) + i] * this.data.unit;
  }

  /** mu~ at a place in cells. */
  ratio(x, y) {
    const i = Math.min(Math.max(Math.floor(x), 0), this.columns - 1);
    const j = Math.min(Math.max(Math.floor(y), 0), this.rows - 1);
    const [s, t] = [x - i, y - j];
    const along = (row) => (1 - s) * this.node(i, row) + s * this.node(i + 1, row);
    return (1 - t) * along(j) + t * along(j + 1);
  }

  colours() {
    const [width, height] = [FINE * this.columns, FINE * this.rows];
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    const image = new ImageData(width, height);
    for (let row = 0; row < height; row += 1) {
      for (let column = 0; column < width; column += 1) {
        const rgb = colourOf(this.ratio((column + 0.5) / FINE, (height - row - 0.5) / FINE));
        image.data.set([...rgb, 255], 4 * (row * width + column));
      }
    }
    canvas.getContext("2d").putImageData(image, 0, 0);
    return canvas.toDataURL();
  }

  paint(width, height) {
    if (!this.data) return [];
    const [x, y] = [this.axis("v_tilde", 58, width - 14), this.axis("y_tilde", height - 46, 10)];
    Object.assign(this, { x, y });
    const border = (points, attributes) =>
      curve(points.map(([v]) => x.pixel(v)), points.map(([, a]) => y.pixel(a)), attributes);
    const box = { x: x.from, y: y.to, width: x.to - x.from, height: y.from - y.to };
    return [
      draw("image", { ...box, href: this.image, preserveAspectRatio: "none" }),
      axes(x, y, "dimensionless speed ṽ", "dimensionless amplitude ỹ", false),
      inside(x, y,
        this.numbers(x, y),
        border(this.data.border, { class: "border shade" }),
        border(this.data.border, { class: "border" }),
        label("stick–slip", x.from + 0.16 * box.width, y.pixel(0.3), "tag strong"),
        label("continuous", x.from + 0.78 * box.width, y.pixel(0.06), "tag strong")),
      this.marker(x, y),
    ];
  }

  marker(x, y) {
    if (!this.point) return null;
    const [v, a] = this.point;
    return point(x.pixel(x.clamp(v)), y.pixel(y.clamp(a)), this.outside(v, a));
  }

  /** The values of levels, where they are crossed on the way up along y~. */
  numbers(x, y) {
    const heights = Array.from({ length: FINE * this.rows }, (_, j) => j / FINE);
    return [...LABELS].map(([level, share]) => {
      const j = heights.find((height) => this.ratio(share * this.columns, height) < level);
      return j === undefined ? null : label(String(level), x.from + share * (x.to - x.from),
        y.from + (j / this.rows) * (y.to - y.from) + 4, "tag");
    });
  }
}
