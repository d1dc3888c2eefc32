// The inputs: units and bounds, what a person types, numbers as text, the state of the page, its case and its address.
// Nothing here needs a browser; tests/page tests it with node.

/** By name: label, symbol, offered units, the slider's decimal exponents (SI), start value. */
export const INPUTS = {
  mu0: { label: "friction µ₀", symbol: "µ₀", offered: ["-"], range: [-2, 0.5], start: [0.3, "-"] },
  Fz: { label: "force Fz", symbol: "Fz", offered: ["N", "mN", "kN"], range: [-3, 5], start: [10, "N"] },
  k: { label: "stiffness k", symbol: "k", offered: ["N/µm", "kN/m", "N/m"], range: [2, 10], start: [1, "N/µm"] },
  y0: { label: "amplitude y₀", symbol: "y₀", offered: ["µm", "nm", "mm", "m"], range: [-10, -3], start: [2, "µm"] },
  Fz_amplitude: { label: "force ΔFz", symbol: "ΔFz", offered: ["N", "mN", "kN"], range: [-3, 5], start: [5, "N"] },
  omega: { label: "frequency", symbol: "ω", offered: ["kHz", "Hz", "rad/s"], range: [0, 7], start: [20, "kHz"] },
  v0: { label: "speed v₀", symbol: "v₀", offered: ["mm/s", "µm/s", "m/s"], range: [-7, 2], start: [10, "mm/s"] },
};
const ALL = Object.keys(INPUTS);
export const CHOICES = { contact: ["spring", "ball"], direction: ["across", "along", "normal"] };
export const MODELS = {
  spring: "one spring of stiffness k", ball: "a ball (Hertz) with the initial stiffness k",
  across: "oscillation across the sliding direction", along: "oscillation along the sliding direction",
  normal: "an oscillating normal force",
};
export const REGIMES = { continuous: "continuous sliding", stick_slip: "stick–slip", static: "at rest" };

/** What names.json says: `knows` (what the host of the page can do), the approximations and the paper's borders. */
export const about = { knows: new Set(), approximations: {}, borders: {} };

/** Takes units and bounds as names.json tells them; nothing here works before that. */
export function setNames({ inputs, knows, approximations, borders }) {
  for (const name of ALL) {
    const { unit, units, bound, positive } = inputs[name] ?? { ...inputs.Fz, bound: inputs.y0.bound, positive: false };
    Object.assign(INPUTS[name], { si: unit, bound, positive, units: { ...units } });
  }
  // a frequency f stands for omega = 2 pi f; a unit of both (1/s) says neither
  const { units } = INPUTS.omega;
  for (const [unit, [times, over]] of Object.entries(inputs.f.units)) {
    units[unit] = unit in units ? null : [times * 2 * Math.PI, over];
  }
  Object.assign(about, { knows: new Set(knows), approximations, borders });
}

/** The inputs of a case: an oscillating normal force has its amplitude in the place of y0. */
export function namesOf({ direction }) {
  return ALL.filter((name) => name !== (direction === "normal" ? "y0" : "Fz_amplitude"));
}

// --- quantities: { value, unit }, or { low, high, unit } for an interval -----------------------------------

const hasUnit = (name, unit) => Object.hasOwn(INPUTS[name].units, unit) && INPUTS[name].units[unit] !== null;

export const toSI = (name, value, unit) => {
  const [times, over] = INPUTS[name].units[unit];
  return (value * times) / over;
};
export const fromSI = (name, value, unit) => {
  const [times, over] = INPUTS[name].units[unit];
  return (value * over) / times;
};

/** A quantity in SI; the geometric middle of an interval. */
export const si = (name, { value, low, high, unit }) =>
  toSI(name, low === undefined ? value : Math.sqrt(low) * Math.sqrt(high), unit);

/** The symbol that goes with a unit: a frequency in Hz is f. */
export const symbolOf = (name, unit) => (name === "omega" && unit.endsWith("Hz") ? "f" : INPUTS[name].symbol);

