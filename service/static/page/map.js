// The map: µ/µ₀ over ṽ and ỹ with the user's point, which can be dragged.
import { Channel } from "./ask.js";
import d3 from "./d3.js";
import { $, attribute, write } from "./dom.js";
import { caseOf, inputsOf } from "./state.js";
import { Plot } from "./plot.js";
import { get } from "./service.js";
import { inLine } from "./number.js";
import { about, inPrint, inUnit, inWords, show, toUnit, unitAt, whole } from "./words.js";

const { contours } = d3;

const DIGITS = 27; // pixels of a number of the legend
const DIGIT = 7; // pixels of a figure beside the line of a target
const NEAR = 7; // pixels from the user's point, within which its own number is read
const SLIM = 360; // pixels of a map, below which it has no axis to the right
const KEY = 340; // pixels of a frame, from which its key stands beside the title of its axis

/** The relative deviation of an input; 0 where it has none. */
const deviationOf = (one) => (one?.std ? one.std / one.value : 0);

const PALE = 0.5; // of µ/µ₀, from which the map is so pale that words on it are dark
/** The powers of the inputs in ṽ, and in ỹ by the input that is shaken. */
const SPEED = { v0: 1, k: 1, mu0: -1, Fz: -1, f: -1 };
const AMPLITUDE = {
  y0: { y0: 1, k: 1, mu0: -1, Fz: -1 },
  Fz_amplitude: { Fz_amplitude: 1, Fz: -1 },
};

