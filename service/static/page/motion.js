// Any motion: oscillations in x, y and the load at once, in the place of one; the friction of one
// steady cycle, its forces and its path, and which value of an input gives a wanted mean friction.
import { Channel } from "./ask.js";
import { motionTexts } from "./copy.js";
import d3 from "./d3.js";
import { $, tell, write } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import { list } from "./meanings.js";
import { Plot, circleAt } from "./plot.js";
import { post } from "./service.js";
import { PARTS, inputsOf, motionOf, partsOf, startState, uncertainOf } from "./state.js";
import {
  about,
  asTyped,
  called,
  capital,
  digitsWithin,
  friction,
  inUnit,
  left,
  middleOf,
  percent,
  prefixed,
  prose,
  show,
  whole,
} from "./words.js";

const { extent } = d3;

const MEANINGS = { x: "along", y: "across", normal: "load" };
/** The input whose units an oscillation has. */
const LIKE = { x: "y0", y: "y0", normal: "Fz_amplitude" };
const UNKNOWNS = {
  v0: "v₀",
  k: "k",
  f: "f",
  "x.amplitude": "x amplitude",
  "x.phase": "x phase",
  "y.amplitude": "y amplitude",
  "y.phase": "y phase",
  "normal.amplitude": "ΔFz amplitude",
  "normal.phase": "ΔFz phase",
};
/** What slips, in the words of the contact. */
const SLIPS = {
  spring: "way that the foot of the spring slips in a period",
  ball: "way that the contact of the ball slips in a period, in the mean",
  rigid: "way that the contact slips in a period",
};
/** An oscillation without what makes no difference. */
const plainly = (text) =>
  asTyped(text)
    .replace("at", "@")
    .replace("−", "-")
    .replace(/(deg|°)$/, "")
    .replace(/@0$/, "");
/** The axes of the path. */
const AXES = { x: "x − v₀t [µm]", y: "y [µm]" };
const SLIPPING = 1 - 1e-9; // of the limit of friction, from which a spring slips
const AHEAD = 16; // pixels from the dot of a path to its arrow
const BEYOND = "too large to be written";
const TAKEN = 6; // digits of a value that is taken into the form
const LINE = 14; // pixels between two names

