// The controls of the law: along what, from where to where, which curves beside it.
import { INPUTS, NAMES, fromSI, unitText } from "./inputs.js";
import { lawRange, readCurves } from "./lawpanel.js";
import { readValue } from "./read.js";
import { show } from "./show.js";

const $ = (id) => document.getElementById(id);
const ENDS = ["start", "stop"];

export class LawForm {
  /** `change(part of the state)` when something is chosen; `status` says what cannot be used. */
  constructor(change, status) {
    Object.assign(this, { change, status, faults: {} });
    $("along").append(...NAMES.map((name) => new Option(INPUTS[name].symbol, name)));
    $("family").append(new Option("none", ""), ...NAMES.map((name) => new Option(INPUTS[name].symbol, name)));
    $("along").addEventListener("change", () => this.along($("along").value));
    $("scale").addEventListener("change", () => change({ scale: $("scale").value }));
    $("approximations").addEventListener("change", () => change({ approximations: $("approximations").checked }));
    $("family").addEventListener("change", () => this.family($("family").value));
    $("curves").addEventListener("change", () => this.curves());
    ENDS.forEach((end, i) => $(end).addEventListener("change", () => this.end(end, i)));
  }

  along(along) {
    this.forget(...ENDS);
    this.change({ along, range: [null, null], ...(this.state.family === along ? { family: null, curves: [] } : {}) });
  }

  /** Half, once and twice the value, until others are given. */
  family(name) {
    this.forget("curves");
    const value = name && (this.state.values[name] || INPUTS[name].start);
    this.change({ family: name || null, curves: name ? [0.5, 1, 2].map((factor) => Number((factor * value).toPrecision(6))) : [] });
  }

  curves() {
    const { family, units } = this.state;
    const found = readCurves(family, $("curves").value, units[family]);
    this.blame("curves", found.fault && `Curves: ${found.fault}.`);
    if (!found.fault) this.change({ curves: found.values });
  }

  end(end, i) {
    const { along, units, range } = this.state;
    const text = $(end).value.trim();
    const found = text === "" ? { si: null } : readValue(along, text, units[along]);
    const fault = found.rigid ? "give a number" : found.fault;
    this.blame(end, fault && `${end}: ${fault}.`);
    if (!fault) this.change({ range: range.map((old, at) => (at === i ? found.si : old)) });
  }

  blame(id, fault) {
    if (fault) this.faults[id] = fault;
    else delete this.faults[id];
    $(id).setAttribute("aria-invalid", String(Boolean(fault)));
    this.status.set("typed", Object.values(this.faults).join(" "));
  }

  forget(...ids) {
    for (const id of ids) this.blame(id, null);
  }

  /** Shows a state; what is typed and cannot be used stays. */
  sync(state, border) {
    this.state = state;
    $("along").value = state.along;
    $("scale").value = state.scale;
    $("approximations").checked = state.approximations;
    for (const option of $("family").options) option.disabled = option.value === state.along;
    $("family").value = state.family ?? "";
    $("curves-label").hidden = $("curves-hint").hidden = !state.family;
    const text = (name, value) => show(fromSI(name, state.units[name], value), 6);
    if (state.family && !this.faults.curves) $("curves").value = state.curves.map((value) => text(state.family, value)).join("; ");
    $("curves-unit").textContent = state.family ? unitText(state.units[state.family]) : "";
    for (const place of document.querySelectorAll("#law-options .unit")) place.textContent = unitText(state.units[state.along]);
    const range = lawRange(state, border);
    ENDS.forEach((end, i) => {
      $(end).placeholder = text(state.along, range[i]);
      if (!this.faults[end]) $(end).value = state.range[i] === null ? "" : text(state.along, state.range[i]);
    });
  }
}
