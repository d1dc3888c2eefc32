// Downloads of what is on the page.
import { NAMES, symbolOf } from "./inputs.js";
import { withUnit } from "./show.js";

export function save(blob, name) {
  const address = URL.createObjectURL(blob);
  Object.assign(document.createElement("a"), { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

/** The inputs in one line, without one or more of them. */
export function caption({ values, units, rigid }, ...without) {
  return NAMES.filter((name) => !without.includes(name))
    .map((name) => `${symbolOf(name, units[name])} = ${name === "k" && rigid ? "rigid" : withUnit(name, values[name], units[name], 5)}`)
    .join(", ");
}
