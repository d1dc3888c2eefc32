// "Solve for": which value of an input gives a wanted friction.
import { Channel, Refused, post } from "./api.js";
import { INPUTS, NAMES, symbolOf } from "./inputs.js";
import { readNumber } from "./read.js";
import { REGIMES, show, watts, withUnit } from "./show.js";

const $ = (id) => document.getElementById(id);

const asked = ({ values, rigid }) => JSON.stringify([values, rigid]);

export class Solver {
  /** `use(name, value)` takes a found value over; `fail(error)` where there is none for want of the service. */
  constructor(use, fail) {
    this.use = use;
    $("unknown").append(...NAMES.map((name) => new Option(INPUTS[name].label, name)));
    $("unknown").value = "y0";
    this.channel = new Channel({
      ask: ({ request }) => post("v1/solve-for", request),
      answer: (found, question) => this.show(found, question.state),
      fail: (error) => {
        this.say(error instanceof Refused ? error.message : `${error.message} Asking again by itself.`);
        fail(error);
      },
    });
    $("solve-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.ask();
    });
    for (const id of ["unknown", "quantity", "target"]) $(id).addEventListener("input", () => this.clear());
  }

  /** Follows a state: what was found for another one is taken away. */
  sync(state) {
    this.state = state;
    if (this.found && this.found !== asked(state)) this.clear();
  }

  say(text) {
    $("solve-status").textContent = text;
    $("roots").replaceChildren();
  }

  clear() {
    this.channel.cancel();
    this.found = null;
    $("target").setAttribute("aria-invalid", "false");
    this.say("");
  }

  ask() {
    this.clear();
    const number = readNumber($("target").value);
    const [unknown, quantity] = [$("unknown").value, $("quantity").value];
    let fault = number.fault;
    if (!fault && !["", "%"].includes(number.unit)) fault = `“${number.unit}” is no unit of friction: leave it out`;
    else if (!fault && number.value < 0) fault = "must be >= 0";
    else if (unknown === "mu0" && quantity === "mu_ratio") fault = "as a share of µ₀ makes no sense for µ₀: give µ";
    if (fault) {
      $("target").setAttribute("aria-invalid", "true");
      this.say(`The target ${fault}.`);
      return;
    }
    const { values, rigid } = this.state;
    const request = { ...values, ...(rigid ? { k: null } : {}), unknown, quantity, target: number.unit === "%" ? number.value / 100 : number.value, include: ["power"] };
    delete request[unknown];
    this.found = asked(this.state);
    this.channel.push({ request, state: this.state });
  }

  show(found, state) {
    const { unknown, reachable, results: [{ roots, reason }] } = found;
    const unit = state.units[unknown];
    const symbol = symbolOf(unknown, unit);
    if (!roots.length) {
      const bounds = `${reachable.min_included ? "from" : "from above"} ${show(reachable.min, 4)} ${reachable.max_included ? "to" : "to below"} ${show(reachable.max, 4)}`;
      const constant = reachable.min === reachable.max;
      this.say(constant ? reason : `No value of ${symbol} gives that: ${found.quantity === "mu_ratio" ? "µ/µ₀" : "µ"} can be ${bounds} here.`);
      return;
    }
    this.say(roots.length > 1 ? `${roots.length} values give it:` : "");
    $("roots").replaceChildren(...roots.map((root) => {
      const item = document.createElement("li");
      const text = `${symbol} = ${withUnit(unknown, root.value, unit, 6)}: µ = ${show(root.mu_macro, 5)}, ${REGIMES[root.regime]}`;
      const take = Object.assign(document.createElement("button"), { type: "button", textContent: "Use" });
      take.setAttribute("aria-label", `use ${symbol} = ${withUnit(unknown, root.value, unit, 6)}`);
      take.addEventListener("click", () => {
        this.found = null; // it stays on the screen until something else changes
        this.use(unknown, root.value);
        this.found = asked(this.state);
      });
      const power = root.power?.oscillation ?? null;
      item.append(Object.assign(document.createElement("span"), { textContent: power === null ? text : `${text}, shaker ${watts(power)}` }), take);
      return item;
    }));
  }
}
