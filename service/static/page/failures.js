// Why there is no answer.

/** The service wants a key, or another one. */
export class KeyWanted extends Error {}

/** No answer for now: worth asking again after so many seconds, or when the channel thinks so. */
export class Unanswered extends Error {
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
