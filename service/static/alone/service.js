// Answers without a service: from the table in mumacro.wasm, in the form in which the service gives them.
const FIELDS = ["mu0", "Fz", "k", "y0", "omega", "v0"];
const FOUND = ["error", "mu_macro", "mu_ratio", "error_bound", "v_tilde", "y_tilde", "source", "regime", "v0_crit",
  "power", "stick_fraction"];
const finite = (value) => (Number.isFinite(value) ? value : null);
const refuse = (why) => { throw new RangeError(why); };

const bytes = await (await fetch("static/page/mumacro.wasm")).arrayBuffer();
const { instance: { exports: table } } = await WebAssembly.instantiate(bytes);

/** A text of the module. */
function text(at) {
  const held = new Uint8Array(table.memory.buffer, at);
  return new TextDecoder().decode(held.subarray(0, held.indexOf(0)));
}

const about = { table: { id: `${text(table.checksum()).slice(0, 12)}, in this page`, tolerance: table.tolerance() } };

/** All about one case; k "rigid" is rigid contact. */
export function evaluate(values) {
  const given = FIELDS.map((name) => (values[name] === "rigid" ? Infinity : Number(values[name])));
  const numbers = new Float64Array(table.memory.buffer, table.evaluate(...given), FOUND.length + FIELDS.length);
  const found = Object.fromEntries(FOUND.map((name, i) => [name, numbers[i]]));
  if (found.error) refuse(text(table.error_text(found.error)));
  const slope = (i) => (given[i] === Infinity ? null : finite(numbers[FOUND.length + i]));
  const gradient = Object.fromEntries(FIELDS.map((name, i) => [name, slope(i)]));
  const [source, regime] = [table.source_name(found.source), table.regime_name(found.regime)].map(text);
  return { ...found, gradient, source, regime };
}

const staticOf = (values) => evaluate({ ...values, v0: 0 }).mu_macro;

function point(values) {
  const { error, v_tilde, y_tilde, v0_crit, power, stick_fraction, ...found } = evaluate(values);
  const { mu0, Fz, k, v0 } = values;
  return {
    ...found, ...about, stick_fraction: finite(stick_fraction),
    groups: { v_tilde: finite(v_tilde), y_tilde: finite(y_tilde), l0: k === "rigid" ? 0 : (mu0 * Fz) / k },
    limits: { mu_static: staticOf(values), v0_crit: finite(v0_crit) },
    power: { oscillation: finite(power), saved: finite((mu0 - found.mu_macro) * Fz * v0) },
  };
}

/** Where sliding begins or ends between two values: the end that slides, to the last digit. */
function borderBetween(slides, low, high) {
  const after = slides(high);
  for (let middle = (low + high) / 2; middle > low && middle < high; middle = (low + high) / 2) {
    [low, high] = slides(middle) === after ? [low, middle] : [middle, high];
  }
  return after ? high : low;
}

function law({ along, start, stop, points, scale, ...others }) {
  if (scale === "log" && start <= 0) refuse("The law cannot be drawn: start must be > 0.");
  const [low, high] = scale === "log" ? [Math.log10(start), Math.log10(stop)] : [start, stop];
  const values = Array.from({ length: points }, (_, i) => {
    const value = low + ((high - low) * i) / (points - 1);
    return Math.min(Math.max(scale === "log" ? 10 ** value : value, start), stop);
  });
  [values[0], values[points - 1]] = [start, stop]; // exactly
  const at = (value) => ({ ...others, [along]: value });
  const found = values.map((value) => evaluate(at(value)));
  const slides = (value) => evaluate(at(value)).regime === "continuous";
  const changes = values.map((_, i) => i).filter((i) => i && slides(values[i]) !== slides(values[i - 1]));
  const border = changes.map((i) => borderBetween(slides, values[i - 1], values[i]));
  return {
    along, values, ...about, mu_static: values.map((value) => staticOf(at(value))),
    mu_macro: found.map((one) => one.mu_macro), regime: found.map((one) => one.regime),
    border: border.map((value) => ({ value, mu_macro: evaluate(at(value)).mu_macro })),
  };
}

/** A file of the page itself. */
export const get = (path) => fetch(path).then((response) => response.json())
  .then((found) => ({ found }), () => ({ later: "A file of this page cannot be read." }));

/** Answers what the page asks. */
export async function post(path, body) {
  try {
    return { found: { "v1/mu-macro": point, "v1/law": law }[path](body) };
  } catch (error) {
    if (error instanceof RangeError) return { refused: error.message };
    throw error;
  }
}
