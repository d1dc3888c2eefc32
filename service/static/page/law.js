// The friction law: what is asked for it, its controls, its plot with legend and table, its downloads.
import { Status } from "./ask.js";
import { Field } from "./form.js";
import {
  INPUTS, REGIMES, fromSI, namesOf, readInterval, show, si, spanOf, symbolOf, textOf, toSI, valueOf,
} from "./inputs.js";
import { Axis, Plot, axes, band, curve, draw, inside, label, line, point } from "./plots.js";
import { post } from "./service.js";

const $ = (id) => document.getElementById(id);
const POINTS = 301;
const [LEAST, MOST] = [1e-280, 1e280]; // of what a range that nobody chose is laid around
const unitOf = ({ along, given }) => given[along].unit;

/** The law's axis: "v₀ [mm/s]". */
function heading(state) {
  const unit = unitOf(state);
  return `${symbolOf(state.along, unit)}${unit === "-" ? "" : ` [${unit}]`}`;
}

/** { low, high, unit } of the swept input: what was chosen, else whole decades around the point and its border. */
function lawRange(state, border) {
  const { along, scale, given } = state;
  if (state.range) return state.range;
  const unit = unitOf(state);
  const near = [si(along, given[along]), along === "v0" ? border : null];
  const sizes = near.filter((value) => value > 0 && Number.isFinite(value));
  const { start: usual, positive } = INPUTS[along];
  if (!sizes.length) sizes.push(toSI(along, ...usual));
  const within = sizes.map((value) => fromSI(along, Math.min(Math.max(value, LEAST), MOST), unit));
  const [low, high] = [Math.min(...within), Math.max(...within)];
  const round = (value) => Number(value.toPrecision(1));
  if (scale === "linear") return { low: positive ? round(high / 100) : 0, high: round(4 * high), unit };
  const decade = (exponent) => Number(`1e${exponent}`);
  return { low: decade(Math.floor(Math.log10(low)) - 2), high: decade(Math.ceil(Math.log10(high)) + 2), unit };
}

/** The question for the law. */
function lawQuestion(state, border) {
  const { along, scale } = state;
  const { low, high, unit } = lawRange(state, border);
  const [start, stop] = [low, high].map((end) => toSI(along, end, unit));
  return { ...spanOf(state, along), along, start, stop, points: POINTS, scale };
}

/** What is drawn of the answer, in the unit of the field. */
function drawn(found, state) {
  const { along, scale } = state;
  const unit = unitOf(state);
  const shown = (value) => fromSI(along, value, unit);
  return {
    along, title: heading(state), unit, values: found.values.map(shown), mu: found.mu_macro, still: found.mu_static,
    low: found.mu_macro_low, high: found.mu_macro_high, regime: found.regime,
    border: found.border.map((mark) => shown(mark.value)), scale, top: along === "mu0" ? 0 : valueOf(state, "mu0"),
  };
}

/** All that is drawn, as CSV (RFC 4180), in the units that are shown. */
function asCsv({ title, values, mu, low, high, still, regime }) {
  const columns = [
    [title, values.map((value) => Number(value.toPrecision(15)))], ["mu_macro [-]", mu], ["mu_static [-]", still],
    ["regime", regime], ...(low ? [["mu_macro_low [-]", low], ["mu_macro_high [-]", high]] : []),
  ];
  const lines = [columns.map(([name]) => name), ...values.map((_, i) => columns.map(([, column]) => column[i]))];
  return lines.map((cells) => `${cells.join(",")}\r\n`).join(""); // no cell holds a comma or a quotation mark
}

export class LawPanel {
  /** `change(part of the state)`, `pick(quantity)` of the swept input. */
  constructor({ change, pick }) {
    Object.assign(this, { change, asked: null, law: null, point: null, cursor: null });
    this.status = new Status("law-status", "law-section");
    this.channel = this.status.channel("law", (request) => post("v1/law", request), (found) => {
      this.found = found;
      this.status.answered = true;
      this.show();
    });
    this.plot = new Plot($("law"), (...size) => this.paint(...size));
    this.plot.follow({
      move: (x) => this.x && this.read(x < this.x.from || x > this.x.to ? null : this.nearest(this.x.value(x))),
      pick: (x) => this.x && pick({ value: Number(this.x.value(x).toPrecision(4)), unit: this.law.unit }),
      leave: () => this.read(null),
    });
    this.range = new Field($("range"), {
      read: (text) => (text.trim() === "" ? null : readInterval(this.state.along, text, unitOf(this.state))),
      use: (found) => change({ range: found }), blame: (fault) => this.status.set("typed", fault && `range: ${fault}.`),
    });
    const choose = (id, read) => $(id).addEventListener("change", () => change(read($(id))));
    choose("along", ({ value: along }) => ({ along, range: null }));
    choose("scale", ({ value: scale }) => ({ scale }));
  }

