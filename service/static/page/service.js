// Questions to the service.  A page without one has another file in the place of this: ../alone/service.js.
import { KeyWanted, Refused, Unanswered, withKey } from "./ask.js";

const WAIT_MS = 20_000; // for an answer

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
  throw new Refused(`The service refuses this: ${why}.`);
}

export const get = (path) => ask(path, withKey());
export const post = (path, body) =>
  ask(path, { method: "POST", ...withKey({ "Content-Type": "application/json" }), body: JSON.stringify(body) });
