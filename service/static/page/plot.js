// What the plots share: a frame of two axes that follows its size, dragging, arrow keys, pictures
// for download.  Scales, axes, shapes and dragging are those of d3.
import d3 from "./d3.js";

const { axisBottom, axisLeft, axisRight, axisTop, drag, scaleLinear, scaleLog, select, line } = d3;

const DIGIT = 7; // pixels of a figure beside an axis
const NARROW = 240; // pixels of a frame, in which the name of a regime has a line for each word
const RADIUS = 7; // pixels of the user's point
const CAP = 5; // pixels of the cap of a bar, to either side
const BAR = 40; // places of a bar, at which it may lie on a text
const TICKS = 10; // of a linear axis, about, at most
const FLAT = 2; // pixels of half the width of an ellipse, below which it is drawn as a bar
const FINGER = 36; // pixels from the point, within which a finger takes it
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
/** Of an input, by one press of an arrow key; with Shift. */
const STEP = 1.05;
const FINE_STEP = 1.005;
/** Of a drawn element; a saved picture has no style sheet. */
const LOOKS = [
  "fill",
  "fill-opacity",
  "stroke",
  "stroke-width",
  "stroke-opacity",
  "stroke-dasharray",
  "font",
  "text-anchor",
  "paint-order",
  "opacity",
];
const RAISED = {
  "-": "⁻",
  0: "⁰",
  1: "¹",
  2: "²",
  3: "³",
  4: "⁴",
  5: "⁵",
  6: "⁶",
  7: "⁷",
  8: "⁸",
  9: "⁹",
};

/** A power of ten as people write it; other ticks of a logarithmic axis have no number. */
function decade(value) {
  const exponent = Math.log10(value);
  if (Math.abs(exponent - Math.round(exponent)) > 1e-9) return "";
  return `10${[...String(Math.round(exponent))].map((sign) => RAISED[sign]).join("")}`;
}

/** Decades of a logarithmic scale, so many that their numbers have room. */
function decades(scale, most) {
  const [low, high] = scale.domain().map(Math.log10);
  const [first, last] = [Math.ceil(low - 1e-9), Math.floor(high + 1e-9)];
  const step = Math.max(1, Math.ceil((last - first + 1) / most));
  return Array.from(
    { length: Math.floor((last - first) / step) + 1 },
    (_, i) => 10 ** (first + i * step),
  );
}

/** An axis of d3 with ticks that suit its length. */
function ticked(axis, scale, room) {
  const [from, to] = scale.range();
  const most = Math.max(2, Math.floor(Math.abs(to - from) / room));
  if (!scale.base) {
    const few = Math.min(most, TICKS);
    return axis.tickValues(scale.ticks(few)).tickFormat(scale.tickFormat(few));
  }
  const whole = decades(scale, most);
  if (whole.length > 1) return axis.tickValues(whole).tickFormat(decade);
  const within = scale.ticks(most).filter((value) => /^[125]e/.test(value.toExponential()));
  return axis.tickValues(within).tickFormat((value) => String(Number(value.toPrecision(3))));
}

/** The shape of a circle. */
export const circleAt = (x, y, radius) =>
  `M${x - radius} ${y}a${radius} ${radius} 0 1 0 ${2 * radius} 0` +
  `a${radius} ${radius} 0 1 0 ${-2 * radius} 0Z`;

const scaleOf = ({ domain, log }) => (log ? scaleLog() : scaleLinear()).domain(domain);
const plots = [];
/** Whether two boxes [left, top, right, bottom] lie on each other. */
const overlap = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];

/**
 * An SVG of two layers: `paint(plot)` fills the lower one when its size or what it shows changes,
 * `mark(plot)` the upper one, which is drawn anew by itself in every step of a drag.
 *
 * `axes({ x, y })` gives it two scales { domain, log, title }; then `plot.x`, `plot.y` are d3's
 * scales, `plot.inside` the group that is cut off at the frame, `plot.over` the one above it, each
 * of the layer that is drawn.
 */
export class Plot {
  constructor(svg, paint, mark = () => {}) {
    Object.assign(this, { svg, paint, mark, stale: true, centred: [], lines: [] });
    plots.push(this);
    new ResizeObserver(([{ contentRect }]) => {
      [this.width, this.height] = [contentRect.width, contentRect.height].map(Math.round);
      this.redraw();
    }).observe(svg);
  }

