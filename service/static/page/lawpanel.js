// What is asked of the friction law, its legend, its table, and its downloads.
import { post } from "./api.js";
import { INPUTS, NAMES, approximations, borders, equations, fromSI, symbolOf, toSI, unitText } from "./inputs.js";
import { readNumber, readValue } from "./read.js";
import { REGIMES, show, withUnit } from "./show.js";

const POINTS = 301;
const [LEAST, MOST] = [1e-280, 1e280]; // of what a range that nobody chose is laid around
const MOST_CURVES = 20;
const DASHES = [[7, 4], [2, 3], [12, 4], [7, 3, 2, 3]];

/** The law's axis: "v₀ [mm/s]". */
export function heading(state, name = state.along) {
  const unit = unitText(state.units[name]);
  return `${symbolOf(name, state.units[name])}${unit && ` [${unit}]`}`;
}

/** [start, stop] in SI: what was chosen, else whole decades around the point and its border. */
export function lawRange(state, border) {
  const { along, scale, units, values, range } = state;
  const unit = units[along];
  const here = (along === "v0" ? [border, values.v0] : [values[along]]).filter((value) => value > 0 && Number.isFinite(value));
  if (!here.length) here.push(INPUTS[along].start);
  const [low, high] = [Math.min(...here), Math.max(...here)].map((value) => fromSI(along, unit, Math.min(Math.max(value, LEAST), MOST)));
  const auto = scale === "linear"
    ? [INPUTS[along].positive ? Number((high / 100).toPrecision(1)) : 0, Number((4 * high).toPrecision(1))]
    : [Number(`1e${Math.floor(Math.log10(low)) - 2}`), Number(`1e${Math.ceil(Math.log10(high)) + 2}`)];
  return auto.map((value, i) => range[i] ?? toSI(along, unit, value));
}

const others = ({ values, rigid }, ...without) =>
  Object.fromEntries(NAMES.filter((name) => !without.includes(name)).map((name) => [name, name === "k" && rigid ? null : values[name]]));

/** The question for the law itself. */
export function lawQuestion(state, border) {
  const [start, stop] = lawRange(state, border);
  const request = { ...others(state, state.along), along: state.along, start, stop, points: POINTS, scale: state.scale };
  return state.approximations ? { ...request, include: ["approximations"] } : request;
}

/** The question for the family beside it; null for none. */
export function familyQuestion(state, border) {
  const { along, family, curves } = state;
  if (!family || family === along) return null;
  const [start, stop] = lawRange(state, border);
  return { ...others(state, along, family), along, start, stop, points: POINTS, scale: state.scale, family: { [family]: curves } };
}

export const askLaw = (request) => post("v1/law", request);

/** Short name of an approximation, with the paper's equations. */
const titled = (name) => `${name.replaceAll("_", " ")} ${equations(approximations[name])}`.trim();

/** Values of the swept input at which its speed reaches the border by a formula: `speeds` of that formula at each value, null where it is not given. */
function crossings(values, speeds, speedAt, log) {
  const over = speeds.map((speed, i) => (speed === null ? NaN : speedAt(values[i]) - speed));
  return over.flatMap((here, i) => {
    const next = over[i + 1];
    if (!(here < 0 ? next >= 0 : here >= 0 && next < 0)) return [];
    const share = here / (here - next);
    const [from, to] = [values[i], values[i + 1]];
    return [log ? from * (to / from) ** share : from + share * (to - from)];
  });
}

/** What the plot draws of an answer to a request: in the unit of the field. */
export function drawn(found, state, request) {
  const unit = state.units[state.along];
  const shown = (value) => fromSI(state.along, unit, value);
  const known = Object.entries(found.approximations ?? {});
  const speedAt = state.along === "v0" ? (value) => value : () => request.v0;
  return {
    title: heading(state),
    values: found.values.map(shown), mu: found.mu_macro, still: found.mu_static, regime: found.regime,
    border: found.border.map((mark) => shown(mark.value)), scale: state.scale, top: state.along === "mu0" ? 0 : state.values.mu0,
    // only those that are meant to hold somewhere here
    approximations: known.map(([name, column], i) => ({ name, column, label: titled(name), about: approximations[name].text, token: `a${i + 1}`, shade: (colour) => colour(`a${i + 1}`), dash: DASHES[i % DASHES.length] }))
      .filter(({ column }) => column.some((value) => value !== null)),
    // the paper's formulas for the border, where they are given
    borders: Object.entries(found.border_speeds ?? {}).filter(([name, column]) => borders[name] && column.some((value) => value !== null))
      .map(([name, column]) => ({ name, column, numbers: equations(borders[name]), about: borders[name].text, places: crossings(found.values, column, speedAt, state.scale === "log").map(shown) })),
  };
}

