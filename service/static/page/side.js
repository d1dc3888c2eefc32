// Beside the law: the other numbers of the case, how much each input matters, and which value of
// an input reaches a target.
import { Channel } from "./ask.js";
import { $, write } from "./dom.js";
import { html, render, svg } from "../lib/lit-html.js";
import { post } from "./service.js";
import { caseAround, inputsOf } from "./state.js";
import { about, friction, inUnit, inWords, numberOf, prefixed, show, typeset } from "./words.js";

/** Tabs: buttons that show one of several parts. */
export function tabs(id) {
  const buttons = [...$(id).querySelectorAll("[role=tab]")];
  function choose(button, focus = false) {
    for (const one of buttons) {
      const chosen = one === button;
      one.setAttribute("aria-selected", String(chosen));
      one.tabIndex = chosen ? 0 : -1;
      $(one.getAttribute("aria-controls")).hidden = !chosen;
    }
    if (focus) button.focus();
  }
  buttons.forEach((button, i) => {
    button.addEventListener("click", () => choose(button));
    button.addEventListener("keydown", ({ key }) => {
      const way = { ArrowRight: 1, ArrowLeft: -1 }[key];
      if (way) choose(buttons.at((i + way) % buttons.length), true);
    });
  });
  choose(buttons[0]);
}

/** The other numbers of a case: [name, explanation, value]. */
function numbers(answer, all) {
  const { groups = {}, limits = {}, power, settling, stick_fraction: stick, inputs } = answer;
  const digits = all ? 10 : 4;
  const amplitude = inputs.y0?.value;
  const peak = amplitude === undefined ? null : amplitude * 2 * Math.PI * inputs.f.value;
  const rows = [
    ["µ/µ₀", "share of the friction that remains", show(answer.mu_ratio, digits)],
    ["static µ", "µ where v₀ goes to 0", show(limits.mu_static, digits)],
    [
      "border v₀",
      "from this speed on the contact slides all the time",
      prefixed(limits.v0_crit, "m/s"),
    ],
    ["peak y₀ω", "largest speed of the oscillation", prefixed(peak, "m/s")],
    [
      "sticks",
      "share of the period in which the contact sticks",
      stick === undefined || stick === null ? "–" : `${show(100 * stick, digits)} %`,
    ],
    [
      "shaker power",
      "mean power that the oscillation takes",
      prefixed(power?.oscillation, "W", digits),
    ],
    [
      "power saved",
      "what the drive needs less than without oscillation: (µ₀ − µ) Fz v₀",
      prefixed(power?.saved, "W", digits),
    ],
    [
      "settles in",
      "periods until a small disturbance has fallen to 1 %",
      settling === undefined ? "–" : `${show(settling.periods ?? Infinity, 3)} periods`,
    ],
    ["ṽ", "v₀/(l₀ω), dimensionless speed", show(groups.v_tilde ?? Infinity, digits)],
    [
      "ỹ",
      inputs.y0 ? "y₀/l₀, dimensionless amplitude" : "ΔFz/Fz",
      show(groups.y_tilde ?? Infinity, digits),
    ],
    [
      "l₀",
      "µ₀Fz/k: how far the contact is drawn before it slips",
      prefixed(groups.l0, "m", digits),
    ],
    ["error ≤", "bound of the numerical error of µ", show(answer.error_bound, 2)],
  ];
  return rows;
}

/** Per cent that µ changes when an input grows by 1 %, and its deviation's share. */
function bars({ gradient, mu_macro: mu, inputs }) {
  if (!gradient || !mu) return html`<p class="hint">There is none: µ is 0.</p>`;
  const names = Object.keys(gradient);
  const shares = names.map((name) => {
    const [input, per] = name === "omega" ? ["f", 2 * Math.PI] : [name, 1];
    const value = numberOf(inputs[input]);
    const share =
      gradient[name] === null || value === undefined ? null : (gradient[name] * per * value) / mu;
    return [input, share];
  });
  const most = Math.max(1, ...shares.map(([, share]) => Math.abs(share)));
  return html`<table>
    <tbody>
      ${shares.map(([name, share]) => {
        const width = (50 * Math.abs(share)) / most;
        return html`<tr>
          <th scope="row">${typeset(about.inputs[name].symbol)}</th>
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
          <td>
            ${share === null ? "–" : `${share < 0 ? "−" : "+"}${Math.abs(share).toFixed(3)} %`}
          </td>
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
    const unit = answer.inputs[unknown]?.unit ?? undefined;
    const [{ roots }] = results;
    const line = ({ value, mu_macro: mu, regime, power }) => {
      const text = `${about.inputs[unknown].symbol} = ${inUnit(unknown, value, unit, 6)}`;
      const shaker = power ? `, shaker ${prefixed(power.oscillation, "W")}` : "";
      return html`<li>
        <span><b>${text}</b>: µ = ${friction(mu, 4)}, ${inWords(regime)}${shaker}</span>
        <button
          class="use"
          aria-label=${`Use ${text}`}
          @click=${() => moved({ [unknown]: value }, 12)}
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
  tabs("side-tabs");

  return (latest) => {
    answer = latest;
    const names = inputsOf(store.state);
    const option = (name) =>
      html`<option value=${name} ?selected=${store.state.unknown === name}>
        ${about.inputs[name].symbol}
      </option>`;
    render(names.map(option), $("unknown"));
    $("quantity").value = store.state.quantity;
    $("target").value = store.state.target;
    if (!answer) return;
    const rows = numbers(answer, store.state.digits === "all");
    render(
      rows.map(
        ([name, meaning, value]) =>
          html`<div>
            <dt title=${meaning} tabindex="0">${name}</dt>
            <dd>${value}</dd>
          </div>`,
      ),
      $("values"),
    );
    write(
      "origin",
      `Block ${answer.source} of the table ${answer.table.id}, ` +
        `built to ${show(answer.table.tolerance)}.`,
    );
    render(bars(answer), $("bars"));
    compare();
  };
}