/** A number with so many significant digits, without trailing zeros, with an exponent only where it is shorter. */
export function show(value, digits = 6) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e-4 && size < 10 ** Math.max(digits, 5)) return String(Number(value.toPrecision(digits)));
  const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  return `${Number(mantissa)}e${Number(exponent)}`;
}

const withUnit = (text, unit) => (unit === "-" ? text : `${text} ${unit}`);

/** A quantity as text, with all of its digits or with so many: "2 µm", "0.8..1.2 N/µm". */
export function textOf({ value, low, high, unit }, digits = null) {
  const texts = (low === undefined ? [value] : [low, high]).map((one) => (digits ? show(one, digits) : String(one)));
  return withUnit(texts.join(".."), unit);
}

/** A value of an input [SI] as text in a unit, or in the offered one that suits it. */
export function inUnit(name, value, unit = suiting(name, value), digits = 4) {
  return value === null ? "–" : withUnit(show(fromSI(name, value, unit), digits), unit);
}

function suiting(name, value) {
  const sizes = INPUTS[name].offered.map((unit) => [unit, Math.abs(fromSI(name, value, unit))]);
  const fit = sizes.filter(([, size]) => size >= 1).sort((a, b) => a[1] - b[1])[0];
  return (fit ?? sizes.sort((a, b) => b[1] - a[1])[0])[0];
}

/** Watts with a prefix. */
export function watts(value) {
  if (value === null) return "–";
  const prefixes = ["p", "n", "µ", "m", "", "k", "M", "G"];
  const i = value === 0 ? 4 : Math.floor(Math.log10(Math.abs(value)) / 3) + 4;
  const at = Math.min(Math.max(i, 0), prefixes.length - 1);
  return `${show(value / 1000 ** (at - 4), 4)} ${prefixes[at]}W`;
}

/** A friction coefficient to the second digit of its uncertainty; where none is told, with `usual` digits. */
export function friction(value, uncertainty = 0, usual = 4) {
  if (!value) return show(value);
  const places = uncertainty > 0 ? Math.floor(Math.log10(value)) - Math.floor(Math.log10(uncertainty)) + 2 : usual;
  return value.toPrecision(Math.min(Math.max(places, 1), 15));
}

// --- what a person types: understood as a whole, or refused with the reason ---------------------------------

