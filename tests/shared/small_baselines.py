"""Two small baselines for tests, and what makes them seem to have moved."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import structs

from fotismos.comparisons.pictures import Pictures
from fotismos.reports.ci import baselines
from tests.shared.programs import command_line

FAST = ("--spp", 32, "--resolution", "16x12")
SCENES = ("--scene", "fig-8-6a", "--scene", "fig-8-6b")


def make(folder: Path) -> None:
    """Write both, by the command and in this process."""
    command_line("check", folder, "--update", *SCENES, *FAST)


def redder(image: np.ndarray) -> np.ndarray:
    """Return an image with more red in a part of it."""
    changed = image.copy()
    changed[4:8, 5:11, 0] *= 1.5
    return changed


def change(
    path: Path, half: str = "reference", by: Callable[[np.ndarray], np.ndarray] = redder
) -> None:
    """Change the passes of a half in a baseline, so that its scene seems to have moved."""
    file = baselines.read(path)
    images = [by(picture.image) for picture in file.halves[half].files]
    halves = dict(file.halves) | {half: Pictures.of(half, images)}
    baselines.write(baselines.BaselineFile(path, file.baseline, halves))


def changed_header(path: Path, new: Path, **changes: Any) -> None:
    """Write a baseline with other fields in its header to another file."""
    file = baselines.read(path)
    baseline = structs.replace(file.baseline, **changes)
    baselines.write(baselines.BaselineFile(new, baseline, file.halves))
