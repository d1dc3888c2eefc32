// The card of the inputs: contact, oscillation, sketch, and a field for each input.  Its label is
// dragged, and has what the service understood where that says more than the text.
import { dials } from "./dials.js";
import { $, attribute, write } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import { inputsOf, motionFrom } from "./state.js";
import {
  about,
  around,
  asTyped,
  inUnit,
  numberOf,
  pageOf,
  percent,
  prose,
  show,
  unitAt,
  withUnit,
} from "./words.js";

/** Of an input, by one press of an arrow key; with Shift. */
const [STEP, FINE_STEP] = [1.05, 1.005];

const ANY = "with several oscillations at once";
/** What can be done with a label. */
const HOW =
  "Drag it sideways: 1 pixel is 1 %. Arrow up and down in the field: 5 %, with Shift 0.5 %";

/**
 * A choice of a few words, as a row of buttons of which one is pressed in; `take(value)` hears of
 * another one.
 */
function choice(name, words, chosen, take, reasons) {
  const one = (value) => html`
    <label
      title=${reasons[value] ?? nothing}
      @click=${() => reasons[value] && write("chosen", reasons[value])}
    >
      <input
        type="radio"
        name=${name}
        value=${value}
        .checked=${chosen === value}
        ?disabled=${Object.hasOwn(reasons, value)}
        @change=${() => take(value)}
      />
      <span>${words[value]}</span>
    </label>
  `;
  return html`<div class="field" role="radiogroup" aria-labelledby=${`${name}-title`}>
    <span id=${`${name}-title`} class="label">${about.titles[name]}</span>
    <div class="choice" id=${name}>${Object.keys(words).map(one)}</div>
  </div>`;
}

/**
 * What the service understood of the text that is typed, where that says more than the text; in a
 * drag it was another text of its form.
 */
function understood(name, typed, { text, value, unit, std, low, high } = {}, dragged = false) {
  if (typeof value !== "number" || ((text ?? typed) !== typed && !dragged)) return "";
  if (high !== undefined) {
    const [from, to] = [low, high].map((end) => inUnit(name, end, unit ?? undefined));
    const [number] = from.split(" ");
    return asTyped(`${number}..${to}`) === asTyped(typed) ? "" : `${number} to ${to}`;
  }
  if (std) return typed.includes("%") ? `± ${inUnit(name, std, unit ?? undefined, 3)}` : "";
  const said = inUnit(name, value, unitAt(name, value, unit), 6);
  return text && !dragged && asTyped(text) !== asTyped(said) ? `read as ${said}` : "";
}

