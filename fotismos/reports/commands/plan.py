"""``fotismos plan``: which effects a scene needs."""

from typing import Annotated

from msgspec import Meta

from fotismos.comparisons.options import option
from fotismos.reports.command import SCENES, OnScene
from fotismos.reports.jobs import Terminal


class Plan(OnScene, frozen=True):
    """List the effects that a scene needs, the rule for each, and what will be simulated.

    With --within, the exit code is 1 if no measured method passes.

    Examples
    --------
      fotismos plan cornell-box
      fotismos plan --within 5 cornell-box
    """

    argument = "SCENE"
    options_shown = (SCENES, "as_json", "verbose", "within", "timeout")

    within: Annotated[
        Annotated[float, Meta(gt=0)] | None,
        option(
            "Measure the methods of `cost`, and name the fastest that passes: at most 5 % of its"
            " pixels exceed this ΔE2000.",
            metavar="ERROR",
        ),
    ] = None

    def run(self, terminal: Terminal) -> int:
        """Print the plan, or the price and the fastest method within a tolerance."""
        with terminal.processes() as pool:
            from fotismos.reports.run import plan  # loaded late

            if self.within is None:
                return plan.show(pool, self.scene, self.options, terminal)
            return plan.show_fastest(pool, self.scene, self.options, self.within, terminal)
