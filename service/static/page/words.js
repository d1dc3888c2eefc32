// Numbers and names for people: the one place where the page writes a value.
/** What the service says of inputs, contacts and geometries (names.json). */
export const about = {};

const SMALL = 1e-4; // below, a number is written with a power of ten

/** A number with up to so many digits; "–" where there is none, ∞ where it is infinite. */
export function show(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const number = Number(value.toPrecision(digits));
  const text = number !== 0 && Math.abs(number) < SMALL ? number.toExponential() : String(number);
  return text.replace("e+", "e").replace(/^-/, "−");
}

/** A quantity with the SI prefix that suits it: 13.4 mW. */
export function prefixed(value, unit, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value) || value === 0)
    return `${show(value)} ${unit}`;
  const magnitude = Math.abs(value);
  if (magnitude < 1e-24 || magnitude >= 1e27) return `${show(value, digits)} ${unit}`;
  const [, number, prefix] = globalThis.d3
    .format(`.${digits}~s`)(value)
    .match(/^(.*\d)(\D?)$/);
  return `${number.replace("-", "−")} ${prefix}${unit}`;
}

/** The size of a unit of an input [SI]: value = number × times / over. */
const scaleOf = (name, unit) => about.inputs[name].units[unit] ?? [1, 1];

/** The offered unit in which a value of an input [SI] reads best. */
export function unitFor(name, value) {
  const { offered } = about.inputs[name];
  const number = (unit) => Math.abs(toUnit(name, value, unit));
  const fits = offered.find((unit) => number(unit) >= 0.1 && number(unit) < 1000);
  const far = (unit) => Math.abs(Math.log10(number(unit)) - 1);
  const nearest = () => offered.reduce((best, unit) => (far(unit) < far(best) ? unit : best));
  return fits ?? nearest();
}

/** The unit that was typed, where a value [SI] reads in it; else the one in which it reads best. */
export function unitAt(name, value, typed, most = 1e5) {
  const number = typed ? Math.abs(toUnit(name, value, typed)) : NaN;
  return number === 0 || (number >= 1e-3 && number < most) ? typed : unitFor(name, value);
}

/** The unit in which both ends of a range [SI] read: the one that was typed, or an offered one. */
export function unitOver(name, low, high, typed) {
  const reads = (unit) =>
    toUnit(name, high, unit) < 1e5 && (low === 0 || toUnit(name, low, unit) >= 1e-5);
  const units = [typed, ...about.inputs[name].offered].filter(Boolean);
  return units.find(reads) ?? typed ?? unitFor(name, high);
}

export const toUnit = (name, value, unit) => {
  const [times, over] = scaleOf(name, unit);
  return (value * over) / times;
};
export const toSI = (name, number, unit) => {
  const [times, over] = scaleOf(name, unit);
  return (number * times) / over;
};

/** A unit with µ, for which the service writes u: N/µm. */
export const inPrint = (unit) => unit.replace(/\bu(?=[A-Za-z])/, "µ");

/** A value that was understood as a number [SI]; a rigid contact has none. */
export const numberOf = (one) => (typeof one?.value === "number" ? one.value : undefined);

/** A value of an input [SI] as text in a unit, as a person types it: "2 µm". */
export function inUnit(name, value, unit = unitFor(name, value), digits = 4) {
  const number = Number(toUnit(name, value, unit).toPrecision(digits));
  return unit === "-" ? String(number) : `${number} ${inPrint(unit)}`;
}

const NUMBER = String.raw`[-+]?\d[\d.,]*(?:e[-+]?\d+)?`;
const DEVIATION = String.raw`\s*(?:±|\+\/?-)\s*${NUMBER}`;
/** A text without a unit: a number, an interval, or a number with a deviation, also in per cent. */
const BARE = new RegExp(
  String.raw`^(${NUMBER}(?:\s*\.\.\s*${NUMBER}|${DEVIATION}(?!\s*%|[\d.,e]))?)(${DEVIATION}\s*%)?$`,
  "i",
);

/** A text that is typed without a unit, in the unit of its field: the one that it had, or SI. */
export function withUnit(name, text, typed) {
  const [, number, deviation = ""] = text.trim().match(BARE) ?? [];
  const unit = typed ?? siUnit(name);
  return number && unit && unit !== "-" ? `${number} ${inPrint(unit)}${deviation}` : text;
}
/** The offered unit of an input that is SI. */
const siUnit = (name) =>
  about.inputs[name].offered.find((unit) => scaleOf(name, unit).every((part) => part === 1));

/** The text of an input at a value [SI], in the unit and with the relative deviation it had. */
export function textAt(answer, name, value, digits = 4) {
  const { unit, std, value: before } = answer.inputs[name] ?? {};
  const text = inUnit(name, value, unitAt(name, value, unit), digits);
  return std ? `${text} ± ${show((100 * std) / before, 3)} %` : text;
}

