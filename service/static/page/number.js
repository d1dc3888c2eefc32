// The number: µ, as large as the page has it, with its deviation or its interval; what of µ₀ is
// left, and the regime, in words; one line of advice, and what it assumes below that.
import { Channel } from "./ask.js";
import { $, tell, write } from "./dom.js";
import { html, nothing, render } from "../lib/lit-html.js";
import { post } from "./service.js";
import { caseAround, caseOf, inputsOf } from "./state.js";
import {
  about,
  around,
  called,
  capital,
  digitsWithin,
  friction,
  inUnit,
  inWords,
  left,
  middleOf,
  numberOf,
  percent,
  prose,
  show,
  whole,
  withDeviation,
  withEnds,
} from "./words.js";

const STIFFNESS = "k is known"; // row of the model
const ALWAYS = "the contact does not stretch before it slips"; // of a rigid one, without a limit
const SLIGHT = 3; // change of µ in per cent for 10 % of k, below which k needs no advice
const FEW = 4; // digits of the number

const symbolOf = (name) => about.inputs[name === "omega" ? "f" : name].symbol;

/** Whether one deviation of an input changes µ otherwise than its slope says. */
const isRough = ({ std, remarks = [] }) => std && remarks.some(({ row }) => row === "std");

/** Both ends of what a deviation or an interval leaves open; null where neither is given. */
export const endsOf = ({ mu_macro_low: low, mu_macro_high: high }) =>
  high > low ? [low, high] : null;

/** The ends, where they say more than a deviation does. */
const shownEnds = (answer) => (!answer.std || isRough(answer) ? endsOf(answer) : null);

