// The state of the page: what is chosen, and the inputs as they were typed.  It reads no number.
//
// The address holds it as text, and every change is one entry of the history, a drag as a whole.
import { inUnit } from "./words.js";

const ALL = 15; // digits of a value that was typed
const FEW = 6; // digits of the middle of an interval

/** The six inputs by direction, in the order of the form. */
export const inputsOf = ({ direction }) => [
  "mu0",
  "Fz",
  "k",
  direction === "normal" ? "Fz_amplitude" : "y0",
  "f",
  "v0",
];

/** What is chosen beside the inputs, each with its values; the first is where the page starts. */
const CHOICES = {
  contact: ["spring", "ball", "rigid"],
  direction: ["across", "along", "normal"],
  motion: ["one", "any"], // oscillation, or several at once
  along: ["v0", "mu0", "Fz", "k", "y0", "Fz_amplitude", "f"],
  scale: ["log", "linear"],
  axis: ["fit", "zero"], // of µ in the law
  digits: ["few", "all"],
  unknown: ["y0", "mu0", "Fz", "k", "Fz_amplitude", "f", "v0"],
  quantity: ["mu_ratio", "mu_macro"],
  side: ["values", "bars", "target"],
  panel: ["none", "stiffness", "fit"],
  motion_unknown: [
    "y.amplitude",
    "y.phase",
    "x.amplitude",
    "x.phase",
    "normal.amplitude",
    "normal.phase",
    "v0",
    "k",
    "f",
  ],
};
/** The oscillations of any motion, and the one that each direction is. */
export const PARTS = ["x", "y", "normal"];
export const PART_OF = { along: "x", across: "y", normal: "normal" };
const UNSHAKEN = { x: "", y: "", normal: "" };
/** Texts beside the inputs; an empty one is left to the service. */
const TEXTS = {
  from: "",
  to: "",
  exponent: "",
  target: "0.5",
  ...UNSHAKEN,
  motion_target: "0.15",
};

/** The inputs of the usual case, by name, as the service gives them. */
let usual = {};
export const useStart = (texts) => {
  usual = texts;
};

export const startState = () => ({
  ...Object.fromEntries(Object.entries(CHOICES).map(([name, [first]]) => [name, first])),
  ...TEXTS,
  ...usual,
  y: usual.y0,
});

/** Any motion with the oscillation of a case alone, whose amplitude is this text. */
export const motionFrom = ({ direction }, amplitude) => ({
  motion: "any",
  ...UNSHAKEN,
  [PART_OF[direction]]: amplitude,
  motion_unknown: `${PART_OF[direction]}.amplitude`,
});

/** The state as the part of an address behind "#": the inputs, and what is not as at the start. */
export function toAddress(state) {
  const start = startState();
  const words = new URLSearchParams();
  for (const name of inputsOf(state))
    words.set(name, name === "k" ? stiffnessOf(state) : state[name]);
  if (state.contact === "ball") words.set("contact", "ball");
  if (state.direction !== "across") words.set("direction", state.direction);
  for (const name of [...Object.keys(CHOICES).slice(2), ...Object.keys(TEXTS)]) {
    if (state[name] !== start[name]) words.set(name, state[name]);
  }
  return `#${words}`;
}

/** The state that an address holds, and the names in it that the page does not know. */
export function fromAddress(hash) {
  const state = startState();
  const unknown = [];
  for (const [name, value] of new URLSearchParams(hash.slice(1))) {
    const choices = Object.hasOwn(CHOICES, name) ? CHOICES[name] : [value];
    if (Object.hasOwn(state, name) && choices.includes(value)) state[name] = value;
    else unknown.push(`${name}=${value}`);
  }
  if (state.k.trim().toLowerCase() === "rigid")
    Object.assign(state, { contact: "rigid", k: usual.k });
  return { state: allowed(state), unknown };
}

/** The contact and the direction of a state, as one word each. */
export const kindOf = ({ contact, direction }) =>
  `${contact === "ball" ? "ball" : "spring"} ${direction}`;

/** k as it is asked: a rigid contact has none. */
export const stiffnessOf = (state) => (state.contact === "rigid" ? "rigid" : state.k);

