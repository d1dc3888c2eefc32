// The form of the inputs, and three panels: solve for an input, k from materials, fit of measured
// points.
import { Status } from "./ask.js";
import {
  RIGID,
  about,
  attempt,
  caseAround,
  caseOf,
  fromSI,
  inUnit,
  inWords,
  movedAlong,
  namesOf,
  powerOf,
  readPoints,
  readQuantity,
  readValue,
  refuse,
  sentence,
  show,
  symbolOf,
  valueOf,
  within,
} from "./inputs.js";
import { $, Frame, Plot, make } from "./plots.js";
import { post } from "./service.js";

const STEPS = 1000; // of a slider, a decade
/** What a field of materials can hold, while it is empty: a ball of steel. */
const SUCH_AS = {
  radius: "such as 5 mm",
  length: "such as 10 mm",
  E: "steel: 210 GPa",
  nu: "steel: 0.3",
};

/**
 * Shows a quantity in its field; what is typed and cannot be used stays, and is marked unless it is
 * empty.
 */
function fill(input, { text, fault, typed = text }) {
  input.value = typed;
  input.setAttribute("aria-invalid", String(fault !== undefined && typed.trim() !== ""));
}

/** The form: `set({ name: quantity })`, `setSI({ name: value })`; faults go to `status`. */
export function inputForm(set, setSI, status) {
  let state;
  let elastic = about.inputs.k.start; // which the switch of a rigid contact brings back
  const rigid = make("input", { type: "checkbox", id: "rigid", role: "switch" });
  rigid.addEventListener("change", () =>
    set({ k: rigid.checked ? RIGID : readValue("k", elastic) }),
  );
  for (const [name, words] of Object.entries(about.choices)) {
    const radio = (value) =>
      make("label", {}, make("input", { type: "radio", name, value }), value);
    $(name).append(...Object.keys(words).map(radio));
  }
  $("contact").append(make("label", { class: "switch" }, rigid, "rigid"));
  /**
   * Which contact and oscillation there are beside what is chosen; the others cannot be, and why.
   */
  function offer({ contact, direction, k }) {
    const reasons = [];
    for (const [name, kind] of [
      ["contact", (one) => `${one} ${direction}`],
      ["direction", (one) => `${contact} ${one}`],
    ]) {
      for (const radio of $(name).querySelectorAll("[type=radio]")) {
        const reason = about.impossible[kind(radio.value)];
        radio.disabled = reason !== undefined;
        if (reason) reasons.push(reason);
      }
    }
    const body = k === RIGID ? "rigid contact" : about.choices.contact[contact];
    const setUp = `${body}, ${about.choices.direction[direction]}`;
    $("chosen").textContent = reasons[0] ?? `${setUp[0].toUpperCase()}${setUp.slice(1)}.`;
    for (const part of $("sketch").querySelectorAll(".body, .motion")) {
      part.toggleAttribute(
        "hidden",
        !part.matches(`.body.${k === RIGID ? "rigid" : contact}, .motion.${direction}`),
      );
    }
    $("sketch").setAttribute("aria-label", `The set-up: ${setUp}`);
  }
  /**
   * The fields of the exponent of k, each where its question is about Fz, and what holds while they
   * are empty.
   */
  function offerExponent({
    along,
    contact,
    Fz: { low: load, unit },
    stiffness_exponent: exponent,
  }) {
    const usual = about.exponents[contact];
    const without = usual === "0" ? "it is constant" : `it grows as for a ball, m = ${usual}`;
    for (const [id, name] of [
      ["law-section", along],
      ["solve", $("unknown").value],
    ]) {
      for (const part of $(id).querySelectorAll(".exponent")) part.hidden = name !== "Fz";
      for (const part of $(id).querySelectorAll(".no-exponent")) part.hidden = name === "Fz";
      $(id).querySelector(".exponent .usual").textContent =
        `k holds at Fz = ${inUnit("Fz", load, unit)}. Without m ${without}. ` +
        "Rough surfaces: 0.5 to 1.";
      const field = $(id).querySelector("[name=stiffness_exponent]");
      field.placeholder = usual;
      fill(field, exponent);
    }
  }
  $("unknown").addEventListener("input", () => offerExponent(state));
  const options = [
    ["along", "symbol"],
    ["unknown", "label"],
  ].flatMap(([id, word]) => {
    $(id).append(
      ...Object.entries(about.inputs).map(([name, input]) => new Option(input[word], name)),
    );
    return [...$(id).options];
  });
  $("unknown").value = "y0";
  const rows = Object.entries(about.inputs).map(
    ([
      name,
      {
        label,
        note,
        range: [low, high],
      },
    ]) => {
      const fault = make("p", { id: `fault-${name}`, class: "fault" });
      const input = make("input", {
        name,
        spellcheck: "false",
        id: `field-${name}`,
        "aria-describedby": fault.id,
      });
      const steps = { min: low * STEPS, max: high * STEPS, step: 1 };
      const slider = make("input", {
        type: "range",
        id: `slider-${name}`,
        "aria-label": `${label}, slider`,
        ...steps,
      });
      slider.addEventListener("input", () => setSI({ [name]: 10 ** (slider.value / STEPS) }));
      const words = make("label", { for: input.id }, label, note && make("small", {}, note));
      return {
        name,
        row: make("div", { class: "field" }, words, input, slider),
        input,
        slider,
        fault,
      };
    },
  );
  $("messages").append(...rows.map(({ fault }) => fault));
  $("form").append(...rows.map(({ row }) => row));
  return (now) => {
    if (now === state) return; // what is being typed stays
    state = now;
    offer(state);
    rigid.checked = state.k === RIGID;
    if (!rigid.checked) elastic = state.k.text;
    fill($("range"), state.range);
    for (const option of options)
      option.hidden = option.disabled = !namesOf(state).includes(option.value);
    // the other amplitude
    if ($("unknown").selectedOptions[0].disabled) $("unknown").value = namesOf(state)[3];
    offerExponent(state);
    for (const { name, row, input, slider, fault } of rows) {
      const [quantity, size] = [state[name], valueOf(state, name)];
      row.hidden = !namesOf(state).includes(name);
      input.disabled = slider.disabled = quantity === RIGID;
      fill(input, quantity);
      slider.value = size > 0 ? Math.round(STEPS * Math.log10(size)) : slider.min;
      slider.setAttribute("aria-valuetext", `${symbolOf(name, quantity.unit)} = ${quantity.text}`);
      fault.textContent =
        quantity.fault && !row.hidden
          ? `${symbolOf(name, quantity.unit)}: ${sentence(quantity.fault)}`
          : "";
      fault.classList.toggle("bad", input.ariaInvalid === "true");
      status.set(
        `typed ${name}`,
        row.hidden ? "" : fault.textContent,
        input.ariaInvalid === "false",
      );
    }
  };
}