/** The number as texts: the value, or both ends of what is open, and the deviation. */
export function headline(answer, all) {
  const { mu_macro: mu, std, error_bound: bound } = answer;
  const ends = shownEnds(answer);
  if (ends) {
    const [from, to] = all
      ? ends.map((end) => friction(end, digitsWithin(end, bound) + 1))
      : withEnds(...ends);
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

/** µ of a case in a line of text, as the headline has it. */
export function inLine(answer) {
  const { value, std } = headline(answer, false);
  return std ? `${value} ± ${std}` : value;
}

/** The number in one line of a phone, with what of µ₀ is left; or why there is none. */
function shortOf(answer, faults, old) {
  if (old)
    return `µ = –, ${faults.length ? `check ${faults.map(called).join(", ")}` : "no answer"}`;
  return `µ = ${inLine(answer)}, ${some(answer)}${shareOf(answer)} left`;
}

/** The share of µ₀ that is left: a value, or both ends. */
function shareOf(answer) {
  const { value: mu0 } = answer.inputs.mu0;
  const ends = shownEnds(answer)?.map((end) => Math.min(end / mu0, 1));
  const [from, to] = (ends ?? [answer.mu_ratio, answer.mu_ratio]).map(percent);
  return from === to ? to : `${from.replace(" %", "")} to ${to}`;
}

/** Where an input has a deviation, the share has one, too. */
const some = (answer) => (answer.std ? "about " : "");

/** What of µ₀ is left, in words. */
const remains = (answer) => left(shareOf(answer), some(answer));

/** The regimes of an interval of k, and where one begins: a law over it. */
function regimes({ regime, border }, unit) {
  const [first, last] = [regime.at(0), regime.at(-1)].map(inWords);
  const places = border.map(({ value }) => inUnit("k", value, unit)).join(" and ");
  if (!border.length) return `${capital(first)} in the whole interval`;
  if (border.length === 1) return `${capital(first)} below k = ${places}, ${last} above it`;
  return `${capital(first)} to ${last}, with borders at k = ${places}`;
}

/** The regime, and which share of a period the contact sticks; of an interval, in its middle. */
function going(answer) {
  const name = capital(inWords(answer.regime));
  const middle = middleOf(answer);
  if (middle) return `${name} at ${middle}, the middle of the interval`;
  const stick = answer.stick_fraction;
  return stick > 0 && stick < 1 ? `${name}: sticks for ${percent(stick)} of each period` : name;
}

/** Per cent that µ changes when an input grows by 1 %, by input; null where it has none. */
export function sensitivities({ gradient, mu_macro: mu, inputs }) {
  if (!gradient || !mu) return [];
  return Object.entries(gradient).map(([name, slope]) => {
    const [input, per] = name === "omega" ? ["f", 2 * Math.PI] : [name, 1];
    const value = numberOf(inputs[input]);
    return [input, slope === null || value === undefined ? null : (slope * per * value) / mu];
  });
}

/** The largest speed of the oscillation [m/s], undefined where the load is shaken. */
export const peakOf = ({ y0, f }) => y0 && y0.value * 2 * Math.PI * f.value;

/**
 * The inputs that change µ most when they are 10 % more or less, as far as two digits tell, and k
 * beside them where it matters, which may then be given as an interval or fitted.
 */
function deciding(answer, effect) {
  const change = ([name, share]) =>
    Number((name === "k" && effect ? 100 * effect : Math.abs(10 * share)).toPrecision(2));
  const changes = sensitivities(answer).map((one) => [one[0], change(one)]);
  const most = Math.max(0, ...changes.map(([, size]) => size));
  if (!most) return null;
  const first = changes.filter(([, size]) => size === most).map(([name]) => name);
  const [, ofK = 0] = changes.find(([name]) => name === "k") ?? [];
  const matters = ofK >= SLIGHT;
  const each = first.length > 1 ? "each" : "it";
  const k = matters && !first.includes("k") ? `, 10 % of k by ${show(ofK)} %` : "";
  return {
    row: `${first.map(symbolOf).join(" and ")} decide${first.length > 1 ? "" : "s"} most`,
    words: `10 % of ${each} changes µ by ${show(most)} %${k}.`,
    remedy: matters && numberOf(answer.inputs.k),
  };
}

/** Where the deviation of the number comes from. */
function variance(answer) {
  const { mu_macro: mu, std, std_share: shares } = answer;
  const parts = Object.entries(shares ?? {}).filter(([, share]) => share >= 0.005);
  const words = parts
    .sort(([, a], [, b]) => b - a)
    .map(([name, share], i) => {
      const much = `${Math.round(100 * share)} %`;
      return `${much}${i ? "" : " of the variance"} from ${symbolOf(name)}`;
    });
  const [value, deviation] = withDeviation(mu, std);
  const middle = isRough(answer) ? `; to first order µ = ${value} ± ${deviation}.` : "";
  const origin = `${words.join(", ")}${middle || "; ± is one standard deviation."}`;
  return words.length ? origin : "";
}

/** A remark in the page's signs. */
const sentence = (text) => prose(text).replace(/[^.!?]$/, "$&.");

/** Rows of the model, with which the number says less than it seems to. */
const DOUBTS = ["first order", "std"];

/**
 * What is said of the number, the most urgent first: { row, words, doubt, own }, `own` where it is
 * no remark on the model.  The first of them is its line of advice.
 */
function sayings(answer) {
  const { remarks = [], model = [], inputs, mu_macro: mu } = answer;
  const said = new Set(remarks.map(({ row }) => row));
  const named = {
    std: "standard deviation",
    units: "check the units",
    [STIFFNESS]: "rigid contact", // of which alone it is a remark
    ...(answer.state.contact === "ball" && { "one spring": "a ball" }),
  };
  const stiffness = model.find(({ row }) => row === STIFFNESS);
  const others = model.filter((one) => one !== stiffness && !said.has(one.row));
  const rows = [...remarks, ...others].map(({ row, text }) => ({
    words: capital(sentence(text.replace(/^rigid: /, ""))),
    doubt: (said.has(row) && !text.endsWith(ALWAYS)) || DOUBTS.includes(row),
    row: named[row] ?? row,
  }));
  const unit = inputs.k.unit ?? undefined;
  const ends = [inputs.k.low, inputs.k.high].map((end) => inUnit("k", end, unit));
  const middle = middleOf(answer);
  const own = [
    middle && {
      row: "interval",
      words: `k from ${ends.join(" to ")}; µ = ${friction(mu, FEW)} at ${middle} (geometric mean).`,
    },
    answer.std && { row: "uncertainty", words: variance(answer) },
    !middle && (stiffness || !answer.std) && !said.has(STIFFNESS)
      ? deciding(answer, stiffness?.effect)
      : null,
  ];
  const doubts = rows.filter(({ doubt }) => doubt);
  const mine = own.filter((one) => one?.words).map((one) => ({ ...one, own: true }));
  return [...new Set([...doubts, ...mine, ...rows])];
}

/** How many remarks the case has beside its line of advice, in words. */
function counted(first, rest) {
  const count = rest.filter(({ own }) => !own).length;
  const more = first && !first.own ? "more " : "";
  return `${count || "No"} ${more}remark${count === 1 ? "" : "s"} on this case`;
}

export function numberPanel(store) {
  let law, asked; // over an interval of k, for its regimes
  const ends = new Channel(
    (question) => post("v1/law", question),
    (reply, question) => {
      law = { reply, question: JSON.stringify(question) };
      if (law.question === asked) write("regime", whole(regimes(reply, unit)));
    },
    () => {},
  );
  let unit; // of k, as it is typed
  /** Asks for the regimes of an interval, and returns what is known of the case until then. */
  function spread(answer) {
    const { k } = answer.inputs;
    if (!middleOf(answer)) {
      asked = null;
      return going(answer);
    }
    unit = k.unit ?? undefined;
    const range = { along: "k", start: k.low, stop: k.high, points: 2, scale: "log" };
    const question = { ...caseAround(answer.state, answer, "k"), ...range };
    const words = JSON.stringify(question);
    if (words !== asked && !store.dragged) {
      asked = words;
      ends.push(question);
    }
    return law?.question === words ? regimes(law.reply, unit) : going(answer);
  }

  /** What an earlier state has otherwise than that of the form, as its texts. */
  function otherwise(state) {
    const [before, now] = [caseOf(state), caseOf(store.state)];
    const names = Object.keys(before).filter((name) => before[name] !== now[name]);
    const text = (name) =>
      about.inputs[name]
        ? `${symbolOf(name)} = ${before[name]}`
        : `${about.titles[name].toLowerCase()} ${before[name]}`;
    return names.map(text).join(", ");
  }

  /** Why the number is not that of the form, which a field tells of itself, and whose it is. */
  function reasons(trouble, faults, shown) {
    if (!trouble?.text) return "";
    const told = faults.length && faults.every((name) => inputsOf(store.state).includes(name));
    const reason = told
      ? `Check ${faults.map(called).join(", ")}.`
      : prose(trouble.text).replace(/[^.!?]$/, "$&.");
    return whole(shown ? `${reason} The number shown is that of ${otherwise(shown)}.` : reason);
  }

  /** What can be done about a stiffness that matters. */
  function remedies(k) {
    if (!k) return nothing;
    const range = around(k);
    const words = `give k as ${range.replace("..", " to ")}`;
    return html`<span class="hint aside">k is rarely known to 10 %:</span>
      <button id="give" @click=${() => store.change({ k: range })}>${words}</button>
      <span class="hint">or</span>
      <button id="fit-k" @click=${() => store.look({ panel: "fit" })}>fit it</button>`;
  }

  $("number").replaceChildren(); // what stands there until the first answer
  return (answer, trouble, old) => {
    const faults = [...(trouble?.faults?.keys() ?? [])];
    tell("status", reasons(trouble, faults, old ? answer.state : null), trouble?.calm);
    for (const part of document.querySelectorAll(".result")) part.classList.toggle("old", old);
    if (!answer) {
      render(html`<output id="mu" for="fields">…</output>`, $("number"));
      return;
    }
    const { value, std } = headline(answer, store.state.digits === "all");
    const length = value.length + (std ?? "").length / 2;
    $("number").classList.toggle("wide", length > 12 && length <= 16);
    $("number").classList.toggle("long", length > 16);
    const deviation = [
      std ? html`<wbr /><span id="std"> ± ${std}</span>` : nothing,
      answer.std ? html` <span id="std-name">(1 std. dev.)</span>` : nothing,
    ];
    render(html`<output id="mu" for="fields">${value}</output>${deviation}`, $("number"));
    write("share", remains(answer));
    write("regime", whole(spread(answer)));
    $("regime").classList.toggle("two", middleOf(answer) !== "");
    if (store.state.motion === "one") write("short", shortOf(answer, faults, old));
    $("advice").classList.toggle("old", old || store.dragged);
    if (store.dragged) return; // words may grow, and would move the map that is dragged
    const [first, ...rest] = sayings(answer);
    const said = ({ row, words }) => html`<b>${capital(row)}.</b> ${whole(words)}`;
    render(remedies(first?.remedy), $("remedies"));
    write("validity", counted(first, rest));
    render(first ? said(first) : nothing, $("advice"));
    $("advice").classList.toggle("doubt", Boolean(first?.doubt));
    for (const part of document.querySelectorAll("[data-of]"))
      part.hidden = part.dataset.of !== answer.state.contact;
    const line = (one) => html`<li class=${one.doubt ? "doubt" : ""}>${said(one)}</li>`;
    render(rest.map(line), $("rows"));
  };
}
