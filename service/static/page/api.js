// Questions to the service.
import { withKey } from "./key.js";

const WAIT_MS = 20_000; // for an answer
const SLOW_MS = 1_500; // after which the old answer is marked as old
const AGAIN_S = [1, 2, 4, 8]; // between attempts, as long as there is no answer

/** The service wants a key, or another one. */
export class KeyWanted extends Error {}

/** No answer for now: worth asking again after so many seconds, or when the channel thinks so. */
class Unanswered extends Error {
  constructor(message, seconds = null) {
    super(message);
    this.seconds = seconds;
  }
}

/** What was asked is refused; `faults` are { field, reason }. */
export class Refused extends Error {
  constructor(message, faults) {
    super(message);
    this.faults = faults;
  }
}

async function ask(path, options) {
  let response, body;
  try {
    response = await fetch(path, { ...options, signal: AbortSignal.timeout(WAIT_MS) });
    body = await response.json();
  } catch (error) {
    if (response === undefined || error.name === "TimeoutError") throw new Unanswered("The service does not answer.");
    throw new Unanswered(`The response of the service cannot be read (status ${response.status}).`);
  }
  if (response.ok) return body;
  if (response.status === 401) throw new KeyWanted("This service asks for an API key.");
  const why = body.detail ?? `status ${response.status}`;
  if (response.status >= 500 || response.status === 408 || response.status === 429) {
    throw new Unanswered(`The service cannot answer now: ${why}.`, Number(response.headers.get("Retry-After")) || null);
  }
  throw new Refused(`The service refuses this: ${why}.`, body.errors ?? []);
}

const query = (values) => new URLSearchParams(Object.entries(values).filter(([, value]) => value !== undefined));
export const get = (path, values) => ask(values ? `${path}?${query(values)}` : path, withKey());
export const post = (path, body) =>
  ask(path, { method: "POST", ...withKey({ "Content-Type": "application/json" }), body: JSON.stringify(body) });

/**
 * One question in flight; while it is, only the newest of those that come is kept.  Where there is no answer it is
 * asked again until there is one.
 *
 * `ask(question)` -> answer; `answer(found, question)`; `fail(error)` after each failure; `wait(slow)` with true when
 * an answer takes long, with false when there is one.
 */
export class Channel {
  constructor({ ask: question, answer, fail, wait = () => {} }) {
    Object.assign(this, { ask: question, answer, fail, wait, busy: false, next: null, tries: 0, timer: null, unanswered: null });
    addEventListener("online", () => this.again());
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
    while (this.next !== null) {
      const { question } = this.next;
      Object.assign(this, { next: null, dropped: false });
      try {
        const found = await this.ask(question);
        this.tries = 0;
        if (this.next === null && !this.dropped) this.answer(found, question);
      } catch (error) {
        if (this.next !== null || this.dropped) continue;
        this.fail(error);
        if (error instanceof Unanswered) this.later(question, error.seconds);
        else if (!(error instanceof KeyWanted || error instanceof Refused)) throw error;
      }
    }
    clearTimeout(slow);
    this.busy = false;
    this.wait(false);
  }

  /** Asks the same again after some seconds. */
  later(question, seconds) {
    const wait = seconds ?? AGAIN_S[Math.min(this.tries, AGAIN_S.length - 1)];
    this.tries += 1;
    this.unanswered = { question };
    this.timer = setTimeout(() => this.again(), 1000 * wait);
  }

  again() {
    if (this.timer === null) return;
    this.next = this.unanswered;
    this.run();
  }
}
