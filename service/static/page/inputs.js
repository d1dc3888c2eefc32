// The inputs: units and bounds, what a person types, numbers as text, the state of the page, its
// case and its address. Nothing here needs a browser; tests/service/page tests it with node.

/**
 * What names.json says; nothing here works before that.  Of an input: label, symbol, units, bound,
 * offered units, the slider's decimal exponents (SI), start value; beside them the choices with
 * their words, of each contact the exponent of k over Fz as text, geometries and their arguments,
 * and whether there is a guide.
 */
export const about = {};
/** The name of a regime in words. */
export const inWords = (name) => name.replaceAll("_", " ");
const POWER = { units: { kW: [1e3, 1], mW: [1, 1e3], µW: [1, 1e6], nW: [1, 1e9], W: [1, 1] } };

export const RIGID = { text: "rigid", unit: "N/µm", low: Infinity, high: Infinity };

/** What there is about a quantity: an input, an argument of a geometry, or a power. */
const kindOf = (name) => about.inputs[name] ?? about.arguments[name] ?? POWER;

/** The inputs of a case: an oscillating normal force has its amplitude in the place of y0. */
export const namesOf = ({ direction }) =>
  Object.keys(about.inputs).filter(
    (name) => name !== (direction === "normal" ? "y0" : "Fz_amplitude"),
  );

export const toSI = (name, value, unit) =>
  (value * kindOf(name).units[unit][0]) / kindOf(name).units[unit][1];
export const fromSI = (name, value, unit) =>
  (value * kindOf(name).units[unit][1]) / kindOf(name).units[unit][0];

/** The symbol that goes with a unit: a frequency in Hz is f. */
export const symbolOf = (name, unit) =>
  name === "omega" && unit.endsWith("Hz") ? "f" : about.inputs[name].symbol;

const withUnit = (text, unit) => (unit === "-" ? text : `${text} ${unit}`);

/**
 * A number with so many significant digits, without trailing zeros, with an exponent only where it
 * is shorter.
 */