/**
 * A question as text.  Where k grows with Fz, it is the same question at every load along that
 * growth.
 */
function textOf(question) {
  const { Fz, k, stiffness_exponent: exponent, ...others } = question;
  if (exponent === undefined) return JSON.stringify(question);
  return JSON.stringify({ ...others, exponent, k: (k / Fz ** exponent).toPrecision(9) });
}

/**
 * A form that asks `path` for what `read(state)` says; what it `show`s is grey while it would ask
 * something else.
 */
function panel(name, path, read, show) {
  const status = new Status(`${name}-status`, name);
  let state, answered; // the question that the result belongs to, as text
  const compare = () => {
    const { result: now } = attempt(() => read(state));
    if (now) status.set("typed", null);
    const same = !answered || (now && textOf(now) === answered);
    if (same) status.set(name, null);
    status.set("changed", same ? null : "This was asked with other values.", true);
  };
  const channel = status.channel(
    name,
    (question) => post(path, question),
    (answer, question) => {
      answered = textOf(question);
      status.answered = true;
      compare();
      $(`${name}-result`).hidden = false;
      show(answer, question, state);
    },
  );
  $(`${name}-form`).addEventListener("submit", (event) => {
    event.preventDefault();
    const { result: question, fault } = attempt(() => read(state));
    status.set("typed", fault && sentence(fault));
    if (!fault) channel.push(question);
  });
  $(`${name}-form`).addEventListener("input", compare);
  return (now) => {
    state = now;
    compare();
  };
}

