// The map of mu~ over (v~, y~): colours with their bar, isolines, the border, the user's point.
import { Axis, Plot, axes, curve, draw, inside, label, line, point } from "./plots.js";

const LEVELS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99];
// label -> where along v~ it stands, so that labels keep clear of each other and of the border
const LABELS = new Map([[0.01, 0.45], [0.1, 0.55], [0.3, 0.66], [0.5, 0.75], [0.7, 0.83], [0.9, 0.9], [0.99, 0.94]]);
/** How the border by each of the paper's formulas is drawn: colours that are seen on the map and on the card. */
export const FORMULAS = {
  eq_23: ["#e07000", "6 3"], eq_24: ["#e5246f", "3 3"], eq_26: ["#b84dff", "8 3 2 3"], eq_27: ["#e53935", ""],
};
const BAR = 66; // room on the right for the colour bar and its numbers
const FINE = 4; // painted cells per cell of the grid, along each side
const VIRIDIS = ["440154", "482878", "3e4989", "31688e", "26828e", "1f9e89", "35b779", "6ece58", "b5de2b", "fde725"];

/** [red, green, blue] of a share from 0 to 1. */
function colourOf(share) {
  const x = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
  const i = Math.min(Math.floor(x), VIRIDIS.length - 2);
  return [0, 2, 4].map((at) => {
    const [low, high] = [i, i + 1].map((shade) => parseInt(VIRIDIS[shade].slice(at, at + 2), 16));
    return Math.round(low + (x - i) * (high - low));
  });
}

/** Where to mark a case: { place: [v~, y~], out: [-1 | 0 | 1, ...] }; null where nothing moves at all. */
function placed(x, y, v, a, slope) {
  if (v !== Infinity || a !== Infinity) return { place: [x.clamp(v), y.clamp(a)], out: [x.side(v), y.side(a)] };
  // rigid contact: the end of the line v~ / y~ = v0 / (y0 omega), where it leaves the frame
  if (Number.isNaN(slope)) return null;
  const top = slope * y.high;
  if (top <= x.high) return { place: [x.clamp(top), y.high], out: [x.side(top) || 1, 1] };
  return { place: [x.high, y.clamp(x.high / slope)], out: [1, y.side(x.high / slope) || 1] };
}

export class FrictionMap {
  /** `pick(vTilde, yTilde)` when the user moves the point, `hover(vTilde, yTilde)` or `hover(null)`. */
  constructor(svg, pick, hover) {
    Object.assign(this, { data: null, point: null, formulas: false });
    this.plot = new Plot(svg, (...size) => this.paint(...size));
    this.plot.follow({
      move: (x, y) => {
        if (!this.x) return;
        const within = x >= this.x.from && x <= this.x.to && y >= this.y.to && y <= this.y.from;
        hover(within ? this.x.value(x) : null, this.y.value(y));
      },
      pick: (x, y) => this.x && pick(this.x.value(x), this.y.value(y)),
      leave: () => hover(null),
    });
  }

  /** Takes map.json. */
  show(data) {
    Object.assign(this, { data, columns: data.v_tilde.n - 1, rows: data.y_tilde.n - 1 });
    this.image = this.colours();
    this.isolines = LEVELS.map((level) => [level, this.isoline(level)]);
    this.plot.redraw();
  }

