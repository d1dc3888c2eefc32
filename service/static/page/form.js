// The fields of the six inputs: value, unit, slider, standard deviation.  Typed values apply on commit.
import { INPUTS, NAMES, fromSI, unitText } from "./inputs.js";
import { readDeviation, readValue } from "./read.js";
import { show } from "./show.js";

const STEPS = 1000; // of a slider, a decade
const make = (tag, properties, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};

export class Form {
  /** `change(part of the state)` when something is committed; `trouble()` when what is wrong changes. */
  constructor(form, change, trouble) {
    Object.assign(this, { change, trouble, rows: {}, faults: new Map(), typed: {} });
    for (const name of NAMES) form.append(this.build(name));
    form.addEventListener("submit", (event) => event.preventDefault());
  }

  build(name) {
    const { label, offered, range } = INPUTS[name];
    const text = make("input", { type: "text", id: `field-${name}`, inputMode: name === "k" ? "text" : "decimal", spellcheck: false });
    const spread = make("input", { type: "text", id: `std-${name}`, placeholder: "0", spellcheck: false });
    const unit = make("select", { id: `unit-${name}`, disabled: offered.length === 1 });
    const slider = make("input", { type: "range", id: `slider-${name}`, min: range[0] * STEPS, max: range[1] * STEPS, step: 1 });
    const fault = make("p", { id: `fault-${name}`, className: "fault" });
    unit.setAttribute("aria-label", `unit of ${label}`);
    slider.setAttribute("aria-label", `${label}, slider`);
    spread.setAttribute("aria-label", `uncertainty of ${label}, one standard deviation, in its unit or in %`);
    for (const input of [text, spread]) input.setAttribute("aria-describedby", fault.id);
    const deviation = make("label", { className: "deviation" }, "±", spread);
    const row = make("div", { className: "field" }, make("label", { htmlFor: text.id, textContent: label }), text, unit, slider, deviation);
    this.rows[name] = { row, text, unit, slider, spread, fault };
    if (name === "k") row.append(this.buildSwitch());
    row.append(fault);
    this.listen(name);
    return row;
  }

  buildSwitch() {
    this.rigid = make("input", { type: "checkbox", id: "rigid" });
    this.rigid.setAttribute("role", "switch");
    this.rigid.addEventListener("change", () => {
      this.settle("k");
      this.change({ rigid: this.rigid.checked });
    });
    return make("label", { className: "switch" }, this.rigid, "rigid contact (no spring)");
  }

  listen(name) {
    const { text, unit, slider, spread } = this.rows[name];
    this.onCommit(text, () => this.commit(name));
    this.onCommit(spread, () => this.commitDeviation(name));
    unit.addEventListener("change", () => this.change({ units: { ...this.state.units, [name]: unit.value } }));
    slider.addEventListener("input", () => {
      this.settle(name);
      this.change({ values: { ...this.state.values, [name]: Number((10 ** (slider.value / STEPS)).toPrecision(4)) } });
    });
  }

  /** Commits on Enter and on leaving a field, where it was changed; Escape brings the last good value back. */
  onCommit(input, commit) {
    input.addEventListener("change", commit);
    input.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      this.blame(input, null);
      this.sync(this.state);
    });
  }

  commit(name) {
    const { text } = this.rows[name];
    const { units, values } = this.state;
    const found = readValue(name, text.value, units[name]);
    this.blame(text, found.fault && `${INPUTS[name].symbol}: ${found.fault}.`);
    if (found.fault) return;
    if (found.rigid) {
      this.change({ rigid: true });
      return;
    }
    this.typed[name] = found;
    this.change({ values: { ...values, [name]: found.si }, units: { ...units, [name]: found.unit } });
  }

  commitDeviation(name) {
    const { spread } = this.rows[name];
    const { units, values, std } = this.state;
    const found = readDeviation(name, spread.value, units[name], values[name]);
    this.blame(spread, found.fault && `± of ${INPUTS[name].symbol}: ${found.fault}.`);
    if (!found.fault) this.change({ std: { ...std, [name]: found.si } });
  }

  /** Says what is wrong with an input, or (null) that nothing is. */
  blame(input, fault) {
    if (!fault && !this.faults.has(input)) return;
    if (fault) this.faults.set(input, fault);
    else this.faults.delete(input);
    input.setAttribute("aria-invalid", String(Boolean(fault)));
    for (const { text, spread, fault: place } of Object.values(this.rows)) {
      place.textContent = [text, spread].map((one) => this.faults.get(one)).filter(Boolean).join(" ");
    }
    this.trouble();
  }

  /** Takes a typed text back: another way of setting the value was used. */
  settle(name) {
    if (this.faults.has(this.rows[name].text)) this.blame(this.rows[name].text, null);
  }

  /** Forgets all that is typed and not applied. */
  clear() {
    for (const input of [...this.faults.keys()]) this.blame(input, null);
  }

  /** Shows a state; what is typed and cannot be used stays. */
  sync(state) {
    this.state = state;
    this.rigid.checked = state.rigid;
    for (const name of NAMES) {
      const { row, text, unit, slider, spread } = this.rows[name];
      const [value, chosen, typed] = [state.values[name], state.units[name], this.typed[name]];
      const { offered } = INPUTS[name];
      const options = offered.includes(chosen) ? offered : [...offered, chosen];
      if (unit.options.length !== options.length || unit.value !== chosen) {
        unit.replaceChildren(...options.map((one) => new Option(unitText(one) || "–", one)));
        unit.value = chosen;
      }
      const off = name === "k" && state.rigid;
      for (const input of [text, unit, slider, spread]) input.disabled = off || (input === unit && options.length === 1);
      row.classList.toggle("off", off);
      // all digits that were typed, else as many as are read easily
      const exact = typed && typed.si === value && typed.unit === chosen;
      const shown = exact ? String(typed.value) : show(fromSI(name, chosen, value), 7);
      if (!this.faults.has(text)) text.value = off ? "rigid" : shown;
      if (!this.faults.has(spread)) spread.value = state.std[name] && !off ? show(fromSI(name, chosen, state.std[name]), 5) : "";
      slider.value = value > 0 ? Math.round(STEPS * Math.log10(value)) : slider.min;
      slider.setAttribute("aria-valuetext", `${shown} ${unitText(chosen)}`.trim());
    }
  }
}
