"""Two small baselines for tests, and what makes one of them seem to have moved."""

import json
import sys
from pathlib import Path

import pytest

from reports import cli, jobs

FAST = ("--spp", 32, "--resolution", "16x12")
SCENES = ("--scene", "fig-8-6a", "--scene", "fig-8-6b")
SERVICES = ("GITHUB_ACTIONS", "GITLAB_CI", "TF_BUILD", "TEAMCITY_VERSION")
"""Variables by which CI services are told; the tests may themselves run in one."""


def make(folder: Path) -> None:
    """Write both, with pictures, by the command and in this process."""
    words = ["check", folder, "--update", *SCENES, "--images", *FAST]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jobs, "IN_PROCESSES", False)
        patch.setattr(sys, "argv", ["fotismos", *map(str, words)])
        cli.main()


def change(path: Path, half: str = "reference", factor: float = 1.5) -> None:
    """Change a baseline so that its scene seems to have moved in one block."""
    data = json.loads(path.read_text(encoding="utf-8"))
    data[half]["blocks"][1][2]["mean"][0] *= factor
    path.write_text(json.dumps(data), encoding="utf-8")
