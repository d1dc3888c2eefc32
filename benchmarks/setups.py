"""The picture of the set-ups, from the sketch of the page: one drawing in both.

python benchmarks/setups.py [OUT]      (default: docs/img/setups.svg)
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


def picture() -> str:
    """The set-ups as SVG on white."""
    drawn, panels = parts(), []
    for i, ((body, motion), words) in enumerate(SETUPS.items()):
        x, y = MARGIN + WIDTH * (i % 3), MARGIN + HEIGHT * (i // 3)
        label = f'<text class="words" x="{WIDTH // 2}" y="144">{words}</text>'
        inside = [drawn["base"], drawn[body], drawn[motion], label]
        panels.append("\n".join([f'<g transform="translate({x} {y})">', *inside, "</g>"]))
    width, height = 3 * WIDTH + 2 * MARGIN, 2 * HEIGHT + 2 * MARGIN
    description = "; ".join(SETUPS.values())
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


if __name__ == "__main__":
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "setups.svg"
    out.write_text(picture(), encoding="utf-8")