const NUMBER = /^([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(?![\d.,])(.*)$/is;

/** { value, unit } of a typed number, unit "" where there is none; or { fault } in words.  As on the command line. */
export function readNumber(text) {
  const tidy = text.trim().replace("−", "-");
  if (tidy === "") return { fault: "give a number" };
  const [, digits, unit] = NUMBER.exec(tidy) ?? [];
  if (digits === undefined) {
    const point = tidy.replace(",", ".");
    if (NUMBER.test(point)) return { fault: `“${tidy}”: the decimal sign is a point, ${point}` };
    return { fault: `“${tidy}” is not a number` };
  }
  const value = Number(digits);
  if (!Number.isFinite(value)) return { fault: `“${tidy}” is too large` };
  if (value === 0 && /[1-9]/.test(digits.split(/e/i)[0])) return { fault: `“${tidy}” is too small` };
  return { value, unit: unit.trim() };
}

/** The unit of an input that is meant by a text; { fault } if none is. */
function readUnit(name, text) {
  const tidy = text.replace(/[\s·[\]()]/g, "");
  const found = [tidy.replace(/[uμ](?=m)/g, "µ"), tidy].find((unit) => hasUnit(name, unit));
  if (found !== undefined) return { unit: found };
  const { units, offered, symbol } = INPUTS[name];
  if (units[tidy] === null) return { fault: `“${text}” can be Hz or rad/s: write one of them` };
  const near = Object.keys(units).filter((unit) => unit.toLowerCase() === tidy.toLowerCase());
  if (near.length) return { fault: `“${text}” is not a unit: did you mean ${near.join(" or ")}?` };
  const known = name === "mu0" ? "leave it out" : `give ${offered.join(", ")}`;
  return { fault: `“${text}” is not a unit of ${symbol}: ${known}` };
}

/** A typed value, in `unit` where none is typed: { value, unit }, { low, high, unit }, { rigid } or { fault }. */
export function readValue(name, text, unit, positive = INPUTS[name].positive) {
  if (name === "k" && /^rigid$/i.test(text.trim())) return { rigid: true };
  if (name === "k" && text.includes("..")) {
    if (about.knows.has("k_range")) return readInterval(name, text, unit);
    return { fault: "must be one number: this service knows no interval" };
  }
  const number = readNumber(text);
  if (number.fault) return number;
  const named = number.unit === "" ? { unit } : readUnit(name, number.unit);
  if (named.fault) return named;
  const { value } = number;
  const found = toSI(name, value, named.unit);
  const bad = !Number.isFinite(found) || found < 0 || (positive && value === 0);
  if (bad) return { fault: `must be ${positive ? INPUTS[name].bound : "finite and >= 0"}` };
  return found === 0 && value !== 0 ? { fault: "is too small" } : { value, unit: named.unit };
}

/** A typed interval "low..high": { low, high, unit }, or { fault }. */
export function readInterval(name, text, unit) {
  const ends = text.split("..");
  if (ends.length !== 2) return { fault: `“${text.trim()}” is not an interval: write low..high` };
  const high = readValue(name, ends[1], unit);
  const low = readValue(name, ends[0], high.unit ?? unit);
  const fault = low.fault ?? high.fault;
  if (fault) return { fault };
  if (low.rigid || high.rigid) return { fault: "must be an interval of two numbers" };
  const first = low.unit === high.unit ? low.value : fromSI(name, si(name, low), high.unit);
  if (!(first < high.value)) return { fault: "must go up: write low..high" };
  return { low: first, high: high.value, unit: high.unit };
}

/** A typed standard deviation: in the input's unit, or in %; null for none, { fault } if it is neither. */
export function readDeviation(name, text, unit) {
  if (text.trim() === "") return null;
  const bare = text.replace(/^\s*±/, "");
  const number = readNumber(bare);
  const percent = number.unit === "%";
  if (!percent) return readValue(name, bare, unit, false);
  return number.value < 0 ? { fault: "must be finite and >= 0" } : number;
}

/** Typed values of a family of curves, separated by ";": a list of quantities, or { fault }. */
export function readCurves(name, text, unit) {
  const parts = text.split(";").map((part) => part.trim()).filter(Boolean);
  if (!parts.length) return { fault: "give values, separated by ;" };
  if (parts.length > 20) return { fault: "up to 20 values" };
  const bare = parts.filter((part) => readNumber(part).unit === "").length;
  if (bare > 0 && bare < parts.length) return { fault: "give a unit to every value or to none" };
  const found = parts.map((part) => readValue(name, part, unit));
  const wrong = found.findIndex(({ value }) => value === undefined);
  return wrong < 0 ? found : { fault: `${parts[wrong]}: ${found[wrong].fault ?? "give a number"}` };
}

// --- the state of the page, the case that it asks for, and its address, in the words of the command line: "y0=2um" ---

export const startState = () => ({
  given: Object.fromEntries(Object.entries(INPUTS).map(([name, { start: [value, unit] }]) => [name, { value, unit }])),
  std: {}, rigid: false, contact: "spring", direction: "across", digits: "few",
  along: "v0", scale: "log", approximations: false, range: null, family: null, curves: [],
});

/** An input of the state [SI]; Infinity for the stiffness of a rigid contact. */
export const valueOf = (state, name) => (name === "k" && state.rigid ? Infinity : si(name, state.given[name]));

/** Both ends of the stiffness where it is an interval, as quantities; else null. */
export function endsOf({ rigid, given: { k: { low, high, unit } } }) {
  return rigid || low === undefined ? null : [low, high].map((value) => ({ value, unit }));
}

/** The inputs as the service takes them, without some of them; of an interval its middle. */
export function caseOf(state, ...without) {
  const names = namesOf(state).filter((name) => !without.includes(name));
  const given = names.map((name) => [name, name === "k" && state.rigid ? "rigid" : valueOf(state, name)]);
  const choices = Object.entries(CHOICES).filter(([name, [usual]]) => state[name] !== usual);
  return Object.fromEntries([...given, ...choices.map(([name]) => [name, state[name]])]);
}

/** The question for the readout. */
export function question(state) {
  const ends = endsOf(state);
  const request = ends ? { ...caseOf(state, "k"), k_range: ends.map((end) => si("k", end)) } : caseOf(state);
  const include = ["groups", "limits", "stick_fraction", "power", "gradient"];
  const std = {};
  const single = (name) => name !== "k" || !(ends || state.rigid);
  for (const name of namesOf(state).filter((one) => state.std[one]?.value && single(one))) {
    const { value, unit } = state.std[name];
    std[name] = unit === "%" ? (value / 100) * valueOf(state, name) : si(name, state.std[name]);
  }
  return Object.keys(std).length ? { ...request, std, include: [...include, "std"] } : { ...request, include };
}

/** The state as the part of an address behind "#". */
export function toAddress(state) {
  const usual = startState();
  const names = namesOf(state);
  const text = (quantity) => textOf(quantity).replaceAll(" ", "").replaceAll("µ", "u");
  const keyOf = (name) => (symbolOf(name, state.given[name].unit) === "f" ? "f" : name);
  const parts = names.map((name) => [keyOf(name), name === "k" && state.rigid ? "rigid" : text(state.given[name])]);
  for (const name of names) if (state.std[name]) parts.push([`${name}.std`, text(state.std[name])]);
  for (const key of ["contact", "direction", "digits", "along", "scale", "approximations"]) {
    if (state[key] !== usual[key]) parts.push([key, state[key]]);
  }
  if (state.range) parts.push(["range", text(state.range)]);
  if (state.family) parts.push(["family", state.family], ["curves", state.curves.map(text).join(";")]);
  const quoted = (value) => encodeURIComponent(value).replace(/%(2F|3B)/g, decodeURIComponent);
  return `#${parts.map(([key, value]) => `${key}=${quoted(value)}`).join("&")}`;
}

/** { state, faults }: what an address says, start values in place of what cannot be used, and why, in words. */
export function fromAddress(hash) {
  const state = startState();
  const faults = [];
  const given = new Map(new URLSearchParams(hash.slice(1)));
  const bad = (key, why) => faults.push(`${key} = ${given.get(key) || "nothing"} (${why})`);
  const known = new Set(["omega", "f"]);
  /** Takes what `read` makes of a text of the address, if it has that key. */
  const take = (key, read, use) => {
    known.add(key);
    if (!given.has(key)) return;
    const found = read(given.get(key));
    if (found?.fault) bad(key, found.fault);
    else use(found);
  };
  const choice = (key, words, use) =>
    take(key, (word) => (words.includes(word) ? word : { fault: `must be one of ${words.join(", ")}` }), use);

  for (const [name, words] of Object.entries(CHOICES)) {
    choice(name, about.knows.has(name) ? words : words.slice(0, 1), (word) => { state[name] = word; });
  }
  const names = namesOf(state);
  const set = (name) => (found) => { if (found.rigid) state.rigid = true; else state.given[name] = found; };
  for (const name of names) take(name, (text) => readValue(name, text, INPUTS[name].si), set(name));
  if (given.has("omega") && given.has("f")) bad("f", "omega is given, too");
  else take("f", (text) => readValue("omega", text, "Hz"), set("omega"));
  for (const name of names) {
    take(`${name}.std`, (text) => readDeviation(name, text, INPUTS[name].si), (found) => { state.std[name] = found; });
  }
  choice("digits", ["few", "all"], (word) => { state.digits = word; });
  choice("along", names, (name) => { state.along = name; });
  choice("scale", ["log", "linear"], (scale) => { state.scale = scale; });
  choice("approximations", ["true", "1"], () => { state.approximations = true; });
  const { along } = state;
  take("range", (text) => readInterval(along, text, INPUTS[along].si), (range) => { state.range = range; });
  choice("family", names.filter((name) => name !== along), (family) => {
    const use = (curves) => Object.assign(state, { family, curves });
    take("curves", (text) => readCurves(family, text, INPUTS[family].si), use);
  });
  known.add("curves");
  for (const key of given.keys()) if (!known.has(key)) bad(key, "unknown");
  return { state, faults };
}
