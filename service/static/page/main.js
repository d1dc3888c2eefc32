// The page: one state, the question that follows from it, and the cards that show the answer.
import { Channel } from "./ask.js";
import { $, afterPicture, write } from "./dom.js";
import { copies, textsOf } from "./copy.js";
import { fitPanel } from "./fit.js";
import { inputsPanel } from "./inputs.js";
import { lawPanel } from "./law.js";
import { mapPanel, textAt } from "./map.js";
import { meaningsDialog } from "./meanings.js";
import { motionPanel } from "./motion.js";
import { numberPanel } from "./number.js";
import { getPreloaded, post } from "./service.js";
import { sidePanel, tabs } from "./side.js";
import { Store, caseOf, fromAddress, kindOf, startState, useStart } from "./state.js";
import { stiffnessPanel } from "./stiffness.js";
import { about } from "./words.js";

let answer = null; // the last one, with the state that it belongs to
let trouble = null; // why there is no newer one: { text, calm, faults by input }
let target = null; // the friction that is asked for, as a line in the plots
let panels;

const store = new Store(() => {
  ask();
  show();
});
let asked = null; // the state of the last question

/** The question of a state: the texts as they are typed, and all outputs that its kind has. */
function questionOf(state) {
  return {
    ...caseOf(state),
    include: ["inputs", "model", ...about.outputs[kindOf(state)]],
  };
}

const point = new Channel(
  (state) => post("v1/mu-macro", questionOf(state)),
  (reply, state) => {
    answer = { ...reply, state };
    trouble = null;
    target = null;
    show();
  },
  (reason, calm, reply) => {
    const faults = (reply?.faults ?? []).map(({ field, reason: why }) => [field, why]);
    trouble = reason === null ? null : { text: reason, calm, faults: new Map(faults) };
    show();
  },
);

/** Asks for the number of a state; one that differs in what is looked at alone has it already. */
function ask() {
  if (asked === store.state) return;
  asked = store.state;
  const same = (state) => JSON.stringify(questionOf(state)) === JSON.stringify(questionOf(asked));
  if (answer && !trouble && !point.busy && same(answer.state)) answer = { ...answer, state: asked };
  else point.push(asked);
}

/** Gives inputs other values [SI], in the units and with the deviations that they had. */
function moved(values, digits = 4, more = {}) {
  const texts = Object.entries(values).filter(([, value]) => Number.isFinite(value));
  if (!answer || !texts.length) return store.change(more);
  return store.change({
    ...Object.fromEntries(
      texts.map(([name, value]) => [name, textAt(answer, name, value, digits)]),
    ),
    ...more,
  });
}

/** Fields, number and point follow at once, all else when these are on the screen. */
function show() {
  if (!panels) return;
  const old = answer !== null && answer.state !== store.state && trouble !== null;
  panels.inputs(answer, trouble?.faults ?? new Map());
  panels.number(answer, trouble, old);
  panels.map?.(answer, target?.mu_ratio);
  afterPicture(() => showRest(old));
}

/** While something is dragged, what does not belong to the case alone waits for the end of it. */
function showRest(old) {
  if (!answer && !trouble) return; // the first number comes before the other cards
  if (!panels.map) Object.assign(panels, otherPanels());
  const { state } = store;
  panels.law(state, answer, panels.map(answer, target?.mu_ratio), target, old);
  panels.side(answer);
  if (store.dragged) return;
  const settled = answer?.state === state;
  panels.copy(textsOf(state), settled ? null : (trouble?.text ?? "there is no number yet."));
  panels.tab(state.panel);
  panels.stiffness();
  panels.fit(answer);
  panels.motion(answer, settled || trouble !== null);
  for (const name of ["along", "scale", "from", "to", "exponent"]) $(name).value = state[name];
  $("digits").checked = state.digits === "all";
  $("exponent-field").hidden = state.along !== "Fz" && state.unknown !== "Fz";
  write("print-case", location.href);
  write("print-date", new Date().toISOString().slice(0, 10));
}

function otherPanels() {
  meaningsDialog();
  for (const [name, { symbol }] of Object.entries(about.inputs))
    $("along").append(new Option(symbol, name));
  return {
    map: mapPanel(store, moved, () => show()),
    law: lawPanel(store, moved),
    side: sidePanel(store, moved, (mark) => {
      target = mark;
      show();
    }),
    copy: copies("copy"),
    tab: tabs("panel-tabs", (panel) => store.look({ panel })),
    stiffness: stiffnessPanel(store, moved),
    fit: fitPanel(store, moved, (address) =>
      store.change(fromAddress(`#${address}&panel=fit`).state),
    ),
    motion: motionPanel(store, moved),
  };
}

function start(names) {
  Object.assign(about, names);
  useStart(about.start);
  store.open(); // the question is under way while the cards are made
  panels = { inputs: inputsPanel(store, moved), number: numberPanel(store) };
  show();
  $("version").textContent = about.version;
  for (const link of document.querySelectorAll("[data-guide]")) link.hidden = !about.guide;
  const unknown = store.unknown.join(", ");
  $("notice").hidden = !unknown;
  $("notice-text").textContent = unknown
    ? `The page does not know this part of the link, and leaves it out: ${unknown}.`
    : "";
}

$("reset").addEventListener("click", () =>
  store.change({ ...startState(), panel: store.state.panel }),
);
$("notice-close").addEventListener("click", () => {
  $("notice").hidden = true;
});
for (const name of ["along", "scale", "from", "to", "exponent"])
  $(name).addEventListener("change", ({ target: { value } }) =>
    store.change(name === "along" ? { along: value, from: "", to: "" } : { [name]: value }),
  );
$("digits").addEventListener("change", ({ target: { checked } }) =>
  store.change({ digits: checked ? "all" : "few" }),
);
$("print").addEventListener("click", () => window.print());
new Channel(
  () => getPreloaded("static/page/names.json"),
  start,
  (reason) => {
    $("status").textContent = reason ?? "";
  },
).push(null);
