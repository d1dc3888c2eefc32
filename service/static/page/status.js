// What is wrong, in words, and what of the page is therefore old.

/** One place of the page: its reasons by topic, shown in `place`; `shown` is greyed while there is one. */
export class Status {
  constructor(place, shown) {
    Object.assign(this, { place, shown, reasons: new Map() });
  }

  /** Says what is wrong with a topic, or (null) that nothing is. */
  set(topic, text) {
    if (text) this.reasons.set(topic, text);
    else this.reasons.delete(topic);
    // one reason is enough; what the user can mend comes first
    const words = this.reasons.get("typed") ?? [...this.reasons.values()][0] ?? "";
    if (this.place.textContent !== words) this.place.textContent = words;
    this.shown.classList.toggle("old", this.reasons.size > 0);
  }
}
