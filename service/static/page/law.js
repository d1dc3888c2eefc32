// The friction law: µ over one input.
import { Channel } from "./ask.js";
import d3 from "./d3.js";
import { $, attribute, tell, write } from "./dom.js";
import { endsOf, inLine, peakOf } from "./number.js";
import { Plot, save } from "./plot.js";
import { post } from "./service.js";
import { caseAround, inputsOf } from "./state.js";
import {
  about,
  friction,
  inPrint,
  inUnit,
  inWords,
  numberOf,
  show,
  toSI,
  toUnit,
  unitAt,
  unitOver,
  whole,
} from "./words.js";

const { area, bisectCenter } = d3;

const POINTS = 241;
const NEAR = 8; // pixels between two marks that are one
const LINE = 16; // pixels of a line of text
const FAR = 0.25; // of the axis of µ: what is drawn above that has an axis that does not begin at 0
const FLAT = 0.03; // of µ: what varies less is drawn over an axis from 0
const EXTREMES = [1e-300, 1e300]; // of a range
const POSITIVE = ["mu0", "Fz", "k"]; // inputs that cannot be 0

/** Where the law is drawn while no range is typed [SI]. */
function usualRange(state, { inputs, limits }) {
  const { along, scale } = state;
  // where the law of a soft and of a rigid contact bends
  const bend = state.contact === "rigid" ? peakOf(inputs) : limits?.v0_crit;
  const marks = [numberOf(inputs[along]), along === "v0" ? bend : null].filter(
    (one) => one > 0 && Number.isFinite(one),
  );
  let [low, high] = about.inputs[along].range.map((exponent) => 10 ** exponent);
  if (marks.length) {
    const exponents = marks.map(Math.log10);
    low = scale === "linear" ? 0 : 10 ** (Math.floor(Math.min(...exponents)) - 2);
    high =
      scale === "linear" ? 2 * Math.max(...marks) : 10 ** (Math.ceil(Math.max(...exponents)) + 1);
  } else if (scale === "linear") low = 0;
  // at Fz the contact lifts off
  if (along === "Fz" && state.direction === "normal")
    low = Math.max(low, 1.01 * inputs.Fz_amplitude.value);
  if (along === "Fz_amplitude") high = Math.min(high, 0.99 * inputs.Fz.value);
  if (scale === "linear" && POSITIVE.includes(along)) low = Math.max(low, 1e-3 * high);
  return [Math.max(low, scale === "linear" ? 0 : EXTREMES[0]), Math.min(high, EXTREMES[1])];
}

/** The question of a law. */
function lawQuestion(state, answer) {
  const { along, scale } = state;
  const [start, stop] = usualRange(state, answer);
  return {
    ...caseAround(state, answer, along, false),
    along,
    start: state.from || start,
    stop: state.to || stop,
    points: POINTS,
    scale,
  };
}

/** What a state says of the case: where the number is an earlier one, the law is its law. */
const inputsAlone = (state) =>
  Object.fromEntries(
    [...Object.keys(about.inputs), "contact", "direction"].map((name) => [name, state[name]]),
  );

