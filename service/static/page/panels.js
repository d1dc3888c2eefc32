// Two panels that fill the form: k from geometry and materials, and k and µ₀ from measured points.
import { Status } from "./ask.js";
import { make } from "./form.js";
import { INPUTS, about, caseOf, fromSI, inUnit, readPoints, readQuantity, show, si, valueOf } from "./inputs.js";
import { Axis, Plot, axes, band, curve, draw, inside, line } from "./plots.js";
import { post } from "./service.js";

const $ = (id) => document.getElementById(id);

/** What is common to both: a form that asks, its status, and a button that takes the result over. */
class Panel {
  constructor(name, take) {
    Object.assign(this, { name, take, found: null, status: new Status(`${name}-status`, name) });
    this.channel = this.status.channel(name, (asked) => post(`v1/${name}`, asked), (found, asked) => {
      this.found = found;
      this.status.answered = true;
      $(`${name}-use`).hidden = false;
      this.show(found, asked);
    });
    $(`${name}-form`).addEventListener("submit", (event) => {
      event.preventDefault();
      const { fault, ...asked } = this.read();
      this.channel.cancel();
      this.status.set(name, null);
      this.status.set("typed", fault && `${fault}.`);
      if (!fault) this.channel.push(asked);
    });
    $(`${name}-form`).addEventListener("input", () => this.found && $(name).classList.add("old"));
    $(`${name}-use`).addEventListener("click", () => take(this.taken(this.found)));
  }

  sync(state) {
    this.state = state;
  }
}

export class StiffnessPanel extends Panel {
  /** `take(part of the state)`. */
  constructor(take) {
    super("stiffness", take);
    $("geometry").append(...Object.entries(about.geometries).map(([name, one]) => new Option(one.meaning, name)));
    $("geometry").addEventListener("change", () => this.build());
    this.build();
  }

  /** The arguments of the chosen geometry; what was typed for another one stays. */
  build() {
    const typed = new Map(this.inputs?.map(({ id, value }) => [id, value]));
    this.names = about.geometries[$("geometry").value].arguments.filter((name) => name !== "Fz");
    this.inputs = this.names.map((name) => {
      const [id, { choices }] = [`argument-${name}`, about.arguments[name]];
      const common = { id, "aria-describedby": `about-${name}` };
      const input = choices.length ? make("select", common, ...choices.map((one) => new Option(one)))
        : make("input", { type: "text", spellcheck: false, ...common });
      input.value = typed.get(id) ?? choices[0] ?? "";
      return input;
    });
    $("arguments").replaceChildren(...this.names.map((name, i) => {
      const { unit, meaning } = about.arguments[name];
      const text = unit.length > 1 || /[a-z]/i.test(unit) ? `${name} [${unit}]` : name;
      const told = make("span", { id: `about-${name}`, className: "hint" }, meaning);
      const input = this.inputs[i];
      return make("div", { className: "argument" }, make("label", { htmlFor: input.id }, text), input, told);
    }));
  }

  /** The question, or { fault }; what is left empty is left out. */
  read() {
    const asked = { geometry: $("geometry").value, Fz: valueOf(this.state, "Fz") };
    for (const [i, name] of this.names.entries()) {
      const { choices, unit } = about.arguments[name];
      const text = this.inputs[i].value.trim();
      if (text === "") continue;
      const rigid = /^E2?$/.test(name) && /^rigid$/i.test(text);
      const read = choices.length || rigid ? text.toLowerCase() : readQuantity(name, text, unit);
      if (read.fault) return { fault: `${name}: ${read.fault}` };
      asked[name] = typeof read === "string" ? read : si(name, read);
    }
    return asked;
  }

  show({ k, contact }, { Fz }) {
    const model = contact === "ball" ? "ball (Hertz)" : "one spring";
    $("stiffness-found").textContent = `k = ${inUnit("k", k)} at Fz = ${inUnit("Fz", Fz)}; contact: ${model}`;
  }

  taken({ k, contact }) {
    const { unit } = this.state.given.k;
    const quantity = { value: Number(fromSI("k", k, unit).toPrecision(6)), unit };
    const kind = about.knows.has("contact") ? { contact } : {};
    return { given: { ...this.state.given, k: quantity }, rigid: false, ...kind };
  }
}

