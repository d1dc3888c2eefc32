// Questions to the service.
import { withKey } from "./key.js";

/** One question in flight; while it is, only the newest of those that come is kept. */
export class Channel {
  constructor(ask, answer, fail) {
    this.ask = ask;
    this.answer = answer;
    this.fail = fail;
    this.busy = false;
    this.next = null;
  }

  push(...question) {
    this.next = question;
    if (!this.busy) this.run();
  }

  async run() {
    this.busy = true;
    while (this.next !== null) {
      const question = this.next;
      this.next = null;
      try {
        const found = await this.ask(...question);
        if (this.next === null) this.answer(found, ...question);
      } catch (error) {
        if (this.next === null) this.fail(error);
      }
    }
    this.busy = false;
  }
}

/** The service wants a key, or another one. */
export class KeyWanted extends Error {}

async function read(response) {
  if (response.status === 401) throw new KeyWanted("this service asks for an API key");
  const body = await response.json().catch(() => ({}));
  if (response.ok) return body;
  throw new Error(body.detail ?? body.error?.message ?? `the service answered ${response.status}`);
}

export const query = (values) => new URLSearchParams(Object.entries(values).map(([name, value]) => [name, String(value)])).toString();
export const get = async (path, values) => read(await fetch(values ? `${path}?${query(values)}` : path, withKey()));
export const post = async (path, body) =>
  read(await fetch(path, { method: "POST", ...withKey({ "Content-Type": "application/json" }), body: JSON.stringify(body) }));

/** The content of an address, as a browser's download; for what a plain link cannot fetch, because it needs the key. */
export async function download(path, name) {
  const response = await fetch(path, withKey());
  if (!response.ok) return read(response);
  const address = URL.createObjectURL(await response.blob());
  Object.assign(document.createElement("a"), { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
  return null;
}
