// Questions to the service, and what its answers mean for the page.
import { withKey } from "./ask.js";
import { called } from "./words.js";

const WAIT_MS = 20_000; // for an answer

/** The faults of a question by the names that the page has; those of one reason stand together. */
function together(errors) {
  const names = Map.groupBy(errors, ({ reason }) => reason);
  return [...names]
    .map(([reason, all]) => {
      const fields = all.map(({ field }) => called(field)).join(", ");
      return `${fields}${reason.startsWith("must ") ? "" : ":"} ${reason}`;
    })
    .join("; ");
}

/** A fault of a number: that it has to be finite is no news of one that is. */
const ofNumber = (fault) =>
  typeof fault.value === "number"
    ? {
        ...fault,
        reason: fault.reason
          .replace("finite and > 0", "greater than 0")
          .replace("finite and >= 0", "0 or greater"),
      }
    : fault;

async function ask(path, options) {
  let response, body;
  try {
    response = await fetch(path, { ...options, signal: AbortSignal.timeout(WAIT_MS) });
    body = await response.json();
  } catch (error) {
    if (!response || error.name === "TimeoutError") return { later: "No answer from the service." };
    return { later: `The response of the service cannot be read (status ${response.status}).` };
  }
  if (response.ok) return { answer: body };
  const { status, headers } = response;
  if (status === 401) return { key: true };
  const { errors: all = [], inputs = {} } = body;
  const errors = all.map(ofNumber);
  const detail = together(errors) || (body.detail ?? `status ${status}`);
  if (status < 500 && ![408, 429].includes(status))
    return { refused: detail, faults: errors, inputs };
  return {
    later: `The service cannot answer now: ${detail}.`,
    seconds: Number(headers.get("Retry-After")) || null,
  };
}

export const get = (path) => ask(path, withKey());
/** What needs no key, and is on its way since the head of the document was read. */
export const getPreloaded = (path) => ask(path, {});
export const post = (path, body) =>
  ask(path, {
    method: "POST",
    ...withKey({ "Content-Type": "application/json" }),
    body: JSON.stringify(body),
  });