/** Shows lines: [text], or [text, ...values] with a button for `use(...values)`. */
const list = (id, lines, use) =>
  $(id).replaceChildren(
    ...lines.map(([text, ...values]) => {
      const button = make("button", { class: "use", "aria-label": `use ${text}` }, "Use");
      button.addEventListener("click", () => use(...values));
      return make("li", {}, text, values.length > 0 && button);
    }),
  );

/** Which value of an input gives a target friction.  `use(changed)` takes it into the state. */
export function solver(use) {
  return panel(
    "solve",
    "v1/solve-for",
    (state) => {
      const { unknown, quantity, target: text } = Object.fromEntries(new FormData($("solve-form")));
      const { low: target } = within("target", () => readQuantity("mu0", text, "-"));
      const { fault } = state.stiffness_exponent;
      if (fault && unknown === "Fz") refuse(`m: ${fault}`);
      return { ...caseAround(state, unknown), unknown, quantity, target, include: powerOf(state) };
    },
    ({ unknown, reachable: { min, max }, results: [{ roots, reason }] }, question, state) => {
      const { unit } = state[unknown];
      const none =
        min === max
          ? reason
          : `No value gives that: here it can be ${show(min, 4)} to ${show(max, 4)}.`;
      const lines = roots.map(({ value, mu_macro: mu, regime, power }) => {
        const root = `${symbolOf(unknown, unit)} = ${inUnit(unknown, value, unit, 6)}`;
        const shaker = power ? `, shaker ${inUnit("power", power.oscillation)}` : "";
        return [
          `${root}: µ = ${show(mu, 5)}, ${inWords(regime)}${shaker}`,
          movedAlong(state, unknown, value, 15),
        ];
      });
      list("solve-result", lines.length ? lines : [[none]], use);
    },
  );
}

/** k from geometry and materials. */
export function stiffness(use) {
  $("geometry").append(
    ...Object.entries(about.geometries).map(([name, one]) => new Option(one.meaning, name)),
  );
  // which is that of the form
  const shown = Object.entries(about.arguments).filter(([name]) => name !== "Fz");
  $("arguments").append(
    ...shown.map(([name, { unit, meaning, choices }]) => {
      const attributes = {
        name,
        id: `argument-${name}`,
        "aria-describedby": `about-${name}`,
        class: "wide",
      };
      const input = choices.length
        ? make(
            "select",
            attributes,
            choices.map((one) => new Option(one)),
          )
        : make("input", { spellcheck: "false", placeholder: SUCH_AS[name] ?? "", ...attributes });
      const label = make(
        "label",
        { for: attributes.id },
        /\w/.test(unit) ? `${name} [${unit}]` : name,
      );
      const hint = make("span", { id: `about-${name}`, class: "hint wide" }, meaning);
      return make("fieldset", { class: "field", name }, label, input, hint);
    }),
  );
  function choose() {
    const names = about.geometries[$("geometry").value].arguments;
    for (const row of $("arguments").children)
      row.disabled = row.hidden = !names.includes(row.name);
  }
  $("geometry").addEventListener("input", choose); // before the form compares
  choose();
  return panel(
    "stiffness",
    "v1/stiffness",
    (state) => {
      // of what is not disabled
      const { geometry, ...typed } = Object.fromEntries(new FormData($("stiffness-form")));
      const entries = Object.entries(typed)
        .filter(([, text]) => text.trim())
        .map(([name, text]) => {
          const { choices, unit } = about.arguments[name];
          const word = choices.length || (/^E2?$/.test(name) && /^\s*rigid\s*$/i.test(text));
          return [
            name,
            word
              ? text.trim().toLowerCase()
              : within(name, () => readQuantity(name, text, unit)).low,
          ];
        });
      return { geometry, Fz: valueOf(state, "Fz"), ...Object.fromEntries(entries) };
    },
    ({ k, contact, warnings }, { Fz }) => {
      const model = contact === "ball" ? "ball (Hertz)" : "one spring";
      const warned = (warnings ?? []).map((text) => `. Warning: ${text}`).join("");
      const line = `k = ${inUnit("k", k)} at Fz = ${inUnit("Fz", Fz)}; contact: ${model}${warned}`;
      list("stiffness-result", [[line, { k }, 6, { contact }]], use);
    },
  );
}

