// The cards beside the inputs and the number.  They and d3 are loaded when the first number is on
// the screen.
import { copies, textsOf } from "./copy.js";
import { $, write } from "./dom.js";
import { fitPanel } from "./fit.js";
import { lawPanel } from "./law.js";
import { mapPanel } from "./map.js";
import { meaningsDialog } from "./meanings.js";
import { motionPanel } from "./motion.js";
import { sidePanel, tabs } from "./side.js";
import { fromAddress } from "./state.js";
import { stiffnessPanel } from "./stiffness.js";
import { about } from "./words.js";

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
  const copy = copies("copy");
  const tab = tabs("panel-tabs", (panel) => store.look({ panel }));
  const stiffness = stiffnessPanel(store, moved);
  const fit = fitPanel(store, moved, (address) =>
    store.change(fromAddress(`#${address}&panel=fit`).state),
  );
  const motion = motionPanel(store, moved);
  meaningsDialog();
  lawFields(store);

  const point = (answer, target) => map(answer, target?.mu_ratio);

  /** While something is dragged, what asks another question waits for the end of it. */
  function rest(answer, trouble, target, old) {
    const { state } = store;
    law(state, answer, point(answer, target), target, old);
    side(answer);
    const settled = answer?.state === state;
    copy(textsOf(state), settled ? null : (trouble?.text ?? "there is no number yet."));
    if (store.dragged) return;
    tab(state.panel);
    stiffness();
    fit(answer);
    motion(answer, settled || trouble !== null);
    for (const name of LAW_FIELDS) $(name).value = state[name];
    $("digits").checked = state.digits === "all";
    $("exponent-field").hidden = state.along !== "Fz" && state.unknown !== "Fz";
    write("print-case", location.href);
    write("print-date", new Date().toISOString().slice(0, 10));
  }
  return { point, rest };
}

/** What is chosen of the law, and how many digits are shown. */
function lawFields(store) {
  for (const [name, { symbol }] of Object.entries(about.inputs))
    $("along").append(new Option(symbol, name));
  for (const name of LAW_FIELDS)
    $(name).addEventListener("change", ({ target: { value } }) =>
      store.change(name === "along" ? { along: value, from: "", to: "" } : { [name]: value }),
    );
  $("digits").addEventListener("change", ({ target: { checked } }) =>
    store.change({ digits: checked ? "all" : "few" }),
  );
}
