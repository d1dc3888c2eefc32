// The page: one state, the questions that follow from it, and what the answers change.
import { Solver, showAnswer } from "./answer.js";
import { Channel, KeyWanted, Refused, Unanswered, keyTaken, onKey, wantKey } from "./ask.js";
import { Form } from "./form.js";
import {
  INPUTS, REGIMES, about, fromAddress, fromSI, namesOf, question, setNames, show, startState, symbolOf, textOf,
  toAddress, valueOf,
} from "./inputs.js";
import { LawPanel, equations, showLegend } from "./law.js";
import { FORMULAS, FrictionMap } from "./map.js";
import { get, post } from "./service.js";

const $ = (id) => document.getElementById(id);
let state, form, solver, law;
let answer = null; // the last one, with the state that asked for it

const OLD = "Grey results belong to earlier values.";

// --- what is wrong, in words, and what of the page is therefore old --------------------------------------

/** One place of the page: its reasons by topic, shown in `place`; `shown` is grey while there is one. */
class Status {
  constructor(place, shown) {
    Object.assign(this, { place, shown, reasons: new Map() });
  }

  /** Says what is wrong with a topic, or (null) that nothing is; `calm`: it mends itself, or is not typed yet. */
  set(topic, text, calm = false) {
    if (text) this.reasons.set(topic, { text: answer ? `${text} ${OLD}` : text, calm });
    else this.reasons.delete(topic);
    // one reason is enough; what the user can mend comes first
    const first = this.reasons.get("typed") ?? [...this.reasons.values()][0];
    if (this.place.textContent !== (first?.text ?? "")) this.place.textContent = first?.text ?? "";
    this.place.classList.toggle("bad", first?.calm === false);
    this.shown.classList.toggle("old", this.reasons.size > 0);
  }
}

const status = new Status($("status"), $("main"));
const lawStatus = new Status($("law-status"), $("law-section"));
const channels = [];

/** A channel whose failures are told in a place. */
function channel(place, topic, ask, use) {
  const made = new Channel({
    ask,
    answer: (found, asked) => {
      place.set(topic, null);
      use(found, asked);
    },
    fail: (error) => {
      if (error instanceof KeyWanted) wantKey();
      const text = error instanceof Unanswered ? `${error.message} Asking again by itself.` : error.message;
      place.set(topic, error instanceof KeyWanted ? null : text, !(error instanceof Refused));
    },
    wait: (waiting) => {
      if (waiting) place.set(topic, null);
      place.set(`${topic} slow`, waiting ? "Waiting for the service." : null, true);
      busy();
    },
  });
  channels.push(made);
  return made;
}
const busy = () => { $("main").dataset.asking = String(!channels.every((one) => one.idle)); };

const askPoint = channel(status, "point", (asked) => post("v1/mu-macro", question(asked)), (found, asked) => {
  answer = { ...found, asked };
  keyTaken();
  showAnswer(found, asked);
  movePoint();
  law.move(answer);
  law.sync(state, found.limits.v0_crit);
  law.ask(found.limits.v0_crit);
});
const askMap = channel(status, "map", () => get("static/page/map.json"), (data) => {
  map.show(data);
  movePoint();
});
const askHover = new Channel({
  ask: ([v0, y0]) => post("v1/mu-macro", { mu0: 1, Fz: 1, k: 1, omega: 1, y0, v0 }),
  answer: ({ mu_ratio, regime }, place) => {
    const [v, y, ratio] = [...place, mu_ratio].map((value) => show(value, 4));
    $("map-read").textContent = `ṽ = ${v}, ỹ = ${y}: µ/µ₀ = ${ratio}, ${REGIMES[regime]}`;
  },
});

// --- state ------------------------------------------------------------------------------------------------

