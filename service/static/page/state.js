// The state of the page, and its form as an address: everything in SI units, units of the fields beside it.
import { INPUTS, NAMES, hasUnit } from "./inputs.js";
import { readDeviation, readValue } from "./read.js";

export const startState = () => ({
  values: Object.fromEntries(NAMES.map((name) => [name, INPUTS[name].start])),
  units: Object.fromEntries(NAMES.map((name) => [name, INPUTS[name].offered[0]])),
  std: {},
  rigid: false,
  along: "v0",
  scale: "log",
  approximations: false,
  range: [null, null],
  family: null,
  curves: [],
});

/** The state as the part of an address behind "#". */
export function toAddress(state) {
  const parts = [];
  for (const name of NAMES) parts.push([name, name === "k" && state.rigid ? "rigid" : state.values[name]]);
  for (const name of NAMES) if (state.units[name] !== "-") parts.push([`${name}.unit`, state.units[name]]);
  for (const name of NAMES) if (state.std[name]) parts.push([`${name}.std`, state.std[name]]);
  parts.push(["along", state.along], ["scale", state.scale]);
  if (state.approximations) parts.push(["approximations", 1]);
  ["start", "stop"].forEach((end, i) => { if (state.range[i] !== null) parts.push([end, state.range[i]]); });
  if (state.family) parts.push(["family", state.family], ["curves", state.curves.join(";")]);
  return `#${new URLSearchParams(parts)}`;
}

/** { state, faults }: what an address says, start values in place of what cannot be used, and why, in words. */
export function fromAddress(hash) {
  const state = startState();
  const faults = [];
  const given = new URLSearchParams(hash.slice(1));
  const bad = (key, why) => faults.push(`${key} = ${given.get(key) || "nothing"} (${why})`);
  const si = (name, key, text) => {
    const found = readValue(name, text, INPUTS[name].si);
    if (found.fault || found.rigid) bad(key, found.fault ?? "must be a number");
    return found.si ?? null;
  };
  const choice = (key, known, use) => {
    if (!given.has(key)) return;
    if (known.includes(given.get(key))) use(given.get(key));
    else bad(key, `must be one of ${known.join(", ")}`);
  };

  if (given.has("omega") && given.has("f")) bad("f", "omega is given, too");
  else if (given.has("f")) {
    const found = readValue("omega", given.get("f"), "Hz");
    if (found.fault) bad("f", found.fault);
    else state.values.omega = found.si;
  }
  for (const name of NAMES) {
    if (!given.has(name)) continue;
    const found = readValue(name, given.get(name), INPUTS[name].si);
    if (found.fault) bad(name, found.fault);
    else if (found.rigid) state.rigid = true;
    else state.values[name] = found.si;
  }
  for (const name of NAMES) {
    const unit = given.get(`${name}.unit`);
    if (unit !== null && hasUnit(name, unit)) state.units[name] = unit;
    else if (unit !== null) bad(`${name}.unit`, "not a unit of it");
    if (!given.has(`${name}.std`)) continue;
    const found = readDeviation(name, given.get(`${name}.std`), INPUTS[name].si, state.values[name]);
    if (found.fault) bad(`${name}.std`, found.fault);
    else state.std[name] = found.si;
  }
  choice("along", NAMES, (name) => { state.along = name; });
  choice("scale", ["log", "linear"], (scale) => { state.scale = scale; });
  choice("approximations", ["1"], () => { state.approximations = true; });
  ["start", "stop"].forEach((end, i) => { if (given.has(end)) state.range[i] = si(state.along, end, given.get(end)); });
  choice("family", NAMES.filter((name) => name !== state.along), (name) => {
    const curves = (given.get("curves") ?? "").split(";").map((text) => si(name, "curves", text));
    if (curves.every((value) => value !== null)) Object.assign(state, { family: name, curves });
  });
  for (const key of new Set(given.keys())) if (!KEYS.has(key)) bad(key, "unknown");
  return { state, faults };

}

const KEYS = new Set([...NAMES, ...NAMES.flatMap((name) => [`${name}.unit`, `${name}.std`]), "f", "along", "scale",
  "approximations", "start", "stop", "family", "curves"]);
