"""A headless Chromium that opens the page, for tests and screenshots."""

import json
import math
import re
import shutil
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

PATIENCE_S = 120  # a browser on a busy machine can be slow
#: the case that the page starts with
START: dict[str, Any] = {
    "mu0": 0.3,
    "Fz": 10.0,
    "k": 1e6,
    "y0": 2e-6,
    "omega": 2 * math.pi * 20e3,
    "v0": 0.01,
}

#: the service as it is; what it is asked is kept, for Page.asked
RECORDED = """(path, options = {}) => {
  (window.asked ??= []).push([path, options.body && JSON.parse(options.body)]);
  return real(path, options);
}"""


def start(folder: Path) -> Any:
    """A separate browser that can connect to this machine only; its files are in the folder.

    Raises
    ------
    LookupError
        Selenium, Chromium or its ChromeDriver is not installed.
    """
    chromium = (
        shutil.which("chromium")
        or shutil.which("chromium-browser")
        or shutil.which("google-chrome")
    )
    driver = shutil.which("chromedriver")
    if chromium is None or driver is None or find_spec("selenium") is None:
        raise LookupError(
            "the PyPI package selenium, or Chromium with its ChromeDriver on the PATH, is missing"
        )
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for argument in (
        "headless=new",
        "no-sandbox",
        "disable-gpu",
        "disable-dev-shm-usage",
        "disable-quic",
        "no-first-run",
        "disable-background-networking",
        "disable-component-update",
        "disable-sync",
        "disable-back-forward-cache",  # a page that is left would be kept, in a process of its own
        "window-size=1400,1000",
        "hide-scrollbars",
        "host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
        f"user-data-dir={folder}",
    ):
        options.add_argument(f"--{argument}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    browser.set_script_timeout(PATIENCE_S)
    return browser


def plain(text: str) -> str:
    """Return a text without what keeps its equations on one line."""
    return text.replace("\N{NO-BREAK SPACE}", " ").replace("\N{WORD JOINER}", "")


class Opened:
    """Opens a state of the page by its address, each time in a new document."""

    def __init__(self, browser: Any, url: Any) -> None:
        self.browser, self.url = browser, url

    def __call__(
        self,
        address: str = "",
        width: int = 1400,
        height: int = 1000,
        url: Any = None,
        path: str = "",
        wait: bool = True,
    ) -> Any:
        page = Page(self.browser, url or self.url)
        self.browser.get("about:blank")
        metrics = {
            "width": width,
            "height": height,
            "deviceScaleFactor": 1,
            "mobile": width < 500,
        }
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        page.scheme("light")
        page.complaints()
        self.browser.get(f"{url or self.url}/{path}{address}")
        if wait and not path and url is None:
            page.settle()
        return page

    @contextmanager
    def faked(self, function: Any, address: str = "", wait: bool = True) -> Any:
        """The page with a function in the place of ``fetch`` from its first question on; ``real``
        is the true one."""
        source = f"const real = window.fetch; window.fetch = {function};"
        added = self.browser.execute_cdp_cmd(
            "Page.addScriptToEvaluateOnNewDocument", {"source": source}
        )
        try:
            yield self(address, wait=wait)
        finally:
            self.browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)


