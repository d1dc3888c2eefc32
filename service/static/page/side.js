// Beside the law: the other numbers of the case, how much each input matters, and which value of
// an input reaches a target.
import { Channel } from "./ask.js";
import { $, write } from "./dom.js";
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

/** `found(mark)` hears of the target that is asked for, null of none. */
export function sidePanel(store, moved, found) {
  let answer, asked, solved;
  let refusal = null;
  const channel = new Channel(
    (question) => post("v1/solve-for", question),
    (reply, question) => {
      asked = JSON.stringify(question);
      solved = { reply, question };
      draw();
      found(markOf());
    },
    (reason) => {
      refusal = reason;
      compare();
    },
  );

  /** The target's line in the plots. */
  function markOf() {
    const { reply, question } = solved;
    const mu0 = answer.inputs.mu0.value;
    const mu =
      reply.quantity === "mu_ratio" ? reply.results[0].target * mu0 : reply.results[0].target;
    return { along: reply.unknown, mu_macro: mu, mu_ratio: mu / mu0, question };
  }

  function question() {
    const { unknown, quantity, target } = store.state;
    const power =
      store.state.direction !== "normal" && store.state.contact !== "rigid"
        ? { include: ["power"] }
        : {};
    return { ...caseAround(store.state, answer, unknown), unknown, quantity, target, ...power };
  }

  function draw() {
    const { reply } = solved;
    const { unknown, reachable, results } = reply;
    const typed = answer.inputs[unknown]?.unit;
    const [{ roots }] = results;
    const line = ({ value, mu_macro: mu, regime, power }) => {
      const digits = store.state.digits === "all" ? 6 : 4;
      const shown = inUnit(unknown, value, unitAt(unknown, value, typed), digits);
      const text = `${about.inputs[unknown].symbol} = ${shown}`;
      const shaker = power ? `, shaker ${prefixed(power.oscillation, "W")}` : "";
      return html`<li>
        <span><b>${text}</b>: µ = ${friction(mu, 4)}, ${inWords(regime)}${shaker}</span>
        <button
          class="use"
          aria-label=${`Use ${text}`}
          @click=${() => moved({ [unknown]: value }, 6)}
        >
          Use
        </button>
      </li>`;
    };
    const range = `${show(reachable.min)} to ${show(reachable.max)}`;
    const none = `No value gives that: here it can be ${range}.`;
    render(roots.length ? roots.map(line) : html`<li>${none}</li>`, $("solve-result"));
    compare();
  }

  /** A result of other values is grey; a refusal says why there is no other. */
  function compare() {
    const old = Boolean(solved && answer && JSON.stringify(question()) !== asked);
    $("solve-result").classList.toggle("old", old);
    write("solve-status", refusal ?? (old ? "This was asked with other values." : ""));
    $("solve-status").classList.toggle("bad", refusal !== null);
  }

  $("solve-form").addEventListener("submit", (event) => {
    event.preventDefault();
    const form = new FormData($("solve-form"));
    store.change(Object.fromEntries(form));
    if (answer) channel.push(question());
  });
  $("solve-form").addEventListener("change", ({ target: { name, value } }) =>
    store.change({ [name]: value }),
  );
  const tab = tabs("side-tabs", (side) => store.look({ side }));

  return (latest) => {
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
    render(bars(answer), $("bars"));
    compare();
  };
}
