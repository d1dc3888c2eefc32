// Typed fields, the form of the inputs, and three panels: solve for an input, k from materials, fit of measured points.
import { Status } from "./ask.js";
import {
  CHOICES, INPUTS, RIGID, about, attempt, caseOf, fromSI, inUnit, inWords, namesOf, powerOf, readPoints, readQuantity,
  readValue, rounded, show, symbolOf, valueOf, within,
} from "./inputs.js";
import { $, Frame, Plot, make } from "./plots.js";
import { post } from "./service.js";

const STEPS = 1000; // of a slider, a decade

/** A typed text: read on Enter and on leaving the field; Escape brings the last good one back. */
export class Field {
  /** `read(text)` -> what `use` takes, or a fault; `blame(fault, empty)` with the reason, or null. */
  constructor(input, read, use, blame) {
    Object.assign(this, { input, told: blame, fault: null, shown: "" });
    input.addEventListener("change", () => {
      const { found, fault = null } = attempt(() => read(input.value));
      this.blame(fault);
      if (fault === null) use(found);
    });
    input.addEventListener("keydown", ({ key }) => {
      if (key !== "Escape") return;
      this.blame(null);
      this.show(this.shown);
    });
  }

  /** Says what is wrong; null forgets what is typed and cannot be used. */
  blame(fault) {
    if (fault === this.fault) return;
    const empty = this.input.value.trim() === "";
    this.fault = fault;
    this.input.setAttribute("aria-invalid", String(fault !== null && !empty));
    this.told(fault, empty);
  }

  /** Shows a text; what is typed and cannot be used stays. */
  show(text) {
    this.shown = text;
    if (!this.fault) this.input.value = text;
  }
}

export class Form {
  /** `set({ name: quantity })`, `change(part of the state)` when something is chosen; `blame(name, fault, empty)`. */
  constructor(set, change, blame) {
    Object.assign(this, { blame, rows: {} });
    this.rigid = make("input", { type: "checkbox", id: "rigid", role: "switch" });
    this.rigid.addEventListener("change", () => set({ k: this.rigid.checked ? RIGID : this.elastic }));
    $("form").append(...Object.keys(INPUTS).map((name) => this.build(name, set)));
    $("form").addEventListener("submit", (event) => event.preventDefault());
    for (const [name, words] of Object.entries(CHOICES)) {
      for (const value of Object.keys(words)) {
        const radio = make("input", { type: "radio", name, value });
        radio.addEventListener("change", () => change({ [name]: value }));
        $(name).append(make("label", {}, radio, value));
      }
    }
  }

  build(name, set) {
    const { label, symbol, range: [low, high] } = INPUTS[name];
    const fault = make("p", { id: `fault-${name}`, class: "fault" });
    const input = make("input", { spellcheck: "false", id: `field-${name}`, "aria-describedby": fault.id });
    const steps = { min: low * STEPS, max: high * STEPS, step: 1 };
    const slider = make("input", { type: "range", id: `slider-${name}`, "aria-label": `${label}, slider`, ...steps });
    const unit = () => this.state.given[name].unit;
    slider.addEventListener("input", () => set({ [name]: rounded(name, 10 ** (slider.value / STEPS), unit(), 4) }));
    const use = (found) => set({ [name]: found });
    const field = new Field(input, (text) => readValue(name, text, unit()), use, (why, empty) => {
      fault.textContent = why && `${symbol}: ${why}.`;
      fault.classList.toggle("bad", why !== null && !empty);
      this.blame(name, why && fault.textContent, empty);
    });
    const rigid = name === "k" && make("label", { class: "switch" }, this.rigid, "rigid (no spring)");
    const row = make("div", { class: "field" }, make("label", { for: input.id }, label), input, slider, rigid, fault);
    this.rows[name] = { row, slider, field };
    return row;
  }

  /** Whether something that is typed cannot be used. */
  get bad() {
    return Object.values(this.rows).some(({ field }) => field.fault !== null);
  }

  /** Takes typed texts back: another way of setting these values was used. */
  settle(names = Object.keys(INPUTS)) {
    for (const name of names) this.rows[name].field.blame(null);
  }

