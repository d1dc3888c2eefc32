// The page: one state, the questions that follow from it, and what the answers change.
import { Solver, showAnswer } from "./answer.js";
import { Status, keyTaken, onKey } from "./ask.js";
import { Form } from "./form.js";
import {
  INPUTS, REGIMES, about, fromAddress, fromSI, namesOf, question, setNames, show, startState, symbolOf, textOf,
  toAddress, valueOf,
} from "./inputs.js";
import { LawPanel } from "./law.js";
import { FrictionMap } from "./map.js";
import { FitPanel, StiffnessPanel } from "./panels.js";
import { get, post } from "./service.js";

const $ = (id) => document.getElementById(id);
let state, form, law;
let panels = []; // that follow the state
let answer = null; // the last one, with the state that asked for it

const status = new Status("status", "main");
const askPoint = status.channel("point", (asked) => post("v1/mu-macro", question(asked)), (found, asked) => {
  status.answered = true;
  answer = { ...found, asked };
  keyTaken();
  showAnswer(found, asked);
  movePoint();
  law.move(answer);
  law.sync(state, found.limits.v0_crit);
  law.ask(found.limits.v0_crit);
});
const askMap = status.channel("map", () => get("static/page/map.json"), (data) => {
  map.show(data);
  movePoint();
});
// --- state ------------------------------------------------------------------------------------------------

let addressTimer = null;
function change(changed) {
  Object.assign(state, changed);
  const names = namesOf(state);
  if (!names.includes(state.along)) Object.assign(state, { along: "v0", range: null });
  form.sync(state);
  for (const panel of panels) panel.sync(state);
  law.sync(state, answer?.limits.v0_crit);
  $("digits").checked = state.digits === "all";
  // browsers refuse an address that changes with every step of a slider
  clearTimeout(addressTimer);
  addressTimer = setTimeout(() => history.replaceState(null, "", toAddress(state)), 150);
  ask();
  if (answer) law.ask(answer.limits.v0_crit);
  law.show();
}

function ask() {
  status.set("typed", form.faults, form.calm);
  if (form.faults) {
    askPoint.cancel();
    status.set("point", null);
  } else askPoint.push(structuredClone(state));
}

function readAddress({ newURL }) {
  const read = fromAddress(new URL(newURL).hash); // the address line itself may hold an earlier state by now
  state = read.state;
  form.sync(state);
  form.clear();
  $("notice").hidden = !read.faults.length;
  const why = `This link has values that cannot be used; start values replace them: ${read.faults.join("; ")}.`;
  $("notice-text").textContent = why;
  change({});
}

function setValue(name, quantity) {
  form.settle(name);
  change({ given: { ...state.given, [name]: quantity }, ...(name === "k" ? { rigid: false } : {}) });
}

/** Takes what a panel found. */
function takeOver(found) {
  for (const name of ["k", "mu0"]) form.settle(name);
  change(found);
}

/** Sets an input to a value [SI], in the unit that its field has. */
function setSI(values) {
  const given = Object.entries(values).map(([name, value]) => {
    const { unit } = state.given[name];
    form.settle(name);
    return [name, { value: Number(fromSI(name, value, unit).toPrecision(4)), unit }];
  });
  change({ given: { ...state.given, ...Object.fromEntries(given) } });
}

// --- the map ----------------------------------------------------------------------------------------------

const isMapped = ({ contact, direction }) => contact === "spring" && direction === "across";

function movePoint() {
  if (!answer) return;
  const { groups: { v_tilde, y_tilde, l0 }, asked, mu_ratio, regime } = answer;
  const mapped = isMapped(asked);
  $("map-section").classList.toggle("other", !mapped);
  if (!mapped) {
    $("map-out").textContent = "This map is that of one spring across. It does not hold for what is chosen.";
    map.mark(null);
    return;
  }
  const v = v_tilde ?? valueOf(asked, "v0") / (l0 * valueOf(asked, "omega"));
  const y = y_tilde ?? valueOf(asked, "y0") / l0;
  if (asked.rigid || Number.isNaN(v)) {
    $("map-out").textContent = `${asked.rigid ? "A rigid contact" : "A contact at rest"} has no point on the map.`;
    map.mark(null);
    return;
  }
  map.mark([v, y]);
  const out = map.outside(v, y);
  const sides = [["ṽ", v], ["ỹ", y]].filter((_, i) => out[i]).map(([name, value]) => `${name} = ${show(value, 3)}`);
  const away = `The point is outside of this map (${sides.join(", ")}): the arrow on the frame points to it.`;
  $("map-out").textContent = sides.length ? away : "";
  const here = `speed ${show(v, 3)}, amplitude ${show(y, 3)}, ratio ${show(mu_ratio, 3)}, ${REGIMES[regime]}`;
  $("map").setAttribute("aria-label", `Map of the friction ratio. The point: ${here}.`);
}

