// The page: one state (SI), its fields, the questions it asks, and what the answers change.
import { Channel, KeyWanted, download, get, post, query } from "./api.js";
import { FIELDS, NAMES, SYMBOLS, fault, parse, show, withUnit } from "./fields.js";
import { apiKey, setApiKey } from "./key.js";
import { LawPlot } from "./law.js";
import { FrictionMap } from "./map.js";

const $ = (id) => document.getElementById(id);
const REGIMES = { continuous: "continuous sliding", stick_slip: "stick–slip", static: "at rest" };
const STEPS = 1000; // of a slider, a decade
const POINTS = 301;

const start = () => ({ ...Object.fromEntries(NAMES.map((name) => [name, FIELDS[name].start])), along: "v0", scale: "log", approximations: false });
const units = Object.fromEntries(NAMES.map((name) => [name, FIELDS[name].unit ?? Object.keys(FIELDS[name].units)[0]]));
let state = start();
let answer = null;
let sensitivity = null;
const rows = {};
const complain = (text) => {
  $("status").textContent = text;
};

// --- state <-> address --------------------------------------------------------------------------------

function readAddress() {
  const given = new URLSearchParams(location.hash.slice(1));
  const found = start();
  for (const name of NAMES) {
    const value = given.has(name) ? parse(given.get(name)) : found[name];
    if (fault(name, value) === null) found[name] = value;
    const unit = given.get(`${name}.unit`);
    if (unit in FIELDS[name].units) units[name] = unit;
  }
  if (NAMES.includes(given.get("along"))) found.along = given.get("along");
  if (given.get("scale") === "linear") found.scale = "linear";
  found.approximations = given.has("approximations");
  state = found;
}

let addressTimer = null;
function writeAddress() {
  const shown = Object.fromEntries(NAMES.map((name) => [name, state[name]]));
  for (const name of NAMES) if (name !== "mu0") shown[`${name}.unit`] = units[name];
  Object.assign(shown, { along: state.along, scale: state.scale });
  if (state.approximations) shown.approximations = 1;
  const hash = `#${query(shown)}`;
  $("link").href = hash;
  // browsers refuse an address that changes with every step of a slider
  clearTimeout(addressTimer);
  addressTimer = setTimeout(() => history.replaceState(null, "", hash), 150);
}

// --- fields -------------------------------------------------------------------------------------------

function buildFields() {
  for (const name of NAMES) {
    const { label, units: known, range } = FIELDS[name];
    const row = document.createElement("div");
    row.className = "field";
    const caption = Object.assign(document.createElement("label"), { htmlFor: `field-${name}`, textContent: label });
    const text = Object.assign(document.createElement("input"), { type: "text", id: `field-${name}`, inputMode: "decimal", spellcheck: false });
    const unit = Object.assign(document.createElement("select"), { id: `unit-${name}` });
    unit.setAttribute("aria-label", `unit of ${label}`);
    unit.append(...Object.keys(known).map((key) => new Option(key, key)));
    unit.disabled = Object.keys(known).length === 1;
    const slider = Object.assign(document.createElement("input"), { type: "range", id: `slider-${name}`, min: range[0] * STEPS, max: range[1] * STEPS, step: 1 });
    slider.setAttribute("aria-label", `${label}, slider`);
    row.append(caption, text, unit, slider);
    $("form").append(row);
    rows[name] = { text, unit, slider };
    text.addEventListener("input", () => {
      const value = parse(text.value);
      const si = value === null ? null : value * known[units[name]];
      const wrong = fault(name, si);
      text.setAttribute("aria-invalid", String(wrong !== null));
      complain(wrong ?? "");
      if (wrong === null) change({ [name]: si }, name);
    });
    text.addEventListener("blur", () => {
      if (text.getAttribute("aria-invalid") === "true") complain("");
      syncField(name);
    });
    unit.addEventListener("change", () => {
      units[name] = unit.value;
      change({});
    });
    slider.addEventListener("input", () => change({ [name]: Number((10 ** (slider.value / STEPS)).toPrecision(4)) }));
  }
  $("form").addEventListener("submit", (event) => event.preventDefault());
  $("along").append(...NAMES.map((name) => new Option(SYMBOLS[name], name)));
}

