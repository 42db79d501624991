"""A kind of light of the kernel, declared when this is imported: before anything lists lights."""

from dataclasses import dataclass
from typing import ClassVar

from fotismos.heuristic import lights


@dataclass(frozen=True)
class TrialLight(lights.DirectionalLight):
    """Parallel light of three times its intensity."""

    plugin: ClassVar[str] = "heuristic_trial"

    def rays(self, position):
        toward, distance, colours = super().rays(position)
        return toward, distance, [3.0 * colour for colour in colours]


lights.PLUGINS[TrialLight.plugin] = TrialLight
