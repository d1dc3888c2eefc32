// The map of mu~ over (v~, y~), and the friction law over one input; both with the user's point.
import { Status } from "./ask.js";
import {
  RIGID,
  about,
  caption,
  caseAround,
  fromSI,
  inUnit,
  inWords,
  readInterval,
  readValue,
  sentence,
  show,
  symbolOf,
  toSI,
  valueOf,
} from "./inputs.js";
import { $, Frame, Plot, label, make, save } from "./plots.js";
import { get, post } from "./service.js";

const NARROW = 280; // of a map: there the name of a regime takes two lines
const FINE = 1000; // steps from the foot of the map to its top
const kindOf = ({ contact, direction }) => `contact=${contact}&direction=${direction}`;

/** A function of a place in shares of the axes, linear between the values of map.json. */
function interpolated({ v_tilde: { n: columns }, y_tilde: { n: rows }, mu_ratio, unit }) {
  return (x, y) => {
    const [u, w] = [x * (columns - 1), y * (rows - 1)];
    const [i, j] = [Math.min(Math.floor(u), columns - 2), Math.min(Math.floor(w), rows - 2)];
    const along = (at) => (1 - u + i) * mu_ratio[at] + (u - i) * mu_ratio[at + 1];
    return unit * ((1 - w + j) * along(j * columns + i) + (w - j) * along((j + 1) * columns + i));
  };
}

/**
 * The map of the chosen contact: `set({ name: value [SI] })`, `nudge(name, steps)`; that it cannot
 * be had is reported to `status`.
 */
