// Asking and its failures: one question in flight, its report, the API key and its field.
// The questions themselves are in service.js.
import { $, markBusy } from "./dom.js";

const SLOW_MS = 1_500; // after which the old answer is marked as old
const AGAIN_S = 3; // between attempts, where the service does not say it
const channels = [];
const wakeAll = () => channels.forEach((one) => one.wake());
addEventListener("online", wakeAll);

/**
 * One question in flight; while it is, only the newest of those that come is kept.  Where there is
 * no answer it is asked again until there is one: after a while, when the network is back, or when
 * a key is entered.
 *
 * `ask(question)` -> { answer }, or why not: { refused }, { later, seconds } or { key: true };
 * `use(answer, question)`; `report(reason, calm, reply)`: null where there is no reason, calm where
 * it mends itself; a refusal has its faults and what was understood.
 */
export class Channel {
  constructor(ask, use, report) {
    Object.assign(this, { ask, use, report, next: null, busy: false, wake: () => {} });
    channels.push(this);
  }

  push(question) {
    this.next = { question };
    this.wake();
    if (!this.busy) this.run();
  }

  async run() {
    this.mark(true);
    while (this.next !== null) {
      const pending = this.next;
      this.next = null;
      const slow = setTimeout(() => this.report("Waiting for the service.", true), SLOW_MS);
      const reply = await this.ask(pending.question);
      clearTimeout(slow);
      if (this.next !== null) continue;
      if (reply.later || reply.key) await this.again(pending, reply);
      else {
        showKeyForm(false); // the key was taken, or none is needed
        this.report(reply.refused ?? null, false, reply);
        if (!reply.refused) this.use(reply.answer, pending.question);
      }
    }
    this.mark(false);
  }

  again(pending, { later, seconds, key }) {
    this.next = pending;
    this.report(later ? `${later} Retrying automatically.` : null, true);
    if (key) showKeyForm(true);
    return new Promise((wake) => {
      this.wake = wake;
      if (later) setTimeout(wake, 1000 * (seconds ?? AGAIN_S));
    });
  }

  mark(busy) {
    this.busy = busy;
    markBusy(this, busy);
  }
}

// The API key is kept for this tab, sent as a header, never part of an address.
const NAME = "mumacro-api-key";
/**
 * What `use(storage)` is; null where storage is switched off: there the key lives as long as the
 * page.
 */
function stored(use) {
  try {
    return use(sessionStorage);
  } catch {
    return null;
  }
}
let apiKey = stored((all) => all.getItem(NAME));

function setKey(key) {
  apiKey = key;
  stored((all) => (key === null ? all.removeItem(NAME) : all.setItem(NAME, key)));
}

/** The options of a request, with the key where there is one; its answer is then kept by nobody. */
export const withKey = (headers = {}) =>
  apiKey === null
    ? { headers }
    : { headers: { ...headers, "X-API-Key": apiKey }, cache: "no-store" };

/** Asks for the key, and says so when the one that was sent is not it; or does not ask. */
function showKeyForm(needed) {
  if (needed && apiKey !== null)
    $("key-status").textContent = "That is not the key of this service.";
  if (needed) setKey(null);
  if ($("forget")) $("forget").hidden = apiKey === null;
  if ($("key-form").hidden === !needed) return;
  $("key-form").hidden = !needed;
  if (needed) $("key").focus();
}

$("key-form").addEventListener("submit", (event) => {
  event.preventDefault();
  const key = $("key").value.trim();
  const usable = /^[!-~]{1,512}$/.test(key);
  $("key-status").textContent = usable
    ? ""
    : "A key has 1 to 512 characters: letters, digits, signs, no spaces.";
  if (!usable) return;
  $("key").value = "";
  setKey(key);
  wakeAll();
});
$("forget")?.addEventListener("click", () => {
  setKey(null);
  location.reload();
});