/** `moved({ name: value [SI] })` takes a value that was pointed at. */
export function lawPanel(store, moved) {
  let answer, law, target, latest;
  let pointer = null; // where it is in the plot
  let refused = null;
  let waits = false; // where the reason mends itself
  let behind = false; // whether the number belongs to earlier values
  const plot = new Plot($("law"), paint, mark);
  const along = () => law?.along ?? store.state.along;
  /** The unit of the axis: that of the input as it was typed, where the ends of the axis read. */
  const unit = () =>
    unitOver(along(), law?.values[0] ?? 1, law?.values.at(-1) ?? 1, answer?.inputs[along()]?.unit);
  const text = (value) => `${about.inputs[along()].symbol} = ${inUnit(along(), value, unit())}`;
  const heading = () =>
    `${about.inputs[along()].symbol}${unit() === "-" ? "" : ` [${inPrint(unit())}]`}`;
  const channel = new Channel(
    (question) => post("v1/law", question),
    (reply, { scale }) => {
      law = { ...reply, scale };
      for (const id of ["csv", "law-image"]) $(id).disabled = false;
      plot.redraw();
      describe();
    },
    (reason, calm) => {
      [refused, waits] = [reason, calm];
      explain();
    },
  );

  /** Why there is no other law; what the number lacks, too, is told beside the number. */
  function explain() {
    tell("law-status", behind ? "" : refused, waits);
    $("law").classList.toggle("old", behind || refused !== null);
  }

  function describe() {
    const at = (i) => `${show(law.mu_macro.at(i))} at ${text(law.values.at(i))}`;
    const marks = law.border
      .map(({ value }) => `; border of continuous sliding at ${text(value)}`)
      .join("");
    attribute("law", "aria-label", `Friction law from ${at(0)} to ${at(-1)}${marks}.`);
    read(pointer);
  }

  /** µ₀ where the law is drawn: at each value, or one for all of them. */
  const heights = () => (law.along === "mu0" ? law.values : [answer.inputs.mu0.value]);
  /** Both ends of what an interval or a deviation leaves open. */
  function band() {
    const { mu_macro_low: low, mu_macro_high: high } = law ?? {};
    return low ? [low, high] : null;
  }
  /** What is drawn of the case itself. */
  const own = () => (band() ? null : endsOf(answer)) ?? [answer.mu_macro];
  /** The lower end of the axis of µ: 0, or a little below what is drawn where that is far above. */
  function bottom(top) {
    const drawn = [...own(), ...law.mu_static, ...law.mu_macro, ...(band() ?? []).flat()];
    const [least, most] = [Math.min(...drawn), Math.max(...drawn)];
    const bottom = least - 0.15 * (top - least);
    const flat = most - least < FLAT * most;
    return store.state.axis === "zero" || flat || bottom < FAR * top ? 0 : bottom;
  }
  const shown = () => law.values.map((value) => toUnit(law.along, value, unit()));

  function paint() {
    if (!law || !answer) return;
    const top = 1.05 * Math.max(...heights(), ...own(), ...(band()?.[1] ?? law.mu_macro)) || 1;
    const foot = bottom(top);
    const places = shown();
    plot.axes({
      x: { domain: [places[0], places.at(-1)], log: law.scale === "log", title: heading() },
      y: {
        domain: [foot, top],
        log: false,
        title: `friction µ${foot > 0 ? `, axis from ${show(foot, 2)}` : ""}`,
      },
      lines: true,
    });
    if (foot > 0) plot.cut();
    const still = places.map((x, i) => [x, law.mu_static[i]]);
    // at a border the curve may be steep
    const steep = law.border.map(({ value, mu_macro: mu }) => [
      toUnit(law.along, value, unit()),
      mu,
    ]);
    const curve = [...places.map((x, i) => [x, law.mu_macro[i]]), ...steep];
    curve.sort(([a], [b]) => a - b);
    plot.path(still, "still");
    const ends = band();
    if (ends) range(places, ...ends, "band");
    plot.path(curve, "curve");
    for (const line of [curve, still]) plot.avoid(line);
    avoidPoint();
    peak();
    for (const one of law.border) border(one);
    nameStatic(places);
  }

  /** Keeps names clear of the user's point and its bar. */
  function avoidPoint() {
    const { value, low = value, high = value } = answer.inputs[law.along] ?? {};
    if (!(numberOf(answer.inputs[law.along]) > 0)) return;
    const [xs, ys] = [[low, high].map((one) => at(one)), own().map((one) => plot.y(one))];
    plot.lines.push([
      Math.min(...xs) - NEAR,
      Math.min(...ys) - NEAR,
      Math.max(...xs) + NEAR,
      Math.max(...ys) + NEAR,
    ]);
  }

  const at = (value) => plot.x(toUnit(law.along, value, unit()));
  /** Places of a name to the right of an upright line, or to its left, at its ends first. */
  function beside(x, right) {
    const { box } = plot;
    const rows = Array.from(
      { length: Math.max(Math.floor(box.height / LINE), 1) },
      (_, i) => box.y + 12 + LINE * i,
    );
    const end = (y) => Math.min(y - box.y, box.y + box.height - y);
    const ends = rows.toSorted((a, b) => end(a) - end(b));
    return ends.map((y) => ({ x: x + (right ? 4 : -4), y, anchor: right ? "start" : "end" }));
  }

  /** The line of a border, with the regime that begins at it. */
  function border({ value }) {
    const { inside, box } = plot;
    const x = at(value);
    inside.append("path").attr("class", "border").attr("d", `M${x} ${box.y}v${box.height}`);
    plot.lines.push([x - 1, box.y, x + 1, box.y + box.height]);
    const i = law.values.findIndex((one) => one > value);
    const [below, above] = [law.regime.at(i - 1), law.regime.at(i)];
    const right =
      ["continuous", "reverse_slip"].find((one) => one === below || one === above) === above;
    const arrow = (words) => (right ? `${words} →` : `← ${words}`);
    const slides = [below, above].includes("continuous");
    const words = slides ? "sliding all the time" : inWords("reverse_slip");
    const critical = law.along === "v0" && slides;
    const texts = critical
      ? [`critical speed${isPeak(x) ? " = y₀ω" : ""}`, "critical speed", "critical\nspeed"]
      : [arrow(`${words} from here`), arrow(words), arrow(words.replace(/ (?=\S+ \S+$)/, "\n"))];
    // what has an arrow stands on the side that it tells of, where there is room
    const sides = [right, !right].map((one) => beside(x, one));
    for (const places of critical ? [sides.flat()] : sides)
      if (plot.label(texts, places, "mark")) return;
  }

  /** Whether the largest speed of the oscillation is at a place of the axis. */
  const isPeak = (x) => Math.abs(at(peakOf(answer.inputs)) - x) < NEAR;

  /** The largest speed of the oscillation on the axis of v₀, where it is no border. */
  function peak() {
    const speed = law.along === "v0" && peakOf(answer.inputs);
    const { box } = plot;
    if (!(speed > law.values[0] && speed < law.values.at(-1))) return;
    const x = at(speed);
    if (law.border.some(({ value }) => isPeak(at(value)))) return;
    const foot = box.y + box.height;
    plot.over.append("path").attr("class", "rule").attr("d", `M${x} ${foot}v-9`);
    plot.lines.push([x - 1, foot - 9, x + 1, foot]);
    const spots = [...beside(x, true), ...beside(x, false)];
    plot.label(
      ["y₀ω"],
      spots.filter(({ y }) => y > foot - 2 * LINE),
      "note",
    );
  }

  /** Names the dotted line, to the right and beyond the curve where there is room. */
  function nameStatic(places) {
    const spots = places.map((one, i) => {
      const [x, y] = [plot.x(one), plot.y(law.mu_static[i])];
      const below = { x, y: y + 13, anchor: "middle" };
      const above = { x, y: y - 5, anchor: "middle" };
      const higher = { ...above, y: y - 9 };
      return law.mu_static[i] > law.mu_macro[i] ? [above, higher, below] : [below, above, higher];
    });
    plot.label(["static µ"], spots.reverse().flat(), "note");
  }

  /** The line of the target and the user's point. */
  function mark() {
    if (target?.along === law.along) {
      const ends = plot.x.domain();
      plot.path(
        ends.map((x) => [x, target.mu_macro]),
        "target",
      );
    }
    const rigid = law.along === "k" && store.state.contact === "rigid";
    const here = rigid ? Infinity : numberOf(answer.inputs[law.along]);
    if (here === undefined) return;
    const x = toUnit(law.along, here, unit());
    const { low, high } = answer.inputs[law.along];
    const ends = endsOf(answer);
    if (high > low)
      plot.bar(...[low, high].map((end) => [toUnit(law.along, end, unit()), answer.mu_macro]));
    else if (ends) plot.bar(...ends.map((end) => [x, end]));
    plot.point(x, answer.mu_macro);
    nameTarget();
  }

  function nameTarget() {
    if (target?.along !== law.along) return;
    const { box } = plot;
    const y = plot.y(target.mu_macro);
    const right = box.x + box.width - 4;
    const spots = Array.from({ length: 8 }, (_, i) => right - (i / 8) * box.width);
    const at = (x) => [y - 5, y + 13].map((one) => ({ x, y: one, anchor: "end" }));
    plot.label([`target ${show(target.mu_macro)}`], spots.flatMap(at), "note target-number");
  }

  const range = (places, low, high, className) =>
    plot.inside
      .append("path")
      .attr("class", className)
      .attr(
        "d",
        area()
          .x((_, i) => plot.x(places[i]))
          .y0((_, i) => plot.y(low[i]))
          .y1((_, i) => plot.y(high[i]))(places),
      );

  /** The value of the case as its field has it, or both ends of its interval; empty where it has
   * none. */
  function here() {
    const { low, high, unit: typed } = answer?.inputs[law.along] ?? {};
    const { symbol } = about.inputs[law.along];
    const said = (value) => inUnit(law.along, value, unitAt(law.along, value, typed));
    if (high > low) return `${symbol} = ${said(low)} to ${said(high)}`;
    const value = numberOf(answer?.inputs[law.along]);
    return value === undefined ? "" : `${symbol} = ${said(value)}`;
  }

  /** What stands below the law: at the pointer, else at the user's point. */
  function read(place) {
    pointer = place;
    if (!law) return;
    if (!place || !plot.box || !plot.holds(place)) {
      write("law-read", here() && whole(`Your case: ${here()}, µ = ${inLine(answer)}`));
      return;
    }
    const i = bisectCenter(law.values, toSI(law.along, plot.x.invert(place[0]), unit()));
    const there = `${text(law.values[i])}, µ = ${friction(law.mu_macro[i], 4)}`;
    write("law-read", whole(`At the pointer: ${there}, ${inWords(law.regime[i])}`));
  }

  plot.follow({
    read,
    pull: ([x]) => law && moved({ [law.along]: toSI(law.along, plot.x.invert(x), unit()) }),
    grab: (moving) => store.drag(moving),
    step(right, up, factor) {
      const value = numberOf(answer?.inputs[along()]);
      if (!right || value === undefined) return false;
      read(null); // the point has moved, and the pointer has not
      moved({ [along()]: value * factor ** right });
      return true;
    },
  });

  /** All that is drawn, as CSV (RFC 4180), in the units that are shown. */
  function csv() {
    const {
      values,
      k,
      mu_macro,
      mu_static,
      regime,
      mu_macro_low: low,
      mu_macro_high: high,
      std,
    } = law;
    const columns = {
      [heading()]: values.map((value) => Number(toUnit(law.along, value, unit()).toPrecision(15))),
      ...(k && { "k [N/m]": k }),
      "mu_macro [-]": mu_macro,
      "mu_static [-]": mu_static,
      regime,
      ...(low && { "mu_macro_low [-]": low, "mu_macro_high [-]": high }),
      ...(std && { "std [-]": std }),
    };
    const rows = values.map((_, i) => Object.values(columns).map((column) => column[i]));
    return [Object.keys(columns), ...rows].map((cells) => `${cells.join(",")}\r\n`).join("");
  }
  const caption = () =>
    inputsOf(store.state)
      .filter((name) => name !== law.along)
      .map((name) => `${about.inputs[name].symbol} = ${answer.inputs[name]?.text}`)
      .join(", ");
  $("csv").addEventListener(
    "click",
    () => law && save(csv(), "text/csv", `friction-law-${law.along}.csv`),
  );
  $("law-image").addEventListener(
    "click",
    () => law && plot.save(caption(), `friction-law-${law.along}.svg`),
  );

  let ground; // what the curve is drawn on
  return (state, reply, wanted, old) => {
    if (reply !== answer || wanted !== target) plot.remark();
    [answer, target] = [reply, wanted];
    behind = old;
    const drawn = old ? { ...state, ...inputsAlone(reply.state) } : state;
    explain();
    for (const id of ["csv", "law-image"]) $(id).disabled = !law;
    if (!answer) return;
    const below = [unit(), answer.inputs.mu0.value, own(), state.axis].join();
    if (below !== ground) plot.redraw();
    ground = below;
    const question = lawQuestion(drawn, answer);
    const [low, high] = usualRange(drawn, answer);
    const usual = unitOver(state.along, low, high, answer.inputs[state.along]?.unit);
    $("from").placeholder = `auto: ${inUnit(state.along, low, usual, 3)}`;
    $("to").placeholder = `auto: ${inUnit(state.along, high, usual, 3)}`;
    if (law) describe();
    const words = JSON.stringify(question);
    if (words === latest) return;
    latest = words;
    channel.push(question);
  };
}
