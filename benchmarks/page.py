"""Screenshot of the page for the documents, with a separate service and a headless Chromium.

``python benchmarks/page.py --write`` replaces docs/img/page.png; ``--all DIR`` shows the page and /docs at three
widths, in the light and dark schemes.  Needs Chromium with its ChromeDriver and the PyPI package selenium.
"""

import argparse
import base64
import re
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs" / "img" / "page.png"
SHOWN = "#y0=3um&v0=20mm/s"
SIZES = {1440: 900, 1024: 768, 390: 844}
READY_S = 300.0


@contextmanager
def serving() -> Iterator[str]:
    """The address of a separate service."""
    command = [sys.executable, "-m", "service", "--port", "0"]
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT)
        try:
            yield _when_ready(process, log)
        finally:
            process.terminate()
            process.wait()


def _when_ready(process: subprocess.Popen[bytes], log: Any) -> str:
    deadline = time.monotonic() + READY_S
    while time.monotonic() < deadline and process.poll() is None:
        log.seek(0)
        found = re.search(r"running on (http://[^ ]+:\d+) ", log.read())
        try:
            if found:
                with urllib.request.urlopen(f"{found[1]}/readyz", timeout=10):
                    return found[1]
        except OSError:
            pass
        time.sleep(0.1)
    log.seek(0)
    raise SystemExit(f"the service does not start:\n{log.read()}")


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
    sys.path.insert(0, str(ROOT / "tests"))  # tests/ is not a package
    import browser as driven

    with serving() as url, tempfile.TemporaryDirectory() as profile:
        browser = driven.start(profile)
        try:
            opened = driven.Opened(browser, url)
            if options.write:
                page = opened(SHOWN, width=1440, height=900)
                time.sleep(0.5)
                PICTURE.write_bytes(picture(page))
            if options.all:
                everything(opened, options.all)
        finally:
            browser.quit()


if __name__ == "__main__":
    main()
