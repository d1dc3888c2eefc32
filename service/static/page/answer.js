// The readout: mu_macro with its error and uncertainty, what goes with it, and what each input does to it.
import { INPUTS, NAMES } from "./inputs.js";
import { REGIMES, show, watts, withUnit } from "./show.js";

const $ = (id) => document.getElementById(id);

/** What is asked of the service for the readout. */
export function question({ values, rigid, std }) {
  const given = NAMES.filter((name) => std[name] > 0 && !(name === "k" && rigid));
  const include = ["groups", "limits", "stick_fraction", "power", "gradient", ...(given.length ? ["std"] : [])];
  const spread = Object.fromEntries(given.map((name) => [`std_${name}`, std[name]]));
  return { ...values, ...(rigid ? { k: "rigid" } : {}), ...spread, include: include.join(",") };
}

export function showAnswer(found, state) {
  const { values } = state;
  const { limits, groups, power } = found;
  const texts = {
    mu: show(found.mu_macro, 6), regime: REGIMES[found.regime], ratio: show(found.mu_ratio, 6),
    "peak-speed": withUnit("v0", values.y0 * values.omega), stick: found.stick_fraction === null ? "–" : `${show(100 * found.stick_fraction, 4)} %`,
    shaker: power.oscillation === null && state.rigid ? "– (rigid)" : watts(power.oscillation), saved: watts(power.saved), static: show(limits.mu_static, 6),
    crit: withUnit("v0", limits.v0_crit), "v-tilde": groups.v_tilde === null ? "∞" : show(groups.v_tilde, 5),
    "y-tilde": groups.y_tilde === null ? "∞" : show(groups.y_tilde, 5),
    bound: found.error_bound === null ? "not known" : `± ${show(found.error_bound, 2)}`, source: found.source, table: found.table.id,
  };
  for (const [id, text] of Object.entries(texts)) $(id).textContent = text;
  showUncertainty(found);
  showBars(found, values);
}

function showUncertainty(found) {
  const place = $("uncertainty");
  place.hidden = found.std === undefined;
  if (place.hidden) return;
  if (found.std === null) place.textContent = "± not finite: the slope is infinite here";
  else if (found.std_first_order_enough) place.textContent = `± ${show(found.std, 3)} (one standard deviation)`;
  else place.textContent = `± ${show(found.std_sampled, 3)} (one standard deviation, from samples; first order, ${show(found.std, 3)}, is not accurate enough here)`;
}

/** Per cent that mu_macro changes when an input grows by 1 %, and the input's share of the variance. */
function showBars(found, values) {
  const shares = NAMES.map((name) => (found.gradient[name] === null || !found.mu_macro ? null : (found.gradient[name] * values[name]) / found.mu_macro));
  const most = Math.max(1, ...shares.map(Math.abs));
  const variance = found.std_share;
  $("variance-head").hidden = !variance;
  $("bars").tBodies[0].replaceChildren(...NAMES.map((name, i) => {
    const row = document.createElement("tr");
    row.append(Object.assign(document.createElement("th"), { scope: "row", textContent: INPUTS[name].symbol }));
    const share = shares[i];
    const bar = Object.assign(document.createElement("div"), { className: "bar" });
    const fill = Object.assign(document.createElement("span"), { className: share < 0 ? "less" : "more" });
    const width = (50 * Math.abs(share)) / most;
    Object.assign(fill.style, { width: `${width}%`, left: `${share < 0 ? 50 - width : 50}%` });
    bar.append(fill);
    row.insertCell().append(bar);
    const text = share === null ? "–" : `${share < 0 ? "−" : "+"}${Math.abs(share).toFixed(3)} %`;
    Object.assign(row.insertCell(), { id: `bar-${name}`, textContent: text });
    if (variance) Object.assign(row.insertCell(), { id: `share-${name}`, textContent: variance[name] === null ? "–" : `${(100 * variance[name]).toFixed(1)} %` });
    return row;
  }));
}