export function mapPanel(set, nudge, status) {
  let state, answer, latest, data, frame, point;
  const maps = new Map(); // by kind of contact
  const plot = new Plot($("map"), paint);
  const channel = status.channel(
    "map",
    (kind) => get(`static/page/map.json?${kind}`),
    (grid, kind) => {
      maps.set(kind, prepared(grid));
      mark();
    },
  );

  /** The data of a map with its areas of one colour: how high each ends above a place along v~. */
  function prepared(grid) {
    const ratio = interpolated(grid);
    const shares = Array.from({ length: grid.v_tilde.n }, (_, i) => i / (grid.v_tilde.n - 1));
    const shades = [Infinity, ...grid.levels.toReversed()].map((level, i) => ({
      colour: grid.colours.at(-1 - i),
      heights: shares.map((x) => crossing(ratio, x, level)),
    }));
    return { ...grid, ratio, shades };
  }

  /** How high the ratio falls below a level; in shares of the axes. */
  function crossing(ratio, x, level) {
    let up = 0;
    while (up < 1 && ratio(x, up) >= level) up += 1 / FINE;
    return up;
  }

  function read(x, y) {
    if (!frame?.holds(x, y)) return "";
    const [v, a] = [frame.x.value(x), frame.y.value(y)];
    const here = data.ratio(frame.x.share(v), frame.y.share(a)).toFixed(2);
    return `ṽ = ${show(v, 3)}, ỹ = ${show(a, 3)}: µ/µ₀ ≈ ${here}`;
  }

  const swing = () => (state.direction === "normal" ? "Fz_amplitude" : "y0");

  /** Moves the point, where there is one: v~ by the speed, y~ by the amplitude. */
  function pick(v, y) {
    const [mu0, Fz, k, omega] = ["mu0", "Fz", "k", "omega"].map((name) => valueOf(state, name));
    const length = (mu0 * Fz) / k; // 0 for a rigid contact
    if (length && omega)
      set({ v0: v * length * omega, [swing()]: y * (state.direction === "normal" ? Fz : length) });
  }

  /** Marks the point of the answer on the map of its contact; says where there is none. */
  function mark() {
    data = maps.get(kindOf(state));
    $("map-section").classList.toggle("other", !data);
    point = null;
    plot.redraw();
    if (!answer) return;
    const {
      groups: { v_tilde, y_tilde },
      inputs: { k, v0, ...kind },
      mu_ratio,
      regime,
    } = answer;
    const [v, y] = [v_tilde ?? Infinity, y_tilde ?? Infinity];
    let out = "";
    if (k === RIGID) out = "A rigid contact has no point on the map.";
    else if (v_tilde === null && v0.low === 0) out = "A contact at rest has no point on the map.";
    else if (kindOf(kind) === kindOf(state)) {
      point = [v, y];
      const away = [
        ["ṽ", v, data?.v_tilde],
        ["ỹ", y, data?.y_tilde],
      ]
        .filter(([, value, axis]) => value < axis?.start || value > axis?.stop)
        .map(([name, value]) => `${name} = ${show(value, 3)}`)
        .join(", ");
      if (away)
        out = `The point is outside of this map (${away}): the arrow on the frame points to it.`;
      const [speed, amplitude, ratio] = [v, y, mu_ratio].map((value) => show(value, 3));
      const here = `speed ${speed}, amplitude ${amplitude}, ratio ${ratio}, ${inWords(regime)}`;
      $("map").setAttribute("aria-label", `Map of the friction ratio. The point: ${here}.`);
    }
    $("map-out").textContent = out;
  }

  function paint(width, height) {
    if (!data) return [...$("map").children]; // until there is another one
    const axis = (name, title, words) => {
      const { start: low, stop: high, log } = data[name];
      return { low, high, log, title, words };
    };
    const size = state.direction === "normal" ? "ỹ = ΔFz/Fz" : "ỹ = y₀k/(µ₀Fz)";
    frame = new Frame(
      width,
      height,
      axis("v_tilde", "speed ṽ = v₀k/(µ₀Fzω)", "faster sliding →"),
      axis("y_tilde", `amplitude ${size}`, "larger amplitude →"),
    );
    const { x: left, y: top, width: wide, height: tall } = frame.box;
    const border = frame.curve(...[0, 1].map((i) => data.border.map((at) => at[i])), "border");
    const at = (x, up) => [left + x * wide, top + (1 - up) * tall];
    const shade = ({ colour, heights }) => {
      const edge = heights.map((up, i) => at(i / (heights.length - 1), up).join(" "));
      const path = make("path", { d: `M${edge.join("L")}V${top}H${left}Z`, class: "shade" });
      path.style.fill = colour;
      return path;
    };
    const areas = data.areas.map(([x, up, text]) => {
      const lines = wide < NARROW ? text.split(/ (?=\S+$)/) : [text];
      const [[px, py], half] = [at(x, up), 4.2 * Math.max(...lines.map((line) => line.length)) + 8];
      return [lines, Math.min(Math.max(px, left + half), left + wide - half), py, half];
    });
    const numbers = []; // those that have room
    for (const one of data.labels) {
      const [px, py] = at(one[1], one[2]);
      const free = areas.every(
        ([, x, y, half]) => Math.abs(x - px) > half + 8 || Math.abs(y - 4 - py) > 20,
      );
      if (free && numbers.every(([, x, y]) => Math.hypot(x - px, y - py) > 24))
        numbers.push([one, px, py]);
    }
    /** The number of a level, turned along its line. */
    const number = ([[level, x], ...place]) => {
      const { heights } = data.shades[data.levels.length - data.levels.indexOf(level)];
      const i = Math.min(Math.max(Math.round(x * (heights.length - 1)), 2), heights.length - 3);
      const rise = ((heights[i + 2] - heights[i - 2]) * tall) / ((4 * wide) / (heights.length - 1));
      const turn = (-180 / Math.PI) * Math.atan(rise);
      const text = label(String(level), 0, 4, "tag");
      text.setAttribute("transform", `translate(${place}) rotate(${turn})`);
      return text;
    };
    return [
      frame.inside(data.shades.map(shade)),
      frame.axes(false),
      frame.inside(
        border,
        numbers.map(number),
        areas.map(([lines, x, y]) =>
          lines.map((line, i) => label(line, x, y + 15 * i, "tag area")),
        ),
      ),
      point && frame.point(...point),
    ];
  }

  plot.follow({
    move: (x, y) => {
      $("map-read").textContent = read(x, y);
    },
    pick: (x, y) => frame && pick(frame.x.value(x), frame.y.value(y)),
    step: (right, up) => nudge(right ? "v0" : swing(), right || up),
  });
  $("map-image").addEventListener("click", () => plot.save(caption(state), "friction-map.svg"));
  return (...now) => {
    [state, answer] = now;
    if (latest !== kindOf(state) && !maps.has(kindOf(state))) channel.push(kindOf(state));
    latest = kindOf(state);
    mark();
  };
}