/** `moved({ name: value [SI] })` takes a value that is dragged or stepped to. */
export function inputsPanel(store, moved) {
  let answer = null;
  let known = new Map(); // the faults of the fields
  let typing = ""; // the field whose text is not taken yet
  let stepped = {}; // the last press of an arrow key: { name, value, text }

  function field(name, fault, doubt) {
    const { label, symbol, note, meaning } = about.inputs[name];
    const rigid = name === "k" && store.state.contact === "rigid";
    const text = rigid ? "rigid" : store.state[name];
    const below = name === typing ? "" : prose(fault ?? doubt ?? "");
    const read = understood(name, text, answer?.inputs[name], store.dragged);
    const said = name === typing ? "Enter takes it" : read || note;
    const movable = numberOf(answer?.inputs[name]) > 0 && !rigid;
    return html`
      <div class="field ${name === typing ? "" : fault ? "bad" : doubt ? "doubt" : ""}">
        <label
          for=${`field-${name}`}
          data-dial=${movable ? name : nothing}
          title=${`${meaning}${movable ? `. ${HOW}` : ""}`}
        >
          <span class="symbol">${symbol}</span>
          <span class="label"
            >${label}<small class=${said === note ? "usual" : ""}>${said}</small></span
          >
        </label>
        <input
          id=${`field-${name}`}
          name=${name}
          spellcheck="false"
          autocomplete="off"
          aria-invalid=${String(fault !== undefined)}
          aria-describedby=${`note-${name}`}
          ?disabled=${rigid}
          .value=${text}
        />
        <p id=${`note-${name}`} class="note">${below}</p>
        ${name === "k" && !rigid ? ways(answer?.inputs.k) : nothing}
      </div>
    `;
  }

  /** Where k comes from, which is the input that nobody knows. */
  function ways({ value: k, std, high } = {}) {
    const free = k > 0 && high === undefined; // of an interval
    const range = free ? around(k, std ? std / k : undefined) : "";
    const tool = (panel, words, title) => html`
      <button
        title=${title}
        id=${`tab-${panel}`}
        type="button"
        aria-controls="tool"
        aria-expanded=${String(store.state.panel === panel)}
        @click=${() => store.look({ panel: store.state.panel === panel ? "none" : panel })}
      >
        ${words}
      </button>
    `;
    const interval = html`
      <button
        id="as-interval"
        type="button"
        title=${free ? `Try k from ${range.replace("..", " to ")}` : "k is an interval"}
        ?disabled=${!free}
        @click=${() => store.change({ k: range })}
      >
        ± ${std ? percent(std / k) : "10 %"}
      </button>
    `;
    return html`<p class="ways">
      Find k: ${tool("stiffness", "materials", "k from materials")} ·
      ${tool("fit", "points", "k from measured points of friction")} ·
      <a title="k from a measured loop" href=${pageOf("how-to/loop")}
        >loop<span class="aside">&nbsp;(guide)</span></a
      >
      ${interval}
    </p>`;
  }

  /** An arrow key moves the input of a field by 5 %, with Shift by 0.5 %. */
  function step(event) {
    const { name } = event.target;
    const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!way || !name || name === typing) return;
    // presses that are faster than the answers go on from each other
    const again = stepped.name === name && stepped.text === store.state[name];
    const from = again ? stepped.value : numberOf(answer?.inputs[name]);
    if (!(from > 0)) return;
    event.preventDefault();
    const value = from * (event.shiftKey ? FINE_STEP : STEP) ** way;
    moved({ [name]: value });
    stepped = { name, value, text: store.state[name] };
  }

  /** Any motion begins with the case, without deviations, and asks what halves µ₀. */
  function anyMotion() {
    const { state } = store;
    const name = inputsOf(state)[3];
    const { value, unit, std } = answer?.inputs[name] ?? {};
    const text = std ? inUnit(name, value, unit ?? undefined) : state[name];
    const mu0 = numberOf(answer?.inputs.mu0);
    return { ...motionFrom(state, text), ...(mu0 && { motion_target: show(mu0 / 2) }) };
  }

  /** What is chosen of the oscillation: a direction, or any motion. */
  const oscillation = () => (store.state.motion === "any" ? "any" : store.state.direction);

  /** The set-up as a drawing and in words. */
  function sketch() {
    const { contact } = store.state;
    const way = oscillation();
    for (const part of $("sketch").querySelectorAll(".body, .motion"))
      part.toggleAttribute("hidden", !part.matches(`.body.${contact}, .motion.${way}`));
    const words = `${about.choices.contact[contact]}, ${about.choices.direction[way] ?? ANY}`;
    attribute("sketch", "aria-label", `The set-up: ${words}`);
    write("chosen", `${words[0].toUpperCase()}${words.slice(1)}.`);
  }

  function fields() {
    const doubts = (name) =>
      answer?.remarks?.find(({ row, field: one }) => row === "units" && one === name)?.text;
    const one = store.state.motion === "one"; // any motion has amplitudes of its own
    const names = inputsOf(store.state).filter((name) => one || name !== "y0");
    const rows = names.map((name) => field(name, known.get(name), doubts(name)));
    render(rows, $("fields"));
  }

  /** Says below a field that its text is not taken yet. */
  function typed({ name, value }) {
    if (!name) return;
    typing = value === store.state[name] ? "" : name;
    fields();
  }

  $("fields").addEventListener("input", ({ target }) => typed(target));
  $("fields").addEventListener("change", ({ target }) => {
    const { name, value } = target;
    if (!name) return;
    typing = "";
    store.change({ [name]: withUnit(name, value, answer?.inputs[name]?.unit) });
    target.value = store.state[name]; // also where that is the text that stood there before
  });
  $("fields").addEventListener("keydown", (event) => {
    const { key, target } = event;
    if (key !== "Escape" || !target.name) return step(event);
    target.value = store.state[target.name];
    return typed(target);
  });
  dials($("fields"), {
    valueOf: (name) => numberOf(answer?.inputs[name]),
    grab: (moving) => store.drag(moving),
    take: (name, value) => moved({ [name]: value }),
  });
  $("fields").addEventListener("submit", (event) => event.preventDefault());

  return (reply, faults) => {
    [answer, known] = [reply, faults];
    const { contact } = store.state;
    const take = (way) =>
      store.change(way === "any" ? anyMotion() : { motion: "one", direction: way });
    const without = (kind) => about.impossible[kind];
    const reasons = (names, kind) =>
      Object.fromEntries(names.map((name) => [name, without(kind(name))]).filter(([, why]) => why));
    const ball = reasons(["spring", "ball", "rigid"], (name) => `${name} ${oscillation()}`);
    const ways = reasons(["across", "along", "normal", "any"], (name) => `${contact} ${name}`);
    render(
      [
        choice("contact", about.contacts, contact, (one) => store.change({ contact: one }), ball),
        choice("direction", { ...about.directions, any: "any" }, oscillation(), take, ways),
      ],
      $("choices"),
    );
    sketch();
    fields();
  };
}
