// The page: one state, the questions that follow from it, and what the answers change.
import { Status } from "./ask.js";
import { lawPanel, mapPanel } from "./figures.js";
import { fit, inputForm, solver, stiffness } from "./forms.js";
import {
  ANY,
  about,
  attempt,
  friction,
  fromAddress,
  inUnit,
  inWords,
  movedAlong,
  namesOf,
  question,
  readTyped,
  rounded,
  show,
  startState,
  toAddress,
  valueOf,
} from "./inputs.js";
import { $, make } from "./plots.js";
import { get, post } from "./service.js";

let state;
let parts = []; // functions that follow the state and the last answer
let answer = null; // with the state that it belongs to

const status = new Status("status", "main");
const askPoint = status.channel(
  "point",
  (inputs) => post("v1/mu-macro", question(inputs)),
  (reply, inputs) => {
    status.answered = true;
    answer = { ...reply, inputs };
    showAnswer(answer);
    follow();
  },
);

const follow = () => parts.forEach((part) => part(state, answer));

let addressTimer = null;
function change(changed) {
  state = { ...state, ...changed };
  if (!namesOf(state).includes(state.along)) state = { ...state, along: "v0", range: ANY };
  follow();
  for (const name of ["contact", "direction", "along", "scale"])
    $("form").elements[name].value = state[name];
  $("digits").checked = state.digits === "all";
  // browsers refuse an address that changes with every step of a slider
  clearTimeout(addressTimer);
  addressTimer = setTimeout(() => history.replaceState(null, "", toAddress(state)), 150);
  if (!namesOf(state).some((name) => state[name].fault)) askPoint.push(state);
}

/** Takes what is typed in a field, on Enter and on leaving it, and what is chosen. */
function take({ target: { name, value, checked } }) {
  if (name === "digits") change({ digits: checked ? "all" : "few" });
  else if (name === "along") change({ along: value, range: ANY });
  else if (name in state)
    change({ [name]: typeof state[name] === "string" ? value : readTyped(state, name, value) });
}

/** Brings back the last good text of a field. */
function takeBack({ key, target: { name } }) {
  if (key === "Escape" && state[name]?.text !== undefined)
    take({ target: { name, value: state[name].text } });
}

/**
 * Sets inputs to values in SI, in the units of their fields, with `more` of the state; what cannot
 * be is left.
 */
function setSI(values, digits = 4, more = {}) {
  const read = ([name, value]) => [name, rounded(name, value, state[name].unit, digits)];
  const { result } = attempt(() => Object.entries(values).map(read));
  if (result) change({ ...Object.fromEntries(result), ...more });
}

/** Gives one input another value [SI]; k follows where it grows with it. */
function move(name, value, digits = 4) {
  const { result } = attempt(() => movedAlong(state, name, value, digits));
  if (result) change(result);
}

/** Makes an input larger or smaller by steps of 5 %; true. */
function nudge(name, steps) {
  const from = state[name].low || 10 ** about.inputs[name].range[0];
  if (from !== Infinity) move(name, from * 1.05 ** steps, 6);
  return true;
}

function readAddress({ newURL }) {
  // the address line itself may hold an earlier state by now
  const read = fromAddress(new URL(newURL).hash);
  $("notice").hidden = !read.faults.length;
  $("notice-text").textContent =
    "This link has values that cannot be used; start values replace them: " +
    `${read.faults.join("; ")}.`;
  change(read.state);
}

/** A sentence of the service in the page's signs. */
const prose = (text) =>
  text
    .replaceAll("mu_macro", "µ")
    .replaceAll("mu0", "µ₀")
    .replaceAll("y0", "y₀")
    .replaceAll("y~", "ỹ")
    .replaceAll(" um ", " µm ")
    .replace("give k_range", "give k as an interval")
    .replace(/(\d) (?=%|µm)/g, "$1\u00a0");

