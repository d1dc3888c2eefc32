// Elements, and what the plots share: an SVG that follows its size, axes with ticks, curves,
// pictures for download.

export const $ = (id) => document.getElementById(id);
const SVG = ["svg", "g", "path", "rect", "circle", "text", "tspan"];

/** An element of HTML or SVG with attributes and children; null children are left out. */
export function make(tag, attributes = {}, ...children) {
  const element = SVG.includes(tag)
    ? document.createElementNS("http://www.w3.org/2000/svg", tag)
    : document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children.flat(Infinity).filter(Boolean));
  return element;
}

export const label = (text, x, y, className = "", anchor = "middle") =>
  make("text", { x, y, class: className, "text-anchor": anchor }, text);

const RAISED = "⁻⁰¹²³⁴⁵⁶⁷⁸⁹";
const power = (exponent) =>
  `10${String(exponent).replace(/./g, (sign) => RAISED["-0123456789".indexOf(sign)])}`;

/** A linear or logarithmic axis from `low` to `high`, drawn between the pixels `from` and `to`. */
class Axis {
  constructor({ low, high, log, title, words = "" }, from, to) {
    Object.assign(this, { low, high, log, title, words, from, to });
    [this.a, this.b] = log ? [Math.log10(low), Math.log10(high)] : [low, high];
  }

  /** Where a value is: 0 at the axis's low end, 1 at its high end. */
  share(value) {
    return ((this.log ? Math.log10(Math.max(value, 0)) : value) - this.a) / (this.b - this.a);
  }

  pixel(value) {
    return this.from + Math.max(this.share(value), -1e3) * (this.to - this.from);
  }

  value(pixel) {
    const x = this.a + ((pixel - this.from) / (this.to - this.from)) * (this.b - this.a);
    return Math.min(Math.max(this.log ? 10 ** x : x, this.low), this.high);
  }

  /** [pixel, label] of the ticks, with `room` pixels for each. */
  ticks(room) {
    const raw = (this.b - this.a) / Math.max(2, Math.floor(Math.abs(this.to - this.from) / room));
    const unit = this.log ? 1 : 10 ** Math.floor(Math.log10(raw));
    const nice = [1, 2, 5, 10].find((factor) => factor * unit >= 0.999 * raw);
    const step = this.log ? Math.max(1, Math.ceil(raw)) : unit * nice;
    const [first, last] = [Math.ceil(this.a / step - 1e-9), Math.floor(this.b / step + 1e-9)];
    return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step).map((at) => [
      this.pixel(this.log ? 10 ** at : at),
      this.log ? power(at) : String(Number(at.toPrecision(6))),
    ]);
  }
}

/**
 * Two axes, { low, high, log, title, words } each, in a plot of this size; what is drawn in them is
 * given by its values.
 */
export class Frame {
  constructor(width, height, x, y) {
    const foot = x.words ? 62 : 46; // words stand below the title of an axis
    const left = y.words ? 74 : 58;
    this.x = new Axis(x, left, width - 14);
    this.y = new Axis(y, height - foot, 12);
    this.box = { x: left, y: 12, width: width - left - 14, height: height - foot - 12 };
  }

  /** Ticks and titles, with lines through the plot or (`grid` false) short ones. */
  axes(grid = true) {
    const { x, y, box } = this;
    const line = (d) => make("path", { d, class: "grid" });
    const upright = (at, text, kind) =>
      make(
        "text",
        { class: kind, transform: `translate(${at} ${box.y + box.height / 2}) rotate(-90)` },
        text,
      );
    return [
      x
        .ticks(56)
        .map(([at, text]) => [
          line(`M${at} ${y.from}V${grid ? y.to : y.from + 4}`),
          label(text, at, y.from + 18, "tick"),
        ]),
      y
        .ticks(36)
        .map(([at, text]) => [
          line(`M${x.from} ${at}H${grid ? x.to : x.from - 4}`),
          label(text, x.from - 7, at + 4, "tick", "end"),
        ]),
      x.words && label(x.words, box.x + box.width / 2, y.from + 54, "words"),
      y.words && upright(30, y.words, "upright words"),
      label(x.title, box.x + box.width / 2, y.from + 38),
      upright(14, y.title, "upright"),
    ];
  }

  /** Whether a place, in pixels, is between the ends of the axes. */
  holds(x, y = this.y.from) {
    return x >= this.x.from && x <= this.x.to && y >= this.y.to && y <= this.y.from;
  }

  /** What is drawn inside of both axes; nothing of it leaves them. */
  inside(...children) {
    const { x, y, width, height } = this.box;
    return make(
      "svg",
      { ...this.box, viewBox: `${x} ${y} ${width} ${height}`, overflow: "hidden" },
      ...children,
    );
  }

