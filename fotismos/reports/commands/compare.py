"""``fotismos compare``: how far textbook shading is from physics."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import click

from fotismos.comparisons.names import PICTURES as SUFFIXES
from fotismos.comparisons.names import picture_parts, with_files
from fotismos.comparisons.options import Options, option
from fotismos.comparisons.processes.pool import Pool
from fotismos.reports.command import PICTURES, PROCESSES, SCENES, OnScene
from fotismos.reports.jobs import Job, Terminal


class Compare(OnScene, frozen=True):
    """Measure how far textbook shading is from physics, where, and whether it is more than noise.

    SCENE is a built-in name (`fotismos scenes`), a Mitsuba file (.xml), or a Python file (.py) in
    which `scene` is a dictionary, or a function that returns one. Pictures of other renderers may
    replace either half; with both, no scene is needed.

    Writes OUTPUT/index.html and tables of all scenes, and for each scene comparison.json,
    comparison.exr and pictures. If one scene fails, the others are still compared. An interrupted
    run keeps its finished scenes: the same command resumes it. With -q, two pictures print one
    line for scripts: share of pixels, mean and decision, with tabs between.

    Examples
    --------
      fotismos compare fig-8-9
      fotismos compare my_scene.xml cornell-box --resolution 640x480 -o results
      fotismos compare my_scene.xml --heuristic my_shader.py
      fotismos compare my_scene.xml --image theirs.exr
      fotismos compare --reference 'theirs_*.exr' --image 'mine_*.exr' --max-visible 5%
      fotismos compare cornell-box --noise 0.5 --spp 2048
      fotismos compare fig-8-8a fig-8-9 --figures -q
      fotismos compare my_scene.xml -D roughness=0.2 --sensor 1
      fotismos compare plastic-spheres --no-why
      fotismos compare my_scene.xml --reference 'cycles_*.exr'
      fotismos compare my_scenes/*.xml --max-visible 5% --summary summary.md
    """

    argument = "[SCENE...]"
    options_shown = (
        "why", SCENES, "image", PICTURES, "tone_map", "noise", "colour_science",
        "output", "figures", "fresh", "quiet", "verbose", "is_opened",
        "within", "max_visible", "junit", "summary", PROCESSES,
    )  # fmt: skip

    why: Annotated[
        bool,
        option("Find which effects are missing, at a small size; not for pictures.", default="why"),
    ] = True

    def run(self, terminal: Terminal) -> int:
        """Compare the scenes, or the two pictures."""
        self._require_halves(terminal.scenes)
        job = Job(
            options=with_files(self.options),
            figures=terminal.figures,
            with_causes=self.why,
            fresh=terminal.fresh,
            within=terminal.within,
        )
        if terminal.scenes:
            with terminal.processes(len(terminal.scenes)) as pool:
                from fotismos.reports.run import batch, scene  # loaded late, as Command says

                subjects = scene.subjects(terminal.scenes)
                finish = _finish(job.options, terminal)
                return batch.compare_all(pool, subjects, job, terminal, finish=finish)
        from fotismos.reports.run import batch, pictures  # without Mitsuba

        with Pool(0) as pool:  # two pictures run no user's code
            subjects = pictures.subjects(job.options)
            finish = _finish(job.options, terminal)
            return batch.compare_all(pool, subjects, job, terminal, finish=finish)

    def _require_halves(self, scenes: tuple[str, ...]) -> None:
        """Refuse what is too little or too much: scenes, pictures, words about pictures."""
        if not (self.image or self.reference):
            self.refuse_reading("--image or --reference")
        if not scenes and not (self.image and self.reference):
            raise click.UsageError(
                "Missing argument 'SCENE...': give a scene, or two pictures, --reference and"
                " --image."
            )
        for name in ("image", "reference"):
            if getattr(self, name) and len(scenes) > 1:
                are_files = any(Path(word).suffix.lower() in SUFFIXES for word in scenes)
                if are_files:
                    raise click.UsageError(f"Put a pattern in quotes: --{name} 'name_*.exr'.")
                raise click.UsageError(f"--{name} goes with one scene.")


def _finish(options: Options, terminal: Terminal) -> Callable[..., int] | None:
    """Return what prints gates and writes files for CI; None if the user wants neither."""
    if terminal.max_visible is None and not (terminal.junit or terminal.summary):
        return None
    from fotismos.reports.ci import summary  # loaded late: most comparisons need no CI

    shader = options.heuristic.partition(":")[0]  # FILE:NAME, or a name alone
    pictures = [picture_parts(word)[0] for word in options.picture_files]
    summary.require_free(terminal.junit, terminal.summary, [*terminal.scenes, shader, *pictures])
    return partial(summary.conclude, terminal)