  /** Draws all plots at once in the size that they have now. */
  static fit() {
    for (const plot of plots) {
      [plot.width, plot.height] = [plot.svg.clientWidth, plot.svg.clientHeight];
      plot.stale = true;
      plot.draw();
    }
  }

  /** Draws both layers, in the next picture of the page. */
  redraw() {
    this.stale = true;
    this.remark();
  }

  /** Draws the upper layer. */
  remark() {
    cancelAnimationFrame(this.next);
    this.next = requestAnimationFrame(() => this.draw());
  }

  draw() {
    const { width, height } = this;
    if (!width || !height) return;
    this.covers = [];
    if (this.stale) {
      this.stale = false;
      this.taken = [];
      this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
      this.paint(this);
      this.centre();
      this.below = this.taken;
    }
    if (!this.marks) return;
    [this.inside, this.over] = this.marks;
    for (const group of this.marks) group.selectAll("*").remove();
    this.taken = [...this.below];
    this.open = false; // whether the user's point has a bar
    this.mark(this);
    this.cross(this.crossed);
    this.uncover();
  }

  /**
   * Two axes with titles, and where it is asked faint `lines` at the ticks of y; so many pixels are
   * left free above, to the right and below; `slim` where there is little room beside it.
   */
  axes({ x, y, top = 10, right = 24, below = 0, lines = false, slim = false }) {
    this.lines = [];
    const foot = 42 + below;
    this.y = scaleOf(y).range([this.height - foot, top]);
    const side = ticked(axisLeft(this.y).tickSizeOuter(0), this.y, 44);
    const numbers = side.tickValues().map((value) => side.tickFormat()(value).length);
    const left = (slim ? 48 : 56) + DIGIT * Math.max(0, ...numbers.map((length) => length - 4));
    this.box = {
      x: left,
      y: top,
      width: this.width - left - right,
      height: this.height - top - foot,
    };
    this.x = scaleOf(x).range([left, this.width - right]);
    const root = select(this.svg);
    root.selectAll("*").remove();
    const { box } = this;
    const clip = `${this.svg.id}-clip`;
    const clipped = () => root.append("g").attr("clip-path", `url(#${clip})`);
    root
      .append("clipPath")
      .attr("id", clip)
      .append("rect")
      .attr("x", box.x)
      .attr("y", box.y)
      .attr("width", box.width)
      .attr("height", box.height);
    this.inside = clipped();
    for (const value of lines ? side.tickValues() : [])
      this.path(
        x.domain.map((end) => [end, value]),
        "line",
      );
    const bottom = root
      .append("g")
      .attr("class", "axis")
      .attr("transform", `translate(0 ${box.y + box.height})`);
    const beside = root
      .append("g")
      .attr("class", "axis")
      .attr("transform", `translate(${box.x} 0)`);
    bottom.call(ticked(axisBottom(this.x).tickSizeOuter(0), this.x, 44));
    if (!y.bare) beside.call(side);
    const title = (text, place) =>
      root.append("text").attr("class", "title").attr("transform", place).text(text);
    title(x.title, `translate(${box.x + box.width / 2} ${this.height - below - 8})`);
    title(y.title, `translate(13 ${box.y + box.height / 2}) rotate(-90)`);
    const marks = clipped(); // below the texts, which a line would strike out
    this.over = root.append("g");
    this.marks = [marks, root.append("g")];
    return this;
  }

  /** A second axis above, and where it is given to the right, in the upper layer. */
  outerAxes({ x, y }) {
    const { box, over } = this;
    const across = scaleOf(x).range([box.x, box.x + box.width]);
    const axis = (made, place) =>
      over.append("g").attr("class", "axis").attr("transform", place).call(made);
    const title = (text, place) =>
      over.append("text").attr("class", "title").attr("transform", place).text(text);
    axis(ticked(axisTop(across).tickSizeOuter(0), across, 44), `translate(0 ${box.y})`);
    title(x.title, `translate(${box.x + box.width / 2} 12)`);
    if (!y) return;
    const up = scaleOf(y).range([box.y + box.height, box.y]);
    axis(ticked(axisRight(up).tickSizeOuter(0), up, 34), `translate(${box.x + box.width} 0)`);
    title(y.title, `translate(${this.width - 12} ${box.y + box.height / 2}) rotate(90)`);
  }

  /** A cut in the axis of y, which does not begin at 0. */
  cut() {
    const { box, over } = this;
    const [left, foot] = [box.x - 6, box.y + box.height - 5];
    over.append("path").attr("class", "gap").attr("d", `M${left} ${foot}l12 -5v-5l-12 5Z`);
    over.append("path").attr("class", "cut").attr("d", `M${left} ${foot}l12 -5m0 -5l-12 5`);
  }

