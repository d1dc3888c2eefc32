// The number: µ_macro, as large as the page has it, with its deviation or its interval; the regime
// in words; one line of advice, and what it assumes below that.
import { $, write } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import {
  about,
  around,
  digitsWithin,
  friction,
  inUnit,
  inWords,
  numberOf,
  prose,
  show,
  withDeviation,
} from "./words.js";

const KNOWN = "k decides";
const FEW = 4; // digits of the number

const symbolOf = (name) => about.inputs[name === "omega" ? "f" : name].symbol;
const capital = (words) => `${words[0].toUpperCase()}${words.slice(1)}`;
/** A heading begins with a capital, but where a symbol begins it. */
const heading = (row) => (row === KNOWN ? row : capital(row));

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

/** Where the deviation of the number comes from. */
function variance({ std_share: shares }) {
  const parts = Object.entries(shares ?? {}).filter(([, share]) => share >= 0.005);
  const words = parts
    .sort(([, a], [, b]) => b - a)
    .map(([name, share]) => `${symbolOf(name)} ${Math.round(100 * share)} %`);
  return words.length ? `the variance comes from ${words.join(", ")}.` : "";
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
    words: sentence(text, inputs),
    doubt: said.has(row) || DOUBTS.includes(row),
  }));
  const unit = inputs.k.unit ?? undefined;
  const ends = [inputs.k.low, inputs.k.high].map((end) => inUnit("k", end, unit));
  const middle =
    high > low ? `k from ${ends.join(" to ")}; ${friction(mu, FEW)} in the middle of it.` : "";
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
    write("status", reason && old && trouble.calm ? `${reason} The last answer stays.` : reason);
    $("status").classList.toggle("bad", Boolean(trouble && !trouble.calm));
    for (const part of document.querySelectorAll(".result")) part.classList.toggle("old", old);
    if (!answer) {
      render(html`<output id="mu" for="fields">…</output>`, $("number"));
      return;
    }
    const { value, std } = headline(answer, store.state.digits === "all");
    $("number").classList.toggle("long", value.length + (std ?? "").length / 2 > 12);
    const deviation = std ? html`<wbr /><span id="std"> ± ${std}</span>` : nothing;
    render(html`<output id="mu" for="fields">${value}</output>${deviation}`, $("number"));
    const { stick_fraction: stick, regime } = answer;
    const share = stick > 0 && stick < 1 ? `: sticks ${show(100 * stick, 2)} %` : "";
    write("regime", `${capital(inWords(regime))}${share}`);
    write("short", shortOf(answer));
    if (store.dragged) return; // words may grow, and would move the map that is dragged
    const [first, ...rest] = sayings(answer);
    write("advice", first ? `${heading(first.row)}: ${first.words}` : "");
    $("advice").classList.toggle("doubt", Boolean(first?.doubt));
    for (const part of document.querySelectorAll("[data-of]"))
      part.hidden = part.dataset.of !== answer.state.contact;
    const line = ({ row, words, doubt }) =>
      html`<li class=${doubt ? "doubt" : ""}><b>${heading(row)}:</b> ${words}</li>`;
    render(rest.map(line), $("rows"));
  };
}
