// Numbers as text.
import { INPUTS, fromSI, unitText } from "./inputs.js";

export const REGIMES = { continuous: "continuous sliding", stick_slip: "stick–slip", static: "at rest" };

/** A number with so many significant digits, without trailing zeros, with an exponent only where it is shorter. */
export function show(value, digits = 6) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e-4 && size < 10 ** Math.max(digits, 5)) return String(Number(value.toPrecision(digits)));
  const [digitsPart, exponent] = value.toExponential(digits - 1).split("e");
  return `${Number(digitsPart)}e${Number(exponent)}`;
}

/** A value of an input [SI] in a unit, or in the offered one that suits it. */
export function withUnit(name, value, unit = suiting(name, value), digits = 4) {
  return value === null ? "–" : `${show(fromSI(name, unit, value), digits)} ${unitText(unit)}`.trim();
}

function suiting(name, value) {
  const sizes = INPUTS[name].offered.map((unit) => [unit, Math.abs(fromSI(name, unit, value))]);
  const fit = sizes.filter(([, size]) => size >= 1).sort((a, b) => a[1] - b[1])[0];
  return (fit ?? sizes.sort((a, b) => b[1] - a[1])[0])[0];
}

/** Watts with a prefix. */
export function watts(value, digits = 4) {
  if (value === null) return "–";
  const prefixes = ["p", "n", "µ", "m", "", "k", "M", "G"];
  const i = value === 0 ? 4 : Math.min(Math.max(Math.floor(Math.log10(Math.abs(value)) / 3) + 4, 0), prefixes.length - 1);
  return `${show(value / 1000 ** (i - 4), digits)} ${prefixes[i]}W`;
}
