// Typed fields, and the form of the inputs: value with unit, slider, contact, direction.
import { CHOICES, INPUTS, fromSI, namesOf, readValue, si, symbolOf, textOf } from "./inputs.js";

const STEPS = 1000; // of a slider, a decade

/** An element with properties, attributes ("aria-label") and children. */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key.includes("-")) element.setAttribute(key, value);
    else element[key] = value;
  }
  element.append(...children);
  return element;
}

/** A typed text: read on Enter and on leaving the field; Escape brings the last good one back. */
export class Field {
  /** `read(text)` -> anything, or { fault }; `use(found)`; `blame(fault)` with the reason, or null. */
  constructor(input, { read, use, blame }) {
    Object.assign(this, { input, read, use, told: blame, fault: null, shown: "" });
    input.addEventListener("change", () => this.commit());
    input.addEventListener("keydown", ({ key }) => {
      if (key !== "Escape") return;
      this.clear();
      this.show(this.shown);
    });
  }

  commit() {
    const found = this.read(this.input.value);
    this.blame(found?.fault ?? null);
    if (!this.fault) this.use(found);
  }

  blame(fault) {
    if (fault === null && this.fault === null) return;
    this.fault = fault;
    this.input.setAttribute("aria-invalid", String(fault !== null && !this.empty));
    this.told(fault);
  }

  get empty() {
    return this.input.value.trim() === "";
  }

  /** Forgets what is typed and cannot be used. */
  clear() {
    this.blame(null);
  }

  /** Shows a text; what is typed and cannot be used stays. */
  show(text) {
    this.shown = text;
    if (!this.fault) this.input.value = text;
  }
}

export class Form {
  /** `change(part of the state)` when something is committed; `trouble()` when what is wrong changes. */
  constructor(form, change, trouble) {
    Object.assign(this, { change, trouble, rows: {} });
    this.rigid = make("input", { type: "checkbox", id: "rigid", role: "switch" });
    this.rigid.addEventListener("change", () => {
      this.settle("k");
      change({ rigid: this.rigid.checked });
    });
    for (const name of Object.keys(INPUTS)) form.append(this.build(name));
    form.addEventListener("submit", (event) => event.preventDefault());
    for (const name of Object.keys(CHOICES)) {
      for (const radio of document.getElementsByName(name)) {
        radio.addEventListener("change", () => change({ [name]: radio.value }));
      }
    }
  }

  build(name) {
    const { label, range: [low, high] } = INPUTS[name];
    const fault = make("p", { id: `fault-${name}`, className: "fault" });
    const text = make("input", { spellcheck: false, type: "text", id: `field-${name}`, "aria-describedby": fault.id });
    const range = { min: low * STEPS, max: high * STEPS, step: 1 };
    const slider = make("input", { type: "range", id: `slider-${name}`, "aria-label": `${label}, slider`, ...range });
    slider.addEventListener("input", () => {
      const { unit } = this.state.given[name];
      const value = Number(fromSI(name, 10 ** (slider.value / STEPS), unit).toPrecision(4));
      this.settle(name);
      this.change({ given: { ...this.state.given, [name]: { value, unit } } });
    });
    const row = make("div", { className: "field" }, make("label", { htmlFor: text.id }, label), text, slider);
    if (name === "k") row.append(make("label", { className: "switch" }, this.rigid, "rigid (no spring)"));
    row.append(fault);
    const value = new Field(text, {
      read: (typed) => readValue(name, typed, this.state.given[name].unit),
      use: (found) => this.change(found.rigid ? found : { given: { ...this.state.given, [name]: found } }),
      blame: (why) => {
        fault.textContent = why ? `${INPUTS[name].symbol}: ${why}.` : "";
        fault.classList.toggle("bad", why !== null && !value.empty);
        this.trouble();
      },
    });
    this.rows[name] = { row, slider, fault, value };
    return row;
  }

  /** Whether what is wrong is only that fields are empty. */
  get calm() {
    return namesOf(this.state).every((name) => !this.rows[name].fault.classList.contains("bad"));
  }

  /** What is wrong, in words; "" if nothing is. */
  get faults() {
    return namesOf(this.state).map((name) => this.rows[name].fault.textContent).filter(Boolean).join(" ");
  }

  /** Takes a typed text back: another way of setting the value was used. */
  settle(name) {
    this.rows[name].value.clear();
  }

  /** Forgets all that is typed and not applied. */
  clear() {
    for (const { value } of Object.values(this.rows)) value.clear();
  }

  /** Shows a state. */
  sync(state) {
    this.state = state;
    this.rigid.checked = state.rigid;
    const shown = namesOf(state);
    for (const [name, { row, slider, value }] of Object.entries(this.rows)) {
      const off = name === "k" && state.rigid;
      const quantity = state.given[name];
      const size = si(name, quantity);
      row.hidden = !shown.includes(name);
      for (const input of [value.input, slider]) input.disabled = off;
      value.show(off ? "rigid" : textOf(quantity));
      slider.value = size > 0 ? Math.round(STEPS * Math.log10(size)) : slider.min;
      slider.setAttribute("aria-valuetext", `${symbolOf(name, quantity.unit)} = ${textOf(quantity)}`);
    }
    for (const name of Object.keys(CHOICES)) {
      for (const radio of document.getElementsByName(name)) radio.checked = radio.value === state[name];
    }
  }
}