  /** Shows a state. */
  sync(state) {
    this.state = state;
    this.rigid.checked = state.given.k === RIGID;
    if (!this.rigid.checked) this.elastic = state.given.k; // which the switch brings back
    this.elastic ??= readValue("k", INPUTS.k.start);
    this.settle(Object.keys(INPUTS).filter((name) => !namesOf(state).includes(name)));
    for (const [name, { row, slider, field }] of Object.entries(this.rows)) {
      const [quantity, size] = [state.given[name], valueOf(state, name)];
      row.hidden = !namesOf(state).includes(name);
      field.input.disabled = slider.disabled = quantity === RIGID;
      field.show(quantity.text);
      slider.value = size > 0 ? Math.round(STEPS * Math.log10(size)) : slider.min;
      slider.setAttribute("aria-valuetext", `${symbolOf(name, quantity.unit)} = ${quantity.text}`);
    }
    for (const name of Object.keys(CHOICES)) {
      for (const radio of document.getElementsByName(name)) radio.checked = radio.value === state[name];
    }
  }
}

/**
 * A form that asks `path` for what `read(state)` says, and `show(found, asked, state)`s the answer; grey while it would
 * ask for something else.  -> a function that follows the state.
 */
function panel(name, path, read, show) {
  const status = new Status(`${name}-status`, name);
  let state, answered; // the question that the result belongs to, as text
  const compare = () => {
    const { found: now } = attempt(() => read(state));
    if (now) status.set("typed", null);
    const same = !answered || JSON.stringify(now) === answered;
    if (same) status.set(name, null);
    status.set("changed", same ? null : "This was asked with other values.", true);
  };
  const channel = status.channel(name, (asked) => post(path, asked), (found, asked) => {
    answered = JSON.stringify(asked);
    status.answered = true;
    compare();
    $(`${name}-result`).hidden = false;
    show(found, asked, state);
  });
  $(`${name}-form`).addEventListener("submit", (event) => {
    event.preventDefault();
    const { found: asked, fault } = attempt(() => read(state));
    status.set("typed", fault && `${fault}.`);
    if (!fault) channel.push(asked);
  });
  $(`${name}-form`).addEventListener("input", compare);
  return (now) => {
    state = now;
    compare();
  };
}

const items = (texts) => texts.map((text) => make("li", {}, text));

/** Which value of an input gives a wanted friction.  `use({ name: quantity }, more)` takes it, here and below. */
export function solver(use) {
  let names = "";
  const follow = panel("solve", "v1/solve-for", (state) => {
    const [unknown, quantity] = [$("unknown").value, $("quantity").value];
    const { low: target } = within("target", () => readQuantity("mu0", $("target").value, "-"));
    return { ...caseOf(state, [unknown]), unknown, quantity, target, include: powerOf(state) };
  }, ({ unknown, reachable: { min, max }, results: [{ roots, reason }] }, asked, state) => {
    const { unit } = state.given[unknown];
    const none = min === max ? reason : `No value gives that: here it can be ${show(min, 4)} to ${show(max, 4)}.`;
    $("solve-result").replaceChildren(...items(roots.length ? [] : [none]), ...roots.map((root) => {
      const told = `${symbolOf(unknown, unit)} = ${inUnit(unknown, root.value, unit, 6)}`;
      const button = make("button", { "aria-label": `use ${told}` }, "Use");
      button.addEventListener("click", () => use({ [unknown]: rounded(unknown, root.value, unit, 15) }));
      const shaker = root.power ? `, shaker ${inUnit("power", root.power.oscillation)}` : "";
      return make("li", {}, `${told}: µ = ${show(root.mu_macro, 5)}, ${inWords(root.regime)}${shaker}`, button);
    }));
  });
  return (state) => {
    if (names !== String(namesOf(state))) {
      $("unknown").replaceChildren(...namesOf(state).map((name) => new Option(INPUTS[name].label, name)));
      $("unknown").value = namesOf(state)[3]; // the amplitude
    }
    names = String(namesOf(state));
    follow(state);
  };
}

