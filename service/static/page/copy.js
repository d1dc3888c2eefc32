// The case, and any motion, as they are taken along: a link, curl, Python, the command.  Each text
// gives the number of the page.
import { $, write } from "./dom.js";
import { html, render } from "../lib/lit-html.js";
import { PARTS, caseOf, motionOf, toAddress } from "./state.js";
import { capital, prose } from "./words.js";

/** What is copied, with the word on its button. */
const BUTTONS = { link: "Link", curl: "curl", python: "Python", command: "Command" };
const USUAL = { contact: "spring", direction: "across" };
const asText = (value) => JSON.stringify(value);
const packed = (value) => String(value).replaceAll(/\s/g, "");
const page = () => location.origin + location.pathname;

const curl = (path, body) =>
  `curl -s ${page()}${path} -H "Content-Type: application/json" ` +
  `-d '${asText(body).replaceAll("'", "\\u0027")}'`;
const keywords = (body) =>
  Object.entries(body)
    .map(([name, value]) => `${name}=${asText(value)}`)
    .join(", ");
/** The inputs of a command, and its options. */
const words = (inputs) =>
  `"${Object.entries(inputs)
    .map(([name, value]) => `${name}=${packed(value)}`)
    .join(" ")}"`;
const options = (chosen) =>
  Object.entries(chosen)
    .map(([name, value]) => ` --${name} ${packed(value)}`)
    .join("");

/** The entries with these names, and the others; what is chosen as usual goes without saying. */
function apart(body, names) {
  const entries = Object.entries(body).filter(([name, value]) => USUAL[name] !== value);
  const some = (within) =>
    Object.fromEntries(entries.filter(([name]) => names.includes(name) === within));
  return [some(false), some(true)];
}

/** The texts of the case, by name. */
export function textsOf(state) {
  const [inputs, chosen] = apart(caseOf(state), ["contact", "direction"]);
  const body = { ...inputs, ...chosen };
  return {
    link: page() + toAddress(state),
    curl: curl("v1/mu-macro", body),
    python: `import mumacro\nprint(mumacro.open().evaluate(${keywords(body)}))`,
    command: `mumacro ${words(inputs)}${options(chosen)}`,
  };
}

/** The texts of any motion, by name. */
export function motionTexts(state, answer) {
  const [inputs, chosen] = apart(motionOf(state, answer), ["contact", ...Object.keys(PARTS)]);
  const body = { ...inputs, ...chosen };
  return {
    link: page() + toAddress(state),
    curl: curl("v1/motion", body),
    python: `import mumacro\nprint(mumacro.motion(${keywords(body)}).mu_macro)`,
    command: `mumacro motion ${words(inputs)}${options(chosen)}`,
  };
}

/**
 * Makes buttons in the row `id` that copy texts, beside the field that shows them.  The returned
 * function takes them; where there is no number, it takes the reason, and the link alone is left.
 */
export function copies(id) {
  const button = ([name, word]) => html`<button data-copy=${name}>${word}</button>`;
  render(Object.entries(BUTTONS).map(button), $(`${id}-row`));
  const [buttons, field] = [[...$(`${id}-row`).children], $(`${id}-text`)];
  let texts = {};
  let reason = null;
  const shown = (name) => texts[name] ?? `Not available. ${capital(prose(reason))}`;
  $(`${id}-row`).addEventListener("click", async ({ target }) => {
    const name = target.closest("[data-copy]")?.dataset.copy;
    if (!name) return;
    field.value = texts[name];
    try {
      await navigator.clipboard.writeText(texts[name]);
      write(`${id}-status`, "Copied.");
    } catch {
      // without https a browser may refuse: the text is there to be copied by hand
      field.select();
      write(`${id}-status`, "Select and copy it.");
    }
  });
  return (latest, why = null) => {
    [texts, reason] = [why === null ? latest : { link: latest.link }, why];
    for (const button of buttons) button.disabled = !Object.hasOwn(texts, button.dataset.copy);
    field.value = shown("command");
    field.classList.toggle("hint", why !== null);
    write(`${id}-status`, "");
  };
}