/**
 * k and µ₀ from measured points; `load(case)` takes the case of the example, in the words of an
 * address.
 */
export function fit(use, load) {
  let paint = () => [];
  let caption;
  const plot = new Plot($("fit-plot"), (...size) => paint(...size));
  $("example").title = about.example.label;
  $("example").addEventListener("click", () => {
    $("points").value = about.example.points;
    $("unknowns").value = "k"; // mu0 is one of its columns
    load(about.example.case);
  });
  $("fit-image").addEventListener("click", () => plot.save(caption, "friction-fit.svg"));
  return panel(
    "fit",
    "v1/fit",
    (state) => {
      const points = readPoints($("points").value);
      const unknowns = $("unknowns")
        .value.split(" ")
        .filter((name) => !(name in points)); // a column mu0 needs no fit
      if (!unknowns.length) refuse("µ₀ is a column of the points: choose k as the unknown");
      return { ...caseOf(state, ["v0", ...unknowns]), unknowns, ...points };
    },
    (
      { values, std, interval, solutions, warnings, reduced_chi2: scatter, residuals, curve },
      question,
      state,
    ) => {
      /** A value of k or µ₀ in the unit of its field; k may be rigid, a bound infinite (null). */
      const text = (name, value, digits = 4) =>
        value === null || value === "rigid"
          ? (value ?? "∞")
          : inUnit(name, value, state[name].unit, digits);
      const names = Object.keys(values);
      const equals = (name, one) => `${about.inputs[name].symbol} = ${text(name, one[name])}`;
      const best = names.map((name) => {
        const spread = std[name] === null ? "not determined" : `± ${text(name, std[name], 2)}`;
        const ends = interval[name].map((end) => text(name, end));
        return `${equals(name, values)} ${spread} (95 %: ${ends.join(" to ")})`;
      });
      const lines = [[best.join("; "), values, 6]];
      for (const other of solutions.slice(1)) {
        const solution = Object.fromEntries(names.map((name) => [name, other[name]]));
        lines.push([
          `the points allow as well: ${names.map((name) => equals(name, other)).join(", ")}`,
          solution,
          6,
        ]);
      }
      if (question.std && scatter !== null) lines.push([`reduced χ² = ${show(scatter, 3)}`]);
      caption = lines.map(([line]) => line).join("; ");
      list("fit-lines", lines, use);
      list(
        "fit-warnings",
        warnings.map((line) => [line]),
      );
      paint = (width, height) => picture(width, height, question, curve, residuals, state.v0.unit);
      plot.redraw();
    },
  );
}

/**
 * Points with their standard deviations, the curve of the fit and its 95 % band; where there is
 * none (null), such as with mu0 at each point, a line through the fit at the points.
 */
function picture(width, height, { v0, mu_macro: mu, std = [] }, curve, residuals, unit) {
  const [speeds, at] = [v0, curve?.v0 ?? []].map((column) =>
    column.map((value) => fromSI("v0", value, unit)),
  );
  const fitted = speeds.map((one, i) => [one, mu[i] - residuals[i]]).sort(([a], [b]) => a - b);
  const [least, most] = [Math.min(...speeds, ...at), Math.max(...speeds, ...at)];
  const log = least > 0 && most > 10 * least;
  const x = {
    low: log ? least / 1.2 : 0,
    high: log ? most * 1.2 : 1.05 * most || 1,
    log,
    title: `v₀ [${unit}]`,
  };
  const ends = mu.map((one, i) => [one - (std[i] ?? 0), one + (std[i] ?? 0)]);
  const top = 1.06 * Math.max(1e-300, ...ends.flat(), ...(curve?.mu_macro ?? []));
  const frame = new Frame(width, height, x, { low: 0, high: top, title: "friction µ macro" });
  return [
    frame.axes(),
    frame.inside(
      curve && [frame.band(at, curve.low, curve.high), frame.curve(at, curve.mu_macro, "curve")],
      !curve && frame.curve(...[0, 1].map((i) => fitted.map((one) => one[i])), "curve"),
      speeds.map((one, i) => [
        frame.curve([one, one], ends[i], "measured"),
        frame.dot(one, mu[i], 3.5, "measured"),
      ]),
    ),
  ];
}
