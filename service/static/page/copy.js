// The case, and any motion, as they are taken along: a link, curl, Python, the command.  Each text
// gives the number of the page.
import { $, write } from "./dom.js";
import { html, render } from "../lib/lit-html.js";
import { PARTS, caseOf, motionOf, toAddress } from "./state.js";

/** What is copied, with the word on its button. */
const BUTTONS = { link: "Link", curl: "curl", python: "Python", command: "Command" };
const SAID_MS = 4000;
const USUAL = { contact: "spring", direction: "across" };
const asText = (value) => JSON.stringify(value);
const packed = (value) => String(value).replaceAll(/\s/g, "");
const page = () => location.origin + location.pathname;

/** Members, two of them on a line, which ends at a comma. */
function inLines(members, comma, start) {
  const line = (i) => start + members.slice(i, i + 2).join(comma);
  return members.flatMap((_, i) => (i % 2 ? [] : [line(i)])).join(",");
}
const curl = (path, body) => {
  const members = Object.entries(body).map(([name, value]) => `${asText(name)}:${asText(value)}`);
  const text = `{${inLines(members, ",", "\n")}}`.replaceAll("'", "\\u0027");
  return `curl -s ${page()}${path} -H Content-Type:application/json -d '${text}'`;
};
const keywords = (body) => {
  const members = Object.entries(body).map(([name, value]) => `${name}=${asText(value)}`);
  return inLines(members, ", ", "\n    ");
};
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
  const [inputs, chosen] = apart(motionOf(state, answer), ["contact", ...PARTS]);
  const body = { ...inputs, ...chosen };
  return {
    link: page() + toAddress(state),
    curl: curl("v1/motion", body),
    python: `import mumacro\nprint(mumacro.motion(${keywords(body)}).mu_macro)`,
    command: `mumacro motion ${words(inputs)}${options(chosen)}`,
  };
}

/**
 * Makes buttons that copy texts, above the field that shows the one that was copied last.  The
 * returned function takes the texts; where they have no number, the link alone is there.
 */
export function copies() {
  const field = $("copy-text");
  let texts = {};
  let usable = false;
  let chosen = "command";
  function draw() {
    const name = usable ? chosen : "link";
    const button = ([one, word]) =>
      html`<button
        data-copy=${one}
        aria-pressed=${String(one === name)}
        ?disabled=${!usable && one !== "link"}
      >
        ${word}
      </button>`;
    render(Object.entries(BUTTONS).map(button), $("copy-row"));
    field.value = texts[name];
  }
  let said;
  /** Says what was done, for some seconds. */
  function say(words) {
    write("copy-status", words);
    clearTimeout(said);
    said = setTimeout(() => write("copy-status", ""), SAID_MS);
  }
  $("copy-row").addEventListener("click", async ({ target }) => {
    const name = target.closest("[data-copy]")?.dataset.copy;
    if (!name) return;
    if (usable) chosen = name;
    draw();
    try {
      await navigator.clipboard.writeText(texts[name]);
      say("Copied.");
    } catch {
      // without https a browser may refuse: the text is there to be copied by hand
      field.select();
      say("Now copy it.");
    }
  });
  return (latest, answered) => {
    [texts, usable] = [latest, answered];
    draw();
    write("copy-status", "");
  };
}
