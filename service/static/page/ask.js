// Asking and its failures: one question in flight, what is told of it, the API key and its field.
// Who answers is said in service.js.

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
    busy();
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

const $ = (id) => document.getElementById(id);
const channels = [];

/** Whether anything is asked, for who waits for it. */
const busy = () => $("main")?.setAttribute("data-asking", String(!channels.every((one) => one.idle)));

/** One place of the page: its reasons by topic, shown in `place`; `shown` is grey while there is one. */
export class Status {
  constructor(place, shown) {
    Object.assign(this, { place: $(place), shown: $(shown), reasons: new Map(), answered: false });
  }

  /** Says what is wrong with a topic, or (null) that nothing is; `calm`: it mends itself, or is not typed yet. */
  set(topic, text, calm = false) {
    const old = this.answered ? " Grey results belong to earlier values." : "";
    if (text) this.reasons.set(topic, { text: text + old, calm });
    else this.reasons.delete(topic);
    // one reason is enough; what the user can mend comes first
    const first = this.reasons.get("typed") ?? [...this.reasons.values()][0];
    if (this.place.textContent !== (first?.text ?? "")) this.place.textContent = first?.text ?? "";
    this.place.classList.toggle("bad", first?.calm === false);
    this.shown.classList.toggle("old", this.reasons.size > 0);
  }

  clear() {
    for (const topic of [...this.reasons.keys()]) this.set(topic, null);
  }

  /** A channel whose failures are told here. */
  channel(topic, ask, use) {
    const made = new Channel({
      ask,
      answer: (found, asked) => {
        this.set(topic, null);
        use(found, asked);
      },
      fail: (error) => {
        if (error instanceof KeyWanted) wantKey();
        const text = error instanceof Unanswered ? `${error.message} Asking again by itself.` : error.message;
        this.set(topic, error instanceof KeyWanted ? null : text, !(error instanceof Refused));
      },
      wait: (waiting) => {
        if (waiting) this.set(topic, null);
        this.set(`${topic} slow`, waiting ? "Waiting for the service." : null, true);
        busy();
      },
    });
    channels.push(made);
    return made;
  }
}

// --- the API key: kept for this tab, sent as a header, never part of an address ------------------------------

const NAME = "mumacro-api-key";
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
