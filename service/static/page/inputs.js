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
export const REGIMES = {
  continuous: "continuous sliding", stick_slip: "stick–slip", static: "at rest", partial_slip: "partial slip",
  reverse_slip: "slip back and forth",
};

/** What names.json says: `knows` (what the host of the page can do), the geometries of a contact, their arguments. */
export const about = { knows: new Set(), geometries: {}, arguments: {} };

/** Takes units and bounds as names.json tells them; nothing here works before that. */
export function setNames({ inputs, knows, geometries, arguments: others }) {
  for (const name of ALL) {
    const { unit, units, bound, positive } = inputs[name] ?? { ...inputs.Fz, bound: inputs.y0.bound, positive: false };
    Object.assign(INPUTS[name], { si: unit, bound, positive, units: { ...units } });
  }
  // a frequency f stands for omega = 2 pi f; a unit of both (1/s) says neither
  const { units } = INPUTS.omega;
  for (const [unit, [times, over]] of Object.entries(inputs.f.units)) {
    units[unit] = unit in units ? null : [times * 2 * Math.PI, over];
  }
  Object.assign(about, { knows: new Set(knows), geometries, arguments: others });
}

/** What is known of a quantity: an input, or an argument of a geometry. */
const kindOf = (name) => INPUTS[name] ?? about.arguments[name];

/** The inputs of a case: an oscillating normal force has its amplitude in the place of y0. */
export function namesOf({ direction }) {
  return ALL.filter((name) => name !== (direction === "normal" ? "y0" : "Fz_amplitude"));
}

// --- quantities: { value, unit }, or { low, high, unit } for an interval -----------------------------------

const hasUnit = (name, unit) => Object.hasOwn(kindOf(name).units, unit) && kindOf(name).units[unit] !== null;

export const toSI = (name, value, unit) => {
  const [times, over] = kindOf(name).units[unit];
  return (value * times) / over;
};
export const fromSI = (name, value, unit) => {
  const [times, over] = kindOf(name).units[unit];
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
  const { units, offered = Object.keys(units), symbol = name } = kindOf(name);
  if (units[tidy] === null) return { fault: `“${text}” can be Hz or rad/s: write one of them` };
  const near = Object.keys(units).filter((unit) => unit.toLowerCase() === tidy.toLowerCase());
  if (near.length) return { fault: `“${text}” is not a unit: did you mean ${near.join(" or ")}?` };
  const known = offered.includes("-") ? "leave it out" : `give ${offered.join(", ")}`;
  return { fault: `“${text}” is not a unit of ${symbol}: ${known}` };
}

/** A typed number with its unit, `unit` where none is typed: { value, unit }, or { fault }. */
export function readQuantity(name, text, unit) {
  const number = readNumber(text);
  if (number.fault) return number;
  const named = number.unit === "" ? { unit } : readUnit(name, number.unit);
  return named.fault ? named : { value: number.value, unit: named.unit };
}