/** The inputs of the case as they are asked, by name, and what it is. */
export function caseOf(state, without = []) {
  const names = inputsOf(state).filter((name) => !without.includes(name));
  const inputs = names.map((name) => [name, name === "k" ? stiffnessOf(state) : state[name]]);
  return {
    ...Object.fromEntries(inputs),
    contact: state.contact === "ball" ? "ball" : "spring",
    direction: state.direction,
  };
}

/** The inputs with a deviation, of those in a question. */
export const uncertainOf = (state, answer, question) =>
  Object.keys(question).filter(
    (name) => answer?.inputs[name]?.std && answer.state[name] === state[name],
  );

/** What the service understood of an input as a text, in the unit that was typed. */
const valueOf = (answer, name, digits) => {
  const { value, unit } = answer.inputs[name];
  return inUnit(name, value, unit ?? undefined, digits);
};

/**
 * The inputs without deviations, for questions that have none (targets, fits, motions):
 * the value alone stands in place of a text with a deviation.
 */
export function exactCase(state, answer, without = []) {
  const question = caseOf(state, without);
  for (const name of uncertainOf(state, answer, question))
    question[name] = valueOf(answer, name, ALL);
  return question;
}

/** The oscillations that a contact can have: the load of a ball stays as it is. */
export const partsOf = ({ contact }) =>
  PARTS.filter((name) => name !== "normal" || contact !== "ball");

/** Any motion: the case without y0 and direction, and the oscillations that are given; of an
 * interval of k its middle. */
export function motionOf(state, answer, without = []) {
  const { direction: _, ...body } = exactCase(state, answer, ["y0", "Fz_amplitude", ...without]);
  if (answer?.inputs.k.high !== undefined && body.k === answer.state.k)
    body.k = valueOf(answer, "k", FEW);
  const parts = partsOf(state).filter((name) => state[name].trim());
  return { ...body, ...Object.fromEntries(parts.map((name) => [name, state[name]])) };
}

/**
 * The case around one input that is swept or solved for.  Where that is Fz and k grows with it, the
 * Fz of the case stays, as the load at which k holds.  What is not `exact` keeps its deviations,
 * but that of the input itself.
 */
export function caseAround(state, answer, name, exact = true) {
  const { contact, exponent } = state;
  const grows = name === "Fz" && contact !== "rigid" && (exponent || contact === "ball");
  const question = exact
    ? exactCase(state, answer, grows ? [] : [name])
    : { ...caseOf(state, [name]), ...(grows && { Fz: exactCase(state, answer).Fz }) };
  return grows && exponent ? { ...question, stiffness_exponent: exponent } : question;
}

/** The state without what its contact and its oscillation do not have. */
function allowed(chosen) {
  const state = chosen.motion === "any" ? { ...chosen, direction: "across" } : chosen;
  const names = inputsOf(state);
  const other = state.direction === "normal" ? "Fz_amplitude" : "y0";
  const shown = (name) => (names.includes(name) ? name : other);
  const panel = state.contact === "rigid" ? "none" : state.panel; // which are for k
  return { ...state, along: shown(state.along), unknown: shown(state.unknown), panel };
}

/** One state and those who follow it; `change` makes an entry of the history. */
export class Store {
  constructor(follow) {
    Object.assign(this, { follow, dragged: false });
    this.state = startState();
    addEventListener("popstate", () => this.open());
  }

  /** Takes the state of the address; names in it that are not known go to `this.unknown`. */
  open() {
    const { state, unknown } = fromAddress(location.hash);
    Object.assign(this, { state, unknown, dragged: false });
    this.follow();
  }

  change(part) {
    this.state = allowed({ ...this.state, ...part });
    if (!this.dragged) this.remember();
    this.follow();
  }

  /** Changes what is looked at: the address holds it, and it is no entry of its own. */
  look(part) {
    this.state = { ...this.state, ...part };
    history.replaceState(null, "", toAddress(this.state));
    this.follow();
  }

  /** The changes of one drag are one entry of the history. */
  drag(moving) {
    const ended = this.dragged && !moving;
    this.dragged = moving;
    if (!ended) return;
    this.remember();
    this.follow();
  }

  remember() {
    const address = toAddress(this.state);
    if (address === location.hash) return;
    // the first entry has no address: it is the start, and stays one
    history.pushState(null, "", address);
  }
}
