// The six inputs: names, units and their factors to SI, the sliders' ranges (decimal exponents, SI), start values.
const TURN = 2 * Math.PI;

export const FIELDS = {
  mu0: { label: "friction µ₀", units: { "–": 1 }, range: [-2, 0.5], start: 0.3, positive: true },
  Fz: { label: "normal force Fz", units: { N: 1, mN: 1e-3, kN: 1e3 }, range: [-3, 5], start: 10, positive: true },
  k: { label: "stiffness k", units: { "N/m": 1, "kN/m": 1e3, "N/µm": 1e6 }, unit: "N/µm", range: [2, 10], start: 1e6, positive: true },
  y0: { label: "amplitude y₀", units: { m: 1, mm: 1e-3, "µm": 1e-6, nm: 1e-9 }, unit: "µm", range: [-10, -3], start: 2e-6 },
  omega: { label: "frequency ω", units: { "rad/s": 1, Hz: TURN, kHz: 1e3 * TURN }, unit: "kHz", range: [0, 7], start: 1.3e5 },
  v0: { label: "sliding speed v₀", units: { "m/s": 1, "mm/s": 1e-3, "µm/s": 1e-6 }, unit: "mm/s", range: [-7, 2], start: 0.01 },
};
export const NAMES = Object.keys(FIELDS);
export const SYMBOLS = { mu0: "µ₀", Fz: "Fz", k: "k", y0: "y₀", omega: "ω", v0: "v₀" };

/** A number with so many significant digits, without trailing zeros, with an exponent only where it is shorter. */
export function show(value, digits = 6) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e-4 && size < 10 ** Math.max(digits, 5)) return String(Number(value.toPrecision(digits)));
  const [digitsPart, exponent] = value.toExponential(digits - 1).split("e");
  return `${Number(digitsPart)}e${Number(exponent)}`;
}

/** The number in a text field, or null: digits, one decimal point or comma, an exponent. */
export function parse(text) {
  const cleaned = text.trim().replace(",", ".");
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(cleaned) ? Number(cleaned) : null;
}

/** What is wrong with a value of a field; null if nothing. */
export function fault(name, value) {
  const { positive } = FIELDS[name];
  if (value === null || !Number.isFinite(value) || value < 0 || (positive && value === 0)) {
    return `${SYMBOLS[name]} must be a number ${positive ? "> 0" : "≥ 0"}`;
  }
  return null;
}

/** A value of a field in the unit that suits it, for reading. */
export function withUnit(name, value, digits = 4) {
  const units = Object.entries(FIELDS[name].units);
  if (name === "mu0") return show(value, digits);
  const fit = units.filter(([, factor]) => value / factor >= 1).sort((a, b) => b[1] - a[1])[0];
  const [unit, factor] = name === "omega" ? units[0] : fit ?? units.sort((a, b) => a[1] - b[1])[0];
  return `${show(value / factor, digits)} ${unit}`;
}
