// The friction law: mu_macro over one input, with its border, its static value, approximations, the user's point.
import { Axis, Plot, drawAxes, drawPoint, theme } from "./plot.js";
import { SYMBOLS } from "./fields.js";

export const APPROXIMATIONS = { static: ["static limit (16)", "a1"], creep: ["creep, first order", "a5"], small_amplitude: ["small amplitude (31)", "a2"], continuous: ["(31) and (35) in one", "a6"], rigid: ["rigid contact (35)", "a3"], corner: ["near ỹ = 1", "a4"] };

export class LawPlot {
  /** `pick(value)` when the user moves along the law, `hover(value, mu, regime)` or `hover(null)`. */
  constructor(canvas, pick, hover) {
    this.law = null;
    this.point = null;
    this.cursor = null;
    this.plot = new Plot(canvas, (...place) => this.draw(...place));
    this.plot.follow({
      move: (x) => {
        if (!this.law || x < this.x.from || x > this.x.to) return this.leave(hover);
        const i = this.nearest(this.x.value(x));
        this.cursor = i;
        this.plot.redraw();
        return hover(this.law.values[i], this.law.mu_macro[i], this.law.regime[i]);
      },
      pick: (x) => this.law && pick(this.x.clamp(this.x.value(x))),
      leave: () => this.leave(hover),
    });
  }

  leave(hover) {
    this.cursor = null;
    this.plot.redraw();
    hover(null);
  }

  show(law, scale, mu0) {
    Object.assign(this, { law, scale, mu0, cursor: null });
    this.plot.redraw();
  }

  move(value, mu) {
    this.point = [value, mu];
    this.plot.redraw();
  }

  nearest(value) {
    const { values } = this.law;
    const share = (x) => this.x.share(x);
    let best = 0;
    values.forEach((x, i) => {
      if (Math.abs(share(x) - share(value)) < Math.abs(share(values[best]) - share(value))) best = i;
    });
    return best;
  }

  draw(context, width, height) {
    if (!this.law) return;
    const colour = theme();
    const { values, mu_macro: mu, mu_static: still, regime, border, along, unit, approximations } = this.law;
    const top = 1.06 * Math.max(...mu, this.mu0, 1e-300);
    const bottom = height - 46;
    this.x = new Axis(values[0], values.at(-1), this.scale === "log", 58, width - 14);
    this.y = new Axis(0, top, false, bottom, 12);
    context.fillStyle = colour("stick");
    regime.forEach((name, i) => {
      if (name === "continuous" || i + 1 >= values.length) return;
      const [from, to] = [this.x.pixel(values[i]), this.x.pixel(values[i + 1])];
      context.fillRect(from, this.y.to, to - from + 0.5, this.y.from - this.y.to);
    });
    drawAxes(context, this.x, this.y, `${SYMBOLS[along]}${unit === "-" ? "" : ` [${unit}]`}`, "µ macro");
    const curve = (column, style, lineWidth, dash) => {
      context.strokeStyle = style;
      context.lineWidth = lineWidth;
      context.setLineDash(dash);
      context.beginPath();
      let down = false;
      column.forEach((value, i) => {
        if (value === null || value > top) down = false;
        else {
          context[down ? "lineTo" : "moveTo"](this.x.pixel(values[i]), this.y.pixel(value));
          down = true;
        }
      });
      context.stroke();
      context.setLineDash([]);
    };
    context.lineJoin = "round";
    if (approximations) {
      for (const [name, [, shade]] of Object.entries(APPROXIMATIONS)) curve(approximations[name], colour(shade), 1.8, [7, 4]);
    } else curve(still, colour("soft"), 1.2, [2, 4]);
    curve(mu, colour("curve"), 2.6, []);
    this.drawMarks(context, colour, border, still, approximations, width);
    if (this.cursor !== null) {
      const [x, y] = [this.x.pixel(values[this.cursor]), this.y.pixel(mu[this.cursor])];
      context.strokeStyle = colour("soft");
      context.lineWidth = 1;
      context.beginPath();
      context.moveTo(x, this.y.from);
      context.lineTo(x, this.y.to);
      context.stroke();
      context.beginPath();
      context.arc(x, y, 4, 0, 2 * Math.PI);
      context.fillStyle = colour("curve");
      context.fill();
    }
    if (this.point) drawPoint(context, this.x.pixel(this.x.clamp(this.point[0])), this.y.pixel(Math.min(this.point[1], top)));
  }

  drawMarks(context, colour, border, still, approximations) {
    context.font = "12px system-ui, sans-serif";
    context.textBaseline = "bottom";
    for (const mark of border) {
      const x = this.x.pixel(mark.value);
      context.strokeStyle = colour("mark");
      context.lineWidth = 1.5;
      context.setLineDash([9, 6]);
      context.beginPath();
      context.moveTo(x, this.y.from);
      context.lineTo(x, this.y.to);
      context.stroke();
      context.setLineDash([]);
      const right = x < this.x.to - 60;
      context.fillStyle = colour("mark");
      context.textAlign = right ? "left" : "right";
      context.fillText("border", x + (right ? 5 : -5), this.y.from - 6);
    }
    context.textAlign = "left";
    if (!approximations) {
      context.fillStyle = colour("soft");
      context.fillText("static", this.x.from + 5, this.y.pixel(still[0]) - 3);
      return;
    }
    // only those that are meant to hold somewhere here
    const shown = Object.entries(APPROXIMATIONS).filter(([name]) => approximations[name].some((value) => value !== null));
    const x = this.x.to - 150;
    context.globalAlpha = 0.85; // curves pass below it, and stay to be seen
    context.fillStyle = colour("card");
    context.fillRect(x - 38, this.y.from - 25 - 17 * shown.length, 188, 17 * shown.length + 7);
    context.globalAlpha = 1;
    shown.forEach(([, [label, shade]], i) => {
      const y = this.y.from - 22 - 17 * (shown.length - 1 - i);
      context.strokeStyle = colour(shade);
      context.lineWidth = 1.8;
      context.setLineDash([7, 4]);
      context.beginPath();
      context.moveTo(x - 32, y - 7);
      context.lineTo(x - 6, y - 7);
      context.stroke();
      context.setLineDash([]);
      context.fillStyle = colour("text");
      context.fillText(label, x, y);
    });
  }
}
