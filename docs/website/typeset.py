"""Typesets equations as SVG in the colour of the text: offline, and without scripts."""

from functools import cache
from html import escape

import numpy as np
from docutils.nodes import SkipNode, math, math_block
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.textpath import TextPath, text_to_path
from numpy.typing import NDArray
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

SIZE = 12
"""Points; the em of the SVG, which scales with the text."""

COMMANDS = {Path.MOVETO: "M", Path.LINETO: "L", Path.CURVE3: "Q", Path.CURVE4: "C"}
"""Of SVG, for Matplotlib's, with points."""

FLIPPED = np.tile((1, -1), 3)
"""Signs of coordinates: SVG's y points down."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.add_html_math_renderer("svg", (inline, None), (block, None))
    return {"parallel_read_safe": True}


def inline(writer: HTML5Translator, node: math) -> None:
    """Write an equation in a sentence."""
    writer.body.append(svg(node.astext()))
    raise SkipNode


def block(writer: HTML5Translator, node: math_block) -> None:
    """Write an equation on a line of its own."""
    style = "overflow-x: auto; margin: 1em 0; font-size: 1.15em"
    writer.body.append(f'<div style="{style}">{svg(node.astext())}</div>')
    raise SkipNode


@cache
def svg(equation: str) -> str:
    """Return an equation in LaTeX as an SVG element, with the equation as its description."""
    text, font = f"${equation.strip()}$", FontProperties(size=SIZE, math_fontfamily="stix")
    width, height, depth = text_to_path.get_text_width_height_descent(text, font, ismath=True)
    path = "".join(
        _command(code, points) for points, code in TextPath((0, 0), text, prop=font).iter_segments()
    )
    ems = f"height: {height / SIZE:.3f}em; vertical-align: {-depth / SIZE:.3f}em"
    style = f"{ems}; overflow: visible"
    box = f"0 {depth - height:.2f} {width:.2f} {height:.2f}"
    return (
        f'<svg role="img" aria-label="{escape(equation)}" viewBox="{box}" style="{style}">'
        f'<path fill="currentColor" d="{path}"/></svg>'
    )


def _command(code: int, points: NDArray[np.float64]) -> str:
    if code == Path.CLOSEPOLY:
        return "Z"
    return COMMANDS[code] + " ".join(f"{each:.2f}" for each in points * FLIPPED[: len(points)])
