"""Pictures of the set-up and of all set-ups, from the sketch of the page: one drawing in both.

python benchmarks/setups.py [FOLDER]      (default: docs/img; setup.svg and setups.svg)
"""

import re
import sys
from pathlib import Path

from mumacro.plotting import BLUE, GREY, INK, RED
from tests.support.measuring import IMAGES

PAGE = Path(__file__).resolve().parent.parent / "service" / "static" / "page" / "index.html"
#: what is drawn of the sketch, and its words, three in a row
SETUPS = {
    ("spring", "across"): "one spring, shaken across",
    ("spring", "along"): "one spring, shaken along",
    ("spring", "normal"): "one spring, its normal force oscillates",
    ("ball", "across"): "a ball, shaken across",
    ("ball", "along"): "a ball, shaken along",
    ("rigid", "across"): "rigid: no spring, the limit of large k",
}
#: the symbols of the set-up, in words
SYMBOLS = {
    "Fz": "load that presses the body on the base",
    "v₀": "speed at which it is dragged",
    "y₀, f": "amplitude and frequency of the shaking",
    "k": "shear stiffness of the contact",
    "µ₀": "its friction without shaking",
    "µ": "friction that is left: mean drag force / Fz",
}
WIDTH, HEIGHT, MARGIN = 300, 162, 10
# the page's colours of its light scheme
STYLE = f"""
text {{ font: 12px system-ui, "DejaVu Sans", sans-serif; fill: {INK} }}
path, circle, ellipse {{ fill: none; stroke: {INK}; stroke-width: 1.5; stroke-linejoin: round }}
.base {{ fill: #e6eaef }} .solid {{ fill: #ffffff }} .foot {{ fill: {INK} }}
.far {{ stroke-dasharray: 2 4; stroke: {GREY} }}
.drive path {{ stroke: {BLUE}; stroke-width: 2 }} .drive text {{ fill: {BLUE} }}
.motion path {{ stroke: {RED}; stroke-width: 2 }} .motion text {{ fill: {RED} }}
.words {{ text-anchor: middle; font-size: 13px }}
.symbol {{ font-size: 17px; font-weight: 600 }} .meaning {{ font-size: 17px }}
"""


def parts() -> dict[str, str]:
    """The base of the sketch, and its groups by their names."""
    drawn = PAGE.read_text("utf-8").partition('id="sketch"')[2].partition("</svg>")[0]
    lines = drawn.partition(">")[2].replace(" hidden", "").splitlines()
    inside = "\n".join(line.strip() for line in lines)
    starts = [group.start() for group in re.finditer(r'<g class="(?:body|motion)', inside)]
    groups = [inside[i:j] for i, j in zip(starts, [*starts[1:], len(inside)], strict=True)]
    names = {group.split('"')[1].split()[1]: group.strip() for group in groups}
    return {"base": inside[: starts[0]].strip(), **names}


def svg(width: int, height: int, description: str, panels: list[str]) -> str:
    """Return panels as one SVG on white."""
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
            f'width="{width}" height="{height}" role="img" aria-label="{description}">',
            f"<style>{STYLE}</style>",
            f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
            *panels,
            "</svg>\n",
        ]
    )


def setup() -> str:
    """Return the set-up of the first example, with a line of words for each symbol."""
    drawn = parts()
    inside = [drawn["base"], drawn["spring"], drawn["across"]]
    lines = "\n".join(
        f'<text class="symbol" x="520" y="{36 + 28 * i}">{symbol}</text>'
        f'<text class="meaning" x="594" y="{36 + 28 * i}">{words}</text>'
        for i, (symbol, words) in enumerate(SYMBOLS.items())
    )
    larger = f'<g transform="translate(10 4) scale(1.6)">{"".join(inside)}</g>'
    description = "a body is pressed on a base, dragged, and shaken sideways: " + "; ".join(
        f"{symbol} {words}" for symbol, words in SYMBOLS.items()
    )
    return svg(980, 196, description, [larger, lines])


def setups() -> str:
    """Return all set-ups."""
    drawn, panels = parts(), []
    for i, ((body, motion), words) in enumerate(SETUPS.items()):
        x, y = MARGIN + WIDTH * (i % 3), MARGIN + HEIGHT * (i // 3)
        label = f'<text class="words" x="{WIDTH // 2}" y="144">{words}</text>'
        inside = [drawn["base"], drawn[body], drawn[motion], label]
        panels.append("\n".join([f'<g transform="translate({x} {y})">', *inside, "</g>"]))
    return svg(3 * WIDTH + 2 * MARGIN, 2 * HEIGHT + 2 * MARGIN, "; ".join(SETUPS.values()), panels)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES
    for draw in (setup, setups):
        (folder / f"{draw.__name__}.svg").write_text(draw(), encoding="utf-8")
