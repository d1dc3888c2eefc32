// Questions and their answers: who answers is said in service.js.
export { KeyWanted, Refused } from "./failures.js";
export { get, post } from "./service.js";
import { KeyWanted, Refused, Unanswered } from "./failures.js";

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
