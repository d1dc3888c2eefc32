"""The page in a headless Chromium, with a service of its own: screenshots for the documents, and
how long a person waits.

``python benchmarks/page.py`` replaces docs/img/page.png and docs/img/page-phone.png; with
``--times`` it prints when the first number is on the screen, and how long after a move of the
pointer its answer is.  Needs Chromium with its ChromeDriver and the PyPI package selenium:
``.ci/peers -- python benchmarks/page.py``.
"""

import argparse
import base64
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.support import browser as driven
from tests.support.measuring import IMAGES, markdown
from tests.support.serving import serving

#: picture -> address, width and height of the screen
PICTURES = {
    "page.png": ("", 1440, 900),
    "page-phone.png": ("#contact=ball&direction=along", 390, 844),
}


#: notes when the first number is drawn, and every later one after a move of the pointer [ms]
NOTES = """
window.waits = [];
window.first = null;
let moved = null;
addEventListener("mousemove", () => { moved = performance.now(); }, true);
new MutationObserver((changes) => {
  const text = document.getElementById("mu")?.textContent ?? "";
  const shown = changes.some((one) => document.getElementById("number")?.contains(one.target));
  if (!shown || !/\\d/.test(text)) return;
  const since = moved;
  moved = null;
  requestAnimationFrame(() => {
    window.first ??= performance.now();
    if (since !== null) window.waits.push(performance.now() - since);
  });
}).observe(document, { subtree: true, childList: true, characterData: true });
"""
LOADS, STEPS, PAUSE_S = 15, 60, 0.1


@contextmanager
def opened() -> Iterator[Any]:
    """What opens pages of a service of its own."""
    with serving() as server, tempfile.TemporaryDirectory() as profile:
        browser = driven.start(Path(profile))
        try:
            yield driven.Opened(browser, server.url)
        finally:
            browser.quit()


def pictures() -> None:
    with opened() as opening:
        for name, (address, width, height) in PICTURES.items():
            page = opening(address, width=width, height=height)
            time.sleep(0.5)
            whole = page.run("return document.documentElement.scrollHeight;")
            shown = whole if width > 760 else 2 * height
            clip = {"x": 0, "y": 0, "width": width, "height": shown, "scale": 1}
            options = {"format": "png", "captureBeyondViewport": True, "clip": clip}
            taken = opening.browser.execute_cdp_cmd("Page.captureScreenshot", options)["data"]
            (IMAGES / name).write_bytes(base64.b64decode(taken))


def times() -> str:
    """Milliseconds from the request of the page to its first number, the files of the page read
    anew each time; and from a move of the pointer on the map by 4 pixels to its number."""
    with opened() as opening:
        browser, firsts = opening.browser, []
        browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": NOTES})
        browser.execute_cdp_cmd("Network.setCacheDisabled", {"cacheDisabled": True})
        for _ in range(LOADS):
            page = opening("", width=1280, height=800)
            firsts.append(page.run("return window.first;"))
        page.run("window.waits.length = 0;")
        page.drag_begins("#map", 0.5, 0.6)
        for step in range(STEPS):
            page.drag_moves(0, -4 if step < STEPS // 2 else 4)
            time.sleep(PAUSE_S)
        page.drag_ends()
        waits = page.run("return window.waits;")
    rows = [
        (name, str(len(some)), *(f"{share(some):.0f}" for share in (statistics.median, max)))
        for name, some in (("first number", firsts), ("a step of a drag", waits))
    ]
    return markdown(("", "times", "median [ms]", "longest [ms]"), rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", action="store_true", help="how long a person waits")
    if parser.parse_args().times:
        print(times())
    else:
        pictures()


if __name__ == "__main__":
    main()