/** `moved({ name: value [SI] })` takes values of the point; `loaded()` hears of a new map. */
export function mapPanel(store, moved, loaded) {
  let map, answer, target;
  let pointer = null; // where it is in the plot
  const plot = new Plot($("map"), paint, mark);
  const amplitude = () => inputsOf(store.state)[3];
  const channel = new Channel(
    (kind) => get(`static/page/map.json?${new URLSearchParams(kind)}`),
    (data, { contact, direction }) => {
      map = { ...data, contact, direction };
      const ends = [Math.min, Math.max].map((end) => end(...data.mu_ratio) * data.unit);
      [map.least, map.most] = ends;
      plot.redraw();
      map.shades = contours().size([data.v_tilde.n, data.y_tilde.n]).thresholds(data.levels)(
        data.mu_ratio.map((one) => one * data.unit),
      );
      loaded();
    },
    (reason, calm) => {
      if (!map || !calm) write("map-read", reason ?? ""); // else it is told beside the number
    },
  );

  /** Where a place of a contour, in cells of the grid, is in the plot. */
  const onPlot = ([column, row]) => [
    plot.box.x + ((column - 0.5) / (map.v_tilde.n - 1)) * plot.box.width,
    plot.box.y + (1 - (row - 0.5) / (map.y_tilde.n - 1)) * plot.box.height,
  ];

  /** A ring of a contour in cells of the grid, as the path of a plot. */
  function outline({ coordinates }) {
    const place = (at) =>
      onPlot(at)
        .map((one) => one.toFixed(1))
        .join(" ");
    return coordinates
      .flat()
      .map((ring) => `M${ring.map(place).join("L")}Z`)
      .join("");
  }

  /** The parts of a contour that do not go along the frame. */
  function within({ coordinates }) {
    const held = ([column, row]) =>
      column > 0 && column < map.v_tilde.n && row > 0 && row < map.y_tilde.n;
    const step = (at, i, ring) =>
      held(at) ? `${i && held(ring[i - 1]) ? "L" : "M"}${onPlot(at).join(" ")}` : "";
    return coordinates.flatMap((rings) => rings.flatMap((ring) => ring.map(step))).join("");
  }

  function paint() {
    if (!map) return;
    const normal = map.direction === "normal";
    plot.axes({
      x: { domain: [map.v_tilde.start, map.v_tilde.stop], log: true, title: "speed ṽ = v₀/(l₀ω)" },
      y: {
        domain: [map.y_tilde.start, map.y_tilde.stop],
        log: map.y_tilde.log,
        title: normal ? "amplitude ỹ = ΔFz/Fz" : "amplitude ỹ = y₀/l₀",
      },
      top: ownSizes() ? 40 : 12,
      right: rightSide(),
      below: 19 + 11 * numberLines() + (isKeyBelow() ? 15 : 0),
      slim: isSlim(),
    });
    const { box, inside, over } = plot;
    const ground = inside.append("rect").attr("class", "shade").style("fill", map.colours[0]);
    ground.attr("x", box.x).attr("y", box.y).attr("width", box.width).attr("height", box.height);
    map.shades.forEach((shade, i) => {
      inside
        .append("path")
        .attr("class", "shade")
        .style("fill", map.colours[i + 1])
        .attr("d", outline(shade));
    });
    plot.rimmed(plot.shape(map.border.filter(([v, y]) => v > 0 && y > 0)), "border");
    if (map.reverse.length) plot.rimmed(plot.shape(map.reverse), "border reverse");
    const at = (u, w) => [box.x + u * box.width, box.y + (1 - w) * box.height];
    // a number gives way to the name of a regime
    for (const [u, w, words] of map.areas)
      plot.area(words, ...at(u, w), `area${ratioAt(u, w) < PALE ? " deep" : ""}`);
    const some = map.labels.filter((_, i) => !isSlim() || i % 2 === 0);
    for (const [level, u, w] of some)
      plot.text(show(level), ...at(u, w), "tag").attr("dy", "0.35em");
    legend(over);
    key(over);
  }

  /** µ/µ₀ at a place of the frame, from 0 to 1 to the right and up: bilinear in the grid. */
  function ratioAt(u, w) {
    const { n } = map.v_tilde;
    const [x, y] = [u * (n - 1), w * (map.y_tilde.n - 1)];
    const column = Math.min(Math.floor(x), n - 2);
    const row = Math.min(Math.floor(y), map.y_tilde.n - 2);
    const between = (a, b, share) => a + (b - a) * share;
    const along = (at) => between(map.mu_ratio[at], map.mu_ratio[at + 1], x - column);
    const at = row * n + column;
    return between(along(at), along(at + n), y - row) * map.unit;
  }

  /** Whether the map has a line of the target. */
  const lined = () => target > map.least && target < map.most;

  /** The line of the target with its number, and the user's point. */
  function mark() {
    if (lined()) {
      const values = map.mu_ratio.map((one) => one * map.unit);
      const shape = contours().size([map.v_tilde.n, map.y_tilde.n]).contour(values, target);
      plot.rimmed(within(shape), "target");
      numbered(shape);
    }
    const size = ownSizes();
    if (size) ownAxes(answer, size);
    if (placeOf(answer)) point(placeOf(answer), answer.inputs);
  }

  /** The number of the target beside its line, where that is farthest to the right in the frame. */
  function numbered({ coordinates }) {
    const { box } = plot;
    const places = coordinates.flat(2).map(onPlot);
    const words = show(target);
    const right = box.x + box.width - 14 - DIGIT * words.length;
    const foot = box.y + box.height - 9;
    const [x, y] = places
      .filter(([x, y]) => x < right && y > box.y + 20 && y < foot)
      .reduce((best, one) => (one[0] > best[0] ? one : best), [-Infinity, 0]);
    if (x > box.x) plot.text(words, x + 8, y + 4, "tag target-number", "start");
  }

  /** Where a case is on the map, null where it has no place. Without oscillation the service has no
   * ṽ, but v₀ has its place on the case's own axis. */
  function placeOf(one) {
    if (!one?.groups) return null;
    const { v_tilde: v, y_tilde: y, l0 } = one.groups;
    const size = l0 * 2 * Math.PI * one.inputs.f.value;
    return { v: v ?? (size > 0 ? one.inputs.v0.value / size : Infinity), y: y ?? Infinity };
  }

  /** The speed and the amplitude of a case where ṽ and ỹ are 1 [SI]. */
  const sizes = ({ groups: { l0 }, inputs }) => ({
    v0: l0 * 2 * Math.PI * inputs.f.value,
    y0: l0,
    Fz_amplitude: inputs.Fz.value,
  });

  /** Those of the answer, null where it has no axes of its own on this map. */
  function ownSizes() {
    if (!answer?.groups) return null;
    if (answer.state.direction !== map.direction) return null;
    const size = sizes(answer);
    return size.v0 > 0 && size[inputsOf(answer.state)[3]] > 0 ? size : null;
  }

  /** The axes of this case, in the units that were typed; 0 has that of the axis. */
  function ownAxes(one, size) {
    const axis = (name, { start, stop, log }) => {
      const unit = unitAt(name, one.inputs[name].value || size[name], one.inputs[name].unit);
      const domain = [start, stop].map((end) => toUnit(name, end * size[name], unit));
      return { domain, log, title: `${about.inputs[name].symbol} [${inPrint(unit)}]` };
    };
    const up = inputsOf(one.state)[3];
    plot.outerAxes({ x: axis("v0", map.v_tilde), y: isSlim() ? null : axis(up, map.y_tilde) });
  }

  const isSlim = () => plot.width < SLIM;
  const rightSide = () => (ownSizes() && !isSlim() ? 62 : 24);
  /** Pixels of the frame, about. */
  const frame = () => plot.width - rightSide() - (isSlim() ? 48 : 56);
  const isKeyBelow = () => frame() < KEY;
  /** Lines for the numbers of the legend. */
  const numberLines = () => (frame() < DIGITS * map.colours.length ? 2 : 1);

  /** What the lines mean, beside the title of the axis or below it. */
  function key(over) {
    const { box } = plot;
    const y = box.y + box.height + (isKeyBelow() ? 49 : 34);
    const sign = (className, left, words) => {
      const group = over.append("g").attr("class", "key");
      group
        .append("path")
        .attr("class", className)
        .attr("d", `M${left} ${y - 4}h22`);
      group
        .append("text")
        .attr("x", left + 27)
        .attr("y", y)
        .text(words);
    };
    sign("border", box.x, "critical speed");
    if (map.reverse.length) sign("border reverse", box.x + box.width - 90, "reverse slip");
  }

  /** The colours and the levels between them, below the map; where they are narrow, every second
   * number is a line lower. */
  function legend(over) {
    const { box } = plot;
    const wide = box.width / map.colours.length;
    const lines = numberLines();
    const top = plot.height - 13 - 11 * lines;
    const group = over.append("g").attr("class", "legend");
    const text = (words, x, y, anchor = "middle") =>
      group.append("text").attr("x", x).attr("y", y).attr("text-anchor", anchor).text(words);
    text("µ/µ₀", box.x - 8, top + 9, "end");
    map.colours.forEach((colour, i) => {
      const left = box.x + i * wide;
      const cell = group.append("rect").attr("x", left).attr("y", top).style("fill", colour);
      cell.attr("width", wide + 0.5).attr("height", 9);
      text(i ? show(map.levels[i - 1]) : "0", left, top + 20 + 11 * (i % lines));
    });
    text("1", box.x + box.width, top + 20);
  }

  const powers = () => [SPEED, AMPLITUDE[amplitude()]];
  const deviations = (inputs) =>
    powers().map((one) => Math.hypot(...Object.keys(one).map((name) => deviationOf(inputs[name]))));

  /** How far the deviation of each input moves a place of the map, in pixels; k, µ₀ and Fz move it
   * along both axes at once. */
  function steps(place, inputs) {
    const scales = [plot.x, plot.y];
    const step = (name) =>
      powers().map((one, i) => {
        const share = (one[name] ?? 0) * deviationOf(inputs[name]);
        const moved = place[i] * (scales[i].base ? Math.exp(share) : 1 + share);
        return share && place[i] > 0 ? scales[i](moved) - scales[i](place[i]) : 0;
      });
    return Object.keys(inputs).map(step);
  }

  /** The user's point, with an ellipse for its deviation and a bar for the interval of k. */
  function point({ v: along, y: up }, inputs) {
    plot.ellipse([along, up], steps([along, up], inputs));
    const { low, high, value } = inputs.k ?? {};
    if (low && high) {
      const at = (k) => [(along * k) / value, map.y_tilde.log ? (up * k) / value : up];
      plot.bar(at(low), at(high));
    }
    plot.point(along, up);
  }

  /** Whether a place is outside of the map. */
  const isOutside = ({ v, y }) =>
    [
      [v, map.v_tilde],
      [y, map.y_tilde],
    ].some(([value, { start, stop }]) => value < start || value > stop);

  /** The user's point in words, with its deviation or over the interval of k. */
  function yourCase() {
    const { inputs } = answer;
    const { v, y } = placeOf(answer);
    const [dv, dy] = deviations(inputs);
    const { low, high, value: k } = inputs.k;
    const said = (at, spread, grows) => {
      if (high > low && grows) return `${show((at * low) / k, 3)} to ${show((at * high) / k, 3)}`;
      return spread ? `${show(at, 3)} ± ${show(at * spread, 2)}` : show(at);
    };
    const mu =
      high > low || answer.std ? `µ = ${inLine(answer)}` : `µ/µ₀ = ${show(answer.mu_ratio)}`;
    const where = isOutside({ v, y }) ? ", outside of this map" : "";
    const place = `ṽ = ${said(v, dv, true)}, ỹ = ${said(y, dy, map.y_tilde.log)}`;
    return `Your case${where}: ${place}, ${mu}`;
  }

  /** Whether a place of the plot is on the user's point, which a drag takes along. */
  function onPoint([x, y]) {
    if (store.dragged || !ownSizes()) return false;
    const own = placeOf(answer);
    return Math.hypot(x - plot.x(own.v), y - plot.y(own.y)) < NEAR;
  }

  /** What stands below the map: at the pointer, else at the user's point. */
  function read(place) {
    pointer = place;
    if (!map) return;
    const at = place && plot.holds(place) && !onPoint(place) ? place : null;
    plot.cross(store.dragged ? null : at);
    if (!at) {
      const line = lined() ? `Dash-dotted line: µ/µ₀ = ${show(target)}.` : "";
      const said = placeOf(answer) ? yourCase() : "";
      write("map-read", whole(line ? `${said.replace(/[^.]$/, "$&.")} ${line}` : said));
      return;
    }
    const [v, y] = [plot.x.invert(at[0]), plot.y.invert(at[1])];
    const { box } = plot;
    const ratio = ratioAt((at[0] - box.x) / box.width, 1 - (at[1] - box.y) / box.height);
    const there = `ṽ = ${show(v, 3)}, ỹ = ${show(y, 3)}, µ/µ₀ ≈ ${show(ratio, 3)}`;
    const size = ownSizes();
    const own = (name, value) => {
      const unit = unitAt(name, value, answer.inputs[name].unit);
      return `${about.inputs[name].symbol} = ${inUnit(name, value, unit, 3)}`;
    };
    const up = size && inputsOf(answer.state)[3]; // an answer may be to another direction
    const words = size ? `${own("v0", v * size.v0)}, ${own(up, y * size[up])}; ` : "";
    write("map-read", whole(`At the pointer: ${words}${there}`));
  }

  /** The values of the case at a place of the map. */
  function pull([x, y]) {
    if (!answer?.groups?.l0) return;
    const size = sizes(answer);
    const place = { v0: plot.x.invert(x), [amplitude()]: plot.y.invert(y) };
    moved(Object.fromEntries(Object.entries(place).map(([name, at]) => [name, at * size[name]])));
  }

  plot.follow({
    read,
    pull,
    grab: (moving) => store.drag(moving),
    step(right, up, factor) {
      if (!answer) return false;
      const names = { v0: right, [amplitude()]: up };
      read(null); // the point has moved, and the pointer has not
      const changed = Object.entries(names).filter(([, way]) => way);
      moved(
        Object.fromEntries(
          changed.map(([name, way]) => [name, answer.inputs[name].value * factor ** way]),
        ),
      );
      return true;
    },
  });
  $("map-image").addEventListener("click", () => map && plot.save(caption(), "friction-map.svg"));
  const caption = () =>
    `${about.choices.contact[map.contact]}, ${about.choices.direction[map.direction]}`;

  let asked;
  let framed = false; // whether the frame has room for the axes of a case
  return (latest, ratio) => {
    if (latest !== answer || ratio !== target) plot.remark();
    [answer, target] = [latest, ratio];
    const own = Boolean(map && ownSizes());
    if (own !== framed) plot.redraw();
    framed = own;
    const { contact, direction } = caseOf(store.state);
    const kind = `${contact} ${direction}`;
    if (asked !== kind) {
      asked = kind;
      channel.push({ contact, direction });
    }
    attribute(
      "map",
      "aria-label",
      answer?.groups
        ? `Map of µ/µ₀. Your point: speed ${show(answer.groups.v_tilde ?? Infinity, 3)}, ` +
            "amplitude " +
            `${show(answer.groups.y_tilde ?? Infinity, 3)}, ${inWords(answer.regime)}.`
        : "Map of µ/µ₀ over dimensionless speed and amplitude",
    );
    read(pointer);
  };
}
