"""``fotismos fit``: the best heuristic parameters, and the error that remains."""

from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from fotismos.comparisons.names import with_files
from fotismos.comparisons.options import option
from fotismos.reports.command import PICTURES, SCENES, OnScene
from fotismos.reports.jobs import Terminal

if TYPE_CHECKING:
    from fotismos.comparisons.case import Scene
    from fotismos.comparisons.fit.fit import Fit as Fitted
    from fotismos.comparisons.records.fit import FitRecord
    from fotismos.reference.rendering.passes import Progress


class Fit(OnScene, frozen=True):
    """Find the textbook parameters nearest to the physical picture, and the error that is left.

    The part of the error that the best parameters remove is the parameter error. The rest is the
    model error, which no parameters remove. Writes a page (physical, before, after, and the errors)
    and fit.json to OUTPUT/fit/SCENE. By default it renders 96x96 pixels with 64 samples each. With
    pictures of another renderer as the reference, it has their size.

    Examples
    --------
      fotismos fit fig-8-9
      fotismos fit my_scene.xml --loss linear --form phong
      fotismos fit my_scene.xml --reference 'theirs_*.exr'
    """

    argument = "SCENE..."
    below = "fit/SCENE"
    options_shown = (
        "loss", "form", SCENES, PICTURES, "output", "as_json", "quiet", "verbose", "timeout",
    )  # fmt: skip
    own_defaults: ClassVar[dict[str, str]] = {"resolution": "96x96", "spp": "64"}

    loss: Annotated[
        Literal["perceptual", "linear"],
        option(
            "Loss to minimise: the mean colour difference in CAM16-UCS, or the mean square of the"
            " error in linear RGB.",
            metavar="[perceptual|linear]",
        ),
    ] = "perceptual"
    form: Annotated[
        Literal["phong", "blinn", "all"],
        option("Form of the lobe, with and without normalisation.", metavar="[phong|blinn|all]"),
    ] = "all"

    def run(self, terminal: Terminal) -> int:
        """Fit each scene, and print the tables or the records."""
        if not self.reference:
            self.refuse_reading("--reference")
        with terminal.processes() as pool:
            from fotismos.reports.files import results  # loaded late
            from fotismos.reports.run import fit_files, folders  # loaded late

            folder = terminal.output / "fit"
            records = folders.results_of(pool, folder, terminal.scenes, self._fitted)
        lines = chain.from_iterable(map(fit_files.lines, records.values()))
        first, *others = records
        terminal.show([*records.values()], lines, folder if others else first / results.PAGE)
        return 0

    def fit(self, scene: "Scene", progress: "Progress | None" = None) -> "Fitted":
        """Fit the heuristic to a scene."""
        from fotismos.comparisons.case import open_case  # loaded late: help needs no Mitsuba
        from fotismos.comparisons.fit.fit import fit  # as late
        from fotismos.heuristic.materials import FORMS  # as late

        case = open_case(scene, with_files(self.options), self.name)
        command = case.command("fit", loss=self.loss, form=self.form)
        forms = FORMS if self.form == "all" else (self.form,)
        return fit(case.source, case.options, self.loss, forms, progress, command)

    def _fitted(self, scene: str, target: Path, progress: "Progress") -> "FitRecord":
        """Fit the heuristic to a scene, and write the fit's files."""
        from fotismos.reports.run import fit_files  # loaded late, in a worker

        result = self.fit(scene, progress)
        fit_files.write(target, result)
        return result.record
