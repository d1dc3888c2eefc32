// The page: one state, the questions that follow from it, and what the answers change.
import { question, showAnswer } from "./answer.js";
import { Channel, KeyWanted, get } from "./api.js";
import { Form } from "./form.js";
import { INPUTS, borders, equations, fromSI, loadNames, symbolOf, toSI } from "./inputs.js";
import { keyTaken, onKey, wantKey } from "./keyform.js";
import { LawPlot } from "./law.js";
import { LawForm } from "./lawform.js";
import { asCsv, askLaw, drawn, drawnFamily, familyQuestion, heading, lawQuestion, lawRows, showLegend, showTable } from "./lawpanel.js";
import { FORMULAS, FrictionMap } from "./map.js";
import { theme } from "./plot.js";
import { caption, save } from "./save.js";
import { REGIMES, show, withUnit } from "./show.js";
import { Solver } from "./solve.js";
import { fromAddress, startState, toAddress } from "./state.js";
import { Status } from "./status.js";

const $ = (id) => document.getElementById(id);
const OLD = "Grey results belong to earlier values.";
const status = new Status($("status"), $("main"));
const lawStatus = new Status($("law-status"), $("law-section"));
let state, form, lawForm, solver;
let answer = null; // the last one
const law = { found: null, request: null, family: null, drawn: null, drawnFamily: null, rows: [], asked: "", askedFamily: "" };

// --- questions ----------------------------------------------------------------------------------------

/** What to do when there is no answer: say so in the status of a place. */
const failing = (place, topic) => (error) => {
  if (error instanceof KeyWanted) wantKey();
  place.set(topic, error instanceof KeyWanted ? null : `${error.message} ${OLD}${error.faults ? "" : " Asking again by itself."}`);
};
const slow = (place, topic) => (waiting) => {
  if (waiting) place.set(topic, null);
  place.set(`${topic} slow`, waiting ? `Waiting for the service. ${OLD}` : null);
  busy();
};
const channel = (place, topic, ask, use) => new Channel({
  ask, fail: failing(place, topic), wait: slow(place, topic),
  answer: (found, asked) => {
    place.set(topic, null);
    use(found, asked);
  },
});

const asks = {
  point: channel(status, "point", (asked) => get("v1/mu-macro", question(asked)), showPoint),
  law: channel(lawStatus, "law", askLaw, (found, request) => { Object.assign(law, { found, request }); drawLaw(); }),
  family: channel(lawStatus, "family", askLaw, (found) => { law.family = found; drawLaw(); }),
  map: channel(status, "map", () => get("static/page/map.json"), (data) => { map.show(data); keyTaken(); movePoint(); }),
  hover: new Channel({ ask: ([v, y]) => get("v1/mu-macro", { mu0: 1, Fz: 1, k: 1, omega: 1, y0: y, v0: v }), answer: showHover, fail: () => {} }),
};
const busy = () => { $("main").dataset.asking = String(![asks.point, asks.law, asks.family, asks.map].every((one) => one.idle)); };

function ask() {
  status.set("typed", form.faults.size ? `${[...form.faults.values()].join(" ")} ${OLD}` : null);
  if (form.faults.size) {
    asks.point.cancel();
    status.set("point", null);
  } else asks.point.push(structuredClone(state));
  busy();
}

function askForLaw() {
  const border = answer?.limits.v0_crit;
  lawForm.sync(state, border);
  for (const [name, key, request] of [["law", "asked", lawQuestion(state, border)], ["family", "askedFamily", familyQuestion(state, border)]]) {
    const text = JSON.stringify(request);
    if (text === law[key]) continue;
    law[key] = text;
    lawStatus.set(name, null);
    if (request) asks[name].push(request);
    else asks[name].cancel();
    if (!request) law[name] = null;
  }
  drawLaw();
}

// --- state --------------------------------------------------------------------------------------------

let addressTimer = null;
function change(changed) {
  Object.assign(state, changed);
  form.sync(state);
  solver.sync(state);
  lawForm.sync(state, answer?.limits.v0_crit);
  compareOnMap();
  $("link").href = toAddress(state);
  // browsers refuse an address that changes with every step of a slider
  clearTimeout(addressTimer);
  addressTimer = setTimeout(() => history.replaceState(null, "", $("link").href), 150);
  ask();
}

