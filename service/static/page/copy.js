// The case as it is taken along: a link, curl, Python, the command.  Each text gives the number of
// the page.
import { $, write } from "./dom.js";
import { caseOf, toAddress } from "./state.js";

const asText = (text) => JSON.stringify(text);

/** The texts, by name. */
export function textsOf(state) {
  const { contact, direction, ...inputs } = caseOf(state);
  const kind = { contact, direction };
  const usual = { contact: "spring", direction: "across" };
  const chosen = Object.entries(kind).filter(([name, value]) => value !== usual[name]);
  const body = JSON.stringify({ ...inputs, ...Object.fromEntries(chosen) });
  const base = location.origin + location.pathname;
  const keywords = [...Object.entries(inputs), ...chosen].map(
    ([name, text]) => `${name}=${asText(text)}`,
  );
  const words = Object.entries(inputs).map(
    ([name, text]) => `${name}=${text.replaceAll(/\s/g, "")}`,
  );
  const options = chosen.map(([name, value]) => ` --${name} ${value}`).join("");
  return {
    link: base + toAddress(state),
    curl:
      `curl -s ${base}v1/mu-macro -H "Content-Type: application/json" ` +
      `-d '${body.replaceAll("'", "\\u0027")}'`,
    python: `import mumacro\nprint(mumacro.open().evaluate(${keywords.join(", ")}).mu_macro)`,
    command: `mumacro "${words.join(" ")}"${options}`,
  };
}

export function copyPanel(store) {
  $("copies").addEventListener("click", async ({ target }) => {
    const name = target.closest("[data-copy]")?.dataset.copy;
    if (!name) return;
    const text = textsOf(store.state)[name];
    $("copied").value = text;
    try {
      await navigator.clipboard.writeText(text);
      $("copy-status").textContent = "Copied.";
    } catch {
      // without https a browser may refuse: the text is there to be copied by hand
      $("copied").select();
      $("copy-status").textContent = "Select and copy it.";
    }
  });
  return () => {
    $("copied").value = textsOf(store.state).command;
    write("copy-status", "");
  };
}