  /**
   * A strip below the axis of x, of so many pixels, with an axis of its own that has 0 in its
   * middle; returns its scale.
   */
  strip({ most, title, pixels }) {
    const { box, over, height } = this;
    const scale = scaleLinear()
      .domain([-1.2 * most, 1.2 * most])
      .range([height - 6, height - pixels + 6]);
    const axis = over.append("g").attr("class", "axis").attr("transform", `translate(${box.x} 0)`);
    axis.call(ticked(axisLeft(scale).tickSizeOuter(0), scale, 30));
    over
      .append("path")
      .attr("class", "rule")
      .attr("d", `M${box.x} ${scale(0)}h${box.width}`);
    this.text(title, box.x, height - pixels - 8, "note", "start");
    return scale;
  }

  /** An empty plot. */
  clear() {
    this.svg.replaceChildren();
    this.marks = null;
  }

  /** A line with a pale rim, which is seen on every colour. */
  rimmed(shape, className) {
    for (const kind of ["rim", className])
      this.inside.append("path").attr("class", kind).attr("d", shape);
  }

  path(points, className, where = this.inside) {
    return where.append("path").attr("class", className).attr("d", this.shape(points));
  }

  shape(points) {
    const shape = line()
      .defined(([x, y]) => Number.isFinite(x) && Number.isFinite(y))
      .x(([x]) => this.x(x))
      .y(([, y]) => this.y(y));
    return shape(points);
  }

  /** The name of a regime about a place, with two lines where the frame is narrow. */
  area(words, x, y, className) {
    const last = words.lastIndexOf(" ");
    const narrow = this.box.width < NARROW && last > 0;
    const lines = narrow ? `${words.slice(0, last)}\n${words.slice(last + 1)}` : words;
    return this.text(lines, x, y, className);
  }

  /** A text of one or more lines at a place; a centred one of the lower layer is kept within the
   * frame. */
  text(words, x, y, className, anchor = "middle") {
    const text = this.over
      .append("text")
      .attr("class", className)
      .attr("text-anchor", anchor)
      .attr("x", x)
      .attr("y", y);
    const lines = words.split("\n");
    if (lines.length === 1) text.text(words);
    else
      for (const [i, one] of lines.entries())
        text
          .append("tspan")
          .attr("x", x)
          .attr("dy", i ? "1.1em" : 0)
          .text(one);
    if (anchor === "middle") this.centred.push([text, x]);
    return text;
  }

  /** Notes a line, which `label` gives way to. */
  avoid(points) {
    const places = points.map(([x, y]) => [this.x(x), this.y(y)]);
    places.slice(1).forEach(([x, y], i) => {
      const [left, top] = places[i];
      this.lines.push([Math.min(left, x), Math.min(top, y) - 1, x + 1, Math.max(top, y) + 1]);
    });
  }

  /**
   * Writes the first of some texts that has room at one of several places { x, y, anchor }, in the
   * frame and clear of lines, points and other labels; returns whether one has.
   */
  label(texts, places, className) {
    const { box } = this;
    for (const words of texts) {
      const text = this.text(words, 0, 0, className, "start");
      const { y: top, width, height } = text.node().getBBox();
      const boxOf = ({ x, y, anchor }) => {
        const left = x - { start: 0, middle: 0.5, end: 1 }[anchor] * width;
        return [left - 2, y + top, left + width + 2, y + top + height];
      };
      const free = places.find((one) => {
        const [left, upper, right, foot] = boxOf(one);
        const held = left >= box.x && right <= box.x + box.width;
        if (!held || upper < box.y || foot > box.y + box.height) return false;
        const others = [...this.lines, ...this.taken, ...this.covers];
        return !others.some((other) => overlap(boxOf(one), other));
      });
      if (free) {
        const place = boxOf(free);
        this.taken.push(place);
        text.attr("x", place[0] + 2).attr("y", free.y);
        text.selectAll("tspan").attr("x", place[0] + 2);
        return true;
      }
      text.remove();
    }
    return false;
  }

  /** A thin cross at a place of the frame, or none. */
  cross(place) {
    const { box } = this;
    this.crossed = place;
    if (!this.marks) return;
    const group = this.marks[1];
    group.selectAll(".cross").remove();
    if (!place) return;
    const shape = `M${box.x} ${place[1]}h${box.width}M${place[0]} ${box.y}v${box.height}`;
    group.insert("path", ":first-child").attr("class", "cross").attr("d", shape);
  }