function readAddress() {
  const read = fromAddress(location.hash);
  state = read.state;
  form.sync(state);
  form.clear();
  lawForm.forget("start", "stop", "curves");
  $("notice").hidden = !read.faults.length;
  $("notice-text").textContent = read.faults.length ? `This link has values that cannot be used; start values replace them: ${read.faults.join("; ")}.` : "";
  change({});
}

const setValue = (name, value) => {
  form.settle(name);
  change({ values: { ...state.values, [name]: value }, ...(name === "k" ? { rigid: false } : {}) });
};

// --- answers ------------------------------------------------------------------------------------------

function showPoint(found, asked) {
  answer = { ...found, asked };
  showAnswer(found, asked);
  movePoint();
  askForLaw();
}

function movePoint() {
  if (!answer) return;
  const { groups: { v_tilde, y_tilde, l0 }, asked: { values, rigid } } = answer;
  const v = v_tilde ?? (rigid ? Infinity : values.v0 / (l0 * values.omega));
  const y = y_tilde ?? (rigid ? Infinity : values.y0 / l0);
  map.move(v, y, values.v0 / (values.y0 * values.omega));
  const out = Number.isNaN(v) || Number.isNaN(y) ? [0, 0] : map.outside(v, y);
  const sides = [["ṽ", v, out[0]], ["ỹ", y, out[1]]].filter(([, , side]) => side !== 0).map(([name, value]) => `${name} = ${show(value, 3)}`);
  $("map-out").hidden = !sides.length;
  $("map-out").textContent = !sides.length ? "" : rigid ? "Rigid contact: ṽ and ỹ are infinite; the arrow on the frame shows the direction." : `The point is outside of this map (${sides.join(", ")}): the arrow on the frame points to it.`;
  $("map").setAttribute("aria-label", `Map of the friction ratio. The point: speed ${show(v, 3)}, amplitude ${show(y, 3)}, ratio ${show(answer.mu_ratio, 3)}, ${REGIMES[answer.regime]}.`);
}

function drawLaw() {
  const { found, family } = law;
  if (!found || found.along !== state.along) return;
  law.drawn = drawn(found, state, law.request);
  law.drawnFamily = family && family.along === state.along && family.family === state.family ? drawnFamily(family, state) : null;
  plot.show(law.drawn);
  plot.showFamily(law.drawnFamily);
  const { along } = state;
  const unit = state.units[along];
  if (answer) plot.move(along === "k" && state.rigid ? Infinity : fromSI(along, unit, answer.asked.values[along]), answer.mu_macro);
  law.rows = lawRows(law.drawn, law.drawnFamily, state);
  showLegend($("legend"), law.rows);
  showTable($("law-table").tBodies[0], law.drawn);
  $("law-input").textContent = heading(state);
  const at = (i) => `${show(found.mu_macro.at(i), 4)} at ${symbolOf(along, unit)} = ${withUnit(along, found.values.at(i), unit)}`;
  const border = found.border.map((mark) => withUnit(along, mark.value, unit)).join(" and ");
  $("law").setAttribute("aria-label", `Macroscopic friction from ${at(0)} to ${at(-1)}${border ? `; border of continuous sliding at ${border}` : ""}.`);
}

/** The paper's formulas for the border on the map, with their legend. */
const mapRows = () => (state.approximations ? Object.entries(FORMULAS).map(([name, [style, dash]]) => ({ label: `border by ${equations(borders[name])}`, about: borders[name].text, css: style, dash })) : []);
function compareOnMap() {
  map.compare(state.approximations);
  showLegend($("map-legend"), mapRows());
}

function showHover(found, [v, y]) {
  if (!hovered) return;
  $("map-read").textContent = `ṽ = ${show(v, 3)}, ỹ = ${show(y, 3)}: µ/µ₀ = ${show(found.mu_ratio, 6)}, ${REGIMES[found.regime]}`;
}

// --- plots --------------------------------------------------------------------------------------------

