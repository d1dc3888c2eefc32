"""Formulas as MathML, which browsers draw themselves: no script, one font, nothing from another
host."""

from __future__ import annotations

import re

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.writers.html5 import HTML5Translator

# What docutils leaves to be said: the index of an accented letter stands at its side, not below as
# that of a sum, and a thin space follows the name of a function.
REPAIRS = [
    (re.compile(r"(\\tilde(?: \w|\{\w\}|\\\w+))(?=[_^])"), r"\1{}"),
    (re.compile(r"(\\(?:sin|cos|tan|ln|arccos|exp))(?= ?\\| [a-zA-Z])"), r"\1\,"),
]


def _draw(translator: HTML5Translator, node: nodes.Element, as_block: bool) -> None:
    text = node.astext()
    for pattern, repaired in REPAIRS:
        text = pattern.sub(repaired, text)
    try:
        translator.body.append(tex2mathml(text, as_block=as_block))
    except MathError as error:
        raise ExtensionError(
            f"{translator.builder.current_docname}: {node.astext()!r}: {error}"
        ) from error
    raise nodes.SkipNode


def _inline(translator: HTML5Translator, node: nodes.Element) -> None:
    _draw(translator, node, as_block=False)


def _block(translator: HTML5Translator, node: nodes.Element) -> None:
    _draw(translator, node, as_block=True)


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer(
        "mathml", inline_renderers=(_inline, None), block_renderers=(_block, None)
    )
    return {"parallel_read_safe": True}