export function show(value, digits = 6) {
  if (value === null || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return "∞";
  const size = Math.abs(value);
  const short = size === 0 || (size >= 1e-4 && size < 10 ** Math.max(digits, 5));
  const close = Number(value.toPrecision(digits));
  return short ? String(close) : close.toExponential().replace("e+", "e");
}

/** A value [SI] as text in a unit, or in the offered one that suits it. */
export function inUnit(name, value, unit = null, digits = 4) {
  if (value === null) return "–";
  const { units, offered = Object.keys(units) } = kindOf(name);
  const sizes = offered.map((one) => [one, Math.abs(fromSI(name, value, one))]);
  sizes.sort((a, b) => a[1] - b[1]);
  const [suits] = sizes.find(([, size]) => size >= 1) ?? sizes.at(-1);
  return withUnit(show(fromSI(name, value, unit ?? suits), digits), unit ?? suits);
}

/**
 * A friction coefficient to the second digit of its uncertainty; where none is stated, with `usual`
 * digits.
 */
export function friction(value, uncertainty = 0, usual = 4) {
  if (!value) return show(value);
  const places =
    uncertainty > 0
      ? Math.floor(Math.log10(value)) - Math.floor(Math.log10(uncertainty)) + 2
      : usual;
  return value.toPrecision(Math.min(Math.max(places, 1), 15));
}

/** A reason as a sentence. */
export const sentence = (text) => (/[.?!]$/.test(text) ? text : `${text}.`);

class Fault extends Error {}
export const refuse = (why) => {
  throw new Fault(why);
};

/** { result } of what reads a text, or { fault }: why it cannot be used. */
export function attempt(read) {
  try {
    return { result: read() };
  } catch (error) {
    if (error instanceof Fault) return { fault: error.message };
    throw error;
  }
}

/** The result of `read`; a fault says where it was. */
export function within(where, read) {
  const { result, fault } = attempt(read);
  return fault ? refuse(`${where}: ${fault}`) : result;
}

const NUMBER = /^([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(?![\d.,])(.*)$/is;

/**
 * [number, unit] of a typed text, unit "" where there is none; a comma is a decimal sign where it
 * is no sign of thousands.
 */
function readNumber(text) {
  const tidy = text.trim().replace("−", "-");
  const [, digits, unit] = NUMBER.exec(tidy) ?? [];
  if (digits === undefined) {
    const point = tidy.replace(",", ".");
    if (NUMBER.test(point) && !/^[+-]?[1-9]\d*,\d{3}(?!\d)/.test(tidy)) return readNumber(point);
    const why = NUMBER.test(point)
      ? `“${tidy}” can be ${point} or ${tidy.replace(",", "")}: write one of them`
      : `“${tidy}” is not a number`;
    refuse(tidy === "" ? "give a number" : why);
  }
  const value = Number(digits);
  if (!Number.isFinite(value)) refuse(`“${tidy}” is too large`);
  if (value === 0 && /[1-9]/.test(digits.split(/e/i)[0])) refuse(`“${tidy}” is too small`);
  return [value, unit.trim()];
}

/** The unit of a quantity that is meant by a text. */
function readUnit(name, text) {
  const { units, offered = Object.keys(units), symbol = name } = kindOf(name);
  const tidy = text.replace(/[\s·[\]()]/g, "");
  const spellings = [tidy.replace(/[uμ](?=m)/g, "µ"), tidy];
  const unit = spellings.find((one) => Object.hasOwn(units, one));
  if (unit !== undefined && units[unit] !== null) return unit;
  if (unit !== undefined) refuse(`“${text}” can be Hz or rad/s: write one of them`);
  const near = Object.keys(units).filter((unit) => unit.toLowerCase() === tidy.toLowerCase());
  if (near.length) refuse(`“${text}” is not a unit: did you mean ${near.join(" or ")}?`);
  const remedy = offered.includes("-") ? "leave it out" : `give ${offered.join(", ")}`;
  return refuse(`“${text}” is not a unit of ${symbol}: ${remedy}`);
}

/** A typed quantity, in `unit` where none is typed: { text, unit, low, high }, low = high in SI. */
export function readQuantity(name, text, unit) {
  const [value, typed] = readNumber(text);
  const own = typed === "" ? unit : readUnit(name, typed);
  const si = toSI(name, value, own);
  if (si === 0 && value !== 0) refuse("is too small");
  return { text: withUnit(String(value), own), unit: own, low: si, high: si };
}

/** A typed value of an input: a number, or for k "rigid" or "low..high". */
export function readValue(name, text, unit = about.inputs[name].offered[0]) {
  if (name === "k" && /^rigid$/i.test(text.trim())) return RIGID;
  if (name === "k" && text.includes("..")) return readInterval(name, text, unit);
  const dashed = /^\s*([\d.]+)\s*[-–]\s*(\d.*)$/.exec(text);
  if (name === "k" && dashed) refuse(`write an interval as ${dashed[1]}..${dashed[2].trim()}`);
  const read = readQuantity(name, text, unit);
  const { positive, bound } = about.inputs[name];
  if (!Number.isFinite(read.low) || read.low < 0 || (positive && read.low === 0))
    refuse(`must be ${bound}`);
  return read;
}

/** A typed interval "low..high". */
export function readInterval(name, text, unit) {
  const ends = text.split("..");
  if (ends.length !== 2) refuse(`“${text.trim()}” is not an interval: write low..high`);
  const high = readValue(name, ends[1], unit);
  const low = readValue(name, ends[0], high.unit);
  if (low === RIGID || high === RIGID) refuse("must be an interval of two numbers");
  if (!(low.low < high.low)) refuse("must go up: write low..high");
  const first = low.unit === high.unit ? low.text.split(" ")[0] : fromSI(name, low.low, high.unit);
  return { text: `${first}..${high.text}`, unit: high.unit, low: low.low, high: high.low };
}

/**
 * A typed exponent of k over Fz: { text, value }, such as 0.5 or 1/3; its bounds are the service's.
 */
export function readExponent(text) {
  if (text.trim() === "") return ANY;
  const parts = text.split("/").map(readNumber);
  const [, unit] = parts.find(([, one]) => one !== "") ?? [];
  if (unit) refuse(`“${unit}” is too much: m has no unit`);
  if (parts.length > 2) refuse(`“${text.trim()}” is not a number`);
  const [[over], [under] = [1]] = parts;
  if (under === 0) refuse(`“${text.trim()}” is not a number`);
  return { text: text.trim(), value: over / under };
}

const readRange = (name, text, unit) => (text.trim() === "" ? ANY : readInterval(name, text, unit));

/** A value of an input [SI], or "rigid", as a quantity with so many digits. */
export const rounded = (name, value, unit, digits) =>
  readValue(
    name,
    String(value === "rigid" ? value : Number(fromSI(name, value, unit).toPrecision(digits))),
    unit,
  );

const COLUMNS = [
  ["v0", /^(v|speed)/i],
  ["mu_macro", /^(mu|µ|μ|friction)(?!_?[0₀])/i],
  ["std", /^(std|±|sigma|s$|u$)/i],
  ["mu0", /^(mu|µ|μ)_?[0₀]/i],
];
const WITH_COMMA = /^[+−-]?\d*,\d+(?:e[+-]?\d+)?(?![\d.,])/i;

/**
 * What stands between the columns: a comma may also be the decimal sign of columns between spaces.
 */
function separatorOf(text, lines) {
  const sign = ["\t", ";", ","].find((one) => text.includes(one));
  if (sign !== ",") return sign ?? /\s+/;
  const cells = lines.filter((line) => /^[\d,+−-]/.test(line)).map((line) => line.split(/\s+/));
  const decimal = cells.every(
    (row) => row.length > 1 && row.every((cell) => /^[^,]+$/.test(cell) || WITH_COMMA.test(cell)),
  );
  return cells.length && decimal ? /\s+/ : sign;
}

/**
 * Cells with a decimal point; the decimal sign is a comma where a cell has one, and then it is so
 * in every cell.
 */
function withPoints(rows) {
  const comma = rows.flat().find((cell) => WITH_COMMA.test(cell));
  if (comma === undefined) return rows;
  const point = rows.flat().find((cell) => /^[+−-]?\d*\./.test(cell));
  if (point !== undefined)
    refuse(`“${comma}” has a decimal comma, “${point}” a decimal point: use one of them`);
  return rows.map((row) => row.map((cell) => cell.replace(",", ".")));
}

/**
 * { v0 [m/s], mu_macro, std, mu0 } of points, one a line.  A first line of words names the columns.
 */
export function readPoints(text) {
  const lines = text
    .split("\n")
    .map((line) => line.trim())
    .filter((line) => line && !line.startsWith("#"));
  const between = separatorOf(text, lines);
  let rows = lines.map((line) => line.split(between).map((cell) => cell.trim()));
  if (!rows.length) refuse("paste points: v₀ and µ, one point a line");
  const headed = /^[^\d.,+−-]/.test(rows[0][0]);
  const head = headed
    ? rows.shift()
    : COLUMNS.map(([name]) => name).slice(0, Math.min(3, rows[0].length));
  const names = head.map((cell) => COLUMNS.find(([, sign]) => sign.test(cell))?.[0]);
  const strange = names.findIndex((name, i) => name === undefined || names.indexOf(name) < i);
  if (strange >= 0)
    refuse(`column “${head[strange]}” is not one of v0, mu_macro, std, mu0, each once`);
  const complete =
    names.includes("v0") && names.includes("mu_macro") && (headed || rows[0].length <= 3);
  if (!complete) refuse("needs two or three columns: v0, mu_macro, std; with mu0 also their names");
  if (!rows.length) refuse("paste points below the names of the columns");
  rows = withPoints(rows);
  const unit = readUnit("v0", /[[(](.*)[\])]/.exec(head[names.indexOf("v0")])?.[1] ?? "m/s");
  return Object.fromEntries(
    names.map((name, j) => [
      name,
      rows.map((row, i) => {
        const line = `line ${i + 1 + headed}`;
        if (row.length !== names.length)
          refuse(`${line} has ${row.length} values, not ${names.length}`);
        const [kind, usual] = name === "v0" ? ["v0", unit] : ["mu0", "-"];
        return within(`${line}, ${name}`, () => readQuantity(kind, row[j], usual)).low;
      }),
    ]),
  );
}

/** The range of a law over which nobody chose one. */
export const ANY = { text: "" };

/**
 * A quantity for each input and for the `range` of the one that the law goes along, and what is
 * chosen.
 */
export const startState = () => ({
  ...Object.fromEntries(
    Object.entries(about.inputs).map(([name, { start }]) => [name, readValue(name, start)]),
  ),
  contact: "spring",
  direction: "across",
  digits: "few",
  along: "v0",
  scale: "log",
  range: ANY,
  stiffness_exponent: ANY,
});

/**
 * What is typed for an input, the range or the exponent; if it cannot be used, what was there, with
 * `typed` and its `fault`.
 */
export function readTyped(state, name, text) {
  const read = {
    range: () => readRange(state.along, text, state[state.along].unit),
    stiffness_exponent: () => readExponent(text),
  };
  const { result, fault } = attempt(read[name] ?? (() => readValue(name, text, state[name].unit)));
  return fault ? { ...state[name], typed: text, fault } : result;
}

/** An input of the state [SI]: of an interval its geometric middle, of a rigid contact Infinity. */
export function valueOf(state, name) {
  const { low, high } = state[name];
  return low === high ? low : Math.sqrt(low) * Math.sqrt(high);
}

/**
 * The inputs as the service takes them, without some of them; with `whole` an interval of k as
 * such.
 */
export function caseOf(state, without = [], whole = false) {
  const entry = (name) => {
    const { low, high } = state[name];
    if (whole && low < high) return ["k_range", [low, high]];
    return [name, low === Infinity ? "rigid" : valueOf(state, name)];
  };
  const chosen = Object.entries(about.choices).filter(
    ([name, all]) => state[name] !== Object.keys(all)[0],
  );
  return Object.fromEntries([
    ...namesOf(state)
      .filter((name) => !without.includes(name))
      .map(entry),
    ...chosen.map(([name]) => [name, state[name]]),
  ]);
}

/** The exponent m in k = k_given (Fz/Fz_given)^m: what is typed, else that of the contact. */
export const exponentOf = (state) =>
  state.stiffness_exponent.value ?? readExponent(about.exponents[state.contact]).value;

/** Whether k grows with the input that is swept or solved for. */
export const stiffens = (state, name) => name === "Fz" && exponentOf(state) !== 0;

/**
 * The case of a question about one input, which is left out; where k grows with it, it stays: the
 * load at which k holds.
 */
export function caseAround(state, name, whole = false) {
  if (!stiffens(state, name)) return caseOf(state, [name], whole);
  return { ...caseOf(state, [], whole), stiffness_exponent: exponentOf(state) };
}

/**
 * What changes when one input gets another value [SI], with so many digits: itself, and k where it
 * grows with it.
 */
export function movedAlong(state, name, value, digits) {
  const { unit, low, high } = state.k;
  const moved = { [name]: rounded(name, value, state[name].unit, digits) };
  if (!stiffens(state, name) || state.k === RIGID) return moved;
  const growth = (moved.Fz.low / state.Fz.low) ** exponentOf(state);
  const ends = [low, high].map((end) =>
    Number(fromSI("k", growth * end, unit).toPrecision(Math.max(digits, 6))),
  );
  return { ...moved, k: readValue("k", low === high ? String(ends[0]) : ends.join(".."), unit) };
}

/** The inputs in one line, without the one that the law goes along. */
export function caption(state, along) {
  const names = namesOf(state).filter((name) => name !== along);
  const parts = names.map((name) => `${symbolOf(name, state[name].unit)} = ${state[name].text}`);
  const exponent = state.stiffness_exponent.text || about.exponents[state.contact];
  if (stiffens(state, along)) parts.push(`k at Fz = ${state.Fz.text}, growing as Fz^(${exponent})`);
  return parts.join(", ");
}

/** The power, where it is known: not for a normal force that oscillates. */
export const powerOf = ({ direction }) => (direction === "normal" ? [] : ["power"]);

/** The question for the readout. */
export function question(state) {
  const include = ["groups", "limits", "stick_fraction", "gradient", ...powerOf(state), "model"];
  return { ...caseOf(state, [], true), include };
}

const inAddress = ({ text }) =>
  encodeURIComponent(text.replaceAll(" ", "").replaceAll("µ", "u")).replaceAll("%2F", "/");
/** The words that a part of the state may be, in the order in which an address is read. */
const WORDS = {
  contact: () => Object.keys(about.choices.contact),
  direction: () => Object.keys(about.choices.direction),
  digits: () => ["few", "all"],
  along: namesOf,
  scale: () => ["log", "linear"],
};

/** The state as the part of an address behind "#". */
export function toAddress(state) {
  const usual = startState();
  const keyOf = (name) => (symbolOf(name, state[name].unit) === "f" ? "f" : name);
  const parts = namesOf(state).map((name) => `${keyOf(name)}=${inAddress(state[name])}`);
  parts.push(
    ...Object.keys(WORDS)
      .filter((key) => state[key] !== usual[key])
      .map((key) => `${key}=${state[key]}`),
  );
  for (const name of ["range", "stiffness_exponent"]) {
    if (state[name].text) parts.push(`${name}=${inAddress(state[name])}`);
  }
  return `#${parts.join("&")}`;
}

/**
 * { state, faults }: what an address says, start values in place of what cannot be used, and why,
 * in words.
 */
export function fromAddress(hash) {
  const [state, faults, texts] = [startState(), [], new Map(new URLSearchParams(hash.slice(1)))];
  /** Sets a part of the state to what `read` makes of a text of the address, if it has that key. */
  const take = (key, read, name = key) => {
    if (!texts.has(key)) return;
    const { result, fault } = attempt(() => read(texts.get(key)));
    if (fault) faults.push(`${key} = ${texts.get(key) || "nothing"} (${fault})`);
    else state[name] = result;
    texts.delete(key);
  };
  for (const [key, words] of Object.entries(WORDS)) {
    const choices = words(state);
    take(key, (word) => {
      if (!choices.includes(word)) refuse(`must be one of ${choices.join(", ")}`);
      return about.impossible[key === "direction" ? `${state.contact} ${word}` : ""]
        ? refuse("not for a ball")
        : word;
    });
  }
  if (texts.has("omega")) take("f", () => refuse("omega is given, too"));
  for (const name of namesOf(state))
    take(name, (text) => readValue(name, text, about.inputs[name].unit));
  take("f", (text) => readValue("omega", text, "Hz"), "omega");
  take("range", (text) => readInterval(state.along, text, about.inputs[state.along].unit));
  take("stiffness_exponent", readExponent);
  for (const key of [...texts.keys()]) take(key, () => refuse("unknown"));
  return { state, faults };
}