const POINTS = 301;
const [LEAST, MOST] = [1e-280, 1e280]; // of what a range that nobody chose is laid around

/**
 * The interval of the swept input: what was chosen, else whole decades around the point and its
 * border, as far as the contact does not lift off.
 */
function lawRange({ along, scale, range, ...state }, border) {
  if (range.text) return range;
  const { unit, low, high } = state[along];
  const sizes = [low, high, along === "v0" ? border : null].filter(
    (value) => value > 0 && Number.isFinite(value),
  );
  if (!sizes.length) sizes.push(readValue(along, about.inputs[along].start).low);
  const shown = sizes.map((value) => fromSI(along, Math.min(Math.max(value, LEAST), MOST), unit));
  const [least, most] = [Math.min(...shown), Math.max(...shown)];
  const linear = [
    about.inputs[along].positive ? (least / 100).toPrecision(1) : 0,
    (4 * most).toPrecision(1),
  ];
  const decades = [
    `1e${Math.floor(Math.log10(least)) - 2}`,
    `1e${Math.ceil(Math.log10(most)) + 2}`,
  ];
  const ends = (scale === "linear" ? linear : decades).map(Number);
  const near = (name, share) =>
    Number((share * fromSI(name, state[name].low, unit)).toPrecision(3));
  if (along === "Fz" && state.direction === "normal")
    ends[0] = Math.max(ends[0], near("Fz_amplitude", 1.01));
  if (along === "Fz_amplitude") ends[1] = Math.min(ends[1], near("Fz", 0.99));
  return readInterval(along, ends.join(".."), unit);
}

