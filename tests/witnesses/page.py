"""The tables of docs/witnesses.md, made from the cases' own declarations and by running them."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.reports.terminal.table import Table, markdown
from tests.witnesses import test_closed_forms, test_povray, test_radiance
from tests.witnesses.witness import deviation


def closed_forms() -> Iterator[tuple[str, str, str]]:
    """Yield how far the reference is from each closed form."""
    yield "case", "reference less form (%)", "95 % interval (±)"
    for each in test_closed_forms.WITNESSES:
        found = deviation(each)
        spread = 1.96 * found.standard_error[0] + each.form_error
        yield each.name, f"{100 * found.value[0]:+.3f}", f"{100 * spread:.3f}"


def figures() -> Iterator[str]:
    """Yield how far the kernel's figures are from POV-Ray's."""
    found = [_figure(name) for name in test_povray.FIGURES + test_povray.OTHERS]
    pixels, alone, largest = zip(*found, strict=True)
    yield (
        f"In {len(found)} figures both see {min(pixels):,} to {max(pixels):,} pixels, and one alone"
        f" sees {max(alone)} at most. The largest difference is {max(largest):.2f} of a rounding."
    )


def whole_scenes() -> Iterator[str]:
    """Yield how far the reference is from Radiance, in the colour and the block that are worst."""
    rows = [("Scene", "mean", "worst block")]
    for name in test_radiance.CASES:
        found, error = (100 * each for each in test_radiance.deviation(*test_radiance.both(name)))
        spots = np.argmax(np.abs(found[0])), found[0].size + np.argmax(np.abs(found[1:]))
        cells = (f"{found.flat[spot]:+.3f}±{1.96 * error.flat[spot]:.3f}" for spot in spots)
        rows.append((name, *cells))
    yield from markdown(Table.of(rows))


def _figure(name: str) -> tuple[int, int, float]:
    with TemporaryDirectory() as folder:
        kernel, witness, alone = test_povray.seen_by_both(SCENES[name].make(), Path(folder))
    rounding = test_povray.HALF * kernel + test_povray.SINGLE
    largest = float(np.max(np.abs(kernel - witness) / rounding))
    return len(kernel), alone, largest
