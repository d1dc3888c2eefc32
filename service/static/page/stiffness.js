// The panel "k from materials": a geometry, two bodies, and the k that follows.
import { Channel } from "./ask.js";
import { $ } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import { post } from "./service.js";
import { about, prefixed, prose, typeset } from "./words.js";

const SUCH_AS = { radius: "5 mm", length: "10 mm" };

export function stiffnessPanel(store, moved) {
  const typed = { geometry: "ball" };
  let faults = new Map();
  let answer, asked;
  const question = () => {
    const names = about.geometries[typed.geometry].arguments;
    const filled = names.filter((name) => name !== "Fz" && typed[name]?.trim());
    return {
      geometry: typed.geometry,
      Fz: store.state.Fz,
      ...Object.fromEntries(filled.map((name) => [name, typed[name]])),
    };
  };
  const channel = new Channel(
    (body) => post("v1/stiffness", body),
    (reply, body) => {
      [answer, asked, faults] = [reply, JSON.stringify(body), new Map()];
      $("stiffness-status").textContent = "";
      draw();
    },
    (reason, _, reply) => {
      $("stiffness-status").textContent = reason ?? "";
      faults = new Map((reply?.faults ?? []).map(({ field, reason: why }) => [field, why]));
      draw();
    },
  );

  const change = (name, value) => {
    typed[name] = value;
    draw();
  };

  function field(name) {
    const { unit, meaning, choices } = about.arguments[name];
    const fault = faults.get(name);
    const shared = { id: `argument-${name}` };
    const input = choices.length
      ? html`<select id=${shared.id} @change=${({ target }) => change(name, target.value)}>
          ${choices.map((one) => html`<option ?selected=${typed[name] === one}>${one}</option>`)}
        </select>`
      : html`<input
          id=${shared.id}
          spellcheck="false"
          placeholder=${SUCH_AS[name] ? `such as ${SUCH_AS[name]}` : nothing}
          aria-invalid=${String(fault !== undefined)}
          aria-describedby=${`about-${name}`}
          .value=${typed[name] ?? ""}
          @change=${({ target }) => change(name, target.value)}
        />`;
    return html`<div class="field ${fault ? "bad" : ""}">
      <label for=${shared.id}
        >${typeset(name)} <span class="label">${/\w/.test(unit) ? unit : ""}</span></label
      >
      ${input}
      <p id=${`about-${name}`} class="note">${fault ?? meaning}</p>
    </div>`;
  }

  /** A body of a usual material. */
  function materials(number, E, nu) {
    const take = ({ target }) => {
      const one = about.materials.rows.find(({ name }) => name === target.value);
      if (!one) return;
      Object.assign(typed, { [E]: one.E, [nu]: one.nu });
      draw();
    };
    return html`<div class="field">
      <label for=${`material-${number}`}>body ${number}</label>
      <select id=${`material-${number}`} @change=${take}>
        <option value="">choose a material, or type E and ν</option>
        ${about.materials.rows.map(
          ({ name, E: modulus }) => html`<option value=${name}>${name}, ${modulus}</option>`,
        )}
      </select>
      <p class="note">
        ${number === 2 ? "Left out: both are of one material." : about.materials.source}
      </p>
    </div>`;
  }

  function result() {
    if (!answer) return nothing;
    const model = answer.contact === "ball" ? "ball (Hertz)" : "one spring";
    const k = `${prefixed(answer.k, "N/m")}`;
    const use = () => moved({ k: answer.k }, 6, { contact: answer.contact });
    return html`<li class=${JSON.stringify(question()) === asked ? "" : "old"}>
        <span><b>k = ${k}</b> at Fz = ${store.state.Fz}; contact: ${model}</span>
        <button class="use" aria-label=${`Use k = ${k}`} @click=${use}>Use</button>
      </li>
      ${answer.warnings.map((text) => html`<li class="doubt">${prose(text)}</li>`)}`;
  }

  function draw() {
    const names = about.geometries[typed.geometry].arguments.filter((name) => name !== "Fz");
    const of = (list) => names.filter((name) => list.includes(name)).map(field);
    render(
      html`<div class="field">
          <label for="geometry">contact of</label>
          <select id="geometry" @change=${({ target }) => change("geometry", target.value)}>
            ${Object.entries(about.geometries).map(
              ([name, { meaning }]) =>
                html`<option value=${name} ?selected=${name === typed.geometry}>
                  ${meaning}
                </option>`,
            )}
          </select>
          <p class="note">Fz is that of the form above.</p>
        </div>
        ${of(["radius", "length", "oscillation"])} ${materials(1, "E", "nu")} ${of(["E", "nu"])}
        ${materials(2, "E2", "nu2")} ${of(["E2", "nu2"])}`,
      $("stiffness-fields"),
    );
    render(result(), $("stiffness-result"));
  }

  $("stiffness-form").addEventListener("submit", (event) => {
    event.preventDefault();
    channel.push(question());
  });
  $("stiffness-form").addEventListener("keydown", (event) => {
    if (event.key === "Enter") event.target.dispatchEvent(new Event("change", { bubbles: true }));
  });
  return draw;
}
