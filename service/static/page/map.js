// The map of mu~ over (v~, y~): colours with their bar, isolines, the border, the user's point.
import { Grid, colourOf } from "./grid.js";
import { Axis, Plot, drawAxes, drawPoint, theme } from "./plot.js";

const LEVELS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99];
// label -> where along v~ it stands, so that labels keep clear of each other and of the border
const LABELS = new Map([[0.01, 0.45], [0.1, 0.55], [0.3, 0.66], [0.5, 0.75], [0.7, 0.83], [0.9, 0.9], [0.99, 0.94]]);
/** How the border by each of the paper's formulas is drawn: colours that are seen on the map and on the card. */
export const FORMULAS = { eq_23: ["#e07000", [6, 3]], eq_24: ["#e5246f", [3, 3]], eq_26: ["#b84dff", [8, 3, 2, 3]], eq_27: ["#e53935", []] };
const BAR = 66; // room on the right for the colour bar and its numbers

/** Where to mark a case: { place: [v~, y~], out: [-1 | 0 | 1, ...] }; null where nothing moves at all. */
export function placed(x, y, v, a, slope) {
  if (v === Infinity && a === Infinity) {
    // rigid contact: the end of the line v~ / y~ = v0 / (y0 omega), where it leaves the frame
    if (Number.isNaN(slope)) return null;
    const top = slope * y.high;
    return top <= x.high ? { place: [x.clamp(top), y.high], out: [x.side(top) || 1, 1] } : { place: [x.high, y.clamp(x.high / slope)], out: [1, y.side(x.high / slope) || 1] };
  }
  return { place: [x.clamp(v), y.clamp(a)], out: [x.side(v), y.side(a)] };
}

export class FrictionMap {
  /** `pick(vTilde, yTilde)` when the user moves the point, `hover(vTilde, yTilde, ratio)` or `hover(null)`. */
  constructor(canvas, pick, hover) {
    Object.assign(this, { grid: null, point: null, formulas: false });
    this.plot = new Plot(canvas, (...place) => this.draw(...place));
    const at = (x, y) => [this.x.clamp(this.x.value(x)), this.y.clamp(this.y.value(y))];
    this.plot.follow({
      move: (x, y) => {
        if (!this.x) return;
        const inside = x >= this.x.from && x <= this.x.to && y >= this.y.to && y <= this.y.from;
        if (inside) hover(...at(x, y), this.grid.ratio(...at(x, y)));
        else hover(null);
      },
      pick: (x, y) => this.x && pick(...at(x, y)),
      leave: () => hover(null),
    });
  }

  show(data) {
    Object.assign(this, { grid: new Grid(data), border: data.border, borders: data.borders, image: null, lines: null });
    this.plot.redraw();
  }

  /** Draws the paper's formulas for the border, or does not. */
  compare(formulas) {
    if (formulas === this.formulas) return;
    this.formulas = formulas;
    this.plot.redraw();
  }

  /** Marks v~, y~; where both are infinite, the end of the line v~ / y~ = slope. */
  move(v, y, slope) {
    this.point = [v, y, slope];
    this.plot.redraw();
  }

  /** [-1 | 0 | 1, ...]: on which sides of the map v~ and y~ are, 0 inside. */
  outside(v, y) {
    if (!this.grid) return [0, 0];
    return [[this.grid.v_tilde, v], [this.grid.y_tilde, y]].map(([{ start, stop }, value]) => new Axis(start, stop, true, 0, 1).side(value));
  }

