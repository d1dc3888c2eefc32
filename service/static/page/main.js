// The page: one state, the question that follows from it, and the cards that show the answer.
import { Channel } from "./ask.js";
import { $, afterPicture, markBusy } from "./dom.js";
import { inputsPanel } from "./inputs.js";
import { numberPanel } from "./number.js";
import { getPreloaded, post } from "./service.js";
import { Store, caseOf, kindOf, startState, useStart } from "./state.js";
import { about, pageOf, textAt } from "./words.js";

let answer = null; // the last one, with the state that it belongs to
let trouble = null; // why there is no newer one: { text, calm, faults by input }
let target = null; // the friction that is asked for, as a line in the plots
let panels;
let loading = false; // the other cards

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

const answerTo = (state) => post("v1/mu-macro", questionOf(state));
const point = new Channel(
  answerTo,
  (reply, state) => {
    answer = { ...reply, state };
    trouble = null;
    show();
  },
  (reason, calm, reply) => {
    const faults = (reply?.faults ?? []).map(({ field, reason: why }) => [field, why]);
    trouble = reason === null ? null : { text: reason, calm, faults: new Map(faults) };
    if (reply?.refused && !answer) instead.push({ ...asked, ...startOf(trouble.faults) });
    show();
  },
);

/** Where a link is refused there is no earlier number: one with what is at fault as at the start,
 * or else with all inputs so. */
const instead = new Channel(
  answerTo,
  (reply, state) => {
    answer ??= { ...reply, state };
    show();
  },
  (_reason, _calm, reply) => {
    if (reply?.refused) instead.push({ ...asked, ...about.start });
  },
);
const startOf = (faults) =>
  Object.fromEntries(Object.entries(about.start).filter(([name]) => faults.has(name)));

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
  const { contact, motion } = store.state;
  const view = motion === "any" ? "any" : contact === "rigid" ? "rigid" : "map";
  $("main").dataset.view = view;
  for (const part of document.querySelectorAll("[data-in]"))
    part.hidden = !part.dataset.in.split(" ").includes(view);
  const old = answer !== null && answer.state !== store.state && trouble !== null;
  panels.inputs(answer, trouble?.faults ?? new Map());
  panels.number(answer, trouble, old);
  panels.others?.point(answer, target);
  afterPicture(() => {
    if (panels.others) panels.others.rest(answer, trouble, target, old);
    else if (answer || trouble) loadOthers();
  });
}

/** Loads the other cards once, so that the number waits for none of their files. */
async function loadOthers() {
  if (loading) return;
  loading = true;
  markBusy(loadOthers, true);
  try {
    const [{ cards }] = await Promise.all([import("./cards.js"), import("./d3.js")]);
    panels.others = cards(store, moved, aim, show);
  } catch {
    loading = false; // the next answer tries it again
    trouble = { text: "The map and the law were not loaded: reload the page.", faults: new Map() };
  }
  if (panels.others) show();
  else panels.number(answer, trouble, false);
  markBusy(loadOthers, false);
}

/** Takes the friction that is asked for. */
function aim(mark) {
  target = mark;
  show();
}

function start(names) {
  Object.assign(about, names);
  useStart(about.start);
  store.open(); // the question is under way while the cards are made
  panels = { inputs: inputsPanel(store, moved), number: numberPanel(store) };
  show();
  $("version").textContent = about.version;
  for (const link of document.querySelectorAll("[data-page]"))
    link.href = pageOf(link.dataset.page);
  const unknown = store.unknown.join(", ");
  $("notice").hidden = !unknown;
  $("notice-text").textContent = unknown
    ? `The page does not know this part of the link, and leaves it out: ${unknown}.`
    : "";
}

$("reset").addEventListener("click", () =>
  store.change({ ...startState(), panel: store.state.panel, side: store.state.side }),
);
$("notice-close").addEventListener("click", () => {
  $("notice").hidden = true;
});
// a ring stands around what keys have reached: not after a press, and not while a text is typed
const root = document.documentElement;
addEventListener("pointerdown", () => root.classList.remove("keys"), true);
addEventListener(
  "keydown",
  ({ key, target }) => {
    if (key === "Tab" || !target.closest?.("input, textarea")) root.classList.add("keys");
  },
  true,
);
// a link to a part would take the place of the case in the address
$("jump").addEventListener("click", ({ target }) =>
  $(target.closest("[data-to]")?.dataset.to)?.scrollIntoView(),
);
$("skip").addEventListener("click", () => $("map").focus());
$("print").addEventListener("click", () => window.print());
new Channel(
  () => getPreloaded("static/page/names.json"),
  start,
  (reason) => {
    $("status").textContent = reason ?? "";
  },
).push(null);