export class FitPanel extends Panel {
  /** `take(part of the state)`. */
  constructor(take) {
    super("fit", take);
    this.plot = new Plot($("fit-plot"), (...size) => this.paint(...size));
  }

  /** The question, or { fault }. */
  read() {
    const unknowns = $("unknowns").value.split(" ");
    return { ...caseOf(this.state, "v0", ...unknowns), unknowns, ...readPoints($("points").value) };
  }

  /** A value of k or µ₀ in the unit of its field; k may be rigid, a bound infinite (null). */
  text(name, value, digits = 4) {
    if (value === null || value === "rigid") return value ?? "∞";
    return inUnit(name, value, this.state.given[name].unit, digits);
  }

  /** A fitted value with its standard deviation and interval. */
  told(name, { values, std, interval }) {
    const [low, high] = interval[name].map((end) => this.text(name, end));
    const spread = std[name] === null ? "not determined" : `± ${this.text(name, std[name], 2)}`;
    return `${INPUTS[name].symbol} = ${this.text(name, values[name])} ${spread} (95 %: ${low} to ${high})`;
  }

  show(found, asked) {
    const { values, solutions, warnings, reduced_chi2: scatter } = found;
    const items = (list) => list.map((text) => make("li", {}, text));
    const names = Object.keys(values);
    const best = names.map((name) => this.told(name, found));
    const other = (one) => names.map((name) => `${INPUTS[name].symbol} = ${this.text(name, one[name])}`).join(", ");
    const beside = solutions.slice(1).map((one) => `the points allow as well: ${other(one)}`);
    if (asked.std && scatter !== null) beside.push(`reduced χ² = ${show(scatter, 3)}`);
    $("fit-found").replaceChildren(...items([...best, ...beside]));
    $("fit-warnings").replaceChildren(...items(warnings));
    for (const id of ["fit-image", "fit-plot"]) $(id).removeAttribute("hidden");
    this.points = asked;
    this.plot.redraw();
  }

  taken({ values }) {
    const numbers = Object.entries(values).filter(([, value]) => value !== "rigid");
    const given = numbers.map(([name, value]) => {
      const { unit } = this.state.given[name];
      return [name, { value: Number(fromSI(name, value, unit).toPrecision(6)), unit }];
    });
    const rigid = "k" in values ? values.k === "rigid" : this.state.rigid;
    return { given: { ...this.state.given, ...Object.fromEntries(given) }, rigid };
  }

  /** Points with their standard deviations, the curve of the fit and its 95 % band. */
  paint(width, height) {
    if (!this.found) return [];
    const { points, found, state: { given: { v0: { unit } } } } = this;
    const fitted = found.curve ?? { v0: [], mu_macro: [], low: [], high: [] }; // there is none at rest
    const speeds = (column) => column.map((value) => fromSI("v0", value, unit));
    const [xs, at] = [speeds(points.v0), speeds(fitted.v0)];
    const [least, most] = [Math.min(...xs, ...at), Math.max(...xs, ...at)];
    const log = least > 0 && most > 10 * least;
    const x = new Axis(log ? least / 1.2 : 0, log ? most * 1.2 : 1.05 * most || 1, log, 58, width - 14);
    const ends = points.mu_macro.map((mu, i) => [-1, 1].map((sign) => mu + sign * (points.std?.[i] ?? 0)));
    const y = new Axis(0, 1.06 * Math.max(1e-300, ...ends.flat(), ...fitted.mu_macro), false, height - 46, 12);
    const [places, levels] = [at.map((one) => x.pixel(one)), (column) => column.map((one) => y.pixel(one))];
    return [
      axes(x, y, `v₀ [${unit}]`, "µ macro"),
      inside(x, y,
        places.length ? band(places, levels(fitted.low), levels(fitted.high)) : null,
        places.length ? curve(places, levels(fitted.mu_macro), { class: "curve" }) : null,
        xs.flatMap((one, i) => [
          line(x.pixel(one), y.pixel(ends[i][0]), x.pixel(one), y.pixel(ends[i][1]), "error"),
          draw("circle", { cx: x.pixel(one), cy: y.pixel(points.mu_macro[i]), r: 3.5, class: "measured" }),
        ])),
    ];
  }

  /** What the picture shows, in words. */
  get caption() {
    return [...$("fit-found").children].map((one) => one.textContent).join("; ");
  }
}