/** `copy(texts, why)` takes the motion as texts. */
export function motionPanel(store, moved, copy) {
  let faults = new Map();
  let refused = null;
  let waits = false; // where the reason mends itself
  let answer, motion, asked, latest, solved, solvedFor, targetRefused, targetWaits;
  const forces = new Plot($("forces"), paintForces);
  const path = new Plot($("path"), paintPath);

  const question = () => ({ ...motionOf(store.state, answer), include: ["inputs"], cycle: true });
  function targetQuestion() {
    const { motion_unknown: unknown, motion_target: target } = store.state;
    const left = unknown.includes(".") ? [] : [unknown];
    return { ...motionOf(store.state, answer, left), unknown, target };
  }
  const answerTo = (body) => post("v1/motion", body);
  function take(reply, body) {
    [motion, asked] = [reply, JSON.stringify(body)];
    const directions = shaken().length;
    $("main").dataset.path = ["none", "line", "plane"][directions];
    $("path-none").hidden = directions > 0;
    const both = motion.contact === "spring" && motion.stick_fraction > 0 && directions > 0;
    for (const hint of ["forces-hint", "path-hint"]) $(hint).hidden = !both;
    forces.redraw();
    path.redraw();
    draw();
  }
  const motions = new Channel(answerTo, take, (reason, calm, reply) => {
    [refused, waits] = [reason, calm];
    faults = new Map((reply?.faults ?? []).map(({ field, reason: why }) => [field, why]));
    if (reply?.refused && !motion) instead.push({ ...question(), ...mended() });
    draw();
  });
  /** Where a link is refused there is no earlier motion: one without what is at fault. */
  const instead = new Channel(
    answerTo,
    (reply, body) => motion ?? take(reply, body),
    () => {},
  );
  const faulty = () => [...new Set([...faults.keys()].map((name) => name.split(",")[0]))];
  const mended = () =>
    Object.fromEntries(faulty().map((name) => [name, startState()[name] || undefined]));
  const targets = new Channel(
    (body) => post("v1/solve-for", body),
    (reply, body) => {
      [solved, solvedFor] = [reply, JSON.stringify(body)];
      draw();
    },
    (reason, calm) => {
      [targetRefused, targetWaits] = [reason, calm];
      draw();
    },
  );

  /** What was understood of an oscillation, where that says more than its text: its terms. */
  function understood(name) {
    const typed = store.state[name].trim();
    const one = motion?.inputs[name];
    if (one?.text !== typed) return "";
    const term = ({ harmonic, amplitude, phase }) =>
      `${harmonic > 1 ? `${harmonic}: ` : ""}${inUnit(LIKE[name], amplitude)} at ${show(phase)}°`;
    const terms = one.harmonics.map(term).join(", ");
    return plainly(terms) === plainly(one.text) ? "" : terms;
  }

  /** Whether a remark stands below the field of an oscillation. */
  const isDoubt = ({ row, field: one }) => row === "units" && PARTS.includes(one);

  /** A doubt about an oscillation as it is typed, in the words of the service. */
  function doubted(name) {
    const { text } = motion?.remarks?.find((one) => isDoubt(one) && one.field === name) ?? {};
    return text && motion.inputs[name]?.text === store.state[name].trim() ? prose(text) : null;
  }

  function field(name) {
    const none = !partsOf(store.state).includes(name);
    const fault = none ? undefined : faults.get(name);
    const doubt = none ? undefined : doubted(name);
    const note = fault ?? doubt ?? "";
    const read = none ? "" : understood(name);
    return html`<div class="field ${fault ? "bad" : doubt ? "doubt" : ""}">
      <label for=${`motion-${name}`}
        ><span class="symbol">${called(name)}</span>
        <span class="label">${MEANINGS[name]}<small>${read}</small></span></label
      >
      <input
        id=${`motion-${name}`}
        name=${name}
        spellcheck="false"
        aria-invalid=${String(fault !== undefined)}
        aria-describedby=${`motion-note-${name}`}
        placeholder=${none ? "not modelled" : "none"}
        title=${none ? about.impossible["ball normal"] : nothing}
        ?disabled=${none}
        .value=${none ? "" : store.state[name]}
      />
      <p id=${`motion-note-${name}`} class="note">${note}</p>
    </div>`;
  }

  /** The number of the motion, and what it says, in the card of the answer. */
  function headline(known, error) {
    const { mu_macro: mu, inputs, stick_fraction: stick } = motion;
    const value = known(mu);
    write("motion-mu", value);
    $("motion-number").classList.toggle("long", value.length > 12);
    const share = value === "0" ? 0 : mu / inputs.mu0.value;
    write("motion-share", share < 0 ? "The motion drives the body forward" : left(percent(share)));
    const parts = stick > 0 && stick < 1 ? `Sticks for ${percent(stick)} of each period` : "";
    write("motion-regime", parts || (stick ? "At rest" : "Continuous sliding"));
    write("short", `µ = ${value}`);
  }

  function numbers() {
    const { error_estimate: error, mu_macro: mu, inputs } = motion;
    const most = store.state.digits === "all" ? 15 : 4;
    const known = (one) =>
      Math.abs(one) <= error ? "0" : friction(one, Math.min(digitsWithin(one, error), most));
    headline(known, error);
    const force = Math.abs(mu) <= error ? 0 : mu * inputs.Fz.value;
    list("motion-values", [
      [
        "µ",
        "mean force along the drag, over Fz; below 0 the motion drives the body along",
        known(mu),
      ],
      ["drag force", "mean force along the drag: µ Fz", prefixed(force, "N")],
      ["µ across", "mean force across it, over Fz", known(motion.mu_lateral)],
      ["sticks", "share of the period", `${show(100 * motion.stick_fraction)} %`],
      ["slip path", SLIPS[motion.contact], amount(motion.slip_path, "m"), BEYOND],
      ["shaker power", "mean, along and across", amount(motion.power, "W"), BEYOND],
      [
        "periods to settle",
        "until a small disturbance has fallen to 1 %",
        motion.periods === null ? "∞: nothing slips" : show(motion.periods),
      ],
      [
        "numerical error",
        "estimate of the numerical error of µ and of µ across",
        `≈ ${show(error, 2)}`,
      ],
    ]);
  }
  const amount = (value, unit) => (value === null ? null : prefixed(value, unit));

  /** The text of an unknown at a value [SI], and what the state becomes with it. */
  function found(unknown, value, digits = TAKEN) {
    const [part, member] = unknown.split(".");
    if (!member)
      return { text: inUnit(unknown, value, undefined, digits), use: { [unknown]: value } };
    const [amplitude, phase] = store.state[part].split("@").map((one) => one.trim());
    const text =
      member === "phase"
        ? `${show(value, digits)} deg`
        : inUnit(LIKE[part], value, undefined, digits);
    const both = member === "phase" ? [amplitude, text] : [text, phase];
    return { text, more: { [part]: both.filter(Boolean).join(" @ ") } };
  }

  function roots() {
    if (!solved) return nothing;
    const { unknown, results, reachable } = solved;
    const [{ roots: all = [], reason }] = results;
    const line = ({ value }) => {
      const { use = {}, more = {} } = found(unknown, value);
      const digits = store.state.digits === "all" ? TAKEN : 4;
      const words = `${UNKNOWNS[unknown]} = ${found(unknown, value, digits).text}`;
      return html`<li>
        <b>${words}</b>
        <button
          class="use"
          type="button"
          aria-label=${`Use ${words}`}
          @click=${() => moved(use, TAKEN, more)}
        >
          Use
        </button>
      </li>`;
    };
    const range = reachable
      ? `; here it can be ${show(reachable.min)} to ${show(reachable.max)}`
      : "";
    return all.length
      ? all.map(line)
      : html`<li>${prose(reason ?? `No value gives that${range}.`)}</li>`;
  }

  /** Deviations of the inputs, or an interval of k, which a motion has not. */
  function withoutDeviations() {
    const body = motionOf(store.state, answer);
    const names = uncertainOf(store.state, answer, body);
    const middle = body.k !== store.state.k && answer && middleOf(answer);
    if (middle) return whole(`Computed at ${middle}, the middle of the interval.`);
    if (!names.length) return "";
    const symbols = names.map((name) => about.inputs[name].symbol).join(", ");
    return `Computed without the standard deviation (±) of ${symbols}: a motion carries none.`;
  }

  function draw() {
    const { state } = store;
    render(PARTS.map(field), $("motion-form"));
    if (motion) numbers();
    render(roots(), $("motion-roots"));
    explain();
    document.querySelector("[data-meanings=motion-values]").disabled = !motion;
    const remarks = (motion?.remarks ?? []).filter((one) => !isDoubt(one));
    const all = [withoutDeviations(), ...remarks.map(({ text }) => capital(prose(text)))].filter(
      Boolean,
    );
    render(
      all.map((words) => html`<li>${words}</li>`),
      $("motion-doubt"),
    );
    $("motion-unknown").value = state.motion_unknown;
    $("motion-target").value = state.motion_target;
    const old = motion && JSON.stringify(question()) !== asked;
    for (const part of document.querySelectorAll(".of-motion"))
      part.classList.toggle("old", Boolean(old));
    const other = Boolean(solved && JSON.stringify(targetQuestion()) !== solvedFor);
    $("motion-roots").classList.toggle("old", other);
    const why = targetRefused && prose(targetRefused);
    tell(
      "motion-target-status",
      why ?? (other ? "This was asked with other values." : ""),
      !why || targetWaits,
    );
    copy(motionTexts(state, answer), !refused);
  }

  /** Why there is no newer number; what is wrong with a field stands beside it. */
  function explain() {
    const names = faulty();
    const fields = [...inputsOf(store.state), ...PARTS];
    const told = names.length > 0 && names.every((name) => fields.includes(name));
    const check = `check ${names.map(called).join(", ")}`;
    const shown = (name) => {
      const { text, value } = motion.inputs[name] ?? { text: "none" };
      return `${called(name)} = ${text ?? inUnit(name, value)}`;
    };
    const whose = motion && `The number shown is that of ${names.map(shown).join(", ")}.`;
    const reason = told ? whole(`${capital(check)}. ${whose ?? ""}`) : prose(refused ?? "");
    tell("motion-status", reason, waits);
    if (refused) write("short", `µ = –, ${told ? check : "no answer"}`);
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
    for (const [from, to, sticking] of runs(cycle))
      if (sticking)
        forces.inside
          .append("rect")
          .attr("class", "sticking")
          .attr("x", forces.x(phase[from]))
          .attr("width", forces.x(phase[to]) - forces.x(phase[from]))
          .attr("y", forces.box.y)
          .attr("height", forces.box.height);
    forces.path(
      [
        [0, 0],
        [1, 0],
      ],
      "rule",
    );
    for (const name of ["Fx", "Fy", "Fz"])
      forces.path(
        phase.map((x, i) => [x, cycle[name][i] ?? NaN]),
        `curve ${name}`,
      );
    // each name beside the end of its curve, a line below the one above it
    let lowest = -Infinity;
    const ends = ["Fx", "Fy", "Fz"].map((name) => [name, forces.y(cycle[name].at(-1) ?? 0) + 4]);
    for (const [name, y] of ends.sort(([, a], [, b]) => a - b)) {
      lowest = Math.max(y, lowest + LINE);
      forces.text(name, forces.width - 26, lowest, `note ${name}`, "start");
    }
  }

  /** The cycle of a spring in parts [from, to, whether it sticks]; of a ball a part sticks nearly
   * always. */
  function runs({ share }) {
    const last = share.length - 1;
    if (motion.contact === "ball") return [[0, last, false]];
    const sticks = share.map((one) => one < SLIPPING);
    const starts = sticks.flatMap((one, i) => (i && one === sticks[i - 1] ? [] : [i]));
    return starts.map((from, i) => [from, Math.min(starts[i + 1] ?? last, last), sticks[from]]);
  }

  /** The directions in which the body is shaken. */
  const shaken = () =>
    ["x", "y"].filter((name) =>
      motion.inputs[name]?.harmonics.some(({ amplitude }) => amplitude > 0),
    );

  /** The way of the upper point without the drag [µm], along and across. */
  function way({ t, x, y }) {
    const drift = (x.at(-1) - x[0]) / t.at(-1);
    return { x: x.map((one, i) => 1e6 * (one - drift * t[i])), y: y.map((one) => 1e6 * one) };
  }

  function paintPath() {
    const cycle = motion?.cycle;
    const names = cycle ? shaken() : [];
    if (!names.length) {
      path.clear();
      return;
    }
    const ways = way(cycle);
    const places = names.length > 1 ? plane(ways) : lane(ways[names[0]], AXES[names[0]]);
    for (const [from, to, sticking] of runs(cycle))
      path.path(places.slice(from, to + 1), `curve${sticking ? " sticks" : ""}`);
    const seen = places.map(([x, y]) => [path.x(x), path.y(y)]);
    path.over
      .append("path")
      .attr("class", "start")
      .attr("d", circleAt(...seen[0], 5));
    // the head of an arrow, so far behind the dot that it is beside it
    const far = (one) => Math.hypot(one[0] - seen[0][0], one[1] - seen[0][1]);
    const i = Math.max(
      seen.findIndex((one) => far(one) > AHEAD),
      1,
    );
    const turn = Math.atan2(seen[i][1] - seen[i - 1][1], seen[i][0] - seen[i - 1][0]);
    path.over
      .append("path")
      .attr("class", "start")
      .attr("d", "M6 0L-6 -6L-6 6Z")
      .attr("transform", `translate(${seen[i]}) rotate(${(turn * 180) / Math.PI})`);
  }

  /** The places of a path in two directions, both axes alike. */
  function plane({ x: along, y: across }) {
    const [length, width] = [along, across].map((one) => Math.max(...one) - Math.min(...one));
    const middle = (one) => (Math.max(...one) + Math.min(...one)) / 2;
    const ratio = Math.max(path.width - 80, 1) / Math.max(path.height - 52, 1);
    const tall = 0.55 * Math.max(length / ratio, width); // the path fills the frame
    const about = (one, half) => [middle(one) - half, middle(one) + half];
    path.axes({
      x: { domain: about(along, tall * ratio), log: false, title: AXES.x },
      y: { domain: about(across, tall), log: false, title: AXES.y },
    });
    return along.map((x, i) => [x, across[i]]);
  }

  /** The places of a path in one direction: there is drawn above back. */
  function lane(way, title) {
    path.axes({
      x: { domain: padded(way), log: false, title },
      y: { domain: [-1, 1], log: false, title: "", bare: true },
    });
    const side = (i) => (way[i + 1] ?? way[1]) >= way[i];
    return way.map((x, i) => [x, side(i) ? 0.5 : -0.5]);
  }

  $("motion-form").addEventListener("submit", (event) => event.preventDefault());
  // a motion with a speed at which it carries the body by itself
  $("conveyor").addEventListener("click", () =>
    store.change({
      ...about.start,
      contact: "spring",
      x: "2 µm @ 90 deg",
      y: "",
      normal: "5 N @ -90 deg",
      motion_unknown: "v0",
      motion_target: "0",
    }),
  );
  for (const form of ["motion-form", "motion-target-form"])
    $(form).addEventListener("change", ({ target: { name, value } }) =>
      store.change({ [name]: value }),
    );
  $("motion-target-form").addEventListener("submit", (event) => {
    event.preventDefault();
    store.change(Object.fromEntries(new FormData($("motion-target-form"))));
    targets.push(targetQuestion());
  });
  render(
    Object.entries(UNKNOWNS).map(([name, words]) => html`<option value=${name}>${words}</option>`),
    $("motion-unknown"),
  );

  /** Computes the motion of a state whose case is answered or refused. */
  return (reply, settled) => {
    answer = reply;
    const body = question();
    const words = JSON.stringify(body);
    if (settled && words !== latest) {
      latest = words;
      motions.push(body);
    }
    draw();
  };
}