  /**
   * Moves centred texts into the frame, and leaves out those that have no room beside the earlier
   * ones; all are measured, then moved, which is one layout.
   */
  centre() {
    const { box, centred, svg } = this;
    const halves = centred.map(([text]) => text.node().getBBox().width / 2 + 3);
    centred.forEach(([text, x], i) => {
      const at = Math.min(Math.max(x, box.x + halves[i]), box.x + box.width - halves[i]);
      text.attr("x", at).selectAll("tspan").attr("x", at);
    });
    this.centred = [];
    this.texts = [];
    for (const text of svg.querySelectorAll(":is(.tag, .area, .mark, .note)")) {
      const { x, y, width, height } = text.getBBox();
      const place = [x - 1, y, x + width + 1, y + height];
      const left = this.texts.some((one) => !one.left && overlap(one.place, place));
      this.texts.push({ text, place, left });
    }
  }

  /** Shows the texts that have room, but those that the user's point or its bar lies on. */
  uncover() {
    for (const { text, place, left } of this.texts ?? [])
      text.classList.toggle("covered", left || this.covers.some((one) => overlap(place, one)));
  }

  /** A bar with caps for what is open about the user's point, from one place to another. */
  bar(...places) {
    this.stroke(places.map(([x, y]) => [this.x(x), this.y(y)]));
  }

  /** A bar between two places in pixels. */
  stroke(ends) {
    const [[left, foot], [right, top]] = ends;
    this.open = true;
    if (Math.hypot(right - left, top - foot) < 2 * RADIUS) return; // it is within the ring
    for (let i = 0; i <= BAR; i += 1)
      this.cover(left + (i / BAR) * (right - left), foot + (i / BAR) * (top - foot), 3);
    const length = Math.hypot(right - left, top - foot);
    const [across, down] = [foot - top, right - left].map((one) => (CAP * one) / length);
    const cap = ([x, y]) => `M${x - across} ${y - down}L${x + across} ${y + down}`;
    this.rimmed(`M${left} ${foot}L${right} ${top}${ends.map(cap).join("")}`, "deviation");
  }

  /**
   * One standard deviation about a place: an ellipse, or a bar where that is flat.  Each step
   * [right, down], in pixels, is the deviation of an independent cause.
   */
  ellipse([x, y], steps) {
    const sum = (i, j) => steps.reduce((all, step) => all + step[i] * step[j], 0);
    const [xx, xy, yy] = [sum(0, 0), sum(0, 1), sum(1, 1)];
    const half = Math.hypot((xx - yy) / 2, xy);
    const [long, short] = [1, -1].map((side) =>
      Math.sqrt(Math.max((xx + yy) / 2 + side * half, 0)),
    );
    if (!(long > 0)) return;
    const turn = Math.atan2(2 * xy, xx - yy) / 2;
    const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
    const [left, top] = [this.x(x), this.y(y)];
    const at = (along, across) => [
      left + along * cos - across * sin,
      top + along * sin + across * cos,
    ];
    const ends = [at(-long, 0), at(long, 0)];
    if (short < FLAT || long < RADIUS) return this.stroke(ends);
    for (let i = 0; i < BAR; i += 1) {
      const angle = (2 * Math.PI * i) / BAR;
      this.cover(...at(long * Math.cos(angle), short * Math.sin(angle)), 3);
    }
    const arc = `A${long} ${short} ${(turn * 180) / Math.PI} 0 1 `;
    this.rimmed(`M${ends[0]}${arc}${ends[1]}${arc}${ends[0]}Z`, "deviation");
    this.open = true;
  }

  /** Notes that something of the upper layer is drawn here. */
  cover(x, y, half) {
    this.covers.push([x - half, y - half, x + half, y + half]);
  }

  /** The user's point, hollow about its bar; where it is outside, an arrow on the frame that points
   * to it. */
  point(x, y) {
    const { box } = this;
    const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
    // 0 and infinity have no place on a logarithmic axis, but a side
    const far = (scale, value, low, high) => {
      if (scale.base && !(value > 0)) return low;
      return value === Infinity ? high : scale(value);
    };
    const at = [far(this.x, x, -Infinity, Infinity), far(this.y, y, Infinity, -Infinity)];
    const place = [clamp(at[0], box.x, box.x + box.width), clamp(at[1], box.y, box.y + box.height)];
    const [right, down] = at.map((value, i) =>
      Math.sign(Math.trunc(100 * clamp(value - place[i], -1e6, 1e6))),
    );
    const outside = right !== 0 || down !== 0;
    this.pointAt = place;
    this.cover(...place, 8);
    const turn = (Math.atan2(down, right) * 180) / Math.PI;
    return this.over
      .append("path")
      .attr("class", `point${this.open && !outside ? " open" : ""}`)
      .attr("d", outside ? "M0 0L-18 -10L-18 10Z" : circleAt(0, 0, RADIUS))
      .attr("transform", `translate(${place}) rotate(${turn})`);
  }

