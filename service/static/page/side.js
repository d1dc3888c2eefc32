// Beside the law: the other numbers of the case, how much each input matters, and which value of
// an input reaches a target.
import { Channel } from "./ask.js";
import { $, tell, write } from "./dom.js";
import { html, nothing, render, svg } from "../lib/lit-html.js";
import { list } from "./meanings.js";
import { inLine, peakOf, sensitivities } from "./number.js";
import { post } from "./service.js";
import { caseAround, inputsOf, kindOf } from "./state.js";
import {
  about,
  friction,
  inUnit,
  inWords,
  middleOf,
  prefixed,
  prose,
  show,
  unitAt,
  whole,
} from "./words.js";

/**
 * Tabs: buttons "tab-name" that show one of several parts; `chosen(name)` hears which, and the
 * returned function chooses one by its name.
 */
function tabs(id, chosen = () => {}) {
  const buttons = [...$(id).querySelectorAll("[role=tab]")];
  function choose(button, focus = false) {
    turn(button);
    if (focus) button.focus();
    chosen(button.id.replace("tab-", ""));
  }
  function turn(button) {
    for (const one of buttons) {
      const selected = one === button;
      one.setAttribute("aria-selected", String(selected));
      one.tabIndex = selected ? 0 : -1;
      $(one.getAttribute("aria-controls")).hidden = !selected;
    }
  }
  buttons.forEach((button, i) => {
    button.addEventListener("click", () => choose(button));
    button.addEventListener("keydown", ({ key }) => {
      const way = { ArrowRight: 1, ArrowLeft: -1 }[key];
      if (way) choose(buttons.at((i + way) % buttons.length), true);
    });
  });
  turn(buttons[0]);
  return (name) => turn(buttons.find((one) => one.id === `tab-${name}`));
}

const TAKEN = 6; // digits of a value that is taken into the form
const MOST = 7; // digits that have room beside a unit

/** The other numbers of a case, as `list` takes them. */
function numbers(answer, all) {
  const {
    groups = {},
    limits = {},
    power,
    settling,
    stick_fraction: stick,
    inputs,
    state,
  } = answer;
  const digits = all ? MOST : 4;
  const lacks = about.lacks[kindOf(state)];
  const without = (name, words) =>
    lacks[name] ? [words, lacks[name]] : ["rigid contact", "it is not given for a rigid contact"];
  // the service has no group that is not finite, nor ṽ where nothing oscillates
  const rigid = state.contact === "rigid";
  const still = groups.y_tilde === 0;
  const group = (name) => {
    const value = groups[name] ?? (still || rigid ? null : Infinity);
    return value === null ? null : show(value, digits);
  };
  const why = rigid
    ? ["rigid contact", "it is infinite for a rigid contact"]
    : ["not shaken", "it is not given where nothing oscillates"];
  const amount = (value, unit, some = digits) =>
    value === null || value === undefined ? null : prefixed(value, unit, some);
  return [
    ["µ/µ₀", "share of the friction that remains", show(answer.mu_ratio, digits)],
    ["static µ", "µ where v₀ goes to 0", show(limits.mu_static, digits)],
    [
      "critical speed",
      "from this speed on the contact slides all the time",
      prefixed(limits.v0_crit, "m/s"),
    ],
    [
      "peak y₀ω",
      "largest speed of the oscillation",
      amount(peakOf(inputs), "m/s", 4),
      "load shaken",
      "the load is shaken, not the body",
    ],
    [
      "sticks",
      "share of the period in which the contact sticks",
      stick === undefined || stick === null ? null : `${show(100 * stick, digits)} %`,
      ...without("stick_fraction", "not modelled"),
    ],
    [
      "shaker power",
      "mean power that the oscillation takes",
      amount(power?.oscillation, "W"),
      ...without("power", "not modelled"),
    ],
    [
      "power saved",
      "what the drive needs less than without oscillation: (µ₀ − µ) Fz v₀",
      amount(power?.saved, "W"),
      ...without("power", "not modelled"),
    ],
    [
      "periods to settle",
      "until a small disturbance has fallen to 1 %",
      settling === undefined ? null : show(settling.periods ?? Infinity, digits),
      ...without("settling", "across only"),
    ],
    ["numerical error", "at most, of µ", `≤ ${show(answer.error_bound, 2)}`],
    ["ṽ", "v₀/(l₀ω), dimensionless speed", group("v_tilde"), ...why],
    ["ỹ", inputs.y0 ? "y₀/l₀, dimensionless amplitude" : "ΔFz/Fz", group("y_tilde"), ...why],
    [
      "l₀",
      "µ₀Fz/k: how far the contact is drawn before it slips",
      prefixed(groups.l0, "m", digits),
    ],
  ];
}

