"""Screenshot of the page for the documents, with a separate service and a headless Chromium.

``python benchmarks/page.py --write`` replaces docs/img/page.png; ``--all DIR`` shows the page and /docs at three
widths, in the light and dark schemes.  Needs Chromium with its ChromeDriver and the PyPI package selenium.
"""

import argparse
import base64
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.measuring import IMAGES
from tests import browser as driven
from tests.serving import serving

SHOWN = "#y0=3um&v0=20mm/s"
SIZES = {1440: 900, 1024: 768, 390: 844}


def picture(page: Any) -> bytes:
    """The whole page as PNG."""
    width, height = page.run("return [innerWidth, document.documentElement.scrollHeight];")
    clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
    options = {"format": "png", "captureBeyondViewport": True, "clip": clip}
    return base64.b64decode(page.browser.execute_cdp_cmd("Page.captureScreenshot", options)["data"])


def everything(opened: Any, folder: Path) -> None:
    """The page and /docs at every width, in the light and dark schemes."""
    folder.mkdir(parents=True, exist_ok=True)
    for width, height in SIZES.items():
        for path, name in (("", "page"), ("docs", "docs")):
            page = opened("" if path else SHOWN, width=width, height=height, path=path, new=True)
            if path:
                page.wait_for("#swagger-ui", "mu_macro")
            for scheme in ("light", "dark"):
                page.scheme(scheme)
                time.sleep(0.5)
                (folder / f"{name}-{width}-{scheme}.png").write_bytes(picture(page))


def main() -> None:
    """Take the screenshots."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="replace docs/img/page.png")
    parser.add_argument("--all", type=Path, metavar="DIR", help="every width, light and dark, into this folder")
    options = parser.parse_args()
    if not (options.write or options.all):
        parser.error("give --write or --all DIR")
    with serving() as server, tempfile.TemporaryDirectory() as profile:
        browser = driven.start(profile)
        try:
            opened = driven.Opened(browser, server.url)
            if options.write:
                page = opened(SHOWN, width=1440, height=900)
                time.sleep(0.5)
                (IMAGES / "page.png").write_bytes(picture(page))
            if options.all:
                everything(opened, options.all)
        finally:
            browser.quit()


if __name__ == "__main__":
    main()