  /** Changes what is drawn: `point` = [v~, y~, slope] or null; `formulas`: those of the paper for the border. */
  set(changed) {
    Object.assign(this, changed);
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

  /** Segments [x1, y1, x2, y2] in cells where mu~ = level: marching squares, saddles by the mean. */
  isoline(level) {
    const found = [];
    for (let j = 0; j < this.rows; j += 1) {
      for (let i = 0; i < this.columns; i += 1) {
        const places = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
        const corners = places.map((place) => this.node(...place) - level);
        const cuts = [];
        for (let e = 0; e < 4; e += 1) {
          const [a, b] = [corners[e], corners[(e + 1) % 4]];
          if (a >= 0 === b >= 0) continue;
          const [p, q] = [places[e], places[(e + 1) % 4]];
          cuts.push([0, 1].map((k) => p[k] + (a / (a - b)) * (q[k] - p[k])));
        }
        for (let c = 0; c + 1 < cuts.length; c += 2) found.push([...cuts[c], ...cuts[c + 1]]);
      }
    }
    return found;
  }

  paint(width, height) {
    if (!this.data) return [];
    const [x, y] = [this.axis("v_tilde", 58, width - BAR), this.axis("y_tilde", height - 46, 10)];
    Object.assign(this, { x, y });
    const border = (points, attributes) =>
      curve(points.map(([v]) => x.pixel(v)), points.map(([, a]) => y.pixel(a)), attributes);
    const formulas = (this.formulas ? Object.entries(FORMULAS) : []).map(([name, [stroke, dash]]) =>
      border(this.data.borders[name], { class: name, stroke, "stroke-width": 2, "stroke-dasharray": dash }));
    const found = this.point && placed(x, y, ...this.point);
    const box = { x: x.from, y: y.to, width: x.to - x.from, height: y.from - y.to };
    return [
      draw("image", { ...box, href: this.image, preserveAspectRatio: "none" }),
      axes(x, y, "dimensionless speed ṽ", "dimensionless amplitude ỹ", false),
      this.bar(width),
      inside(x, y,
        this.lines(x, y),
        border(this.data.border, { class: "border shade" }),
        formulas,
        border(this.data.border, { class: "border" }),
        label("stick–slip", x.from + 0.16 * box.width, y.pixel(0.3), "tag strong"),
        label("continuous", x.from + 0.78 * box.width, y.pixel(0.06), "tag strong")),
      found ? point(x.pixel(found.place[0]), y.pixel(found.place[1]), found.out) : null,
    ];
  }

  lines(x, y) {
    const px = (i) => x.from + (i / this.columns) * (x.to - x.from);
    const py = (j) => y.from + (j / this.rows) * (y.to - y.from);
    const labels = []; // that are drawn: [x, y]
    return this.isolines.flatMap(([level, segments]) => {
      const place = (i, j) => `${px(i).toFixed(1)} ${py(j).toFixed(1)}`;
      const pieces = segments.map(([x1, y1, x2, y2]) => `M${place(x1, y1)}L${place(x2, y2)}`);
      const drawn = [draw("path", { d: pieces.join(""), class: level > 0.75 ? "isoline dark" : "isoline" })];
      if (!LABELS.has(level) || !segments.length) return drawn;
      const target = LABELS.get(level) * this.columns;
      const away = ([at]) => Math.abs(at - target);
      const [at, up] = segments.reduce((best, segment) => (away(segment) < away(best) ? segment : best));
      if (labels.some(([left, top]) => Math.hypot(left - px(at), top - py(up)) < 24)) return drawn;
      labels.push([px(at), py(up)]);
      return [...drawn, label(String(level), px(at), py(up) + 4, "tag")];
    });
  }

  /** The colours from 0 to 1, right of the map. */
  bar(width) {
    const { y: { from, to } } = this;
    const left = width - BAR + 14;
    const step = (from - to) / 50;
    const shades = Array.from({ length: 50 }, (_, i) => {
      const fill = `rgb(${colourOf((i + 0.5) / 50).join(" ")})`;
      return draw("rect", { x: left, y: from - (i + 1) * step, width: 14, height: step + 0.5, fill });
    });
    const ticks = [0, 0.2, 0.4, 0.6, 0.8, 1].flatMap((share) => {
      const at = from + share * (to - from);
      return [line(left + 14, at, left + 18, at, "grid"), label(String(share), left + 21, at + 4, "tick", "start")];
    });
    return [...shades, ...ticks, label("µ/µ₀", left + 11, from + 38)];
  }
}