export function drawnFamily(found, state) {
  const unit = state.units[state.along];
  const name = state.family;
  return {
    values: found.values.map((value) => fromSI(state.along, unit, value)),
    curves: found.curves.map(({ value, mu_macro: mu }, i) => {
      const hue = Math.round(150 + (200 * (i + 0.5)) / found.curves.length);
      const hsl = (light) => `hsl(${hue} 60% ${light})`;
      return { mu, label: `${symbolOf(name, state.units[name])} = ${withUnit(name, value, state.units[name])}`, css: hsl("var(--family)"), shade: (colour) => hsl(colour("family")), dash: [] };
    }),
  };
}

/** Typed values of a family, separated by ";": { values } [SI] or { fault }. */
export function readCurves(name, text, unit) {
  const parts = text.split(";").map((part) => part.trim()).filter(Boolean);
  if (!parts.length) return { fault: "give values, separated by ;" };
  if (parts.length > MOST_CURVES) return { fault: `up to ${MOST_CURVES} values` };
  const bare = parts.filter((part) => readNumber(part).unit === "").length;
  if (bare > 0 && bare < parts.length) return { fault: "give a unit to every value or to none" };
  const found = parts.map((part) => readValue(name, part, unit));
  const wrong = found.findIndex((one) => one.fault || one.rigid);
  if (wrong >= 0) return { fault: `${parts[wrong]}: ${found[wrong].fault ?? "give a number"}` };
  return { values: found.map((one) => one.si) };
}

/** The rows of the legend: approximations, the border by each of the paper's formulas ("border by (24), (39): 70.1 mm/s"), curves of the family. */
export function lawRows(law, family, state) {
  const unit = unitText(state.units[state.along]);
  const marks = law.borders.filter(({ places }) => places.length).map(({ numbers, about, places }) => ({
    label: `border by ${numbers}: ${places.map((place) => `${show(place, 4)} ${unit}`.trim()).join(" and ")}`, about, css: "var(--mark)", shade: (colour) => colour("mark"), dash: [],
  }));
  return [...law.approximations.map((one) => ({ ...one, css: `var(--${one.token})` })), ...marks, ...(family?.curves ?? [])];
}

/** Fills a legend: a line of the curve's style and its name, what it is as a hint. */
export function showLegend(list, entries) {
  list.replaceChildren(...entries.map(({ label, about, css, dash }) => {
    const item = Object.assign(document.createElement("li"), { title: about ?? "" });
    const sample = document.createElement("span");
    Object.assign(sample.style, { borderTopColor: css, borderTopStyle: dash.length ? (dash[0] < 4 ? "dotted" : "dashed") : "solid" });
    item.append(sample, label);
    return item;
  }));
  list.hidden = !entries.length;
}

/** Fills the table with every 25th value. */
export function showTable(body, law) {
  const count = law.values.length;
  const picked = Array.from({ length: 13 }, (_, i) => Math.round((i * (count - 1)) / 12));
  body.replaceChildren(...picked.map((i) => {
    const row = document.createElement("tr");
    for (const text of [show(law.values[i], 4), show(law.mu[i], 6), REGIMES[law.regime[i]]]) {
      row.append(Object.assign(document.createElement("td"), { textContent: text }));
    }
    return row;
  }));
}

/** All that is drawn, as CSV (RFC 4180), in the units that are shown. */
export function asCsv(law, family) {
  const columns = [
    [law.title, law.values.map((value) => Number(value.toPrecision(15)))], ["mu_macro [-]", law.mu], ["mu_static [-]", law.still], ["regime", law.regime],
    ...law.approximations.map(({ name, column }) => [`${name} [-]`, column]),
    ...law.borders.map(({ name, column }) => [`border_${name} [m/s]`, column]),
    ...(family?.curves ?? []).map(({ label, mu }) => [`mu_macro [-] at ${label}`, mu]),
  ];
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const lines = [columns.map(([title]) => title), ...law.values.map((_, i) => columns.map(([, column]) => column[i] ?? ""))];
  return lines.map((line) => line.map((cell) => quoted(String(cell))).join(",")).join("\r\n") + "\r\n";
}
