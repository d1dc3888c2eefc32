// The readout: mu_macro with its interval and model, what goes with it, what each input does to it; and "solve for".
import { Status } from "./ask.js";
import { Field, make } from "./form.js";
import {
  INPUTS, MODELS, REGIMES, caseOf, endsOf, friction, fromSI, inUnit, namesOf, powerOf, readNumber, show, symbolOf,
  textOf, valueOf, watts,
} from "./inputs.js";
import { draw } from "./plots.js";
import { post } from "./service.js";

const $ = (id) => document.getElementById(id);

/** Shows the answer to a state; with the digits that k supports, or with all that the table supports. */
export function showAnswer(found, state) {
  const { mu_macro: mu, mu_macro_low: low, mu_macro_high: high, error_bound: bound } = found;
  const { limits, groups, power = { oscillation: null, saved: null } } = found;
  const [ends, rows] = [endsOf(state), found.model ?? []];
  const width = ends ? high - low : 0;
  const all = state.digits === "all";
  const group = (value) => (value === null ? "∞" : show(value, all ? 15 : 4));
  const kind = state.rigid ? "rigid contact" : MODELS[state.contact];
  const texts = {
    mu: all ? friction(mu, bound, 15) : friction(mu, width / 2, found.digits),
    regime: REGIMES[found.regime],
    ratio: all ? friction(found.mu_ratio, bound / valueOf(state, "mu0"), 15) : show(found.mu_ratio, 4),
    "peak-speed": inUnit("v0", state.direction === "normal" ? null : valueOf(state, "y0") * valueOf(state, "omega")),
    stick: found.stick_fraction === null ? "–" : `${show(100 * found.stick_fraction, 4)} %`,
    shaker: power.oscillation === null && state.rigid ? "– (rigid)" : watts(power.oscillation),
    saved: watts(power.saved), static: show(limits.mu_static, 4), crit: inUnit("v0", limits.v0_crit),
    "v-tilde": group(groups.v_tilde), "y-tilde": group(groups.y_tilde),
    "y-tilde-name": state.direction === "normal" ? "ỹ = ΔFz/Fz" : "ỹ = y₀/l₀",
    bound: bound === null ? "not known" : `± ${show(bound, 2)}`, source: found.source,
    table: `${found.table.id}, tolerance ${show(found.table.tolerance)}`,
    model: `Model: ${kind}, ${MODELS[state.direction]}; not compared with measured points.`,
    interval: ends ? `${friction(low, width)} to ${friction(high, width)} for k = ${textOf(state.given.k, 4)}` : "",
  };
  for (const [id, text] of Object.entries(texts)) $(id).textContent = text;
  $("rows").replaceChildren(...rows.map(({ row, text }) => make("li", {}, `${row}: ${text}.`)));
  showBars(found, state);
}

/** Per cent that mu_macro changes when an input grows by 1 %. */
function showBars(found, state) {
  const names = namesOf(state);
  const shares = names.map((name) => {
    const slope = found.gradient[name] ?? null;
    return slope === null || !found.mu_macro ? null : (slope * valueOf(state, name)) / found.mu_macro;
  });
  const most = Math.max(1, ...shares.map(Math.abs));
  $("bars").tBodies[0].replaceChildren(...names.map((name, i) => {
    const share = shares[i];
    const width = (50 * Math.abs(share)) / most;
    const fill = { x: share < 0 ? 50 - width : 50, width, height: 10, class: share < 0 ? "less" : "more" };
    const box = { class: "bar", viewBox: "0 0 100 10", preserveAspectRatio: "none", "aria-hidden": true };
    const bar = draw("svg", box, draw("rect", fill), draw("path", { d: "M50 0v10" }));
    const text = share === null ? "–" : `${share < 0 ? "−" : "+"}${Math.abs(share).toFixed(3)} %`;
    const cells = [make("td", {}, bar), make("td", { id: `bar-${name}` }, text)];
    return make("tr", {}, make("th", { scope: "row" }, INPUTS[name].symbol), ...cells);
  }));
}

