// The number: µ, as large as the page has it, with its deviation or its interval; what of µ₀ is
// left, and the regime, in words; one line of advice, and what it assumes below that.
import { $, write } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import { inputsOf } from "./state.js";
import {
  about,
  around,
  capital,
  digitsWithin,
  friction,
  inUnit,
  inWords,
  middleOf,
  numberOf,
  percent,
  prose,
  show,
  withDeviation,
} from "./words.js";

const KNOWN = "k decides";
const FEW = 4; // digits of the number

const symbolOf = (name) => about.inputs[name === "omega" ? "f" : name].symbol;

/** The number as texts: the value, or both ends of an interval, and the deviation. */
export function headline(answer, all) {
  const { mu_macro: mu, std, error_bound: bound, mu_macro_low: low, mu_macro_high: high } = answer;
  if (high > low) {
    const few = Math.max(digitsWithin(high, high - low) + 2, FEW); // so that the ends differ
    const [from, to] = [low, high].map((end) =>
      friction(end, all ? digitsWithin(end, bound) + 1 : few),
    );
    return { value: `${from} to ${to}`, std: null };
  }
  if (all) {
    const deviation = std ? show(std, 6) : null;
    return { value: friction(mu, digitsWithin(mu, bound) + 1), std: deviation };
  }
  if (!std) return { value: friction(mu, FEW), std: null };
  const [value, deviation] = withDeviation(mu, std);
  return { value, std: deviation };
}

/** The number in one line of a phone; the regime has room beside a value alone. */
function shortOf(answer) {
  const { value, std } = headline(answer, false);
  if (std) return `µ = ${value} ± ${std}`;
  return value.includes(" ") ? `µ = ${value}` : `µ = ${value}, ${inWords(answer.regime)}`;
}

/** What of µ₀ is left, in words; of an interval both ends. */
export function remains({ mu_macro_low: low, mu_macro_high: high, mu_ratio: ratio, inputs }) {
  const { value: mu0 } = inputs.mu0;
  if (ratio === 0) return "Nothing of µ₀ is left";
  const [from, to] = (high > low ? [low / mu0, high / mu0] : [ratio, ratio]).map(percent);
  if (from === to) return `${from === "100 %" ? "All" : to} of µ₀ is left`;
  return `${from.replace(" %", "")} to ${to} of µ₀ is left`;
}

/** The regime, and which share of a period the contact sticks; of an interval, at its middle. */
function going(answer) {
  const name = capital(inWords(answer.regime));
  const middle = middleOf(answer);
  if (middle) return `${name} at ${middle}`;
  const stick = answer.stick_fraction;
  return stick > 0 && stick < 1 ? `${name}: sticks for ${percent(stick)} of each period` : name;
}

/** Which case the last answer is of, where that is another one now. */
function stays({ state }, store) {
  const other = inputsOf(state).filter((name) => state[name] !== store.state[name]);
  const words = other.map((name) => `${symbolOf(name)} = ${state[name]}`).join(", ");
  return `The last answer stays${words && `, of ${words}`}.`;
}

/** Where the deviation of the number comes from. */
function variance({ std_share: shares }) {
  const parts = Object.entries(shares ?? {}).filter(([, share]) => share >= 0.005);
  const words = parts
    .sort(([, a], [, b]) => b - a)
    .map(([name, share]) => `${symbolOf(name)} ${Math.round(100 * share)} %`);
  const origin = `The variance comes from ${words.join(", ")}`;
  return words.length ? `${origin}; ± is one standard deviation.` : "";
}

/** A remark in the page's signs; an interval of k is shown for this one. */
function sentence(text, inputs) {
  const k = numberOf(inputs?.k);
  const example = k === undefined ? "" : `, such as ${around(k)}`;
  return prose(text.replace("give k as an interval", `give k as an interval${example}`)).replace(
    /[^.!?]$/,
    "$&.",
  );
}

/** Rows of the model, with which the number says less than it seems to. */
const DOUBTS = ["first order", "std"];

/**
 * What is said of the number, the most urgent first: { row, words, doubt }.  The first of them is
 * its line of advice.
 */
function sayings(answer) {
  const {
    remarks = [],
    model = [],
    inputs,
    mu_macro: mu,
    mu_macro_low: low,
    mu_macro_high: high,
  } = answer;
  const said = new Set(remarks.map(({ row }) => row));
  const named = {
    std: "standard deviation",
    units: "check the units",
    "k is known": KNOWN,
    ...(answer.state.contact === "ball" && { "one spring": "a ball" }),
  };
  const rows = [...remarks, ...model.filter(({ row }) => !said.has(row))].map(({ row, text }) => ({
    row: named[row] ?? row,
    words: capital(sentence(text, inputs)),
    doubt: said.has(row) || DOUBTS.includes(row),
  }));
  const unit = inputs.k.unit ?? undefined;
  const ends = [inputs.k.low, inputs.k.high].map((end) => inUnit("k", end, unit));
  const middle =
    high > low
      ? `k from ${ends.join(" to ")}; µ = ${friction(mu, FEW)} at ${middleOf(answer)}.`
      : "";
  const own = [
    { row: "interval", words: middle },
    { row: "deviation", words: variance(answer) },
  ].filter(({ words }) => words);
  const known = rows.filter(({ row }) => row === KNOWN);
  const doubts = rows.filter(({ doubt }) => doubt);
  return [...new Set([...doubts, ...own, ...known, ...rows])];
}

export function numberPanel(store) {
  $("number").replaceChildren(); // what stands there until the first answer
  return (answer, trouble, old) => {
    const reason = trouble?.text ? prose(trouble.text).replace(/[^.!?]$/, "$&.") : "";
    write("status", reason && old && trouble.calm ? `${reason} ${stays(answer, store)}` : reason);
    $("status").classList.toggle("bad", Boolean(trouble && !trouble.calm));
    for (const part of document.querySelectorAll(".result")) part.classList.toggle("old", old);
    if (!answer) {
      const none = trouble && !trouble.calm ? "–" : "…";
      render(html`<output id="mu" for="fields">${none}</output>`, $("number"));
      return;
    }
    const { value, std } = headline(answer, store.state.digits === "all");
    $("number").classList.toggle("long", value.length + (std ?? "").length / 2 > 12);
    const deviation = std ? html`<wbr /><span id="std"> ± ${std}</span>` : nothing;
    render(html`<output id="mu" for="fields">${value}</output>${deviation}`, $("number"));
    write("share", remains(answer));
    write("regime", going(answer));
    write("short", shortOf(answer));
    if (store.dragged) return; // words may grow, and would move the map that is dragged
    const [first, ...rest] = sayings(answer);
    const said = ({ row, words }) => html`<b>${capital(row)}.</b> ${words}`;
    render(first ? said(first) : nothing, $("advice"));
    $("advice").classList.toggle("doubt", Boolean(first?.doubt));
    for (const part of document.querySelectorAll("[data-of]"))
      part.hidden = part.dataset.of !== answer.state.contact;
    const line = (one) => html`<li class=${one.doubt ? "doubt" : ""}>${said(one)}</li>`;
    render(rest.map(line), $("rows"));
  };
}
