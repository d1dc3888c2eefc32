// d3, as its modules are served: classic scripts, of which each adds to one object and comes after
// those that it needs.
const NAMES = [
  "array",
  "color",
  "format",
  "interpolate",
  "time",
  "time-format",
  "scale",
  "dispatch",
  "selection",
  "drag",
  "axis",
  "path",
  "shape",
  "contour",
];

const load = (name) =>
  new Promise((loaded, failed) => {
    const script = document.createElement("script");
    script.src = new URL(`../lib/d3-${name}.min.js`, import.meta.url);
    script.async = false; // one after the other, in this order
    script.addEventListener("load", loaded);
    script.addEventListener("error", () => failed(new Error(`${script.src} was not loaded`)));
    document.head.append(script);
  });

await Promise.all(NAMES.map(load));
export default globalThis.d3;