const signed = (share) => `${share < 0 ? "−" : "+"}${Math.abs(share).toFixed(2)} %`;
/** Why an input has no sensitivity. */
const none = (name) => (name === "k" ? "rigid" : "kink at 0");

/** Per cent that µ changes when an input grows by 1 %; where inputs have deviations, what each of
 * them has of the variance of µ. */
function bars(answer) {
  const { std_share: variance } = answer;
  const shares = sensitivities(answer);
  if (!shares.length) return html`<p class="hint">There is none: µ is 0.</p>`;
  const part = (name) => Math.round(100 * (variance[name === "f" ? "omega" : name] ?? 0));
  const most = Math.max(1, ...shares.map(([, share]) => Math.abs(share)));
  return html`<table>
    ${
      variance
        ? html`<thead>
            <tr>
              <th scope="col" colspan="3">change</th>
              <th scope="col" title="what the ± of an input has of the variance of µ">variance</th>
            </tr>
          </thead>`
        : nothing
    }
    <tbody>
      ${shares.map(([name, share]) => {
        const width = (50 * Math.abs(share)) / most;
        return html`<tr>
          <th scope="row">${about.inputs[name].symbol}</th>
          <td>
            <svg class="bar" viewBox="0 0 100 10" preserveAspectRatio="none" aria-hidden="true">
              ${svg`
                <rect
                  x=${share < 0 ? 50 - width : 50}
                  width=${width}
                  height="10"
                  class=${share < 0 ? "less" : "more"}
                />
                <path d="M50 0v10" />`}
            </svg>
          </td>
          <td class="change">${share === null ? `– ${none(name)}` : signed(share)}</td>
          ${
            variance
              ? html`<td class="variance">${part(name) ? `${part(name)} %` : "–"}</td>`
              : nothing
          }
        </tr>`;
      })}
    </tbody>
  </table>`;
}

