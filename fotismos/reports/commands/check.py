"""``fotismos check``: whether a change moved anything that was measured before.

The table ``[tool.fotismos]`` of a project's pyproject.toml says what it does there::

    [tool.fotismos]
    baselines = "baselines"
    report = "out"
    significance = 0.001
    within = 2
    max_visible = "5%"

An option on the command line comes before the table. Folders are relative to the file.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from msgspec import Meta

from fotismos.comparisons.atomic import file_name
from fotismos.comparisons.options import option
from fotismos.comparisons.processes.pool import Pool
from fotismos.comparisons.records.check import Checks, Tolerance
from fotismos.heuristic.errors import InputError
from fotismos.reports.command import PROCESSES, SCENES, Command
from fotismos.reports.jobs import Terminal, command_line
from fotismos.reports.terminal.parsing import definition, percentage
from fotismos.reports.terminal.words import echo

if TYPE_CHECKING:  # help needs no Mitsuba
    from fotismos.comparisons.records.check import CheckRecord


READING = ("--transfer", "--over")
"""Options that say how pictures are read; they are kept in their baseline."""


class Baseline(Command, frozen=True):
    """A check of what a baseline holds."""

    baseline: Path
    significance: Annotated[
        float,
        Meta(gt=0, lt=1),
        option("Chance of an alarm though nothing changed, over all that is tested."),
    ] = 0.01


class Check(Baseline, frozen=True):
    """Report whether anything that was measured before moved by more than noise.

    BASELINE is a file that an earlier --update wrote, or a folder of them. Each scene is rendered
    again with its baseline's options and seed; --seed replaces the seed. If something moved, the
    exit code is 1, and OUTPUT/check/index.html shows what moved and where. If a baseline could not
    be checked, it is 2; the others are checked nevertheless.

    The table [tool.fotismos] of the nearest pyproject.toml may set baselines, in place of BASELINE,
    report, in place of --output, significance, within and max_visible.

    With --picture, repeats of a picture are compared with earlier ones and not rendered; the scenes
    of a folder are checked, too. Repeats of a renderer without noise are equal, and any change is a
    drift. A tolerance, --within or --max-visible, allows what nobody sees, such as another GPU's
    rounding.

    A scene or shader in Python is code, and so is a baseline that names one: it is executed.

    Examples
    --------
      fotismos check baselines --update --scene cornell-box --scene my_scene.xml
      fotismos check baselines
      fotismos check baselines/cornell-box.exr --update
      fotismos check baselines --update --picture hall='render_*.exr'
      fotismos check baselines --picture hall='new_*.exr'
      fotismos check baselines --picture hall='new_*.png' --within 2 --max-visible 5%
    """

    argument = "BASELINE"
    below = "check"
    options_shown = (
        "update", "scenes", "pictures", "images", "significance", SCENES, "transfer", "over",
        "as_json", "output", "quiet", "verbose", "within", "max_visible", "junit", "summary",
        PROCESSES,
    )  # fmt: skip
    own_defaults: ClassVar[dict[str, str]] = {
        "resolution": "the film's, reduced to 64 pixels at most"
    }
    table: ClassVar[dict[str, str]] = {
        "baselines": "baseline",
        "report": "output",
        "significance": "significance",
        "within": "within",
        "max_visible": "max_visible",
    }

    update: Annotated[bool, option("Write what moved to BASELINE, and print it.")] = False
    scenes: Annotated[
        tuple[str, ...],
        option(
            "With --update: the scene of BASELINE; several for a folder, whose baselines are named"
            " after their scenes.",
            names=("--scene",),
            metavar="SCENE",
        ),
    ] = ()
    pictures: Annotated[
        tuple[tuple[str, str], ...],
        option(
            "Repeats of a picture from any renderer, each with its own seed, such as"
            " 'hall=render_*.exr'; several for a folder, whose baselines have these names.",
            names=("--picture",),
            metavar="NAME=PATTERN",
            type=definition,
        ),
    ] = ()
    images: Annotated[bool, option("Does nothing any more: baselines always keep pictures.")] = (
        False
    )
    within: Annotated[
        float | None,
        option(
            "With --picture: judge by a tolerance in place of drift. Pixels differ visibly if"
            " ΔE2000 is above this.  [default: 2]",
            metavar="DE",
        ),
    ] = None
    max_visible: Annotated[
        float | None,
        option(
            "The share of the pixels that may differ visibly.  [default: 5%]",
            metavar="P%",
            type=percentage,
        ),
    ] = None
    changes: Mapping[str, Any] = {}

    def run(self, terminal: Terminal) -> int:
        """Check or update baselines, print what moved, and return the exit code."""
        self._require_what_fits(terminal.stated)
        inputs = list(self.baseline.glob("*")) if self.baseline.is_dir() else [self.baseline]
        with terminal.processes(max(len(self.scenes), len(inputs))) as pool:
            from fotismos.reports.ci import checks, summary  # loaded late

            # Before anything is rendered: an output that cannot be used is refused at once.
            summary.require_free(terminal.junit, terminal.summary, [*self.scenes, *inputs])
            page = ""
            if self.update:
                outcomes = [record for record, _ in checks.update_all(pool, self)]
            else:
                outcomes, page = self._examined(pool, terminal.output)
            code = summary.conclude_checks(outcomes, terminal, self.significance, page)
            if terminal.as_json:
                record = Checks(
                    passed=not code, significance=self.significance, checks=tuple(outcomes)
                )
                terminal.show(record, ())
            return code

    def _examined(self, pool: Pool, output: Path) -> "tuple[list[CheckRecord], str]":
        """Check the baselines; return the outcomes, and the page if there is anything to see."""
        from fotismos.reports.ci import checks, summary  # loaded late
        from fotismos.reports.files import results  # as late

        with results.hold(output / "check", command_line(), ()) as folder:
            examined = checks.examine_all(pool, self, folder)
            outcomes = [record for record, _ in examined]
            sections = [section for _, section in examined if section is not None]
            if not sections:
                results.clear(folder, (results.PAGE, results.DETAILS))
                return outcomes, ""
            outcome = summary.outcome(outcomes, self.significance)
            return outcomes, str(checks.write_page(folder, sections, outcome))

    def _require_what_fits(self, stated: frozenset[str]) -> None:
        """Refuse options that what is asked has no use for."""
        wanting = [f"--{name.replace('_', '-')}" for name in self.changes if name != "seed"]
        if self.scenes:
            wanting.append("--scene")
        if self.images:
            echo("--images does nothing any more: baselines always keep pictures.", err=True)
        if wanting and not self.update:
            raise InputError(
                f"{', '.join(wanting)}: a check renders its baseline's scene and options. Add"
                " --update to write another baseline."
            )
        others = [word for word in wanting if word not in READING]
        if self.pictures and self.update and others:
            raise InputError(
                f"{', '.join(others)}: pictures are not rendered. Omit it, or --picture."
            )
        if stated & {"within", "max_visible"} and (self.update or not self.pictures):
            raise InputError(
                "--within, --max-visible: a tolerance judges new pictures. Give --picture, without"
                " --update."
            )

    @property
    def tolerance(self) -> Tolerance | None:
        """How many pixels may differ visibly, and from which ΔE2000 on; None if drift decides.

        A project's own tolerance is for its pictures alone.
        """
        is_omitted = self.within is None and self.max_visible is None
        if is_omitted or self.update or not self.pictures:
            return None
        # Loaded late: help needs no NumPy.
        from fotismos.comparisons.departure.criterion import LIMIT, TOLERANCE, checked_threshold

        return Tolerance(
            within=checked_threshold(TOLERANCE if self.within is None else self.within),
            bound=LIMIT if self.max_visible is None else self.max_visible,
        )

    @property
    def patterns(self) -> dict[Path, str]:
        """The patterns of pictures, by the files of their baselines."""
        names = {file_name(name, "--picture"): pattern for name, pattern in self.pictures}
        if len(names) < len(self.pictures) or (len(names) > 1 and self._is_file):
            raise InputError("--picture: give each name once, and a folder for several pictures.")
        return {self._file(name): pattern for name, pattern in names.items()}

    @property
    def scene_words(self) -> dict[Path, str]:
        """The scenes of baselines to be written, by their files; others are in the files."""
        from fotismos.reports.ci import baselines  # loaded late

        if self._is_file and len(self.scenes) > 1:
            raise InputError(
                f"{self.baseline}: a baseline is of one --scene; give a folder for several."
            )
        named = {self._file(baselines.name_of(scene)): scene for scene in self.scenes}
        if len(named) < len(self.scenes):
            raise InputError(
                f"{', '.join(self.scenes)}: two scenes have one name. Give a file for each."
            )
        return named

    @property
    def _is_file(self) -> bool:
        return self.baseline.suffix in (".exr", ".json")

    def _file(self, name: str) -> Path:
        """Return the file of the baseline of this name."""
        from fotismos.reports.ci import baselines  # loaded late

        return baselines.placed(self.baseline if self._is_file else self.baseline / f"{name}.exr")