/** k from geometry and materials. */
export function stiffness(use) {
  $("geometry").append(...Object.entries(about.geometries).map(([name, one]) => new Option(one.meaning, name)));
  const shown = Object.entries(about.arguments).filter(([name]) => name !== "Fz"); // which is that of the form
  const rows = shown.map(([name, { unit, meaning, choices }]) => {
    const given = { id: `argument-${name}`, "aria-describedby": `about-${name}`, class: "wide" };
    const input = choices.length ? make("select", given, choices.map((one) => new Option(one)))
      : make("input", { spellcheck: "false", ...given });
    const label = make("label", { for: given.id }, /\w/.test(unit) ? `${name} [${unit}]` : name);
    const told = make("span", { id: `about-${name}`, class: "hint wide" }, meaning);
    return { name, input, row: make("div", { class: "field" }, label, input, told) };
  });
  const belongs = ({ name }) => about.geometries[$("geometry").value].arguments.includes(name);
  const choose = () => rows.forEach((one) => { one.row.hidden = !belongs(one); });
  $("arguments").append(...rows.map(({ row }) => row));
  $("geometry").addEventListener("change", choose);
  choose();
  let last;
  $("stiffness-use").addEventListener("click", () => use(...last));
  return panel("stiffness", "v1/stiffness", (state) => {
    const entries = rows.filter((one) => belongs(one) && one.input.value.trim()).map(({ name, input: { value } }) => {
      const word = about.arguments[name].choices.length || (/^E2?$/.test(name) && /^\s*rigid\s*$/i.test(value));
      const read = () => readQuantity(name, value, about.arguments[name].unit);
      return [name, word ? value.trim().toLowerCase() : within(name, read).low];
    });
    return { geometry: $("geometry").value, Fz: valueOf(state, "Fz"), ...Object.fromEntries(entries) };
  }, ({ k, contact }, { Fz }, state) => {
    const model = contact === "ball" ? "ball (Hertz)" : "one spring";
    $("stiffness-found").textContent = `k = ${inUnit("k", k)} at Fz = ${inUnit("Fz", Fz)}; contact: ${model}`;
    last = [{ k: rounded("k", k, state.given.k.unit, 6) }, about.knows.has("contact") ? { contact } : {}];
  });
}

/** k and µ₀ from measured points. */
export function fit(use) {
  let paint = () => [];
  let last;
  const plot = new Plot($("fit-plot"), (...size) => paint(...size));
  const found = () => [...$("fit-found").children].map((one) => one.textContent).join("; ");
  $("fit-image").addEventListener("click", () => plot.save(found(), "friction-fit.svg"));
  $("fit-use").addEventListener("click", () => use(last));
  return panel("fit", "v1/fit", (state) => {
    const unknowns = $("unknowns").value.split(" ");
    return { ...caseOf(state, ["v0", ...unknowns]), unknowns, ...readPoints($("points").value) };
  }, ({ values, std, interval, solutions, warnings, reduced_chi2: scatter, curve }, asked, { given }) => {
    /** A value of k or µ₀ in the unit of its field; k may be rigid, a bound infinite (null). */
    const text = (name, value, digits = 4) =>
      (value === null || value === "rigid" ? value ?? "∞" : inUnit(name, value, given[name].unit, digits));
    const equals = (name, one) => `${INPUTS[name].symbol} = ${text(name, one[name])}`;
    const lines = Object.keys(values).map((name) => {
      const spread = std[name] === null ? "not determined" : `± ${text(name, std[name], 2)}`;
      return `${equals(name, values)} ${spread} (95 %: ${interval[name].map((end) => text(name, end)).join(" to ")})`;
    });
    const others = solutions.slice(1).map((one) => Object.keys(values).map((name) => equals(name, one)).join(", "));
    lines.push(...others.map((one) => `the points allow as well: ${one}`));
    if (asked.std && scatter !== null) lines.push(`reduced χ² = ${show(scatter, 3)}`);
    $("fit-found").replaceChildren(...items(lines));
    $("fit-warnings").replaceChildren(...items(warnings));
    last = Object.fromEntries(Object.entries(values).map(([name, value]) =>
      [name, value === "rigid" ? RIGID : rounded(name, value, given[name].unit, 6)]));
    paint = (width, height) => picture(width, height, asked, curve, given.v0.unit);
    plot.redraw();
  });
}

/** Points with their standard deviations, the curve of the fit (null: there is none) and its 95 % band. */
function picture(width, height, { v0, mu_macro: mu, std = [] }, curve, unit) {
  const [speeds, at] = [v0, curve?.v0 ?? []].map((column) => column.map((value) => fromSI("v0", value, unit)));
  const [least, most] = [Math.min(...speeds, ...at), Math.max(...speeds, ...at)];
  const log = least > 0 && most > 10 * least;
  const x = { low: log ? least / 1.2 : 0, high: log ? most * 1.2 : 1.05 * most || 1, log, title: `v₀ [${unit}]` };
  const ends = mu.map((one, i) => [one - (std[i] ?? 0), one + (std[i] ?? 0)]);
  const top = 1.06 * Math.max(1e-300, ...ends.flat(), ...(curve?.mu_macro ?? []));
  const frame = new Frame(width, height, x, { low: 0, high: top, title: "µ macro" });
  return [frame.axes(), frame.inside(
    curve && [frame.band(at, curve.low, curve.high), frame.curve(at, curve.mu_macro, "curve")],
    speeds.map((one, i) => [frame.curve([one, one], ends[i], "measured"), frame.dot(one, mu[i], 3.5, "measured")]),
  )];
}
