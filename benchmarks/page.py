"""Screenshot of the page for the documents, with a separate service and a headless Chromium.

``python benchmarks/page.py`` replaces docs/img/page.png.  Needs Chromium with its ChromeDriver and
the PyPI package selenium: ``.ci/peers -- python benchmarks/page.py``.
"""

import base64
import tempfile
import time
from pathlib import Path

from benchmarks.measuring import IMAGES
from benchmarks.support import browser as driven
from benchmarks.support.serving import serving


def main() -> None:
    with serving() as server, tempfile.TemporaryDirectory() as profile:
        browser = driven.start(Path(profile))
        try:
            page = driven.Opened(browser, server.url)("#y0=3um&v0=20mm/s", width=1440, height=900)
            time.sleep(0.5)
            width, height = page.run("return [innerWidth, document.documentElement.scrollHeight];")
            clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
            options = {"format": "png", "captureBeyondViewport": True, "clip": clip}
            taken = browser.execute_cdp_cmd("Page.captureScreenshot", options)["data"]
            (IMAGES / "page.png").write_bytes(base64.b64decode(taken))
        finally:
            browser.quit()


if __name__ == "__main__":
    main()
