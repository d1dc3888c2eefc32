// The friction law: what is asked for it, its controls, its plot with legend and table, its downloads.
import { Field, make } from "./form.js";
import {
  INPUTS, REGIMES, about, caseOf, endsOf, fromSI, inUnit, namesOf, readCurves, readInterval, show, si, symbolOf, textOf,
  toSI, valueOf,
} from "./inputs.js";
import { Axis, Plot, axes, curve, draw, inside, label, line, point } from "./plots.js";
import { post } from "./service.js";

const $ = (id) => document.getElementById(id);
const POINTS = 301;
const [LEAST, MOST] = [1e-280, 1e280]; // of what a range that nobody chose is laid around
const DASHES = ["7 4", "2 3", "12 4", "7 3 2 3"];

/** The paper's equation numbers of an approximation or a border: "(24), (39)". */
export const equations = ({ equations: numbers }) => numbers.map((number) => `(${number})`).join(", ");

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

/** [input, quantities] of the curves beside the law: those chosen, else both ends of an interval of k; or null. */
function familyOf(state) {
  if (state.family) return [state.family, state.curves];
  return endsOf(state) && state.along !== "k" ? ["k", endsOf(state)] : null;
}

/** The question for the law itself, and that for the curves beside it; null for none. */
function lawQuestions(state, border) {
  const { along, scale, approximations } = state;
  const { low, high, unit } = lawRange(state, border);
  const range = { along, start: toSI(along, low, unit), stop: toSI(along, high, unit), points: POINTS, scale };
  const [name, curves] = familyOf(state) ?? [];
  const family = name && { [name]: curves.map((one) => si(name, one)) };
  return {
    law: { ...caseOf(state, along), ...range, ...(approximations ? { include: ["approximations"] } : {}) },
    family: family ? { ...caseOf(state, along, name), ...range, family } : null,
  };
}

/** Values of the swept input at which its speed reaches the border by a formula: `speeds`, null where not given. */
function crossings(values, speeds, speedAt, log) {
  return speeds.slice(0, -1).flatMap((speed, i) => {
    if (speed === null || speeds[i + 1] === null) return [];
    const [here, next] = [speed - speedAt(values[i]), speeds[i + 1] - speedAt(values[i + 1])];
    if (here >= 0 === next >= 0) return [];
    const [from, to] = [values[i], values[i + 1]];
    const share = here / (here - next);
    return [log ? from * (to / from) ** share : from + share * (to - from)];
  });
}

/** What is drawn of the answers, in the unit of the field. */
function drawn({ found, request, family }, state) {
  const { along, scale } = state;
  const unit = unitOf(state);
  const shown = (value) => fromSI(along, value, unit);
  const given = ([, column]) => column.some((value) => value !== null); // in its range at least once
  const speedAt = along === "v0" ? (value) => value : () => request.v0;
  const kUnit = family && state.given[family.family].unit;
  return {
    along, title: heading(state), unit, values: found.values.map(shown), mu: found.mu_macro, still: found.mu_static,
    regime: found.regime, border: found.border.map((mark) => shown(mark.value)), scale,
    top: along === "mu0" ? 0 : valueOf(state, "mu0"),
    approximations: Object.entries(found.approximations ?? {}).map(([name, column], i) => ({
      name, column, label: `${name.replaceAll("_", " ")} ${equations(about.approximations[name])}`.trim(),
      hint: about.approximations[name].text, style: `var(--a${i + 1})`, dash: DASHES[i % DASHES.length],
    })).filter(({ name, column }) => given([name, column])),
    borders: Object.entries(found.border_speeds ?? {}).filter(([name]) => about.borders[name]).filter(given)
      .map(([name, column]) => ({
        name, column, numbers: equations(about.borders[name]), hint: about.borders[name].text,
        places: crossings(found.values, column, speedAt, scale === "log").map(shown),
      })),
    curves: (family?.curves ?? []).map(({ value, mu_macro: mu }, i, { length }) => ({
      mu, label: `${symbolOf(family.family, kUnit)} = ${inUnit(family.family, value, kUnit)}`,
      style: `hsl(${Math.round(150 + (200 * (i + 0.5)) / length)} 60% var(--family))`, dash: "",
    })),
  };
}