  curve(xs, ys, className) {
    const places = xs.map(
      (x, i) => `${this.x.pixel(x).toFixed(2)} ${this.y.pixel(ys[i]).toFixed(2)}`,
    );
    return make("path", { d: `M${places.join("L")}`, class: className });
  }

  band(xs, lows, highs) {
    return this.curve([...xs, ...xs.toReversed()], [...highs, ...lows.toReversed()], "band");
  }

  dot(x, y, r, className) {
    return make("circle", { cx: this.x.pixel(x), cy: this.y.pixel(y), r, class: className });
  }

  /** The user's point; where it is outside, an arrow on the frame that points to it. */
  point(x, y) {
    const at = [this.x.share(x), this.y.share(y)];
    const inside = at.map((share) => Math.min(Math.max(share, 0), 1));
    const [right, up] = at.map((share, i) => Math.sign(Math.trunc(1e9 * (share - inside[i]))));
    const shape = right || up ? "M0 0L-18 -10L-18 10Z" : "M-7 0a7 7 0 1 0 14 0a7 7 0 1 0 -14 0Z";
    const turn = (Math.atan2(-up, right) * 180) / Math.PI;
    const place = [this.x, this.y].map(({ from, to }, i) => from + inside[i] * (to - from));
    return make("path", {
      d: shape,
      class: "point",
      transform: `translate(${place}) rotate(${turn})`,
    });
  }
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const LOOKS = [
  "fill",
  "fill-opacity",
  "stroke",
  "stroke-width",
  "stroke-opacity",
  "stroke-dasharray",
  "stroke-linejoin",
  "font",
  "text-anchor",
  "paint-order",
];

/**
 * An SVG in CSS pixels, filled by `paint(width, height)` -> elements when its size or what it shows
 * changes.
 */
export class Plot {
  constructor(svg, paint) {
    Object.assign(this, { svg, paint });
    new ResizeObserver(() => this.redraw()).observe(svg);
  }

  redraw() {
    cancelAnimationFrame(this.next);
    this.next = requestAnimationFrame(() => {
      const { clientWidth: width, clientHeight: height } = this.svg;
      if (!width || !height) return;
      this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
      this.svg.replaceChildren(...make("svg", {}, this.paint(width, height)).childNodes);
    });
  }

  /**
   * Calls back with the pointer's place: move(x, y), pick(x, y) for click and drag; move() when it
   * leaves; and with the arrow keys: step(right, up), larger with Shift, true if it is of use.
   */
  follow({ move, pick, step }) {
    const { svg } = this;
    const point = ({ buttons, clientX, clientY }) => {
      const { x, y } = svg.getBoundingClientRect();
      (buttons & 1 ? pick : move)(clientX - x, clientY - y);
    };
    svg.addEventListener("pointermove", point);
    svg.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "mouse") svg.setPointerCapture(event.pointerId);
      point(event);
    });
    svg.addEventListener("pointerleave", () => move());
    svg.addEventListener("keydown", (event) => {
      const arrow = ARROWS[event.key]?.map((one) => (event.shiftKey ? 8 * one : one));
      if (arrow && step(...arrow)) event.preventDefault();
    });
  }

  /** Saves the plot as an SVG file on the card's colour, with a line of text below it. */
  save(text, name) {
    const { clientWidth: width, clientHeight: height } = this.svg;
    const size = { width, height: height + 24 };
    const { color: fill, backgroundColor } = getComputedStyle(this.svg.closest("section"));
    const narrow =
      7 * text.length > width - 32
        ? { textLength: width - 32, lengthAdjust: "spacingAndGlyphs" }
        : {};
    const words = {
      x: 16,
      y: height + 12,
      fill,
      "font-family": "sans-serif",
      "font-size": 13,
      ...narrow,
    };
    const back = make("rect", { ...size, fill: backgroundColor });
    const drawn = this.svg.cloneNode(true);
    const [copies, originals] = [drawn, this.svg].map((one) => one.querySelectorAll("*"));
    copies.forEach(({ style }, i) => {
      // which looks the same without the style sheet
      for (const look of LOOKS)
        style.setProperty(look, getComputedStyle(originals[i]).getPropertyValue(look));
    });
    const picture = make("svg", size, back, [...drawn.children], make("text", words, text));
    save(new XMLSerializer().serializeToString(picture), "image/svg+xml", name);
  }
}

/** Saves a text as a file of the user. */
export function save(text, type, name) {
  const href = URL.createObjectURL(new Blob([text], { type }));
  Object.assign(document.createElement("a"), { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), 10_000);
}