  draw(context, width, height) {
    if (!this.grid) return;
    const { v_tilde: a, y_tilde: b } = this.grid;
    const { x, y } = Object.assign(this, { x: new Axis(a.start, a.stop, true, 58, width - BAR), y: new Axis(b.start, b.stop, true, height - 46, 10) });
    this.image ??= this.grid.paint();
    this.lines ??= LEVELS.map((level) => [level, this.grid.isoline(level)]);
    context.imageSmoothingEnabled = true;
    context.drawImage(this.image, x.from, y.to, x.to - x.from, y.from - y.to);
    drawAxes(context, x, y, "dimensionless speed ṽ", "dimensionless amplitude ỹ", false);
    this.drawBar(context, width);
    const px = (i) => x.from + (i / (a.n - 1)) * (x.to - x.from);
    const py = (j) => y.from + (j / (b.n - 1)) * (y.to - y.from);
    context.save();
    context.beginPath();
    context.rect(x.from, y.to, x.to - x.from, y.from - y.to);
    context.clip();
    this.drawLines(context, px, py);
    this.drawLabels(context, px, py);
    const formulas = this.formulas ? Object.entries(FORMULAS).map(([name, [style, dash]]) => [this.borders[name], style, 2, dash]) : [];
    for (const [line, style, lineWidth, dash] of [[this.border, "rgb(0 0 0 / 60%)", 4, []], ...formulas, [this.border, "#ffffff", 2, [9, 6]]]) {
      Object.assign(context, { strokeStyle: style, lineWidth });
      context.setLineDash(dash);
      context.beginPath();
      line.forEach(([v, amplitude], i) => context[i ? "lineTo" : "moveTo"](x.pixel(v), y.pixel(amplitude)));
      context.stroke();
    }
    context.setLineDash([]);
    context.restore();
    context.font = "600 13px system-ui, sans-serif";
    this.tag(context, "stick–slip", x.from + 0.16 * (x.to - x.from), y.pixel(0.3));
    this.tag(context, "continuous", x.from + 0.78 * (x.to - x.from), y.pixel(0.06));
    const found = this.point && placed(x, y, ...this.point);
    if (found) drawPoint(context, x.pixel(found.place[0]), y.pixel(found.place[1]), found.out);
  }

  drawLines(context, px, py) {
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
  }

  drawLabels(context, px, py) {
    context.font = "11px system-ui, sans-serif";
    for (const [level, segments] of this.lines) {
      if (!LABELS.has(level) || !segments.length) continue;
      const target = LABELS.get(level) * this.grid.v_tilde.n;
      const [x1, y1] = segments.reduce((best, segment) => (Math.abs(segment[0] - target) < Math.abs(best[0] - target) ? segment : best));
      if (py(y1) > this.y.to + 12 && py(y1) < this.y.from - 12) this.tag(context, String(level), px(x1), py(y1));
    }
  }

  /** The colours from 0 to 1, right of the map. */
  drawBar(context, width) {
    const { from, to } = this.y;
    const [left, thick] = [width - BAR + 14, 14];
    const shades = context.createLinearGradient(0, from, 0, to);
    for (let i = 0; i <= 18; i += 1) shades.addColorStop(i / 18, `rgb(${colourOf(i / 18).join(" ")})`);
    context.fillStyle = shades;
    context.fillRect(left, to, thick, from - to);
    const colour = theme();
    Object.assign(context, { fillStyle: colour("soft"), strokeStyle: colour("soft"), font: "12px system-ui, sans-serif", textAlign: "left", textBaseline: "middle", lineWidth: 1 });
    for (let i = 0; i <= 5; i += 1) {
      const y = Math.round(from + (i / 5) * (to - from)) + 0.5;
      context.beginPath();
      context.moveTo(left + thick, y);
      context.lineTo(left + thick + 4, y);
      context.stroke();
      context.fillText(String(i / 5), left + thick + 7, y);
    }
    Object.assign(context, { fillStyle: colour("text"), textAlign: "center", textBaseline: "bottom" });
    context.fillText("µ/µ₀", left + thick / 2 + 4, from + 40);
  }

  tag(context, text, x, y) {
    Object.assign(context, { textAlign: "center", textBaseline: "middle", lineJoin: "round", lineWidth: 4, strokeStyle: "rgb(0 0 0 / 55%)" });
    context.strokeText(text, x, y);
    context.fillStyle = "#ffffff";
    context.fillText(text, x, y);
  }
}
