// The field for the API key.
import { apiKey, setApiKey } from "./key.js";

const $ = (id) => document.getElementById(id);

/** Shows the field for the key; says so when the one that was sent is not it. */
export function wantKey() {
  const tried = apiKey() !== null;
  setApiKey(null);
  if ($("forget")) $("forget").hidden = true;
  if (tried) $("key-status").textContent = "That is not the key of this service.";
  if ($("key-form").hidden) {
    $("key-form").hidden = false;
    $("key").focus();
  }
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
    if (!setApiKey($("key").value.trim())) {
      $("key-status").textContent = "A key has 1 to 512 characters: letters, digits, signs, no spaces.";
      return;
    }
    $("key").value = "";
    $("key-status").textContent = "";
    begin();
  });
  $("forget")?.addEventListener("click", () => {
    setApiKey(null);
    location.reload();
  });
}
