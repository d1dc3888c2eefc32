// The panel "any motion": oscillations in x, y and the load at once, one steady cycle, and which
// value of an input gives a wanted mean friction.
import { Channel } from "./ask.js";
import { $ } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import { Plot } from "./plot.js";
import { post } from "./service.js";
import { exactCase } from "./state.js";
import { digitsWithin, friction, prefixed, prose, show, typeset } from "./words.js";
const { extent } = globalThis.d3;

const PARTS = {
  x: ["along the drag", "1 µm @ 90 deg"],
  y: ["across it", ""],
  normal: ["of the load", ""],
};
const UNKNOWNS = {
  v0: "v₀",
  k: "k",
  f: "f",
  "x.amplitude": "amplitude along",
  "x.phase": "phase along",
  "y.amplitude": "amplitude across",
  "y.phase": "phase across",
  "normal.amplitude": "amplitude of the load",
  "normal.phase": "phase of the load",
};
const UNITS = { v0: "m/s", k: "N/m", f: "Hz", phase: "°" };

export function motionPanel(store) {
  const typed = Object.fromEntries(Object.entries(PARTS).map(([name, [, text]]) => [name, text]));
  let faults = new Map();
  let answer, motion, solved, asked;
  const forces = new Plot($("forces"), paintForces);
  const path = new Plot($("path"), paintPath);

  /** The motion that is asked: the inputs of the form but y0, and the three oscillations. */
  function question(without = []) {
    const left = ["y0", "Fz_amplitude", ...without];
    const { direction: _, ...body } = exactCase(store.state, answer, left);
    const parts = Object.entries(typed).filter(([, text]) => text.trim());
    return { ...body, ...Object.fromEntries(parts) };
  }
  const report = (status) => (reason, _, reply) => {
    $(status).textContent = reason ? prose(reason) : "";
    faults = new Map((reply?.faults ?? []).map(({ field, reason: why }) => [field, why]));
    draw();
  };
  const motions = new Channel(
    (body) => post("v1/motion", body),
    (reply, body) => {
      [motion, asked] = [reply, JSON.stringify(body)];
      draw();
    },
    report("motion-status"),
  );
  const targets = new Channel(
    (body) => post("v1/solve-for", body),
    (reply) => {
      solved = reply;
      draw();
    },
    report("motion-target-status"),
  );

  function field(name) {
    const [meaning] = PARTS[name];
    const fault = faults.get(name);
    return html`<div class="field ${fault ? "bad" : ""}">
      <label for=${`motion-${name}`}
        >${typeset(name === "normal" ? "ΔFz" : name)} <span class="label">${meaning}</span></label
      >
      <input
        id=${`motion-${name}`}
        spellcheck="false"
        aria-invalid=${String(fault !== undefined)}
        aria-describedby=${`motion-note-${name}`}
        placeholder="none"
        .value=${typed[name]}
        @change=${({ target }) => {
          typed[name] = target.value;
          draw();
        }}
      />
      <p id=${`motion-note-${name}`} class="note">
        ${fault ?? "amplitude, and @ phase in degrees"}
      </p>
    </div>`;
  }

  function numbers() {
    if (!motion) return nothing;
    const { error_estimate: error } = motion;
    const known = (mu) =>
      Math.abs(mu) <= error ? "0" : friction(mu, Math.min(digitsWithin(mu, error), 6));
    const rows = [
      ["µ", "mean force along the drag, over Fz", known(motion.mu_macro)],
      ["µ across", "mean force across it, over Fz", known(motion.mu_lateral)],
      ["± error", "estimate, of both", show(error, 2)],
      ["sticks", "share of the period", `${show(100 * motion.stick_fraction, 3)} %`],
      ["slip path", "of the foot in a period", prefixed(motion.slip_path, "m", 3)],
      ["shaker power", "mean, along and across", prefixed(motion.power, "W", 3)],
      [
        "settles in",
        "periods until a small disturbance has fallen to 1 %",
        show(motion.periods ?? Infinity, 3),
      ],
    ];
    return rows.map(
      ([name, meaning, value]) =>
        html`<div>
          <dt title=${meaning} tabindex="0">${name}</dt>
          <dd>${value}</dd>
        </div>`,
    );
  }

  function roots() {
    if (!solved) return nothing;
    const { unknown, results, reachable } = solved;
    const [{ roots: found = [], reason }] = results;
    const last = unknown.split(".").at(-1);
    const unit = UNITS[unknown] ?? UNITS[last] ?? (unknown.startsWith("normal") ? "N" : "m");
    const text = (value) => (unit === "°" ? `${show(value)}°` : prefixed(value, unit, 5));
    const line = ({ value }) => html`<li><b>${UNKNOWNS[unknown]} = ${text(value)}</b></li>`;
    const range = reachable
      ? `; here it can be ${show(reachable.min)} to ${show(reachable.max)}`
      : "";
    return found.length
      ? found.map(line)
      : html`<li>${prose(reason ?? `No value gives that${range}.`)}</li>`;
  }

  function draw() {
    render(Object.keys(PARTS).map(field), $("motion-fields"));
    render(numbers(), $("motion-values"));
    render(roots(), $("motion-roots"));
    const old = motion && JSON.stringify({ ...question(), cycle: true }) !== asked;
    for (const part of ["motion-values", "forces", "path"])
      $(part).classList.toggle("old", Boolean(old));
    forces.redraw();
    path.redraw();
  }

  function padded(values) {
    const [low, high] = extent(values);
    const room = 0.08 * (high - low || Math.abs(high) || 1);
    return [low - room, high + room];
  }

  /** The three forces over one period. */
  function paintForces() {
    const cycle = motion?.cycle;
    if (!cycle) return;
    const period = cycle.t.at(-1);
    const phase = cycle.t.map((t) => t / period);
    const all = ["Fx", "Fy", "Fz"].flatMap((name) => cycle[name]).filter((one) => one !== null);
    forces.axes({
      x: { domain: [0, 1], log: false, title: "time, in periods" },
      y: { domain: padded([0, ...all]), log: false, title: "force [N]" },
      right: 30,
    });
    forces.path(
      [
        [0, 0],
        [1, 0],
      ],
      "rule",
    );
    for (const name of ["Fx", "Fy", "Fz"]) {
      forces.path(
        phase.map((x, i) => [x, cycle[name][i] ?? NaN]),
        `curve ${name}`,
      );
      forces.text(
        name,
        forces.width - 26,
        forces.y(cycle[name].at(-1) ?? 0) + 4,
        `note ${name}`,
        "start",
      );
    }
  }

  /** The way of the upper point without the drag, both axes alike. */
  function paintPath() {
    const cycle = motion?.cycle;
    if (!cycle) return;
    const drift = (cycle.x.at(-1) - cycle.x[0]) / cycle.t.at(-1);
    const along = cycle.x.map((x, i) => 1e6 * (x - drift * cycle.t[i]));
    const across = cycle.y.map((y) => 1e6 * y);
    const half =
      0.55 * Math.max(...[along, across].map((one) => Math.max(...one) - Math.min(...one)), 1e-9);
    const middle = (one) => (Math.max(...one) + Math.min(...one)) / 2;
    const ratio = Math.max(path.width - 64, 1) / Math.max(path.height - 52, 1);
    const [wide, tall] = ratio > 1 ? [half * ratio, half] : [half, half / ratio];
    path.axes({
      x: {
        domain: [middle(along) - wide, middle(along) + wide],
        log: false,
        title: "x − drag [µm]",
      },
      y: { domain: [middle(across) - tall, middle(across) + tall], log: false, title: "y [µm]" },
    });
    path.path(
      along.map((x, i) => [x, across[i]]),
      "curve",
    );
  }

  $("motion-form").addEventListener("submit", (event) => {
    event.preventDefault();
    motions.push({ ...question(), cycle: true });
  });
  $("motion-target-form").addEventListener("submit", (event) => {
    event.preventDefault();
    const { unknown, target } = Object.fromEntries(new FormData($("motion-target-form")));
    const [part, member] = unknown.split(".");
    targets.push({ ...question(member ? [] : [part]), unknown, target });
  });
  render(
    Object.entries(UNKNOWNS).map(([name, words]) => html`<option value=${name}>${words}</option>`),
    $("motion-unknown"),
  );
  return (latest) => {
    answer = latest;
    draw();
  };
}