/** `found(mark)` hears of the target that is asked for while its tab is open, else null. */
export function sidePanel(store, moved, found) {
  let answer, asked, solved, unreached; // the target that no value of its input reaches
  let helpful = []; // other inputs that can reach a target which this one cannot
  const channel = new Channel(
    (body) => post("v1/solve-for", body),
    (reply, body) => {
      if (JSON.stringify(body) !== asked) return; // the tab was closed
      solved = reply;
      helpful = [];
      draw();
      found(markOf());
    },
    (reason, calm) => {
      tell("solve-status", reason && prose(reason), calm);
      if (!reason || calm) return;
      solved = null;
      draw();
      found(null);
    },
  );
  /** Asks for the target by each of the other inputs at once; what cannot be asked is no help. */
  const others = new Channel(
    async (bodies) => {
      const replies = await Promise.all(bodies.map((body) => post("v1/solve-for", body)));
      return replies.find((one) => one.later || one.key) ?? { answer: replies };
    },
    (replies) => {
      helpful = replies
        .filter((one) => one.answer?.results[0].roots.length)
        .map((one) => one.answer.unknown);
      draw();
    },
    () => {},
  );
  const alternatives = () =>
    inputsOf(store.state)
      .filter((name) => name !== store.state.unknown)
      .filter((name) => name !== "k" || store.state.contact !== "rigid")
      .map((name) => question(name));

  /** The target's line in the plots. */
  function markOf() {
    const { unknown, quantity, results: found } = solved;
    const mu0 = answer.inputs.mu0.value;
    const mu = quantity === "mu_ratio" ? found[0].target * mu0 : found[0].target;
    return { along: unknown, mu_macro: mu, mu_ratio: mu / mu0 };
  }

  function question(unknown = store.state.unknown) {
    const { quantity, target } = store.state;
    const power =
      store.state.direction !== "normal" && store.state.contact !== "rigid"
        ? { include: ["power"] }
        : {};
    return { ...caseAround(store.state, answer, unknown), unknown, quantity, target, ...power };
  }

  /** The values that reach the target; where there is none, which inputs can. */
  function draw() {
    render(solved ? results(solved) : nothing, $("solve-result"));
  }

  function results({ unknown, reachable, results: [{ roots }] }) {
    const typed = answer.inputs[unknown]?.unit;
    const { symbol } = about.inputs[unknown];
    const digits = store.state.digits === "all" ? TAKEN : 4;
    const line = ({ value, mu_macro: mu, regime, power }) => {
      const text = `${symbol} = ${inUnit(unknown, value, unitAt(unknown, value, typed), digits)}`;
      const shaker = power ? `, shaker ${prefixed(power.oscillation, "W")}` : "";
      return html`<li>
        <span><b>${text}</b>: µ = ${friction(mu, 4)}, ${inWords(regime)}${shaker}</span>
        <button
          class="use"
          aria-label=${`Use ${text}`}
          @click=${() => moved({ [unknown]: value }, TAKEN)}
        >
          Use
        </button>
      </li>`;
    };
    if (roots.length) return roots.map(line);
    const range = `${show(reachable.min)} to ${show(reachable.max)}`;
    const none = `No value of ${symbol} gives that: here it can be ${range}.`;
    const other = (name) =>
      html`<button data-try=${name} @click=${() => store.change({ unknown: name })}>
        try ${about.inputs[name].symbol}
      </button>`;
    return html`<li>${none}</li>
      <li class="ways">${helpful.map(other)}</li>`;
  }

  $("solve-form").addEventListener("submit", (event) => event.preventDefault());
  $("solve-form").addEventListener("change", ({ target: { name, value } }) =>
    store.change({ [name]: value }),
  );
  /** Solves while the tab is open, and the case has a number. */
  function solve(old) {
    const open = store.state.side === "target";
    if (!open && asked) {
      asked = solved = null;
      found(null);
    }
    if (!open || old) return;
    const body = question();
    const words = JSON.stringify(body);
    if (words !== asked) channel.push(body);
    asked = words;
    const none = solved && !channel.busy && !solved.results[0].roots.length;
    if (!none || store.dragged || words === unreached) return;
    unreached = words;
    others.push(alternatives());
  }
  const tab = tabs("side-tabs", (side) => store.look({ side }));

  return (latest, old) => {
    answer = latest;
    tab(store.state.side);
    const names = inputsOf(store.state);
    const option = (name) =>
      html`<option value=${name} ?selected=${store.state.unknown === name}>
        ${about.inputs[name].symbol}
      </option>`;
    render(names.map(option), $("unknown"));
    $("quantity").value = store.state.quantity;
    $("target").value = store.state.target;
    document.querySelector("[data-meanings=values]").disabled = !answer;
    if (!answer) return;
    const origin = `All are from the block ${answer.source} of the table ${answer.table.id}.`;
    const middle = middleOf(answer);
    const rest = middle ? `at ${middle}` : answer.std && "without\u00a0±";
    write("middle", rest ? whole(`µ = ${inLine(answer)}; all else ${rest}.`) : "");
    list("values", numbers(answer, store.state.digits === "all"), origin);
    write("bars-of", whole(`Change of µ when an input grows by 1 %${middle && `, at ${middle}`}`));
    render(bars(answer), $("bars"));
    draw(); // with as many digits as are wanted now
    solve(old);
  };
}
