// The panel "k from materials": a geometry, two bodies, and the k that follows.
import { Channel } from "./ask.js";
import { $, tell } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import { post } from "./service.js";
import { about, called, inUnit, prefixed, prose } from "./words.js";

const LENGTHS = ["radius", "diameter", "length"];
/** What an empty field may hold, or means. */
const SUCH_AS = {
  radius: "such as 5 mm",
  diameter: "such as 10 mm",
  length: "such as 10 mm",
  E: "such as 210 GPa",
  nu: "such as 0.3",
  E2: "as body 1",
  nu2: "as body 1",
};
const SIZES = ["radius", "diameter"];
/** Of a body, two of which share a row. */
const BODIES = ["E", "nu", "E2", "nu2"];

/** What k is that of. */
const MODELS = { ball: "a ball", spring: "one spring" };
/** What may be left out. */
const OPTIONAL = ["E2", "nu2", "oscillation"];

export function stiffnessPanel(store, moved) {
  const typed = { geometry: "ball", size: "radius" }; // a ball has a radius or a diameter
  let faults = new Map();
  let inputs = {}; // what was understood, by name
  let answer, asked;
  let whole = false; // whether what is missing is told, too
  /** The arguments of the geometry that are typed, with the one that is chosen of radius and
   * diameter. */
  const names = () =>
    about.geometries[typed.geometry].arguments
      .filter((name) => name !== "Fz")
      .map((name) => (name === "radius" ? typed.size : name));
  const isFilled = (name) => Boolean(typed[name]?.trim());
  /** What is missed when k is asked for. */
  const missing = () => names().filter((name) => !isFilled(name) && !OPTIONAL.includes(name));
  const question = () => {
    const filled = names().filter(isFilled);
    return {
      geometry: typed.geometry,
      Fz: store.state.Fz,
      ...Object.fromEntries(filled.map((name) => [name, typed[name]])),
      include: ["inputs"],
    };
  };
  const channel = new Channel(
    (body) => post("v1/stiffness", body),
    (reply, body) => {
      [answer, asked, faults, inputs] = [reply, JSON.stringify(body), new Map(), reply.inputs];
      tell("stiffness-status", "");
      draw();
    },
    (reason, calm, reply) => {
      const all = (reply?.faults ?? []).map(({ field, reason: why }) => [field, why]);
      faults = new Map([
        ...(whole ? missing() : []).map((field) => [field, "is required"]),
        ...all.filter(([field]) => whole || isFilled(field) || field === "Fz"),
      ]);
      inputs = reply?.inputs ?? {};
      const told = [...faults.keys()].every((field) => names().includes(field)); // at the fields
      tell("stiffness-status", reason && !(told && all.length) ? reason : "", calm);
      draw();
    },
  );
  function ask(all) {
    whole = all;
    channel.push(question());
    draw();
  }

  const change = (name, value) => {
    typed[name] = value;
    ask(false);
  };

  /** What was understood of an argument, where that says more than its text. */
  function understood(name) {
    const { text, value, unit } = inputs[name] ?? {};
    if (typeof value !== "number" || text !== typed[name]?.trim()) return "";
    const isLength = LENGTHS.includes(name);
    if (!isLength && about.arguments[name].unit !== "Pa") return "";
    const said = isLength ? inUnit("y0", value, unit, 6) : prefixed(value, "Pa", 6);
    return said.replace(" ", "") === text.replaceAll(" ", "") ? "" : `read as ${said}`;
  }
  /** A doubt about an argument as it is typed now. */
  function doubted(name) {
    const { text } = answer?.remarks?.find(({ field }) => field === name) ?? {};
    return text && JSON.stringify(question()) === asked ? text : undefined;
  }

  function field(name) {
    const { meaning, choices } = about.arguments[name];
    const fault = faults.get(name);
    const doubt = doubted(name);
    // what a body is made of has its meaning at its symbol: its row stays one of 40 px
    const hint = BODIES.includes(name) ? "" : meaning;
    const below = fault ?? doubt ?? (understood(name) || hint);
    const shared = { id: `argument-${name}` };
    const input = choices.length
      ? html`<select id=${shared.id} @change=${({ target }) => change(name, target.value)}>
          ${choices.map((one) => html`<option ?selected=${typed[name] === one}>${one}</option>`)}
        </select>`
      : html`<input
          id=${shared.id}
          spellcheck="false"
          placeholder=${SUCH_AS[name]}
          aria-invalid=${String(fault !== undefined)}
          aria-describedby=${`about-${name}`}
          .value=${typed[name] ?? ""}
          aria-label=${SIZES.includes(name) ? name : nothing}
          @change=${({ target }) => change(name, target.value)}
        />`;
    const title = html`<label for=${shared.id} title=${meaning}
      ><span class="symbol">${called(name)}</span></label
    >`;
    return html`<div
      class="field ${fault ? "bad" : doubt ? "doubt" : ""} ${BODIES.includes(name) ? "" : "wide"}"
    >
      ${SIZES.includes(name) ? size(name) : title} ${input}
      <p id=${`about-${name}`} class="note">${below}</p>
    </div>`;
  }

  /** The choice of radius or diameter; the text stays as it is typed. */
  function size(name) {
    const choose = ({ target }) => {
      const text = typed[name] ?? "";
      Object.assign(typed, { size: target.value, [target.value]: text });
      ask(false);
    };
    return html`<select id="size" aria-label="radius or diameter" @change=${choose}>
      ${SIZES.map((one) => html`<option ?selected=${one === name}>${one}</option>`)}
    </select>`;
  }

  /** A body of a usual material. */
  function materials(number, E, nu) {
    const take = ({ target }) => {
      const one = about.materials.rows.find(({ name }) => name === target.value);
      if (!one) return;
      Object.assign(typed, { [E]: one.E, [nu]: one.nu });
      ask(false);
    };
    const none = !typed[E]?.trim();
    const chosen = about.materials.rows.find((one) => one.E === typed[E] && one.nu === typed[nu]);
    const words = number === 2 && none ? "as body 1" : none ? "choose a material" : "own values";
    return html`<div class="field wide">
      <label for=${`material-${number}`}>body ${number}</label>
      <select id=${`material-${number}`} @change=${take}>
        <option value="" ?selected=${!chosen}>${words}</option>
        ${about.materials.rows.map(
          ({ name, E: modulus }) =>
            html`<option value=${name} ?selected=${name === chosen?.name}>
              ${name}, ${modulus}
            </option>`,
        )}
      </select>
    </div>`;
  }

  function result() {
    if (!answer) return nothing;
    const k = inUnit("k", answer.k);
    const use = () => moved({ k: answer.k }, undefined, { contact: answer.contact });
    const how = `Use, as ${MODELS[answer.contact]}`;
    return html`<li class=${JSON.stringify(question()) === asked ? "" : "old"}>
        <span><b>k = ${k}</b> at Fz = ${store.state.Fz}</span>
        <button class="use" aria-label=${`${how}: k = ${k}`} @click=${use}>${how}</button>
      </li>
      ${answer.warnings.map((text) => html`<li class="doubt">${prose(text)}</li>`)}`;
  }

  function draw() {
    const of = (list) =>
      names()
        .filter((name) => list.includes(name))
        .map(field);
    render(
      html`<div class="field wide">
          <label for="geometry">contact of</label>
          <select id="geometry" @change=${({ target }) => change("geometry", target.value)}>
            ${Object.entries(about.geometries).map(
              ([name, { meaning }]) =>
                html`<option value=${name} ?selected=${name === typed.geometry}>
                  ${meaning}
                </option>`,
            )}
          </select>
        </div>
        ${of([...LENGTHS, "oscillation"])} ${materials(1, "E", "nu")} ${of(["E", "nu"])}
        ${materials(2, "E2", "nu2")} ${of(["E2", "nu2"])}
        <p class="hint wide">
          E is Young's modulus, ν Poisson's ratio; Fz is that of the form. Materials:
          ${about.materials.source}.
        </p>`,
      $("stiffness-fields"),
    );
    render(result(), $("stiffness-result"));
  }

  $("stiffness-form").addEventListener("submit", (event) => {
    event.preventDefault();
    ask(true);
  });
  $("stiffness-form").addEventListener("keydown", (event) => {
    if (event.key === "Enter") event.target.dispatchEvent(new Event("change", { bubbles: true }));
  });
  return draw;
}
