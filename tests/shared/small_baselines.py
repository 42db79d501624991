"""Two small baselines for tests, and what makes one of them seem to have moved."""

import json
from pathlib import Path

from tests.shared.programs import command_line

FAST = ("--spp", 32, "--resolution", "16x12")
SCENES = ("--scene", "fig-8-6a", "--scene", "fig-8-6b")


def make(folder: Path) -> None:
    """Write both, with pictures, by the command and in this process."""
    command_line("check", folder, "--update", *SCENES, "--images", *FAST)


def change(path: Path, half: str = "reference", factor: float = 1.5) -> None:
    """Change a baseline so that its scene seems to have moved in one block."""
    data = json.loads(path.read_text(encoding="utf-8"))
    data[half]["blocks"][1][2]["mean"][0] *= factor
    path.write_text(json.dumps(data), encoding="utf-8")