/** A typed value of an input: { value, unit }, { low, high, unit }, { rigid } or { fault }. */
export function readValue(name, text, unit) {
  if (name === "k" && /^rigid$/i.test(text.trim())) return { rigid: true };
  if (name === "k" && text.includes("..")) {
    if (about.knows.has("k_range")) return readInterval(name, text, unit);
    return { fault: "must be one number: this service knows no interval" };
  }
  const read = readQuantity(name, text, unit);
  if (read.fault) return read;
  const { positive, bound } = INPUTS[name];
  const found = si(name, read);
  const bad = !Number.isFinite(found) || found < 0 || (positive && read.value === 0);
  if (bad) return { fault: `must be ${bound}` };
  return found === 0 && read.value !== 0 ? { fault: "is too small" } : read;
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

const COLUMNS = [["v0", /^(v|speed)/i], ["mu_macro", /^(mu|µ|μ|friction)/i], ["std", /^(std|±|sigma|s$|u$)/i]];

/** { v0 [m/s], mu_macro, std } of points, one a line; or { fault }.  A first line of words names the columns. */
export function readPoints(text) {
  const lines = text.split("\n").map((line) => line.trim()).filter((line) => line && !line.startsWith("#"));
  const between = ["\t", ";", ","].find((sign) => text.includes(sign)) ?? /\s+/;
  const rows = lines.map((line) => line.split(between).map((cell) => cell.trim()));
  if (!rows.length) return { fault: "paste points: v₀ and µ, one point a line" };
  let [names, unit] = [COLUMNS.map(([name]) => name).slice(0, rows[0].length), "m/s"];
  const headed = /^[^\d.+−-]/.test(rows[0][0]);
  if (headed) {
    const head = rows.shift();
    names = head.map((cell) => COLUMNS.find(([, sign]) => sign.test(cell))?.[0]);
    const strange = names.findIndex((name, i) => name === undefined || names.indexOf(name) < i);
    if (strange >= 0) return { fault: `column “${head[strange]}” is not one of v0, mu_macro, std, each once` };
    const named = /[[(](.*)[\])]/.exec(head[names.indexOf("v0")])?.[1];
    const known = named === undefined ? { unit } : readUnit("v0", named);
    if (known.fault) return known;
    unit = known.unit;
  }
  const complete = ["v0", "mu_macro"].every((name) => names.includes(name)) && (headed || rows[0].length <= 3);
  if (!complete) return { fault: "needs two or three columns: v0, mu_macro, std" };
  if (!rows.length) return { fault: "paste points below the names of the columns" };
  const found = Object.fromEntries(names.map((name) => [name, []]));
  for (const [i, cells] of rows.entries()) {
    const line = `line ${i + 1 + headed}`;
    if (cells.length !== names.length) return { fault: `${line} has ${cells.length} values, not ${names.length}` };
    for (const [j, name] of names.entries()) {
      const kind = name === "v0" ? "v0" : "mu0";
      const read = readQuantity(kind, cells[j], kind === "v0" ? unit : "-");
      if (read.fault) return { fault: `${line}, ${name}: ${read.fault}` };
      found[name].push(si(kind, read));
    }
  }
  return found;
}

// --- the state of the page, the case that it asks for, and its address, in the words of the command line: "y0=2um" ---

export const startState = () => ({
  given: Object.fromEntries(Object.entries(INPUTS).map(([name, { start: [value, unit] }]) => [name, { value, unit }])),
  rigid: false, contact: "spring", direction: "across", digits: "few", along: "v0", scale: "log", range: null,
});

/** An input of the state [SI]; Infinity for the stiffness of a rigid contact. */
export const valueOf = (state, name) => (name === "k" && state.rigid ? Infinity : si(name, state.given[name]));

/** Both ends of the stiffness [N/m] where it is an interval; else null. */
export function endsOf({ rigid, given: { k: { low, high, unit } } }) {
  return rigid || low === undefined ? null : [low, high].map((value) => toSI("k", value, unit));
}

/** The inputs as the service takes them, without some of them; of an interval its middle. */
export function caseOf(state, ...without) {
  const names = namesOf(state).filter((name) => !without.includes(name));
  const given = names.map((name) => [name, name === "k" && state.rigid ? "rigid" : valueOf(state, name)]);
  const choices = Object.entries(CHOICES).filter(([name, [usual]]) => state[name] !== usual);
  return Object.fromEntries([...given, ...choices.map(([name]) => [name, state[name]])]);
}

/** The same with an interval of k as such, unless k is left out. */
export function spanOf(state, ...without) {
  const ends = without.includes("k") ? null : endsOf(state);
  return ends ? { ...caseOf(state, "k", ...without), k_range: ends } : caseOf(state, ...without);
}

/** The power, where it is known: not for a normal force that oscillates. */
export const powerOf = ({ direction }) => (direction === "normal" ? [] : ["power"]);

/** The question for the readout. */
export function question(state) {
  const model = about.knows.has("contact") ? ["model"] : []; // of a service that has several
  return { ...spanOf(state), include: ["groups", "limits", "stick_fraction", "gradient", ...powerOf(state), ...model] };
}

/** The state as the part of an address behind "#". */
export function toAddress(state) {
  const usual = startState();
  const names = namesOf(state);
  const text = (quantity) => textOf(quantity).replaceAll(" ", "").replaceAll("µ", "u");
  const keyOf = (name) => (symbolOf(name, state.given[name].unit) === "f" ? "f" : name);
  const parts = names.map((name) => [keyOf(name), name === "k" && state.rigid ? "rigid" : text(state.given[name])]);
  for (const key of ["contact", "direction", "digits", "along", "scale"]) {
    if (state[key] !== usual[key]) parts.push([key, state[key]]);
  }
  if (state.range) parts.push(["range", text(state.range)]);
  const quoted = (value) => encodeURIComponent(value).replaceAll("%2F", "/");
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
  choice("digits", ["few", "all"], (word) => { state.digits = word; });
  choice("along", names, (name) => { state.along = name; });
  choice("scale", ["log", "linear"], (scale) => { state.scale = scale; });
  const { along } = state;
  take("range", (text) => readInterval(along, text, INPUTS[along].si), (range) => { state.range = range; });
  for (const key of given.keys()) if (!known.has(key)) bad(key, "unknown");
  return { state, faults };
}
