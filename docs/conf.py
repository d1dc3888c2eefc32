"""The documentation as a site: ``python3 dev.py docs``; warnings are errors, links are checked by
the build itself."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "src"), str(ROOT / "docs" / "_ext")]

from mumacro import __version__  # noqa: E402 - found by the line above

project = "mumacro"
author = "the mumacro developers"
version = release = __version__
html_title = f"mumacro {__version__}"
highlight_language = "none"
smartquotes = False  # --help is no dash
html_theme = "furo"
# the fonts and colours of the service's page
_FONTS = {
    "font-stack": 'system-ui, "DejaVu Sans", sans-serif',
    "font-stack--monospace": 'ui-monospace, "DejaVu Sans Mono", monospace',
}
_COLOURS = {
    "color-background-primary": "card",
    "color-background-secondary": "back",
    "color-background-border": "line",
    "color-foreground-primary": "text",
    "color-foreground-secondary": "soft",
    "color-foreground-muted": "soft",
    "color-brand-primary": "accent",
    "color-brand-content": "accent",
}
_PAGE = (ROOT / "service" / "static" / "page" / "colours.css").read_text("utf-8")
_PAIRS = {
    name: (light, dark)
    for name, light, dark in re.findall(r"--(\w+): light-dark\((#\w+), (#\w+)\)", _PAGE)
}
_LIGHT, _DARK = (
    _FONTS | {variable: _PAIRS[name][scheme] for variable, name in _COLOURS.items()}
    for scheme in (0, 1)
)
html_theme_options = {"light_css_variables": _LIGHT, "dark_css_variables": _DARK}
html_copy_source = False
html_show_copyright = False
html_math_renderer = "mathml"  # docs/_ext/mathml.py
html_static_path = ["_static"]
html_css_files = ["mathml.css", "site.css"]

extensions = ["myst_parser", "mathml"]
exclude_patterns = ["_ext", "_static"]
# Anchors of headings are those that GitHub makes, so that the pages read alike there.
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_fence_as_directive = ["math"]  # GitHub draws the same fence