class Page:
    def __init__(self, browser: Any, url: Any) -> None:
        self.browser, self.url = browser, url

    @staticmethod
    def rounded(value: Any, digits: int = 4) -> Any:
        """A number as the page shows it."""
        return float(f"{value:.{digits - 1}e}")

    def run(self, script: Any) -> Any:
        return self.browser.execute_async_script(
            f"const done = arguments[arguments.length - 1]; (async () => {{ {script} "
            f"}})().then(done);"
        )

    def settle(self) -> Any:
        """Wait until every request that follows from the state is answered, and what follows is
        drawn.

        The browser may complain of refused and lost requests, which it logs, and of nothing else.
        """
        self.run(
            "while (document.getElementById('main')?.dataset.asking !== 'false')"
            " await new Promise((next) => setTimeout(next, 10));"
            "for (let i = 0; i < 2; i += 1) await new Promise(requestAnimationFrame);"
        )
        complaints = [
            complaint
            for complaint in self.complaints()
            if not re.search(r"status of (401|422|50\d)", complaint)
        ]
        assert complaints == [], complaints
        return self

    def until(self, condition: Any, message: Any) -> Any:
        """What ``condition()`` is as soon as it is true."""
        deadline = time.monotonic() + PATIENCE_S
        while not (value := condition()):
            assert time.monotonic() < deadline, message()
            time.sleep(0.03)
        return value

    def find(self, selector: str) -> Any:
        return self.browser.find_element("css selector", selector)

    def rects(self, selector: str) -> Any:
        """The boxes of all elements."""
        return self.run(
            f"return [...document.querySelectorAll({selector!r})]"
            ".map((one) => one.getBoundingClientRect().toJSON());"
        )

    def text(self, selector: str) -> Any:
        """The text of an element, without what keeps its equations on one line."""
        return plain(self.run(f"return document.querySelector({selector!r}).textContent;"))

    def texts(self, selector: str) -> Any:
        """Those of all elements, likewise."""
        all_ = f"return [...document.querySelectorAll({selector!r})].map((one) => one.textContent);"
        return [plain(text) for text in self.run(all_)]

    def number(self, selector: str = "#mu") -> Any:
        return float(self.text(selector).replace("−", "-"))

    def shown(self) -> Any:
        return dict(zip(self.texts("#values dt"), self.texts("#values dd"), strict=True))

    def value(self, selector: str) -> Any:
        return self.find(selector).get_property("value")

    def wait_for(self, selector: str, pattern: Any) -> Any:
        return self.until(
            lambda: re.search(pattern, self.text(selector)),
            lambda: f"{selector} is {self.text(selector)!r}, not {pattern}",
        )

    def type(self, selector: str, text: str, commit: bool = True) -> None:
        from selenium.webdriver import Keys

        field = self.find(selector)
        field.send_keys(Keys.CONTROL + "a", Keys.NULL, text or Keys.DELETE)
        if commit:
            self.press(selector, "ENTER")

    def press(self, selector: str, *keys: Any) -> None:
        from selenium.webdriver import Keys

        self.find(selector).send_keys(*(getattr(Keys, key) for key in keys))
        self.settle()

    def choose(self, selector: str, value: Any, event: str = "change") -> None:
        self.run(
            f"const field = document.querySelector({selector!r}); field.value = {value!r};"
            f"field.dispatchEvent(new Event('{event}', {{ bubbles: true }}));"
        )
        self.settle()

    def click(self, selector: str) -> None:
        self.run(f"document.querySelector({selector!r}).click();")
        self.settle()

    def is_old(self, selector: str = "#main") -> Any:
        return "old" in self.find(selector).get_attribute("class").split()

    def is_red(self, selector: str) -> Any:
        """Whether a text has the colour of errors, in the light scheme."""
        return self.find(selector).value_of_css_property("color") == "rgba(179, 38, 30, 1)"

    def complaints(self) -> Any:
        log = self.browser.get_log("browser")
        return [entry["message"] for entry in log if entry["level"] in ("SEVERE", "WARNING")]

    def question(self, path: Any) -> Any:
        """The last question to a path, of a page with :data:`RECORDED`."""
        return self.run(f"return window.asked.filter(([path]) => path === '{path}').at(-1)[1];")

    def address(self) -> Any:
        """What the address line holds behind "#"; it follows the state with a delay."""
        self.run("await new Promise((next) => setTimeout(next, 250));")
        return self.browser.current_url.partition("#")[2]

    def touched(self, selector: str, x: Any, y: Any, click: bool = False) -> None:
        """Move the pointer to a relative position in an element."""
        from selenium.webdriver import ActionChains

        element = self.find(selector)
        self.run(f"document.querySelector({selector!r}).scrollIntoView({{ block: 'center' }});")
        size = element.size
        offset = round((x - 0.5) * size["width"]), round((y - 0.5) * size["height"])
        actions = ActionChains(self.browser, duration=0).move_to_element_with_offset(
            element, *offset
        )
        (actions.click() if click else actions).perform()
        self.settle()

    def drag_begins(self, selector: str, x: float, y: float) -> None:
        """Press the pointer at a relative position in an element, and keep it down."""
        from selenium.webdriver import ActionChains

        element = self.find(selector)
        offset = round((x - 0.5) * element.size["width"]), round((y - 0.5) * element.size["height"])
        actions = ActionChains(self.browser, duration=0)
        actions.move_to_element_with_offset(element, *offset).click_and_hold().perform()
        self.settle()

    def drag_moves(self, right: int, down: int) -> None:
        """Move the pointer that is down by so many pixels."""
        from selenium.webdriver import ActionChains

        ActionChains(self.browser, duration=0).move_by_offset(right, down).perform()

    def drag_ends(self) -> None:
        from selenium.webdriver import ActionChains

        ActionChains(self.browser, duration=0).release().perform()
        self.settle()

    @contextmanager
    def by_touch(self) -> Any:
        """The page, opened anew, under a finger in place of a mouse."""
        emulation = {"enabled": True, "maxTouchPoints": 1}
        self.browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", emulation)
        try:
            self.browser.refresh()
            self.settle()
            yield
        finally:
            self.browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})

    def rests(self) -> None:
        """Wait until the page does not scroll any more."""
        self.run(
            "let before; do { before = scrollY; "
            "await new Promise((next) => setTimeout(next, 200)); } while (scrollY !== before);"
        )

    def swipes(self, selector: str, x: float, y: float, *steps: tuple[int, int]) -> None:
        """Put a finger on a place in an element, in pixels from its corner, move it by the steps,
        and lift it."""
        box = self.run(
            f"return document.querySelector({selector!r}).getBoundingClientRect().toJSON();"
        )
        at = [box["x"] + x, box["y"] + y]

        def touch(kind: str, *points: dict[str, float]) -> None:
            event = {"type": kind, "touchPoints": [*points]}
            self.browser.execute_cdp_cmd("Input.dispatchTouchEvent", event)

        touch("touchStart", {"x": at[0], "y": at[1]})
        for right, down in steps:
            at = [at[0] + right, at[1] + down]
            touch("touchMove", {"x": at[0], "y": at[1]})
        touch("touchEnd")
        self.settle()

    def download(self, selector: str, folder: Path, name: str) -> Any:
        """The text of the file that is downloaded when an element is clicked."""
        behaviour = {"behavior": "allow", "downloadPath": str(folder)}
        self.browser.execute_cdp_cmd("Browser.setDownloadBehavior", behaviour)
        self.click(selector)
        self.until((folder / name).exists, lambda: [path.name for path in folder.iterdir()])
        return (folder / name).read_text("utf-8")

    def pixel_ratio(self, ratio: int, width: int, height: int) -> None:
        """Show the page with so many pixels of the screen in one of the style sheet."""
        metrics = {"width": width, "height": height, "mobile": width < 500}
        metrics |= {"deviceScaleFactor": ratio}
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        self.settle()

    @contextmanager
    def paper(self) -> Any:
        """The page as it is printed, on the screen."""
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        try:
            self.settle()
            yield
        finally:
            self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})

    def scheme(self, name: str) -> None:
        """Switch to the light or dark scheme, and wait until the page has taken it and every colour
        has changed."""
        media = {"features": [{"name": "prefers-color-scheme", "value": name}]}
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
        self.run(  # an empty document has no header, and no colours of its own
            "const light = () => getComputedStyle(document.body).backgroundColor.match(/\\d+/g)[0] "
            "> 128;while (document.querySelector('header') && light() !== "
            f"{json.dumps(name == 'light')}) await new Promise(requestAnimationFrame);"
            "const changes = document.getAnimations().filter((one) => one instanceof "
            "CSSTransition);await Promise.allSettled(changes.map((one) => one.finished));"
        )
