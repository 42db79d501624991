"""Comparisons in a notebook, shown as in the page.

::

    from reports.notebook import compare

    compare(mitsuba.cornell_box(), spp=64, resolution=(128, 128))
"""

import heuristic  # noqa: F401  isort: skip  finds LLVM before Mitsuba is imported

from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from msgspec import structs

import comparisons.compare
from comparisons.case import Request, Scene, open_case
from comparisons.record import Comparison
from reports.page import page
from reports.run import output

HEIGHT = 720
"""Pixels of the frame; what is longer scrolls."""


@dataclass(frozen=True)
class Shown:
    """A comparison and the page that shows it.

    `comparison` has the record, ``comparison.record``, and the images, ``comparison.images``.
    """

    comparison: Comparison
    page: str

    def _repr_html_(self) -> str:
        """Show the page in a frame of its own: neither its styles nor its scripts get out."""
        return (
            f'<iframe sandbox="allow-scripts" style="width: 100%; height: {HEIGHT}px; border: 0"'
            f' title="Comparison" srcdoc="{escape(self.page)}"></iframe>'
        )


def compare(scene: Scene, name: str | None = None, **options: Any) -> Shown:
    """Compare a scene as ``fotismos compare`` does.

    Parameters
    ----------
    scene
        A dictionary as ``mitsuba.load_dict`` takes it, a function that returns one, a built-in
        name, or the path of a scene.
    name
        The scene's name, in place of its own.
    options
        By the names of the command line, such as ``spp=64`` or ``resolution=(128, 128)``.

    Raises
    ------
    InputError
        When the scene cannot be read or paired, or an option is not known.
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    case = open_case(scene, Request.of(options), name)
    comparison = comparisons.compare.compare(case.source, case.options, command=case.command())
    with TemporaryDirectory() as folder:
        view = output.write_scene(Path(folder), "scene", comparison)
    return Shown(comparison, page.render([structs.replace(view, files={})]))
