// The description is fetched here and not by the interface, so that a service with an API key can be asked for it.
import { apiKey, setApiKey, withKey } from "../page/key.js";

const $ = (id) => document.getElementById(id);

async function show() {
  const response = await fetch("openapi.json", withKey());
  if (response.status === 401) {
    if (apiKey() !== null) $("key-status").textContent = "That is not the key of this service.";
    setApiKey(null);
    $("key-form").hidden = false;
    $("key").focus();
    return;
  }
  $("key-form").hidden = true;
  // validatorUrl: null keeps the page from sending the description to a public validator.
  window.SwaggerUIBundle({
    spec: await response.json(),
    dom_id: "#swagger-ui",
    deepLinking: true,
    validatorUrl: null,
    presets: [window.SwaggerUIBundle.presets.apis],
    requestInterceptor: (request) => Object.assign(request, withKey(request.headers)),
  });
}

$("key-form").addEventListener("submit", (event) => {
  event.preventDefault();
  if (setApiKey($("key").value.trim())) show();
  else $("key-status").textContent = "A key has 1 to 512 characters: letters, digits, signs, no spaces.";
});
show();
