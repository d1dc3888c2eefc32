// Asking and its failures: one question in flight, the API key and its field.  Who answers is said in service.js.

/** The service wants a key, or another one. */
export class KeyWanted extends Error {}

/** No answer for now: worth asking again after so many seconds, or when the channel thinks so. */
export class Unanswered extends Error {
  constructor(message, seconds = null) {
    super(message);
    this.seconds = seconds;
  }
}

/** What was asked is refused. */
export class Refused extends Error {}

const SLOW_MS = 1_500; // after which the old answer is marked as old
const AGAIN_S = [1, 2, 4, 8]; // between attempts, as long as there is no answer

/**
 * One question in flight; while it is, only the newest of those that come is kept.  Where there is no answer it is
 * asked again until there is one.
 *
 * `ask(question)` -> answer; `answer(found, question)`; `fail(error)` after each failure; `wait(slow)` with true when
 * an answer takes long, with false when there is one.
 */
export class Channel {
  constructor({ ask, answer, fail = () => {}, wait = () => {} }) {
    Object.assign(this, { ask, answer, fail, wait, busy: false, next: null, tries: 0, timer: null });
    addEventListener("online", () => this.timer !== null && this.run());
  }

  push(question) {
    this.next = { question };
    if (!this.busy) this.run();
  }

  /** Forgets what is asked: its answer is of no use any more. */
  cancel() {
    clearTimeout(this.timer);
    Object.assign(this, { next: null, timer: null, dropped: true });
  }

  get idle() {
    return !this.busy && this.timer === null;
  }

  async run() {
    clearTimeout(this.timer);
    Object.assign(this, { busy: true, timer: null });
    const slow = setTimeout(() => this.wait(true), SLOW_MS);
    while (this.next !== null && this.timer === null) {
      const asked = this.next;
      Object.assign(this, { next: null, dropped: false });
      try {
        const found = await this.ask(asked.question);
        this.tries = 0;
        if (this.next === null && !this.dropped) this.answer(found, asked.question);
      } catch (error) {
        if (this.next === null && !this.dropped) this.failed(error, asked);
      }
    }
    clearTimeout(slow);
    this.busy = false;
    this.wait(false);
  }

  failed(error, asked) {
    this.fail(error);
    if (error instanceof Unanswered) {
      const seconds = error.seconds ?? AGAIN_S[Math.min(this.tries, AGAIN_S.length - 1)];
      this.tries += 1;
      this.next = asked;
      this.timer = setTimeout(() => this.run(), 1000 * seconds);
    } else if (!(error instanceof KeyWanted || error instanceof Refused)) throw error;
  }
}

// --- the API key: kept for this tab, sent as a header, never part of an address ------------------------------

const NAME = "mumacro-api-key";
const $ = (id) => document.getElementById(id);
let held = null;

/** What the tab stores, or null; storage that is switched off holds nothing: the key then lives as long as the page. */
function stored(change = (storage) => storage.getItem(NAME)) {
  try {
    return change(sessionStorage) ?? null;
  } catch {
    return null;
  }
}

const apiKey = () => (held ??= stored());

function setKey(key) {
  held = key;
  stored((storage) => (key === null ? storage.removeItem(NAME) : storage.setItem(NAME, key)));
}

/** The options of a request, with the key where there is one; its answer is then kept by nobody. */
export const withKey = (headers = {}) =>
  (apiKey() === null ? { headers } : { headers: { ...headers, "X-API-Key": apiKey() }, cache: "no-store" });

/** Shows the field for the key; says so when the one that was sent is not it. */
export function wantKey() {
  if (apiKey() !== null) $("key-status").textContent = "That is not the key of this service.";
  setKey(null);
  if ($("forget")) $("forget").hidden = true;
  if (!$("key-form").hidden) return;
  $("key-form").hidden = false;
  $("key").focus();
}

/** The key was taken, or none is wanted. */
export function keyTaken() {
  $("key-form").hidden = true;
  if ($("forget")) $("forget").hidden = apiKey() === null;
}

/** Calls `begin` when a key was entered. */
export function onKey(begin) {
  $("key-form").addEventListener("submit", (event) => {
    event.preventDefault();
    const key = $("key").value.trim();
    const usable = /^[!-~]{1,512}$/.test(key);
    $("key-status").textContent = usable ? "" : "A key has 1 to 512 characters: letters, digits, signs, no spaces.";
    if (!usable) return;
    $("key").value = "";
    setKey(key);
    begin();
  });
  $("forget")?.addEventListener("click", () => {
    setKey(null);
    location.reload();
  });
}