// --- "solve for": which value of an input gives a wanted friction ---------------------------------------------

export class Solver {
  /** `use(name, quantity)` takes a found value over. */
  constructor(use) {
    Object.assign(this, { use, status: new Status("solve-status", "roots") });
    const ask = ({ request }) => post("v1/solve-for", request);
    this.channel = this.status.channel("solve", ask, (found, { unit }) => this.show(found, unit));
    const blame = (fault) => this.status.set("typed", fault && `The target ${fault}.`);
    this.target = new Field($("target"), { read: (text) => this.read(text), use: () => {}, blame });
    $("solve-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.ask();
    });
    for (const id of ["unknown", "quantity", "target"]) $(id).addEventListener("input", () => this.clear());
  }

  /** Follows a state: what was found for another one is taken away. */
  sync(state) {
    if (this.state?.direction !== state.direction) {
      $("unknown").replaceChildren(...namesOf(state).map((name) => new Option(INPUTS[name].label, name)));
      $("unknown").value = namesOf(state).find((name) => /^y0|amplitude/.test(name));
    }
    this.state = state;
    if (this.found && this.found !== JSON.stringify(caseOf(state))) this.clear();
  }

  clear() {
    this.channel.cancel();
    this.found = null;
    this.target.clear();
    this.status.clear();
    $("roots").replaceChildren();
  }

  /** { value } of a typed target, or { fault }. */
  read(text) {
    const { value, unit, fault } = readNumber(text);
    if (fault) return { fault };
    if (!["", "%"].includes(unit)) return { fault: `“${unit}” is no unit of friction: leave it out` };
    if (value < 0) return { fault: "must be >= 0" };
    const senseless = $("unknown").value === "mu0" && $("quantity").value === "mu_ratio";
    if (senseless) return { fault: "as a share of µ₀ makes no sense for µ₀: give µ" };
    return { value: unit === "%" ? value / 100 : value };
  }

  ask() {
    this.clear();
    this.target.commit();
    if (this.target.fault) return;
    const [unknown, include] = [$("unknown").value, powerOf(this.state)];
    const { value: target } = this.read($("target").value);
    this.found = JSON.stringify(caseOf(this.state));
    this.channel.push({
      request: { ...caseOf(this.state, unknown), unknown, quantity: $("quantity").value, target, include },
      unit: this.state.given[unknown].unit,
    });
  }

  show({ unknown, quantity, reachable, results: [{ roots, reason }] }, unit) {
    const { min, max, min_included, max_included } = reachable;
    const symbol = symbolOf(unknown, unit);
    if (!roots.length) {
      const [from, to] = [min_included ? "from" : "from above", max_included ? "to" : "to below"];
      const can = `${quantity === "mu_ratio" ? "µ/µ₀" : "µ"} can be ${from} ${show(min, 4)} ${to} ${show(max, 4)} here`;
      this.status.set("found", min === max ? reason : `No value of ${symbol} gives that: ${can}.`);
      return;
    }
    $("roots").replaceChildren(...roots.map((root) => {
      const told = `${symbol} = ${inUnit(unknown, root.value, unit, 6)}`;
      const take = make("button", { type: "button", "aria-label": `use ${told}` }, "Use");
      take.addEventListener("click", () => {
        this.found = null; // it stays on the screen until something else changes
        this.use(unknown, { value: fromSI(unknown, root.value, unit), unit });
        this.found = JSON.stringify(caseOf(this.state));
      });
      const power = root.power?.oscillation ?? null;
      const text = `${told}: µ = ${show(root.mu_macro, 5)}, ${REGIMES[root.regime]}`;
      return make("li", {}, make("span", {}, power === null ? text : `${text}, shaker ${watts(power)}`), take);
    }));
  }
}