let addressTimer = null;
function change(changed) {
  Object.assign(state, changed);
  const names = namesOf(state);
  if (!names.includes(state.along)) Object.assign(state, { along: "v0", range: null });
  if (!names.includes(state.family) || state.family === state.along) Object.assign(state, { family: null, curves: [] });
  form.sync(state);
  solver.sync(state);
  law.sync(state, answer?.limits.v0_crit);
  map.set({ formulas: state.approximations });
  showLegend($("map-legend"), mapLegend());
  $("digits").checked = state.digits === "all";
  $("link").href = toAddress(state);
  // browsers refuse an address that changes with every step of a slider
  clearTimeout(addressTimer);
  addressTimer = setTimeout(() => history.replaceState(null, "", $("link").href), 150);
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
  busy();
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
const mapLegend = () => (state.approximations ? Object.entries(FORMULAS) : []).map(([name, [style, dash]]) =>
  ({ label: `border by ${equations(about.borders[name])}`, hint: about.borders[name].text, style, dash }));

function movePoint() {
  if (!answer) return;
  const { groups: { v_tilde, y_tilde, l0 }, asked, mu_ratio, regime } = answer;
  const mapped = isMapped(asked);
  $("map-section").classList.toggle("other", !mapped);
  if (!mapped) {
    $("map-out").textContent = "This map is that of one spring across. It does not hold for what is chosen.";
    map.set({ point: null });
    return;
  }
  const [v0, y0, omega] = ["v0", "y0", "omega"].map((name) => valueOf(asked, name));
  const v = v_tilde ?? (asked.rigid ? Infinity : v0 / (l0 * omega));
  const y = y_tilde ?? (asked.rigid ? Infinity : y0 / l0);
  map.set({ point: [v, y, v0 / (y0 * omega)] });
  const out = Number.isNaN(v) || Number.isNaN(y) ? [0, 0] : map.outside(v, y);
  const sides = [["ṽ", v], ["ỹ", y]].filter((_, i) => out[i]).map(([name, value]) => `${name} = ${show(value, 3)}`);
  const away = asked.rigid ? "Rigid contact: ṽ and ỹ are infinite; the arrow on the frame shows the direction."
    : `The point is outside of this map (${sides.join(", ")}): the arrow on the frame points to it.`;
  $("map-out").textContent = sides.length ? away : "";
  const here = `speed ${show(v, 3)}, amplitude ${show(y, 3)}, ratio ${show(mu_ratio, 3)}, ${REGIMES[regime]}`;
  $("map").setAttribute("aria-label", `Map of the friction ratio. The point: ${here}.`);
}

const map = new FrictionMap($("map"), moveTo, (v, y) => {
  if (v !== null) askHover.push([v, y].map((value) => Number(value.toPrecision(4))));
  else {
    askHover.cancel();
    $("map-read").textContent = "\u00a0";
  }
});

/** Moves the point of the map: v~ by the speed, y~ by the amplitude. */
function moveTo(v, y) {
  const omega = valueOf(state, "omega");
  if (state.rigid || omega === 0 || !isMapped(state)) {
    askHover.cancel();
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
  return { label: names.map((name) => `${symbolOf(name, state.given[name].unit)} = ${text(name)}`).join(", ") };
}

async function saveLaw() {
  if (law.law) save(await law.plot.picture([caption(state.along), ...law.legend]), `friction-law-${state.along}.png`);
}
const saveMap = async () => save(await map.plot.picture([caption(), ...mapLegend()]), "friction-map.png");
function saveTable() {
  if (law.law) save(new Blob([law.csv()], { type: "text/csv" }), `friction-law-${state.along}.csv`);
}

const onClick = (id, act) => $(id).addEventListener("click", act);
onClick("csv", saveTable);
onClick("law-image", saveLaw);
onClick("map-image", saveMap);
onClick("reset", () => {
  form.clear();
  change(startState());
});
onClick("copy", async () => {
  const copied = navigator.clipboard.writeText($("link").href);
  $("copy").textContent = await copied.then(() => "Copied", () => "Copy the address line");
  setTimeout(() => { $("copy").textContent = "Copy link"; }, 2000);
});
onClick("notice-close", () => { $("notice").hidden = true; });
$("digits").addEventListener("change", () => change({ digits: $("digits").checked ? "all" : "few" }));

// --- start ------------------------------------------------------------------------------------------------

function build(names) {
  setNames(names);
  for (const part of document.querySelectorAll("[data-needs]")) part.hidden = !about.knows.has(part.dataset.needs);
  form = new Form($("form"), change, ask);
  law = new LawPanel({
    change, pick: (quantity) => setValue(state.along, quantity), blame: (text) => lawStatus.set("typed", text),
    channel: (topic, question, use) => channel(lawStatus, topic, question, use),
  });
  solver = new Solver(setValue);
  readAddress({ newURL: location.href });
  askMap.push(null);
  addEventListener("hashchange", readAddress);
  onKey(() => {
    askMap.push(null);
    askPoint.push(structuredClone(state));
    if (answer) law.ask(answer.limits.v0_crit, true);
  });
}
channel(status, "names", () => get("static/page/names.json"), build).push(null);
