// The friction law: mu_macro over one input in the unit of its field, its border, static value, approximations, family, point.
import { Axis, Plot, drawAxes, drawPoint, theme } from "./plot.js";

export class LawPlot {
  /** `pick(value)` when the user moves along the law, `hover(index)` of the value under the pointer, or `hover(null)`. */
  constructor(canvas, pick, hover) {
    Object.assign(this, { law: null, family: null, point: null, cursor: null });
    this.plot = new Plot(canvas, (...place) => this.draw(...place));
    const read = (i) => {
      this.cursor = i;
      this.plot.redraw();
      hover(i);
    };
    this.plot.follow({
      move: (x) => this.x && read(x < this.x.from || x > this.x.to ? null : this.nearest(this.x.value(x))),
      pick: (x) => this.x && pick(this.x.clamp(this.x.value(x))),
      leave: () => read(null),
    });
  }

  /** `law`: { title, values, mu, still, regime, border, scale, top, approximations: [{ column, shade, dash }], borders: [{ numbers, places }] }. */
  show(law) {
    Object.assign(this, { law, cursor: null });
    this.plot.redraw();
  }

  /** `family`: { values, curves: [{ mu, shade }] }, or null. */
  showFamily(family) {
    this.family = family;
    this.plot.redraw();
  }

  move(value, mu) {
    this.point = [value, mu];
    this.plot.redraw();
  }

  nearest(value) {
    const away = this.law.values.map((x) => Math.abs(this.x.share(x) - this.x.share(value)));
    return away.indexOf(Math.min(...away));
  }

  draw(context, width, height) {
    if (!this.law) return;
    const colour = theme();
    const { values, mu, still, regime, border, title, scale, approximations, borders } = this.law;
    const curves = this.family?.curves ?? [];
    const top = 1.06 * Math.max(this.law.top, 1e-300, ...mu, ...curves.flatMap((one) => one.mu));
    const x = new Axis(values[0], values.at(-1), scale === "log", 58, width - 14);
    const y = new Axis(0, top, false, height - 46, 12);
    Object.assign(this, { x, y });
    context.fillStyle = colour("stick");
    regime.forEach((name, i) => {
      if (name === "continuous" || i + 1 >= values.length) return;
      const [from, to] = [x.pixel(values[i]), x.pixel(values[i + 1])];
      context.fillRect(from, y.to, to - from + 0.5, y.from - y.to);
    });
    drawAxes(context, x, y, title, "µ macro");
    context.save();
    context.beginPath();
    context.rect(x.from, y.to - 2, x.to - x.from, y.from - y.to + 3);
    context.clip();
    context.lineJoin = "round";
    if (!approximations.length) this.curve(context, values, still, colour("soft"), 1.2, [2, 4]);
    for (const { column, shade, dash } of approximations) this.curve(context, values, column, shade(colour), 1.8, dash);
    for (const one of curves) this.curve(context, this.family.values, one.mu, one.shade(colour), 1.8, []);
    this.curve(context, values, mu, colour("curve"), 2.8, []);
    context.restore();
    this.drawMarks(context, colour, border, approximations.length ? null : still[0]);
    this.drawFormulas(context, colour, borders.filter(({ places }) => places.length));
    if (this.cursor !== null) this.drawCursor(context, colour);
    if (this.point) {
      const [value, friction] = this.point;
      drawPoint(context, x.pixel(x.clamp(value)), y.pixel(Math.min(friction, top)), [x.side(value), 0]);
    }
  }

  curve(context, values, column, style, lineWidth, dash) {
    Object.assign(context, { strokeStyle: style, lineWidth });
    context.setLineDash(dash);
    context.beginPath();
    let down = false;
    column.forEach((value, i) => {
      if (value !== null) context[down ? "lineTo" : "moveTo"](this.x.pixel(values[i]), Math.max(this.y.pixel(value), -1e4));
      down = value !== null;
    });
    context.stroke();
    context.setLineDash([]);
  }

  drawCursor(context, colour) {
    const { values, mu } = this.law;
    const [at, up] = [this.x.pixel(values[this.cursor]), this.y.pixel(mu[this.cursor])];
    Object.assign(context, { strokeStyle: colour("soft"), fillStyle: colour("curve"), lineWidth: 1 });
    context.beginPath();
    context.moveTo(at, this.y.from);
    context.lineTo(at, this.y.to);
    context.stroke();
    context.beginPath();
    context.arc(at, up, 4, 0, 2 * Math.PI);
    context.fill();
  }

  /** The border by the paper's formulas: a short line for each, in a row of its own above the word "border", with its numbers. */
  drawFormulas(context, colour, formulas) {
    Object.assign(context, { font: "12px system-ui, sans-serif", textBaseline: "middle", lineWidth: 2, lineJoin: "round" });
    formulas.forEach(({ numbers, places }, row) => {
      const middle = this.y.from - 30 - 15 * row;
      for (const place of places) {
        const at = this.x.pixel(place);
        const right = at < this.x.to - 70;
        context.strokeStyle = colour("mark");
        context.beginPath();
        context.moveTo(at, middle - 6);
        context.lineTo(at, middle + 6);
        context.stroke();
        Object.assign(context, { textAlign: right ? "left" : "right", strokeStyle: colour("card"), fillStyle: colour("mark") });
        context.strokeText(numbers, at + (right ? 5 : -5), middle);
        context.fillText(numbers, at + (right ? 5 : -5), middle);
      }
    });
  }

  drawMarks(context, colour, border, still) {
    Object.assign(context, { font: "12px system-ui, sans-serif", textBaseline: "bottom", strokeStyle: colour("mark"), fillStyle: colour("mark"), lineWidth: 1.5 });
    for (const mark of border) {
      const at = this.x.pixel(mark);
      context.setLineDash([9, 6]);
      context.beginPath();
      context.moveTo(at, this.y.from);
      context.lineTo(at, this.y.to);
      context.stroke();
      context.setLineDash([]);
      const right = at < this.x.to - 60;
      context.textAlign = right ? "left" : "right";
      context.fillText("border", at + (right ? 5 : -5), this.y.from - 6);
    }
    if (still === null) return;
    Object.assign(context, { textAlign: "left", fillStyle: colour("soft") });
    context.fillText("static", this.x.from + 5, this.y.pixel(still) - 3);
  }
}
