// The cards beside the inputs and the number.  They and d3 are loaded when the first number is on
// the screen.
import { copies, textsOf } from "./copy.js";
import { $, write } from "./dom.js";
import { fitPanel } from "./fit.js";
import { lawPanel } from "./law.js";
import { mapPanel } from "./map.js";
import { meaningsDialog } from "./meanings.js";
import { motionPanel } from "./motion.js";
import { Plot } from "./plot.js";
import { sidePanel } from "./side.js";
import { fromAddress } from "./state.js";
import { stiffnessPanel } from "./stiffness.js";
import { about, withUnit } from "./words.js";

const LAW_FIELDS = ["along", "scale", "from", "to", "exponent"];

/**
 * Makes the cards.  `moved({ name: value [SI] })` takes values of inputs; `aim(mark)` takes the
 * friction that is asked for, as a line in the plots; `again()` asks to be shown once more.
 *
 * The result shows a case: `point` at once, `rest` when that is on the screen.
 */
export function cards(store, moved, aim, again) {
  const map = mapPanel(store, moved, again);
  const law = lawPanel(store, moved);
  const side = sidePanel(store, moved, aim);
  const copy = copies();
  const open = panels(store);
  const stiffness = stiffnessPanel(store, moved);
  const fit = fitPanel(store, moved, (address) =>
    store.change(fromAddress(`#${address}&panel=fit`).state),
  );
  const motion = motionPanel(store, moved, copy);
  meaningsDialog();
  for (const [kind, media] of [
    ["beforeprint", "all"],
    ["afterprint", "print"],
  ])
    addEventListener(kind, () => {
      $("on-paper").media = media;
      Plot.fit();
    });
  lawFields(store);

  const point = (answer, target) => {
    if (store.state.motion === "one") map(answer, target?.mu_ratio);
  };

  /** While something is dragged, what asks another question waits for the end of it. */
  function rest(answer, trouble, target, old) {
    const { state } = store;
    if (state.motion === "any") motion(answer, answer?.state === state || trouble !== null);
    else {
      law(state, answer, target, old);
      side(answer, old);
      copy(textsOf(state), !trouble);
    }
    if (store.dragged) return;
    open(state.panel);
    stiffness();
    fit(answer);
    for (const name of LAW_FIELDS) $(name).value = state[name];
    $("digits").checked = state.digits === "all";
    $("axis").checked = state.axis === "zero";
    $("exponent-field").hidden = state.along !== "Fz" && state.unknown !== "Fz";
    write("print-case", location.href);
    write("print-date", new Date().toISOString().slice(0, 10));
  }
  return { point, rest };
}

/** What is open beside the map; the result opens it by its name. */
function panels(store) {
  const parts = { stiffness: "part-stiffness", fit: "part-fit" };
  for (const button of document.querySelectorAll("[data-close]"))
    button.addEventListener("click", () => {
      const { panel } = store.state;
      store.look({ panel: "none" });
      $(`tab-${panel}`).focus();
    });
  let shown; // what a link opens stays where it is, below the number
  return (panel) => {
    for (const [name, id] of Object.entries(parts)) $(id).hidden = name !== panel;
    $("tool").hidden = panel === "none";
    const opened = shown !== undefined && panel !== shown && panel !== "none";
    shown = panel;
    if (opened) $(parts[panel]).scrollIntoView({ block: "nearest" });
  };
}

/** What is chosen of the law and its axes, and how many digits are shown. */
function lawFields(store) {
  for (const [name, { symbol }] of Object.entries(about.inputs))
    $("along").append(new Option(symbol, name));
  const unit = (name) => $(name).placeholder.split(" ")[2]; // in which the ends of the axis read
  function changeOf(name, value) {
    if (name === "along") return { along: value, from: "", to: "" };
    const end = name === "from" || name === "to";
    return { [name]: end ? withUnit(store.state.along, value, unit(name)) : value };
  }
  for (const name of LAW_FIELDS)
    $(name).addEventListener("change", ({ target: { value } }) =>
      store.change(changeOf(name, value)),
    );
  $("axis").addEventListener("change", ({ target: { checked } }) =>
    store.change({ axis: checked ? "zero" : "fit" }),
  );
  $("digits").addEventListener("change", ({ target: { checked } }) =>
    store.change({ digits: checked ? "all" : "few" }),
  );
}
