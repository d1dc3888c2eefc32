// The description is fetched here and not by the interface, so that a service with an API key can be asked for it.
import { Channel, withKey } from "../page/ask.js";
import { $ } from "../page/dom.js";
import { get } from "../page/service.js";

const dark = matchMedia("(prefers-color-scheme: dark)");
const follow = () => document.documentElement.classList.toggle("dark-mode", dark.matches);
dark.addEventListener("change", follow);
follow();

// What the interface lacks for those who use a keyboard or listen: no link inside of a button, no text outside of
// every landmark, a heading between that of the page (h1) and those of the groups (h3).
const accessible = ({ React }) => ({
  components: { DeepLink: ({ text }) => React.createElement("span", null, text) },
  wrapComponents: {
    InfoContainer: (Original) => (props) => React.createElement("section", { "aria-label": "About" },
      React.createElement(Original, props), React.createElement("h2", { className: "wrapper" }, "Calls")),
  },
});

// The same for what opens later: text that scrolls can be scrolled by keyboard, a choice has a name, and answers of
// two calls are not two places of one name.
function tidy() {
  for (const text of document.querySelectorAll("pre.microlight:not([tabindex])")) text.tabIndex = 0;
  for (const table of document.querySelectorAll(".responses-table[role=region]")) table.removeAttribute("role");
  for (const choice of document.querySelectorAll("tr[data-param-name] select:not([aria-label])")) {
    choice.setAttribute("aria-label", choice.closest("tr").dataset.paramName);
  }
}
new MutationObserver(tidy).observe($("swagger-ui"), { childList: true, subtree: true });

function show(spec) {
  // validatorUrl: null keeps the page from sending the description to a public validator.
  window.SwaggerUIBundle({
    spec: { ...spec, info: { ...spec.info, title: "Version" } }, // the name stands above it
    dom_id: "#swagger-ui",
    deepLinking: true,
    defaultModelsExpandDepth: 0, // fifty models are folded until somebody opens them
    validatorUrl: null,
    presets: [window.SwaggerUIBundle.presets.apis],
    plugins: [accessible],
    requestInterceptor: (request) => Object.assign(request, withKey(request.headers)),
  });
}

// no channel: its answer, which needs no key, would take away the field of the key
const { found: names } = await get("static/page/names.json");
for (const link of document.querySelectorAll("[data-guide]")) link.hidden = !names?.guide;
const tell = (text) => { $("status").textContent = text; };
new Channel(() => get("openapi.json"), show, tell).push(null);
