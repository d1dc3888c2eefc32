// The map of mu~ over (v~, y~), and the friction law over one input; both with the user's point.
import { Status } from "./ask.js";
import {
  RIGID, about, caption, caseOf, fromSI, inUnit, inWords, readInterval, readValue, show, symbolOf, toSI, valueOf,
} from "./inputs.js";
import { $, Frame, Plot, label, make, save } from "./plots.js";
import { get, post } from "./service.js";

// [level, colour of what is below it, painted over that of the level before, where along v~ its number stands]; viridis
const SHADES = [
  [Infinity, "#fde725"], [0.99, "#d0e11c", 0.93], [0.95, "#a0da39"], [0.9, "#73d056", 0.82], [0.8, "#4ac16d"],
  [0.7, "#2db27d", 0.7], [0.6, "#1fa187"], [0.5, "#21918c", 0.6], [0.4, "#277f8e"], [0.3, "#2e6e8e", 0.5],
  [0.2, "#365c8d"], [0.1, "#3f4788", 0.4], [0.05, "#46327e"], [0.02, "#481b6d"], [0.01, "#440154", 0.3],
];
const FINE = 1000; // steps from the foot of the map to its top

const isMapped = ({ contact, direction }) => contact === "spring" && direction === "across";

/** A function of a place in shares of the axes, linear between the values of map.json. */
function interpolated({ v_tilde: { n: columns }, y_tilde: { n: rows }, mu_ratio, unit }) {
  return (x, y) => {
    const [u, w] = [x * (columns - 1), y * (rows - 1)];
    const [i, j] = [Math.min(Math.floor(u), columns - 2), Math.min(Math.floor(w), rows - 2)];
    const along = (at) => (1 - u + i) * mu_ratio[at] + (u - i) * mu_ratio[at + 1];
    return unit * ((1 - w + j) * along(j * columns + i) + (w - j) * along((j + 1) * columns + i));
  };
}

/** The map: `set({ name: value [SI] })`, `nudge(name, steps)`; that it cannot be had is told to `status`. */
export function mapPanel(set, nudge, status) {
  let state, answer, data, ratio, shades, frame, point;
  const plot = new Plot($("map"), paint);

  /** How high the ratio falls below a level; in shares of the axes. */
  function crossing(x, level) {
    let up = 0;
    while (up < 1 && ratio(x, up) >= level) up += 1 / FINE;
    return up;
  }

  function read(x, y) {
    if (!frame?.holds(x, y)) return "";
    const [v, a] = [frame.x.value(x), frame.y.value(y)];
    const here = ratio(frame.x.share(v), frame.y.share(a)).toFixed(2);
    return `ṽ = ${show(v, 3)}, ỹ = ${show(a, 3)}: µ/µ₀ ≈ ${here}`;
  }

  /** Moves the point, where there is one: v~ by the speed, y~ by the amplitude. */
  function pick(v, y) {
    const [mu0, Fz, k, omega] = ["mu0", "Fz", "k", "omega"].map((name) => valueOf(state, name));
    const length = (mu0 * Fz) / k; // 0 for a rigid contact
    if (length && omega && isMapped(state)) set({ v0: v * length * omega, y0: y * length });
  }

  /** Marks the point of the answer; says where there is none. */
  function mark() {
    point = null;
    plot.redraw();
    if (!answer) return;
    const { groups: { v_tilde, y_tilde }, asked, mu_ratio, regime } = answer;
    const [v, y] = [v_tilde ?? Infinity, y_tilde ?? Infinity];
    let out = "";
    if (!isMapped(asked)) out = "This map is that of one spring across. It does not hold for what is chosen.";
    else if (asked.k === RIGID) out = "A rigid contact has no point on the map.";
    else if (v_tilde === null && asked.v0.low === 0) out = "A contact at rest has no point on the map.";
    else {
      point = [v, y];
      const away = [["ṽ", v, data?.v_tilde], ["ỹ", y, data?.y_tilde]]
        .filter(([, value, axis]) => value < axis?.start || value > axis?.stop)
        .map(([name, value]) => `${name} = ${show(value, 3)}`).join(", ");
      if (away) out = `The point is outside of this map (${away}): the arrow on the frame points to it.`;
      const here = `speed ${show(v, 3)}, amplitude ${show(y, 3)}, ratio ${show(mu_ratio, 3)}, ${inWords(regime)}`;
      $("map").setAttribute("aria-label", `Map of the friction ratio. The point: ${here}.`);
    }
    $("map-section").classList.toggle("other", !isMapped(asked));
    $("map-out").textContent = out;
  }

  function paint(width, height) {
    if (!data) return [];
    const axis = (name, title) => ({ low: data[name].start, high: data[name].stop, log: true, title });
    const [v, y] = [axis("v_tilde", "dimensionless speed ṽ"), axis("y_tilde", "dimensionless amplitude ỹ")];
    frame = new Frame(width, height, v, y);
    const { x: left, y: top, width: wide, height: tall } = frame.box;
    const border = (kind) => frame.curve(...[0, 1].map((i) => data.border.map((at) => at[i])), kind);
    const at = (text, x, up, kind) => label(text, left + x * wide, top + (1 - up) * tall + 4, kind);
    const shade = ({ colour, heights }) => {
      const edge = heights.map((up, i) => `${left + (i * wide) / (heights.length - 1)} ${top + (1 - up) * tall}`);
      const path = make("path", { d: `M${edge.join("L")}V${top}H${left}Z`, class: "shade" });
      path.style.fill = colour;
      return path;
    };
    return [
      shades.map(shade), frame.axes(false),
      frame.inside(
        SHADES.map(([level, , x]) => x && at(String(level), x, crossing(x, level), "tag")),
        border("border back"), border("border"),
        at("stick–slip", 0.16, 0.3, "tag area"), at("continuous", 0.78, 0.16, "tag area")),
      point && frame.point(...point),
    ];
  }

  plot.follow({
    move: (x, y) => { $("map-read").textContent = read(x, y); },
    pick: (x, y) => frame && pick(frame.x.value(x), frame.y.value(y)),
    step: (right, up) => isMapped(state) && nudge(right ? "v0" : "y0", right || up),
  });
  $("map-image").addEventListener("click", () => plot.save(caption(state), "friction-map.svg"));
  status.channel("map", () => get("static/page/map.json"), (found) => {
    [data, ratio] = [found, interpolated(found)];
    const shares = Array.from({ length: data.v_tilde.n }, (_, i) => i / (data.v_tilde.n - 1));
    shades = SHADES.map(([level, colour]) => ({ colour, heights: shares.map((x) => crossing(x, level)) }));
    mark();
  }).push(null);
  return (...now) => {
    [state, answer] = now;
    mark();
  };
}