/** The law: `move(name, value [SI])`, `nudge(name, steps)`. */
export function lawPanel(move, nudge) {
  let state, answer, latest, law, frame, along, unit;
  let cursor = null;
  const status = new Status("law-status", "law-section");
  const channel = status.channel(
    "law",
    (request) => post("v1/law", request),
    (reply, { scale }) => {
      law = { ...reply, scale };
      status.answered = true;
      describe();
    },
  );
  const plot = new Plot($("law"), paint);
  const shown = (value) => fromSI(along, value, unit);
  const text = (value) => `${symbolOf(along, unit)} = ${inUnit(along, value, unit)}`;
  const heading = () => `${symbolOf(along, unit)}${unit === "-" ? "" : ` [${unit}]`}`;

  /** Says what the law is, in words. */
  function describe() {
    if (law?.along !== along) return;
    read(null);
    const at = (i) => `${show(law.mu_macro.at(i), 4)} at ${text(law.values.at(i))}`;
    const marks = law.border
      .map(({ value }) => `; border of continuous sliding at ${text(value)}`)
      .join("");
    $("law").setAttribute("aria-label", `Macroscopic friction from ${at(0)} to ${at(-1)}${marks}.`);
  }

  /** Reads the law at an index; null: nowhere. */
  function read(i) {
    cursor = i;
    plot.redraw();
    const reading = () =>
      `${text(law.values[i])}: µ = ${show(law.mu_macro[i])}, ${inWords(law.regime[i])}`;
    $("law-read").textContent = i === null ? "" : reading();
  }

  function paint(width, height) {
    if (law?.along !== along) return [...$("law").children]; // until there is another one
    const {
      mu_macro: mu,
      mu_macro_low: low,
      mu_macro_high: high,
      mu_static: still,
      regime,
      scale,
    } = law;
    const values = law.values.map(shown);
    const top =
      1.06 * Math.max(along === "mu0" ? 0 : valueOf(state, "mu0"), 1e-300, ...(high ?? mu));
    const x = { low: values[0], high: values.at(-1), log: scale === "log", title: heading() };
    frame = new Frame(width, height, x, { low: 0, high: top, title: "friction µ macro" });
    const {
      box: { y, height: tall },
    } = frame;
    const upright = (kind, at) => make("path", { d: `M${at} ${y}v${tall}`, class: kind });
    const places = values.map((value) => frame.x.pixel(value));
    const stick = (at, i) => ({
      x: at,
      y,
      width: places[i + 1] - at + 0.5,
      height: tall,
      class: "stick",
    });
    const marks = law.border.map(({ value }) => frame.x.pixel(shown(value)));
    return [
      places
        .slice(0, -1)
        .map((at, i) => (regime[i] === "continuous" ? null : make("rect", stick(at, i)))),
      frame.axes(),
      frame.inside(
        low && frame.band(values, low, high),
        frame.curve(values, still, "still"),
        frame.curve(values, mu, "curve"),
      ),
      marks.map((at) => {
        // on the side that has room
        const [away, anchor] = at < frame.x.to - 70 ? [5, "start"] : [-5, "end"];
        return [
          upright("mark border", at),
          label("border", at + away, frame.y.from - 8, "mark", anchor),
        ];
      }),
      label(
        "static",
        frame.x.from + 5,
        Math.min(frame.y.pixel(still[0]) + 14, frame.y.from - 5),
        "tick",
        "start",
      ),
      cursor !== null && [
        upright("grid strong", places[cursor]),
        frame.dot(values[cursor], mu[cursor], 4, "dot"),
      ],
      answer && frame.point(shown(valueOf(answer.inputs, along)), answer.mu_macro),
    ];
  }

  /** All that is drawn, as CSV (RFC 4180), in the units that are shown. */
  function csv() {
    const { values, k, mu_macro, mu_static, regime, mu_macro_low: low, mu_macro_high: high } = law;
    const columns = {
      [heading()]: values.map((value) => Number(shown(value).toPrecision(15))),
      ...(k && { "k [N/m]": k }),
      "mu_macro [-]": mu_macro,
      "mu_static [-]": mu_static,
      regime,
      ...(low && { "mu_macro_low [-]": low, "mu_macro_high [-]": high }),
    };
    const rows = values.map((_, i) => Object.values(columns).map((column) => column[i]));
    // no cell holds a comma
    return [Object.keys(columns), ...rows].map((cells) => `${cells.join(",")}\r\n`).join("");
  }

  plot.follow({
    move: (x) =>
      frame &&
      read(frame.holds(x) ? Math.round((POINTS - 1) * frame.x.share(frame.x.value(x))) : null),
    pick: (x) => frame && move(along, toSI(along, frame.x.value(x), unit)),
    step: (right) => right && nudge(along, right),
  });
  $("csv").addEventListener(
    "click",
    () => law && save(csv(), "text/csv", `friction-law-${along}.csv`),
  );
  $("law-image").addEventListener(
    "click",
    () => law && plot.save(caption(state, along), `friction-law-${along}.svg`),
  );

  return (...now) => {
    [state, answer] = now;
    along = state.along;
    unit = state[along].unit;
    const { text: chosen, low: start, high: stop } = lawRange(state, answer?.limits.v0_crit);
    $("range").placeholder = chosen;
    const fault =
      state.stiffness_exponent.fault && along === "Fz"
        ? `m: ${sentence(state.stiffness_exponent.fault)}`
        : null;
    status.set("typed", state.range.fault ? `range: ${sentence(state.range.fault)}` : fault);
    describe();
    const request = {
      ...caseAround(state, along, true),
      along,
      start,
      stop,
      points: POINTS,
      scale: state.scale,
    };
    if (!answer || JSON.stringify(request) === latest) return;
    latest = JSON.stringify(request);
    channel.push(request);
  };
}