function syncField(name, keepText = false) {
  const { text, unit, slider } = rows[name];
  unit.value = units[name];
  if (!keepText) {
    text.value = show(state[name] / FIELDS[name].units[units[name]], 7);
    text.setAttribute("aria-invalid", "false");
  }
  slider.value = state[name] > 0 ? Math.round(STEPS * Math.log10(state[name])) : slider.min;
  slider.setAttribute("aria-valuetext", `${show(state[name] / FIELDS[name].units[units[name]], 4)} ${units[name]}`);
}

// --- questions ----------------------------------------------------------------------------------------

const inputs = () => Object.fromEntries(NAMES.map((name) => [name, state[name]]));
const fail = (error) => (error instanceof KeyWanted ? wantKey() : complain(error.message));

const asks = {
  point: new Channel((values) => get("v1/mu-macro", { ...values, include: "groups,limits" }), showAnswer, fail),
  slopes: new Channel((values) => post("Gradient", { name: "mu_macro", outWrt: 0, inWrt: 0, input: [NAMES.map((name) => values[name])], sens: [1] }),
    (found, values) => showBars({ slopes: found.output, values }), (error) => { showBars(null); if (error instanceof KeyWanted) wantKey(); }),
  law: new Channel((request) => post("v1/law", request), showLaw, fail),
  hover: new Channel((v, y) => get("v1/mu-macro", { mu0: 1, Fz: 1, k: 1, omega: 1, y0: y, v0: v }), showHover, () => {}),
};

/** Whole decades around the values that the law should show. */
function lawRange() {
  const { along, scale } = state;
  const here = along === "v0" ? [answer?.limits?.v0_crit, state.v0] : [state[along]];
  const shown = here.filter((value) => value > 0 && Number.isFinite(value));
  if (!shown.length) shown.push(FIELDS[along].start);
  const [low, high] = [Math.min(...shown), Math.max(...shown)];
  if (scale === "linear") return { start: along === "mu0" || along === "Fz" || along === "k" ? high / 100 : 0, stop: Number((4 * high).toPrecision(1)) };
  return { start: Number(`1e${Math.floor(Math.log10(low)) - 2}`), stop: Number(`1e${Math.ceil(Math.log10(high)) + 2}`) };
}

let lastLaw = "";
function askLaw() {
  const request = { ...inputs(), along: state.along, ...lawRange(), points: POINTS, scale: state.scale };
  delete request[state.along];
  $("csv").href = `v1/law.csv?${query({ ...request, ...(state.approximations ? { include: "approximations" } : {}) })}`;
  if (state.approximations) request.include = ["approximations"];
  const key = JSON.stringify(request);
  if (key !== lastLaw) asks.law.push(request);
  lastLaw = key;
}

function change(changed, typed = null) {
  Object.assign(state, changed);
  for (const name of NAMES) syncField(name, name === typed);
  $("along").value = state.along;
  $("scale").value = state.scale;
  $("approximations").checked = state.approximations;
  writeAddress();
  asks.point.push(inputs());
  asks.slopes.push(inputs());
}

// --- answers ------------------------------------------------------------------------------------------