/** A text without what makes no difference: blanks, u in place of µ. */
export const asTyped = (text) => text.replaceAll(" ", "").replaceAll("µ", "u");

/** A friction coefficient with so many digits, trailing zeros kept. */
export function friction(value, digits) {
  if (value === null) return "–";
  if (value === 0) return "0";
  const places = digits - 1 - Math.floor(Math.log10(Math.abs(value)));
  return Math.abs(value) < SMALL
    ? show(value, digits)
    : value.toFixed(Math.max(places, 0)).replace("-", "−");
}

/** A friction coefficient and its deviation, both to the second digit of the deviation. */
export function withDeviation(value, std) {
  const places = Math.min(Math.max(1 - Math.floor(Math.log10(std)), 0), 12);
  return [value, std].map((one) => one.toFixed(places));
}

/** A share as a person says it; what is not all of it is below 100 %. */
export function percent(share) {
  const nines = -Math.floor(Math.log10(Math.abs(1 - share)));
  return `${show(100 * share, Math.min(Math.max(nines, share > 1 ? 3 : 2), 4))} %`;
}

/** What of µ₀ is left, in words, for a share in per cent. */
export function left(share, some = "") {
  if (share === "0 %") return "Nothing of µ₀ is left";
  return capital(`${some}${share === "100 %" ? "all" : share} of µ₀ is left`);
}

/** The digits of a value that its error bound leaves. */
export const digitsWithin = (value, bound) =>
  value && bound ? Math.max(Math.min(Math.floor(Math.log10(Math.abs(value) / bound)), 15), 1) : 15;

/** Both ends of an interval of friction, to the third digit of its width. */
export function withEnds(low, high) {
  const places = Math.min(Math.max(2 - Math.floor(Math.log10(high - low)), 0), 15);
  const [from, to] = [low, high].map((one) => one.toFixed(places));
  return [low > 0 && Number(from) === 0 ? show(low, 2) : from, to];
}

/** An interval of a share about a stiffness [N/m], as a person types it: "0.9..1.1 N/µm". */
export function around(k, share = 0.1) {
  const high = inUnit("k", (1 + share) * k, unitFor("k", k), 3);
  const low = inUnit("k", Math.max(1 - share, 0.01) * k, unitFor("k", k), 3);
  return `${low.split(" ")[0]}..${high}`;
}

/** A sentence of the service in the page's signs, and a stiffness in it in the page's units; that a
 * plain number is in SI is not so here, where it has the unit of its field. */
export const prose = (text) =>
  text
    .replace(": a plain number, or with a unit such as", ", such as")
    .replace(/(\d[\d.]*(?:e[+-]?\d+)?) N\/m\b(?!\w)/g, (_, k) =>
      inUnit("k", Number(k), undefined, 3),
    )
    .replaceAll("mu_macro", "µ")
    .replaceAll("mu0", "µ₀")
    .replace(/\bomega\b/g, "ω")
    .replace(/\b([yvl])0\b/g, "$1₀")
    .replace(/\b([yv])~/g, "$1\u0303")
    .replace(/(?<=[\d/] ?)u(?=[mN]\b)/g, "µ")
    .replace(/(\d) (?=%|µm|N\b|mm\b)/g, "$1\u00a0");

/** Names of a request as the page calls them. */
const CALLED = {
  start: "from",
  stop: "to",
  stiffness_exponent: "m",
  normal: "ΔFz",
  nu: "ν",
  E2: "E₂",
  nu2: "ν₂",
};

/** The k that numbers of an interval of k belong to, in its middle; empty where k is one number. */
export function middleOf({ mu_macro_low: low, mu_macro_high: high, std, inputs }) {
  const { value, unit } = inputs.k ?? {};
  return high > low && !std ? `k = ${inUnit("k", value, unit ?? undefined)}` : "";
}

/** A text in which no equation is broken over two lines. */
export const whole = (text) =>
  text
    .replace(/(?<=µ₀) (?=Fz)/g, "\u00a0")
    .replace(/ ([=≈±/]) | to (?=\d)|(?<=\d) (?=[%µa-zA-Z])/g, (gap) =>
      gap.replaceAll(" ", "\u00a0"),
    )
    .replaceAll("/", "/\u2060");

/** A field of a request as the page calls it. */
export function called(field) {
  if (Object.hasOwn(CALLED, field)) return CALLED[field];
  return Object.hasOwn(about.inputs ?? {}, field) ? about.inputs[field].symbol : field;
}

/** The address of a page of the guide, or of its source where no guide is built. */
export const pageOf = (name) => `${about.guide}${name}${about.guide_ending}`;

/** A sentence begins with a capital, but where a symbol begins it. */
export const capital = (words) =>
  /^(a |[a-z]{2})/.test(words) ? `${words[0].toUpperCase()}${words.slice(1)}` : words;

/** A regime as a person names it. */
export const inWords = (regime) => about.regimes[regime] ?? regime;