/** Shows an answer; with the digits that k supports, or with all that the table supports. */
function showAnswer({ inputs, ...reply }) {
  const {
    mu_macro: mu,
    mu_macro_low: low,
    mu_macro_high: high,
    error_bound: bound,
    limits,
    groups,
    power,
  } = reply;
  const { k, contact, direction } = inputs;
  const [normal, wide, all] = [direction === "normal", k.low < k.high, inputs.digits === "all"];
  const width = wide ? high - low : 0;
  const group = (value) => (value === null ? "∞" : show(value, all ? 15 : 4));
  const kind = k.low === Infinity ? "rigid contact" : about.choices.contact[contact];
  $("mu").textContent = all ? friction(mu, bound, 15) : friction(mu, width / 2, reply.digits);
  $("regime").textContent = inWords(reply.regime);
  $("interval").textContent = wide
    ? `${friction(low, width)} to ${friction(high, width)} for k = ${k.text}`
    : "";
  $("model").textContent =
    `One model: ${kind}, ${about.choices.direction[direction]}. ` +
    "It was compared with two published sets of points, shaken along: it describes the dry " +
    "contact, not the oiled one.";
  const rows = reply.model ?? [];
  const [units, spread] = ["units", "k is known"].map((name) =>
    rows.find(({ row }) => row === name),
  ); // beside the number
  $("units").textContent = units ? `Check the units: ${prose(units.text)}` : "";
  $("known").textContent = spread ? `${prose(spread.text)}.` : "";
  $("rows").replaceChildren(
    ...rows
      .filter((one) => one !== units && one !== spread)
      .map(({ row, text }) => make("li", {}, make("b", {}, `${row}: `), `${prose(text)}.`)),
  );
  list("values", {
    "µ/µ₀": all
      ? friction(reply.mu_ratio, bound / valueOf(inputs, "mu0"), 15)
      : show(reply.mu_ratio, 4),
    "static µ (v₀ → 0)": show(limits.mu_static, 4),
    "border at v₀": inUnit("v0", limits.v0_crit),
    "peak speed y₀ω": normal ? "–" : inUnit("v0", valueOf(inputs, "y0") * valueOf(inputs, "omega")),
    "stick fraction":
      reply.stick_fraction === null ? "–" : `${show(100 * reply.stick_fraction, 4)} %`,
    "shaker power": k.low === Infinity ? "– (rigid)" : inUnit("power", power?.oscillation ?? null),
    "power saved": inUnit("power", power?.saved ?? null),
    "ṽ = v₀/(l₀ω)": group(groups.v_tilde),
    [normal ? "ỹ = ΔFz/Fz" : "ỹ = y₀/l₀"]: group(groups.y_tilde),
  });
  list("origin", {
    "numerical error of µ": bound === null ? "not known" : `≤ ${show(bound, 2)}`,
    "answered by block": reply.source,
    "of table": `${reply.table.id}, tolerance ${show(reply.table.tolerance)}`,
  });
  showBars(reply, inputs);
}

const list = (id, texts) =>
  $(id).replaceChildren(
    ...Object.entries(texts).map(([name, text]) =>
      make("div", {}, make("dt", {}, name), make("dd", {}, text)),
    ),
  );

/** Per cent that mu_macro changes when an input grows by 1 %. */
function showBars({ gradient, mu_macro: mu }, inputs) {
  const share = (name) =>
    gradient[name] === null || !mu ? null : (gradient[name] * valueOf(inputs, name)) / mu;
  const shares = namesOf(inputs).map((name) => [name, share(name)]);
  const most = Math.max(1, ...shares.map(([, share]) => Math.abs(share)));
  $("bars").replaceChildren(
    ...shares.map(([name, share]) => {
      const width = (50 * Math.abs(share)) / most;
      const fill = {
        x: share < 0 ? 50 - width : 50,
        width,
        height: 10,
        class: share < 0 ? "less" : "more",
      };
      const box = {
        class: "bar",
        viewBox: "0 0 100 10",
        preserveAspectRatio: "none",
        "aria-hidden": true,
      };
      const bar = make(
        "td",
        {},
        make("svg", box, make("rect", fill), make("path", { d: "M50 0v10" })),
      );
      const text = share === null ? "–" : `${share < 0 ? "−" : "+"}${Math.abs(share).toFixed(3)} %`;
      return make(
        "tr",
        {},
        make("th", { scope: "row" }, about.inputs[name].symbol),
        bar,
        make("td", {}, text),
      );
    }),
  );
}

function start(names) {
  Object.assign(about, names);
  $("version").textContent = about.version;
  for (const link of document.querySelectorAll("[data-guide]")) link.hidden = !about.guide;
  parts = [
    inputForm(change, setSI, status),
    mapPanel(setSI, nudge, status),
    lawPanel(move, nudge),
    solver(change),
    stiffness(setSI),
    fit(setSI, (words) => change(fromAddress(`#${words}`).state)),
  ];
  readAddress({ newURL: location.href });
  addEventListener("hashchange", readAddress);
  addEventListener("change", take);
  addEventListener("keydown", takeBack);
}

$("reset").addEventListener("click", () => change(startState()));
$("notice-close").addEventListener("click", () => {
  $("notice").hidden = true;
});
status.channel("names", () => get("static/page/names.json"), start).push(null);