function showAnswer(found) {
  answer = found;
  // an answer to what was typed before does not mend what is in the field now
  if (NAMES.every((name) => rows[name].text.getAttribute("aria-invalid") !== "true")) complain("");
  $("mu").textContent = show(found.mu_macro, 6);
  $("regime").textContent = REGIMES[found.regime];
  $("ratio").textContent = show(found.mu_ratio, 6);
  $("bound").textContent = found.error_bound === null ? "–" : `± ${show(found.error_bound, 2)}`;
  $("v-tilde").textContent = show(found.groups.v_tilde, 5);
  $("y-tilde").textContent = show(found.groups.y_tilde, 5);
  $("static").textContent = show(found.limits.mu_static, 6);
  $("crit").textContent = found.limits.v0_crit === null ? "–" : withUnit("v0", found.limits.v0_crit);
  $("source").textContent = found.source;
  $("table").textContent = found.table.id;
  const { v_tilde: v, y_tilde: y } = found.groups;
  map.move(v === null || y === null ? null : [v, y]);
  $("map").setAttribute("aria-label", `Map of the friction ratio. The point: speed ${show(v, 3)}, amplitude ${show(y, 3)}, ratio ${show(found.mu_ratio, 3)}, ${REGIMES[found.regime]}.`);
  law.move(state[state.along], found.mu_macro);
  showBars(sensitivity);
  askLaw();
}

/** Draws the bars anew: after the slopes, and after mu_macro itself, whichever comes last. */
function showBars(found) {
  sensitivity = found;
  const body = $("bars").tBodies[0];
  const shares = found === null || !answer?.mu_macro ? null
    : NAMES.map((name, i) => (found.slopes[i] * found.values[name]) / answer.mu_macro);
  const most = shares === null ? 1 : Math.max(1, ...shares.map(Math.abs));
  body.replaceChildren(...NAMES.map((name, i) => {
    const row = document.createElement("tr");
    const head = Object.assign(document.createElement("th"), { scope: "row", textContent: SYMBOLS[name] });
    const bar = Object.assign(document.createElement("div"), { className: "bar" });
    const fill = document.createElement("span");
    const share = shares === null ? 0 : shares[i];
    fill.className = share < 0 ? "less" : "more";
    const width = (50 * Math.abs(share)) / most;
    fill.style.width = `${width}%`;
    fill.style.left = `${share < 0 ? 50 - width : 50}%`;
    bar.append(fill);
    const middle = document.createElement("td");
    middle.append(bar);
    const sign = share >= 0 ? "+" : "−";
    const number = Object.assign(document.createElement("td"), { textContent: shares === null ? "–" : `${sign}${Math.abs(share).toFixed(3)} %` });
    number.id = `bar-${name}`;
    row.append(head, middle, number);
    return row;
  }));
}

function showLaw(found) {
  law.show(found, state.scale, state.along === "mu0" ? 0 : state.mu0);
  if (answer) law.move(state[state.along], answer.mu_macro);
  $("law-input").textContent = `${found.along} [${found.unit}]`;
  const count = found.values.length;
  const picked = Array.from({ length: 13 }, (_, i) => Math.round((i * (count - 1)) / 12));
  $("law-table").tBodies[0].replaceChildren(...picked.map((i) => {
    const row = document.createElement("tr");
    for (const text of [show(found.values[i], 4), show(found.mu_macro[i], 6), REGIMES[found.regime[i]]]) {
      row.append(Object.assign(document.createElement("td"), { textContent: text }));
    }
    return row;
  }));
  const border = found.border.map((mark) => withUnit(found.along, mark.value)).join(" and ");
  $("law").setAttribute("aria-label", `Macroscopic friction from ${show(found.mu_macro[0], 4)} at ${SYMBOLS[found.along]} = ${withUnit(found.along, found.values[0])} to ${show(found.mu_macro[count - 1], 4)} at ${withUnit(found.along, found.values[count - 1])}${border ? `; border of continuous sliding at ${border}` : ""}.`);
}

function showHover(found, v, y) {
  if (!hovered) return;
  $("map-read").textContent = `ṽ = ${show(v, 3)}, ỹ = ${show(y, 3)}: µ/µ₀ = ${show(found.mu_ratio, 6)}, ${REGIMES[found.regime]}`;
}

// --- plots --------------------------------------------------------------------------------------------

