"""Screenshots of the page for the documents, with a separate service and a headless Chromium.

``python benchmarks/page.py`` replaces docs/img/page.png and docs/img/page-phone.png.  Needs
Chromium with its ChromeDriver and the PyPI package selenium:
``.ci/peers -- python benchmarks/page.py``.
"""

import base64
import tempfile
import time
from pathlib import Path

from tests.support import browser as driven
from tests.support.measuring import IMAGES
from tests.support.serving import serving

#: picture -> address, width and height of the screen
PICTURES = {
    "page.png": ("", 1440, 900),
    "page-phone.png": ("#contact=ball&direction=along", 390, 844),
}


def main() -> None:
    with serving() as server, tempfile.TemporaryDirectory() as profile:
        browser = driven.start(Path(profile))
        opened = driven.Opened(browser, server.url)
        try:
            for name, (address, width, height) in PICTURES.items():
                page = opened(address, width=width, height=height)
                time.sleep(0.5)
                foot = page.run("return document.documentElement.scrollHeight;")
                shown = foot if width > 760 else 2 * height
                clip = {"x": 0, "y": 0, "width": width, "height": shown, "scale": 1}
                options = {"format": "png", "captureBeyondViewport": True, "clip": clip}
                taken = browser.execute_cdp_cmd("Page.captureScreenshot", options)["data"]
                (IMAGES / name).write_bytes(base64.b64decode(taken))
        finally:
            browser.quit()


if __name__ == "__main__":
    main()
