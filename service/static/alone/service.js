// Answers without a service: from the table in mumacro.wasm, in the form in which the service gives them.
import { Refused, Unanswered } from "./ask.js";

const FIELDS = ["mu0", "Fz", "k", "y0", "omega", "v0"];
const FOUND = ["error", "mu_macro", "mu_ratio", "error_bound", "v_tilde", "y_tilde", "source", "regime", "v0_crit", "power", "stick_fraction"];
const SLIDES = "continuous";
const finite = (value) => (Number.isFinite(value) ? value : null);

const bytes = await (await fetch("static/page/mumacro.wasm")).arrayBuffer();
const { instance: { exports: table } } = await WebAssembly.instantiate(bytes);

/** A text of the module. */
function text(at) {
  const held = new Uint8Array(table.memory.buffer, at);
  return new TextDecoder().decode(held.subarray(0, held.indexOf(0)));
}

const names = (name) => {
  const known = new Map();
  return (code) => known.get(code) ?? known.set(code, text(table[name](code))).get(code);
};
const sourceName = names("source_name");
const regimeName = names("regime_name");
const about = { table: { id: `${text(table.checksum()).slice(0, 12)}, in this page`, tolerance: table.tolerance() } };

/** All about one case; k "rigid" is rigid contact. */
export function evaluate(values) {
  const given = FIELDS.map((name) => (values[name] === "rigid" ? Infinity : Number(values[name])));
  const numbers = new Float64Array(table.memory.buffer, table.evaluate(...given), FOUND.length + FIELDS.length);
  const found = Object.fromEntries(FOUND.map((name, i) => [name, numbers[i]]));
  if (found.error) throw new Refused(text(table.error_text(found.error)));
  const slopes = [...numbers.subarray(FOUND.length)].map((slope, i) => (given[i] === Infinity ? null : finite(slope)));
  found.gradient = Object.fromEntries(FIELDS.map((name, i) => [name, slopes[i]]));
  return { ...found, source: sourceName(found.source), regime: regimeName(found.regime) };
}

function point(values) {
  const found = evaluate(values);
  const { mu0, Fz, k, v0 } = values;
  return {
    mu_macro: found.mu_macro, mu_ratio: found.mu_ratio, regime: found.regime, error_bound: found.error_bound,
    source: found.source, stick_fraction: finite(found.stick_fraction),
    groups: { v_tilde: finite(found.v_tilde), y_tilde: finite(found.y_tilde), l0: k === "rigid" ? 0 : (mu0 * Fz) / k },
    limits: { mu_static: evaluate({ ...values, v0: 0 }).mu_macro, v0_crit: finite(found.v0_crit) },
    power: { oscillation: finite(found.power), saved: finite((mu0 - found.mu_macro) * Fz * v0) },
    gradient: found.gradient, ...about,
  };
}

/** Both ends exactly, and the values between them. */
function sweep({ start, stop, points, scale }) {
  const [low, high] = scale === "log" ? [Math.log10(start), Math.log10(stop)] : [start, stop];
  const inner = Array.from({ length: points - 2 }, (_, i) => {
    const value = low + ((high - low) * (i + 1)) / (points - 1);
    return Math.min(Math.max(scale === "log" ? 10 ** value : value, start), stop);
  });
  return [start, ...inner, stop];
}

/** One curve; the border is sought between neighbours of which one slides and the other does not. */
function curve(values, along, others) {
  const at = (value) => evaluate({ ...others, [along]: value });
  const found = values.map(at);
  const border = [];
  for (let i = 1; i < found.length; i += 1) {
    let [low, high] = [values[i - 1], values[i]];
    const after = found[i].regime === SLIDES;
    if ((found[i - 1].regime === SLIDES) === after) continue;
    for (let turn = 0; turn < 100; turn += 1) {
      const middle = low + (high - low) / 2;
      if (middle <= low || middle >= high) break;
      if ((at(middle).regime === SLIDES) === after) high = middle;
      else low = middle;
    }
    const value = after ? high : low;
    border.push({ value, mu_macro: at(value).mu_macro });
  }
  return {
    mu_macro: found.map((one) => one.mu_macro), mu_static: values.map((value) => evaluate({ ...others, [along]: value, v0: 0 }).mu_macro),
    regime: found.map((one) => one.regime), border,
  };
}

function law({ along, start, stop, points, scale, ...others }) {
  if (!(stop > start)) throw new Refused("The law cannot be drawn: stop must be > start.");
  if (scale === "log" && start <= 0) throw new Refused("The law cannot be drawn: start must be > 0.");
  const values = sweep({ start, stop, points, scale });
  return { along, values, ...curve(values, along, others), ...about };
}

/** A file of the page itself. */
export async function get(path) {
  try {
    return await (await fetch(path)).json();
  } catch {
    throw new Unanswered("A file of this page cannot be read.");
  }
}

const CALLS = { "v1/mu-macro": point, "v1/law": law };

/** Answers what the page asks. */
export async function post(path, body) {
  if (!(path in CALLS)) throw new Refused("This page has no service to ask.");
  return CALLS[path](body);
}
