// The six inputs: units and bounds as the service tells them, labels, sliders and start values of this page.
import { get } from "./api.js";

const TURN = 2 * Math.PI;

/** By name: label, symbol, offered units (the first is the default), the slider's decimal exponents (SI), start value (SI). */
export const INPUTS = {
  mu0: { label: "friction µ₀", symbol: "µ₀", offered: ["-"], range: [-2, 0.5], start: 0.3 },
  Fz: { label: "normal force Fz", symbol: "Fz", offered: ["N", "mN", "kN"], range: [-3, 5], start: 10 },
  k: { label: "stiffness k", symbol: "k", offered: ["N/µm", "kN/m", "N/m"], range: [2, 10], start: 1e6 },
  y0: { label: "amplitude y₀", symbol: "y₀", offered: ["µm", "nm", "mm", "m"], range: [-10, -3], start: 2e-6 },
  omega: { label: "frequency", symbol: "ω", offered: ["kHz", "Hz", "rad/s"], range: [0, 7], start: 1.3e5 },
  v0: { label: "sliding speed v₀", symbol: "v₀", offered: ["mm/s", "µm/s", "m/s"], range: [-7, 2], start: 0.01 },
};
export const NAMES = Object.keys(INPUTS);

/** What the service says of its approximations, and of the paper's formulas for the border: name -> { equations, text }. */
export let approximations = {};
export let borders = {};

/** The paper's equation numbers of an entry of these: "(24), (39)". */
export const equations = ({ equations: numbers }) => numbers.map((number) => `(${number})`).join(", ");

/** Fetches units and bounds; nothing here works before that.  Returns all that was found. */
export async function loadNames() {
  const found = await get("static/page/names.json");
  for (const name of NAMES) {
    const { unit, units, bound, positive } = found.inputs[name];
    Object.assign(INPUTS[name], { si: unit, bound, positive, units: { ...units } });
  }
  // a frequency f stands for omega = 2 pi f; a unit of both (1/s) says neither
  const { units } = INPUTS.omega;
  for (const [unit, [times, over]] of Object.entries(found.inputs.f.units)) units[unit] = unit in units ? null : [times * TURN, over];
  ({ approximations, borders } = found);
  return found;
}

/** Whether it is a unit of the input. */
export const hasUnit = (name, unit) => Object.hasOwn(INPUTS[name].units, unit) && INPUTS[name].units[unit] !== null;

export const toSI = (name, unit, value) => {
  const [times, over] = INPUTS[name].units[unit];
  return (value * times) / over;
};

export const fromSI = (name, unit, value) => {
  const [times, over] = INPUTS[name].units[unit];
  return (value * over) / times;
};

/** The symbol that goes with a unit: a frequency in Hz is f. */
export const symbolOf = (name, unit) => (name === "omega" && unit.endsWith("Hz") ? "f" : INPUTS[name].symbol);

/** A unit as it is shown: none for a plain number. */
export const unitText = (unit) => (unit === "-" ? "" : unit);