const map = new FrictionMap($("map"), moveTo, (v, y, ratio) => {
  const text = v === null ? "\u00a0" : `ṽ = ${show(v, 3)}, ỹ = ${show(y, 3)}: µ/µ₀ ≈ ${ratio.toFixed(2)}`;
  $("map-read").textContent = text;
});

/** Moves the point of the map: v~ by the speed, y~ by the amplitude. */
function moveTo(v, y) {
  const omega = valueOf(state, "omega");
  if (state.rigid || omega === 0 || !isMapped(state)) {
    const why = state.rigid ? "A rigid contact has no point inside the map: switch it off to move the point."
      : "Without a frequency, or for another contact, there is no point inside the map.";
    $("map-read").textContent = why;
    return;
  }
  const length = (valueOf(state, "mu0") * valueOf(state, "Fz")) / valueOf(state, "k");
  setSI({ v0: v * length * omega, y0: y * length });
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
for (const id of ["map", "law"]) {
  $(id).addEventListener("keydown", (event) => {
    const arrow = ARROWS[event.key];
    if (!arrow || (id === "law" && arrow[1]) || (id === "map" && !isMapped(state))) return;
    event.preventDefault();
    const name = id === "law" ? state.along : arrow[0] ? "v0" : "y0";
    const { value, low, unit } = state.given[name];
    const factor = (event.shiftKey ? 1.5 : 1.05) ** (arrow[0] || arrow[1]);
    const from = (low ?? value) || fromSI(name, 10 ** INPUTS[name].range[0], unit);
    setValue(name, { value: Number((from * factor).toPrecision(6)), unit });
  });
}

// --- downloads and links ----------------------------------------------------------------------------------

function save(blob, name) {
  const href = URL.createObjectURL(blob);
  Object.assign(document.createElement("a"), { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), 10_000);
}

/** The inputs in one line, without one of them. */
function caption(without) {
  const text = (name) => (name === "k" && state.rigid ? "rigid" : textOf(state.given[name], 5));
  const names = namesOf(state).filter((name) => name !== without);
  return names.map((name) => `${symbolOf(name, state.given[name].unit)} = ${text(name)}`).join(", ");
}

const onClick = (id, act) => $(id).addEventListener("click", act);
const lawName = (ending) => `friction-law-${state.along}.${ending}`;
onClick("csv", () => law.law && save(new Blob([law.csv()], { type: "text/csv" }), lawName("csv")));
onClick("law-image", () => law.law && save(law.plot.picture(caption(state.along)), lawName("svg")));
onClick("map-image", () => save(map.plot.picture(caption()), "friction-map.svg"));
onClick("reset", () => {
  form.clear();
  change(startState());
});
onClick("notice-close", () => { $("notice").hidden = true; });
$("digits").addEventListener("change", () => change({ digits: $("digits").checked ? "all" : "few" }));

// --- start ------------------------------------------------------------------------------------------------

function build(names) {
  setNames(names);
  for (const part of document.querySelectorAll("[data-needs]")) part.hidden = !about.knows.has(part.dataset.needs);
  form = new Form($("form"), change, ask);
  law = new LawPanel({ change, pick: (quantity) => setValue(state.along, quantity) });
  panels = [new Solver(setValue)];
  if (about.knows.has("stiffness")) panels.push(new StiffnessPanel(takeOver));
  if (about.knows.has("fit")) {
    const fit = new FitPanel(takeOver);
    onClick("fit-image", () => save(fit.plot.picture(fit.caption), "friction-fit.svg"));
    panels.push(fit);
  }
  readAddress({ newURL: location.href });
  askMap.push(null);
  addEventListener("hashchange", readAddress);
  onKey(() => {
    askMap.push(null);
    askPoint.push(structuredClone(state));
    if (answer) law.ask(answer.limits.v0_crit, true);
  });
}
status.channel("names", () => get("static/page/names.json"), build).push(null);
