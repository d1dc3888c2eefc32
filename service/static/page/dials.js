// Labels that are dragged: a label moved sideways changes the number of its field by 1 % for each
// pixel.  A click goes on to the field, and a finger that moves up or down scrolls the page.
const PIXEL = 1.01; // factor of one pixel
const STARTS = 4; // pixels, from which a press is a drag

/**
 * Makes the labels with `data-dial` in `root` movable.  `valueOf(name)` is the number that a drag
 * begins with, undefined where there is none; `grab(moving)` is called around a drag, and
 * `take(name, value)` in each step of it.
 */
export function dials(root, { valueOf, grab, take }) {
  let press = null; // { pointer, label, x, y }, and { name, from } as soon as it is a drag
  let spent = false; // whether the press was a drag, and no click

  function begins(event) {
    const [right, down] = [event.clientX - press.x, event.clientY - press.y];
    if (Math.abs(right) < STARTS || Math.abs(right) <= Math.abs(down)) return false;
    const name = press.label.dataset.dial;
    const from = valueOf(name);
    if (!(from > 0 && Number.isFinite(from))) return false;
    Object.assign(press, { name, from, x: event.clientX });
    press.label.setPointerCapture(event.pointerId);
    spent = true;
    grab(true);
    return true;
  }
  function end({ pointerId }) {
    if (press?.pointer !== pointerId) return;
    if (press.from) grab(false);
    press = null;
  }

  root.addEventListener("pointerdown", (event) => {
    spent = false;
    const label = event.target.closest("[data-dial]");
    if (!label || event.button || press) return;
    press = { pointer: event.pointerId, label, x: event.clientX, y: event.clientY };
  });
  root.addEventListener("pointermove", (event) => {
    if (press?.pointer !== event.pointerId) return;
    if (!event.buttons) end(event);
    else if (press.from || begins(event))
      take(press.name, press.from * PIXEL ** (event.clientX - press.x));
  });
  for (const kind of ["pointerup", "pointercancel"]) root.addEventListener(kind, end);
  root.addEventListener("click", (event) => {
    if (spent) event.preventDefault();
  });
}