/** Fills a legend: a line of the curve's style and its name, what it is as a hint. */
export function showLegend(list, entries) {
  list.replaceChildren(...entries.map(({ label: text, hint = "", style, dash }) => {
    const sample = draw("svg", { width: 28, height: 6, "aria-hidden": true },
      draw("path", { d: "M0 3h28", stroke: style, "stroke-width": 2.4, "stroke-dasharray": dash }));
    return make("li", { title: hint }, sample, text);
  }));
  list.hidden = !entries.length;
}

/** All that is drawn, as CSV (RFC 4180), in the units that are shown. */
function asCsv({ title, values, mu, still, regime, approximations, borders, curves }) {
  const columns = [
    [title, values.map((value) => Number(value.toPrecision(15)))], ["mu_macro [-]", mu], ["mu_static [-]", still],
    ["regime", regime], ...approximations.map(({ name, column }) => [`${name} [-]`, column]),
    ...borders.map(({ name, column }) => [`border_${name} [m/s]`, column]),
    ...curves.map(({ label: text, mu: column }) => [`mu_macro [-] at ${text}`, column]),
  ];
  const quoted = (cell) => (/[",\n]/.test(cell) ? `"${cell.replaceAll('"', '""')}"` : cell);
  const lines = [columns.map(([name]) => name), ...values.map((_, i) => columns.map(([, column]) => column[i] ?? ""))];
  return lines.map((cells) => cells.map((cell) => quoted(String(cell))).join(",")).join("\r\n") + "\r\n";
}

export class LawPanel {
  /** `change(part of the state)`, `pick(quantity)` of the swept input, `channel(topic, ask, use)`, `blame(words)`. */
  constructor({ change, pick, channel, blame }) {
    Object.assign(this, { change, asked: {}, law: null, point: null, cursor: null });
    const ask = (request) => post("v1/law", request);
    this.channels = {
      law: channel("law", ask, (found, request) => this.take({ found, request })),
      family: channel("family", ask, (family) => this.take({ family })),
    };
    this.plot = new Plot($("law"), (...size) => this.paint(...size));
    this.plot.follow({
      move: (x) => this.x && this.read(x < this.x.from || x > this.x.to ? null : this.nearest(this.x.value(x))),
      pick: (x) => this.x && pick({ value: Number(this.x.value(x).toPrecision(4)), unit: this.law.unit }),
      leave: () => this.read(null),
    });
    this.fields = this.controls(blame);
  }

  controls(blame) {
    const told = () => {
      const faults = Object.entries(this.fields).filter(([, { fault }]) => fault);
      blame(faults.map(([name, { fault }]) => `${name}: ${fault}.`).join(" "));
    };
    const range = new Field($("range"), {
      read: (text) => (text.trim() === "" ? null : readInterval(this.state.along, text, unitOf(this.state))),
      use: (found) => this.change({ range: found }), blame: told,
    });
    const choose = (id, read) => $(id).addEventListener("change", () => this.change(read($(id))));
    choose("along", ({ value: along }) => ({ along, range: null }));
    choose("scale", ({ value: scale }) => ({ scale }));
    choose("approximations", ({ checked: approximations }) => ({ approximations }));
    choose("family", ({ value: family }) => ({ family: family || null, curves: this.usualCurves(family) }));
    const curves = new Field($("curves"), {
      read: (text) => readCurves(this.state.family, text, this.state.given[this.state.family].unit),
      use: (found) => this.change({ curves: found }), blame: told,
    });
    return { range, curves };
  }

  /** Half, once and twice the value of an input. */
  usualCurves(name) {
    if (!name) return [];
    const { value, low, unit } = this.state.given[name];
    const [first] = INPUTS[name].start;
    return [0.5, 1, 2].map((factor) => ({ value: Number((factor * (low ?? (value || first))).toPrecision(6)), unit }));
  }

  /** Shows a state. */
  sync(state, border) {
    const options = namesOf(state).map((name) => [INPUTS[name].symbol, name]);
    if (this.state?.direction !== state.direction) {
      $("along").replaceChildren(...options.map((one) => new Option(...one)));
      $("family").replaceChildren(new Option("none", ""), ...options.map((one) => new Option(...one)));
    }
    const { range, curves } = this.fields;
    if (this.state?.along !== state.along) range.clear();
    if (this.state?.family !== state.family) curves.clear();
    this.state = state;
    for (const name of ["along", "scale"]) $(name).value = state[name];
    for (const option of $("family").options) option.disabled = option.value === state.along;
    $("family").value = state.family ?? "";
    $("approximations").checked = state.approximations;
    $("curves-label").hidden = $("curves-hint").hidden = !state.family;
    curves.show(state.curves.map((one) => textOf(one)).join("; "));
    range.input.placeholder = textOf(lawRange(state, border), 6);
    range.show(state.range ? textOf(state.range) : "");
  }

  /** Asks for what the state needs; `again` even if it was asked for. */
  ask(border, again = false) {
    for (const [name, request] of Object.entries(lawQuestions(this.state, border))) {
      const text = JSON.stringify(request);
      if (text === this.asked[name] && !again) continue;
      this.asked[name] = text;
      if (request) this.channels[name].push(request);
      else {
        this.channels[name].cancel();
        this.take({ [name]: null });
      }
    }
  }

  take(answers) {
    this.answers = { ...this.answers, ...answers };
    this.show();
  }

  /** Shows the answers. */
  show() {
    const { state, answers } = this;
    if (!answers?.found || answers.found.along !== state.along) return;
    const { along, family: beside } = answers.family ?? {};
    const fits = along === state.along && beside === familyOf(state)?.[0];
    const law = drawn({ ...answers, family: fits ? answers.family : null }, state);
    Object.assign(this, { law, cursor: null });
    this.plot.redraw();
    const marks = law.borders.filter(({ places }) => places.length).map(({ numbers, hint, places }) =>
      ({ label: `border by ${numbers}: ${this.texts(places)}`, hint, style: "var(--mark)", dash: "" }));
    this.legend = [...law.approximations, ...marks, ...law.curves];
    showLegend($("legend"), this.legend);
    $("law-input").textContent = law.title;
    const last = law.values.length - 1;
    $("law-table").tBodies[0].replaceChildren(...Array.from({ length: 13 }, (_, row) => {
      const i = Math.round((row * last) / 12);
      const cells = [show(law.values[i], 4), show(law.mu[i], 6), REGIMES[law.regime[i]]];
      return make("tr", {}, ...cells.map((cell) => make("td", {}, cell)));
    }));
    const at = (i) => `${show(law.mu[i], 4)} at ${symbolOf(state.along, law.unit)} = ${this.texts([law.values[i]])}`;
    const border = law.border.length ? `; border of continuous sliding at ${this.texts(law.border)}` : "";
    $("law").setAttribute("aria-label", `Macroscopic friction from ${at(0)} to ${at(last)}${border}.`);
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
    const { values, mu, still, border, title, scale, approximations, borders, curves } = this.law;
    const top = 1.06 * Math.max(this.law.top, 1e-300, ...mu, ...curves.flatMap((one) => one.mu));
    const x = new Axis(values[0], values.at(-1), scale === "log", 58, width - 14);
    const y = new Axis(0, top, false, height - 46, 12);
    Object.assign(this, { x, y });
    const places = values.map((value) => x.pixel(value));
    const along = (column, { style, dash = "", ...others }) => curve(
      places, column.map((value) => (value === null ? null : Math.max(y.pixel(value), -1e4))),
      style ? { stroke: style, "stroke-width": 1.8, "stroke-dasharray": dash } : others);
    const bare = !approximations.length;
    return [
      this.sticks(places), axes(x, y, title, "µ macro"),
      inside(x, y,
        bare ? along(still, { class: "still" }) : null,
        approximations.map((one) => along(one.column, one)), curves.map((one) => along(one.mu, one)),
        along(mu, { class: "curve" })),
      border.flatMap((mark) => this.mark(x.pixel(mark), y.to, y.from, "border", y.from - 8)),
      borders.filter((one) => one.places.length).flatMap(({ numbers, places: found }, row) => {
        const foot = y.from - 24 - 15 * row;
        return found.flatMap((place) => this.mark(x.pixel(place), foot - 12, foot, numbers, foot - 2));
      }),
      bare ? label("static", x.from + 5, y.pixel(still[0]) - 4, "tick", "start") : null,
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

  /** An upright line with its name on the side that has room. */
  mark(at, from, to, name, y) {
    const [away, anchor] = at < this.x.to - 70 ? [5, "start"] : [-5, "end"];
    return [line(at, from, at, to, `mark ${name}`), label(name, at + away, y, "mark", anchor)];
  }

  csv() {
    return asCsv(this.law);
  }
}
