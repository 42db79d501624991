"""Comparisons in a notebook, shown as on the page.

::

    from reports.notebook import compare

    compare(mitsuba.cornell_box(), spp=64, resolution=(128, 128))
"""

import heuristic  # noqa: F401  isort: skip  finds LLVM before Mitsuba is imported

from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from msgspec import structs

import comparisons.compare
from comparisons.case import Request, Scene, open_case
from comparisons.record import Comparison
from comparisons.terms.term_grid import PixelTerms
from heuristic.errors import InputError
from reports.charts import figures, term_figure
from reports.page import page
from reports.run import output

HEIGHT = 900
"""Height of the frame in pixels: the viewer with its controls fits a wide notebook."""

DENSITY = 130
"""Dots per inch of the picture for notebooks that cannot show the frame."""


@dataclass(frozen=True)
class Shown:
    """A comparison and the page that shows it.

    `comparison` has the record, ``comparison.record``, and the images, ``comparison.images``.
    """

    comparison: Comparison = field(repr=False)
    page: str = field(repr=False)

    def _repr_html_(self) -> str:
        """Show the page in a frame, which isolates its styles and scripts."""
        return (
            f'<iframe sandbox="allow-scripts" style="width: 100%; height: {HEIGHT}px; border: 0"'
            f' title="Comparison" srcdoc="{escape(self.page)}"></iframe>'
        )

    def _repr_png_(self) -> bytes:
        """Show both halves and the map of the error where scripts do not run."""
        return figures.drawn(figures.strip(self.comparison), "png", DENSITY)

    def at(self, x: int, y: int) -> "ShownTerms":
        """Return the terms of equation 8.10 at a pixel, or at the nearest one that has them.

        Parameters
        ----------
        x, y
            Column and row, from 0 at the upper left.

        Raises
        ------
        InputError
            For a pixel outside the image or on the background, and for a heuristic other than
            equation 8.10.
        """
        if self.comparison.terms is None:
            raise InputError(f"there are no terms. {self.comparison.no_terms}")
        found = self.comparison.terms.at(x, y)
        if found is None:
            raise InputError(f"pixel {x}, {y} sees no surface. Give one that does.")
        place, images = found.pixel[::-1], self.comparison.images
        error = float(images.reference_stderr[place].max())
        return ShownTerms(found, tuple(images.reference[place].tolist()), error)


@dataclass(frozen=True)
class ShownTerms:
    """The terms at a pixel, shown as a figure and a table.

    `reference` is the physical reference at the pixel, `standard_error` its noisiest channel's.
    """

    terms: PixelTerms
    reference: tuple[float, ...]
    standard_error: float

    def _repr_html_(self) -> str:
        return term_figure.html(self.terms, self.reference, self.standard_error)


def compare(scene: Scene, name: str | None = None, **options: Any) -> Shown:
    """Compare a scene as ``fotismos compare`` does.

    Parameters
    ----------
    scene
        A dictionary for ``mitsuba.load_dict``, a function that returns one, a built-in name, or the
        path of a scene.
    name
        Replaces the scene's name.
    options
        Those of the command line, such as ``spp=64`` or ``resolution=(128, 128)``.

    Raises
    ------
    InputError
        If the scene cannot be read or paired, or an option is unknown.
    NonFiniteError
        If a rendering contains a NaN or an infinity.
    """
    case = open_case(scene, Request.of(options), name)
    comparison = comparisons.compare.compare(case.source, case.options, command=case.command())
    with TemporaryDirectory() as folder:
        view = output.write_scene(Path(folder), "scene", comparison)
    return Shown(comparison, page.render([structs.replace(view, files={})]))
