// The number: µ_macro, as large as the page has it, with its deviation, its doubt and what it
// assumes.
import { $, attribute, write } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import {
  about,
  around,
  digitsWithin,
  friction,
  inWords,
  numberOf,
  prose,
  show,
  withDeviation,
} from "./words.js";

/** Rows of remarks that have a place of their own below the number. */
const BELOW = ["units", "k is known"];
/** Rows that doubt the deviation, among what is assumed. */
const DOUBTS = ["first order", "std"];
const FEW = 4; // digits of the number, at most
const SHOWN = 3; // lines of assumptions; all of them are one click away

const symbolOf = (name) => about.inputs[name === "omega" ? "f" : name].symbol;

/** The number and its deviation as texts. */
function resultOf(answer, all) {
  const { mu_macro: mu, std, error_bound: bound, mu_macro_low: low, mu_macro_high: high } = answer;
  if (all)
    return { value: friction(mu, digitsWithin(mu, bound) + 1), std: std ? show(std, 6) : null };
  if (std) {
    const [value, deviation] = withDeviation(mu, std);
    return { value, std: deviation };
  }
  const width = high > low ? digitsWithin(mu, (high - low) / 2) + 1 : FEW;
  return { value: friction(mu, Math.min(width, FEW)), std: null };
}

/** One line below the number: where its deviation comes from, or how much k matters. */
function spread(answer, rows) {
  const { std_share: shares, mu_macro_low: low, mu_macro_high: high, inputs } = answer;
  if (low !== undefined && high > low) {
    const digits = Math.max(2, digitsWithin(high, high - low) + 3);
    return `${friction(low, digits)} to ${friction(high, digits)} for k = ${inputs.k.text}`;
  }
  if (shares) {
    const parts = Object.entries(shares).filter(([, share]) => share >= 0.005);
    const words = parts
      .sort(([, a], [, b]) => b - a)
      .map(([name, share]) => `${symbolOf(name)} ${Math.round(100 * share)} %`);
    return words.length ? `The variance comes from ${words.join(", ")}.` : "";
  }
  const known = rows.find(({ row }) => row === "k is known");
  return known ? `${sentence(known.text, inputs)}.` : "";
}

const capital = (words) => `${words[0].toUpperCase()}${words.slice(1)}`;

/** A remark in the page's signs; an interval of k is shown for this one. */
function sentence(text, inputs) {
  const k = numberOf(inputs?.k);
  const example = k === undefined ? "" : `, such as ${around(k)}`;
  return prose(text.replace("give k as an interval", `give k as an interval${example}`));
}

export function numberPanel(store) {
  $("number").replaceChildren(); // what stands there until the first answer
  $("assumes").addEventListener("click", () => $("assumptions").showModal());
  $("assumptions").addEventListener("click", ({ target, currentTarget }) => {
    if (target === currentTarget || target.closest("button")) currentTarget.close();
  });
  return (answer, trouble, old) => {
    const reason = trouble?.text ? prose(trouble.text).replace(/[^.!?]$/, "$&.") : "";
    // a refusal needs the room for itself
    write("status", reason && old && trouble.calm ? `${reason} The last answer stays.` : reason);
    attribute("status", "title", $("status").textContent);
    $("status").classList.toggle("bad", Boolean(trouble && !trouble.calm));
    for (const part of document.querySelectorAll(".result")) part.classList.toggle("old", old);
    if (!answer) {
      render(html`<output id="mu" for="fields">…</output>`, $("number"));
      return;
    }
    const remarks = answer.remarks ?? [];
    const said = new Set(remarks.map(({ row }) => row));
    const rows = [...remarks, ...(answer.model ?? []).filter(({ row }) => !said.has(row))];
    const { value, std } = resultOf(answer, store.state.digits === "all");
    const doubt = rows.find(({ row }) => row === "units");
    render(
      html`<output id="mu" for="fields">${value}</output>${
          std ? html`<wbr /><span id="std"> ± ${std}</span>` : nothing
        }`,
      $("number"),
    );
    write("regime", inWords(answer.regime));
    const short = resultOf(answer, false);
    const deviation = short.std ? ` ± ${short.std}` : "";
    write("short", `µ = ${short.value}${deviation}, ${inWords(answer.regime)}`);
    if (store.dragged) return; // words may grow, and would move the map that is dragged
    write("spread", spread(answer, rows));
    write("doubt", doubt ? `Check the units: ${prose(doubt.text)}` : "");
    const { contact } = answer.state;
    for (const part of document.querySelectorAll("[data-of]"))
      part.hidden = part.dataset.of !== contact;
    const lines = rows.filter(({ row }) => !BELOW.includes(row));
    const named = {
      std: "standard deviation",
      ...(contact === "ball" && { "one spring": "a ball" }),
    };
    const heading = (row) => capital(named[row] ?? row);
    const words = (text) => sentence(text, answer.inputs);
    const line = ({ row, text }) =>
      html`<li class=${DOUBTS.includes(row) ? "doubt" : ""} title=${words(text)}>
        <b>${heading(row)}:</b> ${words(text)}
      </li>`;
    render(lines.slice(0, SHOWN).map(line), $("rows"));
    render(
      rows.map(({ row, text }) => html`<p><b>${heading(row)}:</b> ${words(text)}.</p>`),
      $("all-rows"),
    );
  };
}
