// The page: one state, the questions that follow from it, and what the answers change.
import { Status } from "./ask.js";
import { lawPanel, mapPanel } from "./figures.js";
import { Form, fit, solver, stiffness } from "./forms.js";
import {
  CHOICES, INPUTS, about, attempt, friction, fromAddress, inUnit, inWords, isWide, namesOf, question, rounded,
  setNames, show, startState, symbolOf, toAddress, valueOf,
} from "./inputs.js";
import { $, make } from "./plots.js";
import { get, post } from "./service.js";

let state, form, map, law;
let panels = []; // functions that follow the state
let answer = null; // the last one, with the state that asked for it

const status = new Status("status", "main");
const askPoint = status.channel("point", (asked) => post("v1/mu-macro", question(asked)), (found, asked) => {
  status.answered = true;
  answer = { ...found, asked };
  showAnswer(answer);
  map.mark(answer);
  followLaw();
});
const askMap = status.channel("map", () => get("static/page/map.json"), (data) => map.show(data));

// --- the state --------------------------------------------------------------------------------------------

const followLaw = () => law(state, caption(state.along), answer);

let addressTimer = null;
function change(changed) {
  Object.assign(state, changed);
  if (!namesOf(state).includes(state.along)) Object.assign(state, { along: "v0", range: null });
  form.sync(state);
  map.sync(state, caption());
  for (const follow of panels) follow(state);
  followLaw();
  $("digits").checked = state.digits === "all";
  $("main").dataset.direction = state.direction;
  // browsers refuse an address that changes with every step of a slider
  clearTimeout(addressTimer);
  addressTimer = setTimeout(() => history.replaceState(null, "", toAddress(state)), 150);
  ask();
}

function ask() {
  if (!form.bad) askPoint.push({ ...state });
}

/** Says what is wrong with a typed input, or (null) that nothing is. */
function blame(name, fault, empty) {
  status.set(`typed ${name}`, fault, empty);
  if (!fault) ask();
}

/** Sets inputs, and with `more` other parts of the state. */
function setInputs(given, more = {}) {
  form.settle(Object.keys(given));
  change({ given: { ...state.given, ...given }, ...more });
}

/** Sets inputs to values in SI, in the units that their fields have; what cannot be is left as it is. */
function setSI(values, digits = 4) {
  const read = ([name, value]) => [name, rounded(name, value, state.given[name].unit, digits)];
  const { found } = attempt(() => Object.entries(values).map(read));
  if (found) setInputs(Object.fromEntries(found));
}

/** Makes an input larger or smaller by steps of 5 %; true. */
function nudge(name, steps) {
  const from = state.given[name].low || 10 ** INPUTS[name].range[0];
  if (from !== Infinity) setSI({ [name]: from * 1.05 ** steps }, 6);
  return true;
}

function readAddress({ newURL }) {
  const read = fromAddress(new URL(newURL).hash); // the address line itself may hold an earlier state by now
  state = read.state;
  form.sync(state);
  form.settle();
  $("notice").hidden = !read.faults.length;
  const why = `This link has values that cannot be used; start values replace them: ${read.faults.join("; ")}.`;
  $("notice-text").textContent = why;
  change({});
}

/** The inputs in one line, without one of them. */
function caption(without) {
  const names = namesOf(state).filter((name) => name !== without);
  return names.map((name) => `${symbolOf(name, state.given[name].unit)} = ${state.given[name].text}`).join(", ");
}

// --- the answer -------------------------------------------------------------------------------------------