const POINTS = 301;
const [LEAST, MOST] = [1e-280, 1e280]; // of what a range that nobody chose is laid around

/** The interval of the swept input: what was chosen, else whole decades around the point and its border. */
function lawRange({ along, scale, range, ...state }, border) {
  if (range.text) return range;
  const { unit, low, high } = state[along];
  const sizes = [low, high, along === "v0" ? border : null].filter((value) => value > 0 && Number.isFinite(value));
  if (!sizes.length) sizes.push(readValue(along, about.inputs[along].start).low);
  const shown = sizes.map((value) => fromSI(along, Math.min(Math.max(value, LEAST), MOST), unit));
  const [least, most] = [Math.min(...shown), Math.max(...shown)];
  const linear = [about.inputs[along].positive ? (least / 100).toPrecision(1) : 0, (4 * most).toPrecision(1)];
  const decades = [`1e${Math.floor(Math.log10(least)) - 2}`, `1e${Math.ceil(Math.log10(most)) + 2}`];
  return readInterval(along, (scale === "linear" ? linear : decades).join(".."), unit);
}

/** The law: `set({ name: value [SI] })`, `nudge(name, steps)`. */
export function lawPanel(set, nudge) {
  let state, answer, asked, law, frame, along, unit;
  let cursor = null;
  const status = new Status("law-status", "law-section");
  const channel = status.channel("law", (request) => post("v1/law", request), (found, { scale }) => {
    law = { ...found, scale };
    status.answered = true;
    tell();
  });
  const plot = new Plot($("law"), paint);
  const shown = (value) => fromSI(along, value, unit);
  const text = (value) => `${symbolOf(along, unit)} = ${inUnit(along, value, unit)}`;
  const heading = () => `${symbolOf(along, unit)}${unit === "-" ? "" : ` [${unit}]`}`;

  /** Says what the law is, in words. */
  function tell() {
    if (law?.along !== along) return;
    read(null);
    const at = (i) => `${show(law.mu_macro.at(i), 4)} at ${text(law.values.at(i))}`;
    const marks = law.border.map(({ value }) => `; border of continuous sliding at ${text(value)}`).join("");
    $("law").setAttribute("aria-label", `Macroscopic friction from ${at(0)} to ${at(-1)}${marks}.`);
  }

  /** Reads the law at an index; null: nowhere. */
  function read(i) {
    cursor = i;
    plot.redraw();
    const told = () => `${text(law.values[i])}: µ = ${show(law.mu_macro[i])}, ${inWords(law.regime[i])}`;
    $("law-read").textContent = i === null ? "" : told();
  }

  function paint(width, height) {
    if (law?.along !== along) return [...$("law").children]; // until there is another one
    const { mu_macro: mu, mu_macro_low: low, mu_macro_high: high, mu_static: still, regime, scale } = law;
    const values = law.values.map(shown);
    const top = 1.06 * Math.max(along === "mu0" ? 0 : valueOf(state, "mu0"), 1e-300, ...(high ?? mu));
    const x = { low: values[0], high: values.at(-1), log: scale === "log", title: heading() };
    frame = new Frame(width, height, x, { low: 0, high: top, title: "µ macro" });
    const { box: { y, height: tall } } = frame;
    const upright = (kind, at) => make("path", { d: `M${at} ${y}v${tall}`, class: kind });
    const places = values.map((value) => frame.x.pixel(value));
    const stick = (at, i) => ({ x: at, y, width: places[i + 1] - at + 0.5, height: tall, class: "stick" });
    const marks = law.border.map(({ value }) => frame.x.pixel(shown(value)));
    return [
      places.slice(0, -1).map((at, i) => (regime[i] === "continuous" ? null : make("rect", stick(at, i)))),
      frame.axes(),
      frame.inside(
        low && frame.band(values, low, high), frame.curve(values, still, "still"), frame.curve(values, mu, "curve")),
      marks.map((at) => {
        const [away, anchor] = at < frame.x.to - 70 ? [5, "start"] : [-5, "end"]; // on the side that has room
        return [upright("mark border", at), label("border", at + away, frame.y.from - 8, "mark", anchor)];
      }),
      label("static", frame.x.from + 5, frame.y.pixel(still[0]) - 4, "tick", "start"),
      cursor !== null && [upright("grid strong", places[cursor]), frame.dot(values[cursor], mu[cursor], 4, "dot")],
      answer && frame.point(shown(valueOf(answer.asked, along)), answer.mu_macro),
    ];
  }

  /** All that is drawn, as CSV (RFC 4180), in the units that are shown. */
  function csv() {
    const { values, mu_macro, mu_static, regime, mu_macro_low: low, mu_macro_high: high } = law;
    const columns = {
      [heading()]: values.map((value) => Number(shown(value).toPrecision(15))), "mu_macro [-]": mu_macro,
      "mu_static [-]": mu_static, regime, ...(low && { "mu_macro_low [-]": low, "mu_macro_high [-]": high }),
    };
    const rows = values.map((_, i) => Object.values(columns).map((column) => column[i]));
    return [Object.keys(columns), ...rows].map((cells) => `${cells.join(",")}\r\n`).join(""); // no cell holds a comma
  }

  plot.follow({
    move: (x) => frame && read(frame.holds(x) ? Math.round((POINTS - 1) * frame.x.share(frame.x.value(x))) : null),
    pick: (x) => frame && set({ [along]: toSI(along, frame.x.value(x), unit) }),
    step: (right) => right && nudge(along, right),
  });
  $("csv").addEventListener("click", () => law && save(csv(), "text/csv", `friction-law-${along}.csv`));
  $("law-image").addEventListener("click", () => law && plot.save(caption(state, along), `friction-law-${along}.svg`));

  return (...now) => {
    [state, answer] = now;
    along = state.along;
    unit = state[along].unit;
    const { text: chosen, low: start, high: stop } = lawRange(state, answer?.limits.v0_crit);
    $("range").placeholder = chosen;
    status.set("typed", state.range.fault && `range: ${state.range.fault}.`);
    tell();
    const request = { ...caseOf(state, [along], true), along, start, stop, points: POINTS, scale: state.scale };
    if (!answer || JSON.stringify(request) === asked) return;
    asked = JSON.stringify(request);
    channel.push(request);
  };
}
