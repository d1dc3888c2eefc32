// The API key, where the service asks for one: kept for this tab, sent as a header, never part of an address.
const NAME = "mumacro-api-key";
let held = null;

/** The key, or null. */
export function apiKey() {
  if (held === null) {
    try {
      held = sessionStorage.getItem(NAME);
    } catch {
      // storage is switched off: the key then lives as long as the page
    }
  }
  return held;
}

/** Takes a key, or forgets it (null); false if no service can have such a key. */
export function setApiKey(key) {
  if (key !== null && !/^[!-~]{1,512}$/.test(key)) return false;
  held = key;
  try {
    if (key === null) sessionStorage.removeItem(NAME);
    else sessionStorage.setItem(NAME, key);
  } catch {
    // as above
  }
  return true;
}

/** The options of a request, with the key where there is one; its answer is then kept by nobody. */
export const withKey = (headers = {}) =>
  apiKey() === null ? { headers } : { headers: { ...headers, "X-API-Key": apiKey() }, cache: "no-store" };