/** Shows an answer; with the digits that k supports, or with all that the table supports. */
function showAnswer({ asked, ...found }) {
  const { mu_macro: mu, mu_macro_low: low, mu_macro_high: high, error_bound: bound, limits, groups, power } = found;
  const [wide, { k }, all] = [isWide(asked), asked.given, asked.digits === "all"];
  const [normal, width] = [asked.direction === "normal", wide ? high - low : 0];
  const group = (value) => (value === null ? "∞" : show(value, all ? 15 : 4));
  const kind = k.low === Infinity ? "rigid contact" : CHOICES.contact[asked.contact];
  const motion = CHOICES.direction[asked.direction];
  $("mu").textContent = all ? friction(mu, bound, 15) : friction(mu, width / 2, found.digits);
  $("regime").textContent = inWords(found.regime);
  $("interval").textContent = wide ? `${friction(low, width)} to ${friction(high, width)} for k = ${k.text}` : "";
  $("model").textContent = `Model: ${kind}, ${motion}; not compared with measured points.`;
  $("rows").replaceChildren(...(found.model ?? []).map(({ row, text }) => make("li", {}, `${row}: ${text}.`)));
  list("values", {
    "µ/µ₀": all ? friction(found.mu_ratio, bound / valueOf(asked, "mu0"), 15) : show(found.mu_ratio, 4),
    "static µ (v₀ → 0)": show(limits.mu_static, 4),
    "border at v₀": inUnit("v0", limits.v0_crit),
    "peak vibration y₀ω": normal ? "–" : inUnit("v0", valueOf(asked, "y0") * valueOf(asked, "omega")),
    "stick fraction": found.stick_fraction === null ? "–" : `${show(100 * found.stick_fraction, 4)} %`,
    "shaker power": k.low === Infinity ? "– (rigid)" : inUnit("power", power?.oscillation ?? null),
    "power saved": inUnit("power", power?.saved ?? null),
    "ṽ = v₀/(l₀ω)": group(groups.v_tilde), [normal ? "ỹ = ΔFz/Fz" : "ỹ = y₀/l₀"]: group(groups.y_tilde),
  });
  list("origin", {
    "error bound of µ": bound === null ? "not known" : `± ${show(bound, 2)}`, "answered by block": found.source,
    "of table": `${found.table.id}, tolerance ${show(found.table.tolerance)}`,
  });
  showBars(found, asked);
}

const list = (id, texts) => $(id).replaceChildren(...Object.entries(texts).map(([name, text]) =>
  make("div", {}, make("dt", {}, name), make("dd", {}, text))));

/** Per cent that mu_macro changes when an input grows by 1 %. */
function showBars({ gradient, mu_macro: mu }, asked) {
  const names = namesOf(asked);
  const share = (name) => (gradient[name] === null || !mu ? null : (gradient[name] * valueOf(asked, name)) / mu);
  const shares = names.map(share);
  const most = Math.max(1, ...shares.map(Math.abs));
  $("bars").replaceChildren(...names.map((name, i) => {
    const share = shares[i];
    const width = (50 * Math.abs(share)) / most;
    const fill = { x: share < 0 ? 50 - width : 50, width, height: 10, class: share < 0 ? "less" : "more" };
    const box = { class: "bar", viewBox: "0 0 100 10", preserveAspectRatio: "none", "aria-hidden": true };
    const bar = make("td", {}, make("svg", box, make("rect", fill), make("path", { d: "M50 0v10" })));
    const text = share === null ? "–" : `${share < 0 ? "−" : "+"}${Math.abs(share).toFixed(3)} %`;
    return make("tr", {}, make("th", { scope: "row" }, INPUTS[name].symbol), bar, make("td", {}, text));
  }));
}

// --- start ------------------------------------------------------------------------------------------------

function start(names) {
  setNames(names);
  for (const part of document.querySelectorAll("[data-needs]")) part.hidden = !about.knows.has(part.dataset.needs);
  form = new Form(setInputs, change, blame);
  map = mapPanel(setSI, nudge);
  law = lawPanel(change, setSI, nudge);
  const offered = Object.entries({ service: solver, stiffness, fit });
  panels = offered.filter(([name]) => about.knows.has(name)).map(([, panel]) => panel(setInputs));
  readAddress({ newURL: location.href });
  askMap.push(null);
  addEventListener("hashchange", readAddress);
}

$("reset").addEventListener("click", () => {
  form.settle();
  change(startState());
});
$("notice-close").addEventListener("click", () => { $("notice").hidden = true; });
$("digits").addEventListener("change", () => change({ digits: $("digits").checked ? "all" : "few" }));
status.channel("names", () => get("static/page/names.json"), start).push(null);