  /** Shows a state. */
  sync(state, border) {
    if (this.state?.direction !== state.direction) {
      $("along").replaceChildren(...namesOf(state).map((name) => new Option(INPUTS[name].symbol, name)));
    }
    if (this.state?.along !== state.along) this.range.clear();
    this.state = state;
    for (const name of ["along", "scale"]) $(name).value = state[name];
    this.range.input.placeholder = textOf(lawRange(state, border), 6);
    this.range.show(state.range ? textOf(state.range) : "");
  }

  /** Asks for what the state needs; `again` even if it was asked for. */
  ask(border, again = false) {
    const request = lawQuestion(this.state, border);
    const text = JSON.stringify(request);
    if (text === this.asked && !again) return;
    this.asked = text;
    this.channel.push(request);
  }

  /** Shows the answer. */
  show() {
    const { state, found } = this;
    if (found?.along !== state.along) return;
    const law = drawn(found, state);
    Object.assign(this, { law, cursor: null });
    this.plot.redraw();
    const symbol = symbolOf(state.along, law.unit);
    const at = (i) => `${show(law.mu.at(i), 4)} at ${symbol} = ${this.texts([law.values.at(i)])}`;
    const border = law.border.length ? `; border of continuous sliding at ${this.texts(law.border)}` : "";
    $("law").setAttribute("aria-label", `Macroscopic friction from ${at(0)} to ${at(-1)}${border}.`);
  }

  /** Values of the swept input, with their unit. */
  texts(values) {
    return values.map((value) => textOf({ value, unit: this.law.unit }, 4)).join(" and ");
  }

  /** Marks the user's point: { asked, mu_macro } of the last answer. */
  move(answer) {
    this.point = answer;
    this.plot.redraw();
  }

  read(i) {
    if (i === this.cursor) return;
    this.cursor = i;
    this.plot.redraw();
    const { along, unit, values, mu, regime } = this.law;
    const place = i === null ? "" : `${symbolOf(along, unit)} = ${this.texts([values[i]])}`;
    $("law-read").textContent = i === null ? "\u00a0" : `${place}: µ = ${show(mu[i], 6)}, ${REGIMES[regime[i]]}`;
  }

  nearest(value) {
    const away = this.law.values.map((x) => Math.abs(this.x.share(x) - this.x.share(value)));
    return away.indexOf(Math.min(...away));
  }

  paint(width, height) {
    if (!this.law) return [];
    const { values, mu, low, high, still, border, title, scale } = this.law;
    const top = 1.06 * Math.max(this.law.top, 1e-300, ...mu, ...(high ?? []));
    const x = new Axis(values[0], values.at(-1), scale === "log", 58, width - 14);
    const y = new Axis(0, top, false, height - 46, 12);
    Object.assign(this, { x, y });
    const places = values.map((value) => x.pixel(value));
    const heights = (column) => column.map((value) => y.pixel(value));
    return [
      this.sticks(places), axes(x, y, title, "µ macro"),
      inside(x, y,
        low ? band(places, heights(low), heights(high)) : null,
        curve(places, heights(still), { class: "still" }),
        curve(places, heights(mu), { class: "curve" })),
      border.flatMap((mark) => this.mark(x.pixel(mark))),
      label("static", x.from + 5, y.pixel(still[0]) - 4, "tick", "start"),
      this.marker(places, mu, top),
    ];
  }

  /** Where the contact sticks in a part of each period. */
  sticks(places) {
    const { y, law: { regime } } = this;
    const box = (i) => ({ x: places[i], y: y.to, width: places[i + 1] - places[i] + 0.5, height: y.from - y.to });
    const found = regime.slice(0, -1).map((name, i) => (name === "continuous" ? null : i)).filter((i) => i !== null);
    return found.map((i) => draw("rect", { ...box(i), class: "stick" }));
  }

  /** The value that is read, and the user's point. */
  marker(places, mu, top) {
    const { x, y, cursor } = this;
    const found = cursor === null ? [] : [
      line(places[cursor], y.from, places[cursor], y.to, "grid strong"),
      draw("circle", { cx: places[cursor], cy: y.pixel(mu[cursor]), r: 4, class: "dot" }),
    ];
    if (!this.point) return found;
    const { asked, mu_macro } = this.point;
    const here = fromSI(this.law.along, valueOf(asked, this.law.along), this.law.unit);
    return [...found, point(x.pixel(x.clamp(here)), y.pixel(Math.min(mu_macro, top)), [x.side(here), 0])];
  }

  /** The border of continuous sliding, with its name on the side that has room. */
  mark(at) {
    const { x, y } = this;
    const [away, anchor] = at < x.to - 70 ? [5, "start"] : [-5, "end"];
    return [line(at, y.to, at, y.from, "mark border"), label("border", at + away, y.from - 8, "mark", anchor)];
  }

  csv() {
    return asCsv(this.law);
  }
}
