"""``fotismos fit``: the best heuristic parameters, and the error that remains."""

import json
from typing import Annotated, ClassVar, Literal

import click

from fotismos.comparisons.names import with_files
from fotismos.comparisons.options import option
from fotismos.reference.records import plain
from fotismos.reports.command import PICTURES, SCENES, OnScene
from fotismos.reports.files.results import PAGE
from fotismos.reports.jobs import Terminal
from fotismos.reports.terminal.words import tell, tell_where


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
            from fotismos.reports.run import fit_files, folders  # loaded late

            records = folders.results_of(
                pool,
                terminal.output / "fit",
                scenes=terminal.scenes,
                work=fit_files.fitted,
                arguments=(with_files(self.options), self.loss, self.form),
            )
        if terminal.as_json:
            click.echo(json.dumps(plain([*records.values()]), indent=2, ensure_ascii=False))
            return 0
        for record in records.values():
            tell(fit_files.lines(record))
        folder, *others = records
        tell_where(folder.parent if others else folder / PAGE)
        return 0
