// Elements of the page: by id, with texts that are written where they change, and work that waits
// until what matters most is on the screen.
export const $ = (id) => document.getElementById(id);

/** Gives an element a text; one that stands there already costs no layout. */
export function write(id, text) {
  if ($(id).textContent !== text) $(id).textContent = text;
}

/** Gives an element a reason why there is no newer answer; one that mends itself is calm. */
export function tell(id, reason, calm = false) {
  write(id, reason ?? "");
  $(id).classList.toggle("bad", Boolean(reason) && !calm);
}

/** Gives an element an attribute, where it has another value. */
export function attribute(id, name, value) {
  if ($(id).getAttribute(name) !== value) $(id).setAttribute(name, value);
}

const underWay = new Set();
/** Says whether something is asked or waits to be drawn, for who waits for the page. */
export function markBusy(what, busy) {
  if (busy) underWay.add(what);
  else underWay.delete(what);
  $("main")?.setAttribute("data-asking", String(underWay.size > 0));
}

let next = null;
/** Does the newest of such work once, after the next picture of the page. */
export function afterPicture(work) {
  const waits = next !== null;
  next = work;
  if (waits) return;
  markBusy(afterPicture, true);
  requestAnimationFrame(() =>
    setTimeout(() => {
      const now = next;
      next = null;
      try {
        now();
      } finally {
        markBusy(afterPicture, false);
      }
    }),
  );
}