  holds([x, y]) {
    const { box } = this;
    return box && x >= box.x && x <= box.x + box.width && y >= box.y && y <= box.y + box.height;
  }

  /**
   * Calls back with the place of the pointer in the plot: `read(place)` while it moves,
   * `read(null)` when it leaves; `pull(place)` for a click and each step of a drag;
   * `grab(moving)` around it; and `step(right, up, factor)` for the arrow keys.  A finger drags
   * from the point alone, so that it scrolls the page elsewhere.
   */
  follow({ read, pull, grab, step }) {
    const { svg } = this;
    const place = ({ clientX, clientY }) => {
      const { x, y } = svg.getBoundingClientRect();
      return [clientX - x, clientY - y];
    };
    const inFrame = ([x, y]) => {
      const { box } = this;
      return [
        Math.min(Math.max(x, box.x), box.x + box.width),
        Math.min(Math.max(y, box.y), box.y + box.height),
      ];
    };
    const at = ({ x, y }) => {
      read([x, y]);
      pull(inFrame([x, y]));
    };
    const byPoint = (event) => {
      const [x, y] = place(event);
      return this.pointAt && Math.hypot(x - this.pointAt[0], y - this.pointAt[1]) < FINGER;
    };
    const move = drag()
      .container(() => svg)
      .filter((event) => (event.touches ? byPoint(event.touches[0]) : !event.button && this.box))
      .clickDistance(4)
      .on("start", (event) => {
        svg.focus({ preventScroll: true });
        grab(true);
        at(event);
      })
      .on("drag", at)
      .on("end", () => grab(false));
    select(svg).call(move).style("touch-action", null);
    const hold = (event) => byPoint(event.touches[0]) && event.preventDefault();
    svg.addEventListener("touchstart", hold, { passive: false }); // the page does not scroll then
    svg.addEventListener("click", (event) => {
      if (event.pointerType === "touch" && this.box) pull(inFrame(place(event)));
    });
    svg.addEventListener("pointermove", (event) => event.buttons || read(place(event)));
    svg.addEventListener("pointerleave", () => read(null));
    svg.addEventListener("keydown", (event) => {
      const arrow = ARROWS[event.key];
      if (arrow && step(...arrow, event.shiftKey ? FINE_STEP : STEP)) event.preventDefault();
    });
  }

  /** Saves the plot as an SVG file on the card's colour, with a line of text below it. */
  save(text, name) {
    const { width, height } = this;
    const { color, backgroundColor } = getComputedStyle(this.svg.closest("section"));
    const copy = this.svg.cloneNode(true);
    const [copies, originals] = [copy, this.svg].map((one) => one.querySelectorAll("*"));
    copies.forEach(({ style }, i) => {
      const seen = getComputedStyle(originals[i]);
      for (const look of LOOKS) style.setProperty(look, seen.getPropertyValue(look));
    });
    const root = select(copy)
      .attr("width", width)
      .attr("height", height + 24)
      .attr("class", null);
    root.attr("viewBox", `0 0 ${width} ${height + 24}`).attr("xmlns", "http://www.w3.org/2000/svg");
    root
      .insert("rect", ":first-child")
      .attr("width", width)
      .attr("height", height + 24)
      .attr("fill", backgroundColor);
    const words = root
      .append("text")
      .attr("x", 12)
      .attr("y", height + 14)
      .attr("fill", color);
    words.attr("font-family", "sans-serif").attr("font-size", 12).text(text);
    if (6.6 * text.length > width - 24)
      words.attr("textLength", width - 24).attr("lengthAdjust", "spacingAndGlyphs");
    save(new XMLSerializer().serializeToString(copy), "image/svg+xml", name);
  }
}

/** Saves a text as a file of the user. */
export function save(text, type, name) {
  const href = URL.createObjectURL(new Blob([text], { type }));
  Object.assign(document.createElement("a"), { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), 10_000);
}
