"""``fotismos cost``: what each step of accuracy costs in time."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeAlias

import click
from msgspec import Meta

from fotismos.comparisons.departure.criterion import TOLERANCE, checked_threshold
from fotismos.comparisons.ladder.timed_pictures import EngineTimes, TimedPicture
from fotismos.comparisons.names import matching, picture_parts
from fotismos.comparisons.options import Side, option
from fotismos.comparisons.processes.pool import Pool
from fotismos.heuristic.errors import InputError
from fotismos.reports.command import PICTURES, SCENES, OnScene
from fotismos.reports.jobs import Terminal

if TYPE_CHECKING:
    from fotismos.comparisons.case import Case
    from fotismos.comparisons.ladder.engine import Study
    from fotismos.comparisons.records.cost import Cost as CostRecord
    from fotismos.comparisons.records.engine import EngineCost
    from fotismos.reference.rendering.passes import Progress

    # Functions take a mapping for the words of the command line.
    Settings: TypeAlias = Any
else:
    Settings = tuple[Any, ...]


class Cost(OnScene, frozen=True):
    """Measure what each step of accuracy costs in time, and which effect is worth paying for.

    Renders with methods from flat shading to all effects, at several sample counts each, and
    attributes error and time to each effect in which textbook shading differs. Writes a page,
    cost.json, cost.svg and pictures to OUTPUT/cost/SCENE. Without --resolution the film is reduced
    to a width of 128 pixels. --spp gives the largest count of samples per pixel; if omitted, it
    goes on from 64 until a method looks right, or would take a minute.

    With --picture, settings of another renderer have a front of their own: their times are given.
    The size of the pictures becomes that of the study. Without SCENE, nothing is rendered: pictures
    of --reference judge the settings.

    Examples
    --------
      fotismos cost cornell-box
      fotismos cost my_scene.xml --resolution 256x256 --rounds 11
      fotismos cost cornell-box --at 1920x1080
      fotismos cost hall.xml --picture 'PCSS low @ 6.3ms=low_*.exr' --machine 'RTX 3060'
      fotismos cost --reference 'truth_*.exr' --picture 'SSAO @ 1.2ms=ssao_*.exr'
    """

    argument = "[SCENE]"
    below = "cost/SCENE"
    options_shown = (
        "rounds", "at", "pictures", "machine", "kernel_time", SCENES, PICTURES,
        "tone_map", "output", "quiet", "verbose", "as_json", "within", "timeout",
    )  # fmt: skip
    own_defaults: ClassVar[dict[str, str]] = {
        "resolution": "the film's, reduced to a width of 128",
        "spp": "64, then more until a method looks right",
    }

    at: Annotated[
        tuple[Side, Side] | None, option("Predict the times at this size.", metavar="WxH")
    ] = None
    pictures: Annotated[
        Settings,
        option(
            "A setting of another renderer: its picture and the time of it, such as 'PCSS low @"
            " 6.3ms=low_*.exr'. Several files are repeats, which show its noise.",
            names=("--picture",),
            metavar="'NAME @ TIME=PATTERN'",
        ),
    ] = ()
    machine: Annotated[str | None, option("The machine that took these times.", metavar="TEXT")] = (
        None
    )
    kernel_time: Annotated[
        str | None, option("What the textbook kernel takes there, for ratios.", metavar="TIME")
    ] = None
    rounds: Annotated[
        Annotated[int, Meta(ge=2)] | None, option("Timed repeats of each method.", default="7")
    ] = None

    @property
    def engine(self) -> EngineTimes | None:
        """The settings of another renderer, if any are given."""
        settings = [
            setting if isinstance(setting, TimedPicture) else TimedPicture.of(setting)
            for setting in self.pictures
        ]
        return EngineTimes.given(settings, self.machine, self.kernel_time)

    def require_no_scene(self) -> None:
        """Refuse options of a scene, where pictures are judged without one."""
        from fotismos.comparisons.pictures import require_no_scene  # loaded late: it loads NumPy

        of_scenes = ("rounds", "at", "kernel_time")
        require_no_scene(self.options, [name for name in of_scenes if getattr(self, name)])

    def run(self, terminal: Terminal) -> int:
        """Study one scene, or pictures without one, and print the table or the record."""
        engine = self.engine
        if engine is None:
            self.refuse_reading("--picture")
        if self.scene is None and not (self.reference and engine):
            raise click.UsageError(
                "Missing argument 'SCENE': give a scene, or pictures, --reference and --picture."
            )
        if self.scene is not None and terminal.within != TOLERANCE:
            raise InputError("--within: it judges pictures without a scene. Omit it, or the scene.")
        checked_threshold(terminal.within)
        folder = terminal.output / "cost"
        if self.scene is None:
            self.require_no_scene()
            from fotismos.reports.files import results  # loaded late
            from fotismos.reports.run import cost_files, folders  # without Mitsuba

            path, _ = picture_parts(matching(self.reference)[0])
            work = partial(self._judged, terminal.within)
            with Pool(0) as pool:  # pictures run no user's code
                records = folders.results_of(pool, folder, [path.stem], work, files=[path])
        else:
            with terminal.processes() as pool:
                from fotismos.reports.files import results  # loaded late
                from fotismos.reports.run import cost_files, folders  # loaded late

                records = folders.results_of(pool, folder, [self.scene], self._measured)
        ((target, record),) = records.items()
        lines = cost_files.lines(record, terminal.within)
        terminal.show(record, lines, target / results.PAGE)
        return 0

    def study(self, case: "Case", progress: "Progress | None" = None) -> "Study[CostRecord]":
        """Study what accuracy costs on a scene."""
        from fotismos.comparisons.ladder.climb import Effort  # as late
        from fotismos.comparisons.ladder.cost import cost  # loaded late: pictures need no Mitsuba

        times = self.engine
        given = times.as_options() if times else {}
        size = self.at and "x".join(map(str, self.at))
        return cost(
            case.source,
            case.options,
            effort=Effort() if self.rounds is None else Effort(rounds=self.rounds),
            progress=progress,
            command=case.command("cost", rounds=self.rounds, at=size, **given),
            at=self.at,
            engine_times=times,
        )

    def judge(self, name: str, within: float = TOLERANCE) -> "Study[EngineCost]":
        """Judge settings without a scene."""
        from fotismos.comparisons.ladder.engine import front_of_pictures  # loaded late

        times = self.engine
        assert times is not None, "nothing else is judged without a scene"
        chosen = None if within == TOLERANCE else f"{within:g}"
        command = self.options.command("cost", "", **times.as_options(), within=chosen)
        return front_of_pictures(self.options, times, name, command)

    def _measured(self, scene: str, target: Path, progress: "Progress") -> "CostRecord":
        """Study a scene, and write its files."""
        from fotismos.comparisons.case import open_case  # loaded late, in a worker
        from fotismos.reports.run import cost_files  # as late

        study = self.study(open_case(scene, self.options), progress)
        cost_files.write(target, study, cost_files.view(study))
        return study.record

    def _judged(self, within: float, name: str, target: Path, progress: object) -> "EngineCost":
        """Judge settings, and write their files."""
        from fotismos.reports.run import cost_files  # loaded late

        study = self.judge(name, within)
        cost_files.write(target, study, cost_files.view(study, within))
        return study.record
