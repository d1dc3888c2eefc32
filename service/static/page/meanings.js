// Lists of numbers with their names: what each one means is shown by its title, and read in one
// dialog; a number that is missing has the reason in its place.
import { $ } from "./dom.js";
import { html, render } from "../lib/lit-html.js";

const lists = new Map(); // by the id of the list

/** Entries of a list: [name, meaning, value or null, why it is null in a few words, and in all]. */
export const definitions = (rows) =>
  rows.map(
    ([name, meaning, value, why, all = why]) =>
      html`<div>
        <dt title=${meaning}>${name}</dt>
        ${
          value === null
            ? html`<dd class="none" title=${all}>– ${why}</dd>`
            : html`<dd>${value}</dd>`
        }
      </div>`,
  );

/** Shows a list, and keeps it for the dialog, with what is said there below it. */
export function list(id, rows, below = "") {
  lists.set(id, { rows, below });
  render(definitions(rows), $(id));
}

/** Buttons that open the dialog with the meanings of the list that they name. */
export function meaningsDialog() {
  const dialog = $("meanings");
  for (const button of document.querySelectorAll("[data-meanings]"))
    button.addEventListener("click", () => {
      const { rows, below } = lists.get(button.dataset.meanings);
      const line = ([name, meaning, value, why, all = why]) =>
        value === null
          ? html`<p><b>${name}</b>: ${meaning}. None: ${all}.</p>`
          : html`<p><b>${name} ${value}</b>: ${meaning}.</p>`;
      render([...rows.map(line), html`<p>${below}</p>`], $("meanings-list"));
      dialog.showModal();
    });
  dialog.addEventListener("click", ({ target }) => {
    if (target === dialog || target.closest("button")) dialog.close();
  });
}