let hovered = false;
const map = new FrictionMap($("map"), moveTo, (v, y, ratio) => {
  hovered = v !== null;
  $("map-read").textContent = hovered ? `ṽ = ${show(v, 3)}, ỹ = ${show(y, 3)}: µ/µ₀ ≈ ${ratio.toFixed(2)}` : "\u00a0";
  if (hovered) asks.hover.push(Number(v.toPrecision(6)), Number(y.toPrecision(6)));
});
const law = new LawPlot($("law"), (value) => change({ [state.along]: Number(value.toPrecision(4)) }), (value, mu, regime) => {
  $("law-read").textContent = value === null ? "\u00a0" : `${SYMBOLS[state.along]} = ${withUnit(state.along, value)}: µ = ${show(mu, 6)}, ${REGIMES[regime]}`;
});

/** Moves the point of the map: v~ by the speed, y~ by the amplitude. */
function moveTo(v, y) {
  const length = (state.mu0 * state.Fz) / state.k;
  change({ v0: Number((v * length * state.omega).toPrecision(4)), y0: Number((y * length).toPrecision(4)) });
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
for (const id of ["map", "law"]) {
  $(id).addEventListener("keydown", (event) => {
    const arrow = ARROWS[event.key];
    if (!arrow || (id === "law" && arrow[1])) return;
    event.preventDefault();
    const factor = event.shiftKey ? 1.5 : 1.05;
    const step = (name, direction) => ({ [name]: Number(((state[name] || 10 ** FIELDS[name].range[0]) * factor ** direction).toPrecision(6)) });
    if (id === "law") change(step(state.along, arrow[0]));
    else change(arrow[0] ? step("v0", arrow[0]) : step("y0", arrow[1]));
  });
}

// --- key ----------------------------------------------------------------------------------------------

/** Shows the field for the key; says so when the one that was sent is not it. */
function wantKey() {
  const tried = apiKey() !== null;
  setApiKey(null);
  $("forget").hidden = true;
  if (tried) $("key-status").textContent = "That is not the key of this service.";
  if ($("key-form").hidden) {
    $("key-form").hidden = false;
    $("key").focus();
  }
}

function useKey(event) {
  event.preventDefault();
  if (!setApiKey($("key").value.trim())) {
    $("key-status").textContent = "A key has 1 to 512 characters: letters, digits, signs, no spaces.";
    return;
  }
  $("key").value = "";
  $("key-status").textContent = "";
  begin();
}

/** Asks for everything, the map included: at the start, and when there is a key. */
function begin() {
  lastLaw = "";
  change({});
  get("static/page/map.json").then((data) => {
    map.show(data);
    $("key-form").hidden = true;
    $("forget").hidden = apiKey() === null;
  }, fail);
}

// --- start --------------------------------------------------------------------------------------------

buildFields();
showBars(null);
$("along").addEventListener("change", () => change({ along: $("along").value }));
$("scale").addEventListener("change", () => change({ scale: $("scale").value }));
$("approximations").addEventListener("change", () => change({ approximations: $("approximations").checked }));
$("reset").addEventListener("click", () => change(start()));
$("copy").addEventListener("click", async () => {
  try {
    await navigator.clipboard.writeText($("link").href);
    $("copy").textContent = "Copied";
  } catch {
    $("copy").textContent = "Copy the address line";
  }
  setTimeout(() => { $("copy").textContent = "Copy link"; }, 2000);
});
addEventListener("hashchange", () => {
  readAddress();
  change({});
});
$("key-form").addEventListener("submit", useKey);
$("forget").addEventListener("click", () => {
  setApiKey(null);
  location.reload();
});
$("csv").addEventListener("click", (event) => {
  if (apiKey() === null) return; // a plain link will do
  event.preventDefault();
  download($("csv").href, `friction-law-${state.along}.csv`).catch(fail);
});
readAddress();
begin();