let hovered = false;
const map = new FrictionMap($("map"), moveTo, (v, y, ratio) => {
  hovered = v !== null;
  $("map-read").textContent = hovered ? `ṽ = ${show(v, 3)}, ỹ = ${show(y, 3)}: µ/µ₀ ≈ ${ratio.toFixed(2)}` : "\u00a0";
  if (hovered) asks.hover.push([Number(v.toPrecision(6)), Number(y.toPrecision(6))]);
});
const plot = new LawPlot($("law"), (value) => setValue(state.along, toSI(state.along, state.units[state.along], Number(value.toPrecision(4)))), (i) => {
  const { along, units } = state;
  $("law-read").textContent = i === null ? "\u00a0" : `${symbolOf(along, units[along])} = ${withUnit(along, law.found.values[i], units[along])}: µ = ${show(law.drawn.mu[i], 6)}, ${REGIMES[law.drawn.regime[i]]}`;
});

/** Moves the point of the map: v~ by the speed, y~ by the amplitude. */
function moveTo(v, y) {
  const { values, rigid } = state;
  if (rigid || values.omega === 0) {
    hovered = false; // what the place itself would read is of no use now
    $("map-read").textContent = rigid ? "A rigid contact has no point inside the map: switch it off to move the point." : "Without a frequency there is no point inside the map.";
    return;
  }
  const length = (values.mu0 * values.Fz) / values.k;
  form.settle("v0");
  form.settle("y0");
  change({ values: { ...values, v0: Number((v * length * values.omega).toPrecision(4)), y0: Number((y * length).toPrecision(4)) } });
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
for (const id of ["map", "law"]) {
  $(id).addEventListener("keydown", (event) => {
    const arrow = ARROWS[event.key];
    if (!arrow || (id === "law" && arrow[1])) return;
    event.preventDefault();
    const name = id === "law" ? state.along : arrow[0] ? "v0" : "y0";
    const factor = (event.shiftKey ? 1.5 : 1.05) ** (arrow[0] || arrow[1]);
    setValue(name, Number(((state.values[name] || 10 ** INPUTS[name].range[0]) * factor).toPrecision(6)));
  });
}

// --- start --------------------------------------------------------------------------------------------

$("reset").addEventListener("click", () => {
  form.clear();
  change(startState());
});
$("copy").addEventListener("click", async () => {
  try {
    await navigator.clipboard.writeText($("link").href);
    $("copy").textContent = "Copied";
  } catch {
    $("copy").textContent = "Copy the address line";
  }
  setTimeout(() => { $("copy").textContent = "Copy link"; }, 2000);
});
$("notice-close").addEventListener("click", () => { $("notice").hidden = true; });
$("csv").addEventListener("click", () => law.drawn && save(new Blob([asCsv(law.drawn, law.drawnFamily)], { type: "text/csv" }), `friction-law-${state.along}.csv`));
$("law-image").addEventListener("click", async () => {
  if (!law.drawn) return;
  const colour = theme();
  const rows = [{ text: caption(state, state.along) }, ...law.rows.map(({ label, shade, dash }) => ({ text: label, style: shade(colour), dash }))];
  save(await plot.plot.picture(rows), `friction-law-${state.along}.png`);
});
$("map-image").addEventListener("click", async () => save(await map.plot.picture([{ text: caption(state) }, ...mapRows().map(({ label, css, dash }) => ({ text: label, style: css, dash }))]), "friction-map.png"));

/** Asks for everything, the map included: at the start, and when there is a key. */
function begin() {
  Object.assign(law, { asked: "", askedFamily: "" });
  asks.map.push(null);
  change({});
}

function build() {
  form = new Form($("form"), change, ask);
  lawForm = new LawForm((changed) => {
    change(changed);
    askForLaw();
  }, lawStatus);
  solver = new Solver(setValue, (error) => error instanceof KeyWanted && wantKey());
  readAddress();
  asks.map.push(null);
  addEventListener("hashchange", readAddress);
  onKey(begin);
}

new Channel({
  ask: loadNames,
  answer: ({ guide }) => {
    status.set("names", null);
    $("guide").hidden = !guide;
    build();
  },
  fail: (error) => status.set("names", `${error.message} Asking again by itself.`),
}).push(null);
