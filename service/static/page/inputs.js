// The card of the inputs: contact, direction, sketch, and a field for each input with what the
// service understood below it.
import { $, attribute, write } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import { inputsOf } from "./state.js";
import { about, inPrint, inUnit, numberOf, prose, typeset, unitAt } from "./words.js";

const STEPS = 100; // of a slider, a decade

/** A choice of a few words, as a row of buttons of which one is pressed in. */
export function choice(store, name, words, reasons = {}) {
  const one = (value) => html`
    <label title=${reasons[value] ?? nothing}>
      <input
        type="radio"
        name=${name}
        value=${value}
        .checked=${store.state[name] === value}
        ?disabled=${value in reasons}
        @change=${() => store.change({ [name]: value })}
      />
      <span>${words[value]}</span>
    </label>
  `;
  return html`<fieldset class="choice" id=${name}>
    <legend>${about.titles[name]}</legend>
    ${Object.keys(words).map(one)}
  </fieldset>`;
}

/** A text without what makes no difference: blanks, u in place of µ. */
const asTyped = (text) => text.replaceAll(" ", "").replaceAll("µ", "u");

/** What the service understood of the text that is typed, where that says more than the text. */
function understood(name, typed, { text, value, unit, std, low, high } = {}) {
  if (typeof value !== "number" || (text ?? typed) !== typed) return "";
  if (low !== undefined && high !== undefined)
    return `${inUnit(name, low, unit ?? undefined)} to ${inUnit(name, high, unit ?? undefined)}`;
  const said = inUnit(name, value, unitAt(name, value, unit, 1e4), 6);
  if (std) return `${said}, standard deviation ${inUnit(name, std, unit ?? undefined, 3)}`;
  return text && asTyped(text) !== asTyped(said) ? `read as ${said}` : "";
}

/**
 * Texts without a unit get the one that their field has, before they are sent: 2.9 in the field of
 * 2 µm is 2.9 µm.
 */
export function withUnit(name, text, answer) {
  const unit = answer?.inputs[name]?.unit;
  const bare = text.trim() && !/[^\d\s.,e+±%-]/i.test(text) && /\d\s*$/.test(text.trim());
  return bare && unit && unit !== "-" && /[^-\d]/.test(unit)
    ? `${text.trim()} ${inPrint(unit)}`
    : text;
}

/** `moved({ name: value [SI] })` takes the value of a slider. */
export function inputsPanel(store, moved) {
  let answer = null;
  let known = new Map(); // the faults of the fields
  let typing = ""; // the field whose text is not taken yet

  function field(name, fault, doubt) {
    const { label, symbol, note, range } = about.inputs[name];
    const one = answer?.inputs[name];
    const rigid = name === "k" && store.state.contact === "rigid";
    const said = fault ?? doubt ?? (understood(name, store.state[name], one) || note);
    const below = name === typing ? "Enter takes it, Esc takes it back" : said;
    const number = numberOf(one);
    const value = number > 0 ? Math.log10(number) : range[0];
    return html`
      <div class="field ${name === typing ? "" : fault ? "bad" : doubt ? "doubt" : ""}">
        <label for=${`field-${name}`} title=${about.inputs[name].meaning}>
          ${typeset(symbol)} <span class="label">${label}</span>
        </label>
        <input
          id=${`field-${name}`}
          name=${name}
          spellcheck="false"
          autocomplete="off"
          aria-invalid=${String(fault !== undefined)}
          aria-describedby=${`note-${name}`}
          ?disabled=${rigid}
          .value=${rigid ? "rigid" : store.state[name]}
        />
        <input
          type="range"
          id=${`slider-${name}`}
          aria-label=${`${label}, slider`}
          aria-valuetext=${rigid ? "rigid" : store.state[name]}
          min=${range[0] * STEPS}
          max=${range[1] * STEPS}
          step="1"
          ?disabled=${rigid || !one}
          .value=${String(Math.round(value * STEPS))}
          @input=${({ target }) => {
            store.drag(true);
            moved({ [name]: 10 ** (target.value / STEPS) }, 3);
          }}
          @change=${() => store.drag(false)}
          @keydown=${(event) => step(event, name)}
        />
        <p id=${`note-${name}`} class="note" title=${below}>${prose(below)}</p>
      </div>
    `;
  }

  /** An arrow key moves an input by 5 %, with Shift by 0.5 %. */
  function step(event, name) {
    const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    const value = numberOf(answer?.inputs[name]);
    if (!way || !(value > 0)) return;
    event.preventDefault();
    moved({ [name]: value * (event.shiftKey ? 1.005 : 1.05) ** way }, 6);
  }

  function sketch() {
    const { contact, direction } = store.state;
    for (const part of $("sketch").querySelectorAll(".body, .motion"))
      part.toggleAttribute("hidden", !part.matches(`.body.${contact}, .motion.${direction}`));
    const words = `${about.choices.contact[contact]}, ${about.choices.direction[direction]}`;
    attribute("sketch", "aria-label", `The set-up: ${words}`);
    write("chosen", `${words[0].toUpperCase()}${words.slice(1)}.`);
  }

  function fields() {
    const doubts = (name) =>
      answer?.remarks?.find(({ row, field: one }) => row === "units" && one === name)?.text;
    const rows = inputsOf(store.state).map((name) => field(name, known.get(name), doubts(name)));
    render(rows, $("fields"));
  }

  /** Says below a field that its text is not taken yet. */
  function typed({ name, value }) {
    if (!name) return;
    typing = value === store.state[name] ? "" : name;
    fields();
  }

  $("fields").addEventListener("input", ({ target }) => typed(target));
  $("fields").addEventListener("change", ({ target: { name, value } }) => {
    if (!name) return;
    typing = "";
    store.change({ [name]: withUnit(name, value, answer) });
  });
  $("fields").addEventListener("keydown", ({ key, target }) => {
    if (key !== "Escape" || !target.name) return;
    target.value = store.state[target.name];
    typed(target);
  });
  $("fields").addEventListener("submit", (event) => event.preventDefault());

  return (reply, faults) => {
    [answer, known] = [reply, faults];
    const { contact, direction } = store.state;
    const without = (kind) => about.impossible[kind];
    const reasons = (names, kind) =>
      Object.fromEntries(names.map((name) => [name, without(kind(name))]).filter(([, why]) => why));
    const ball = reasons(["spring", "ball", "rigid"], (name) => `${name} ${direction}`);
    const ways = reasons(["across", "along", "normal"], (name) => `${contact} ${name}`);
    render(
      [
        choice(store, "contact", about.contacts, ball),
        choice(store, "direction", about.directions, ways),
      ],
      $("choices"),
    );
    sketch();
    fields();
  };
}
