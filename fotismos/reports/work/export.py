"""The work of ``fotismos export``."""

from pathlib import Path
from typing import Any

from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import Options
from fotismos.comparisons.plain_scene import plain_scene
from fotismos.comparisons.processes.pool import Pool
from fotismos.reports.files import export_files
from fotismos.reports.terminal.words import tell_where
from fotismos.reports.work.folders import results_of


def run(pool: Pool, scene: str, output: Path, options: Options) -> None:
    """Export one scene."""
    (folder,) = results_of(
        pool, output / "export", scenes=[scene], work=exported, arguments=[options]
    )
    tell_where(folder)


def exported(name: str, options: Options, target: Path, progress: Any) -> None:
    """Write the files that another program needs to render a scene."""
    case = open_case(name, options)
    scene = plain_scene(case.source, case.options)
    export_files.write(target, scene, case.command(image="YOURS.exr"))
