"""What can be chosen about a comparison."""

from dataclasses import dataclass

from comparisons.departure.spaces import DEFAULT_VIEWING, Viewing
from heuristic import heuristics
from heuristic.errors import InputError
from heuristic.interpolation import Interpolation
from reference.pairing.factors import Convention
from reference.pairing.halves import Pair, pair
from reference.scene.source import Source


@dataclass(frozen=True)
class Options:
    """What can be chosen about a comparison.

    Parameters
    ----------
    seed
        Of the run; each pass hashes its own from it (`pass_seed`).
    spp
        Samples a pixel in all, in place of the plan's. They are split into the plan's number of
        passes, or fewer where that leaves less than 4 a pass, at least 2. With ``noise``, the
        most that are taken.
    noise
        Go on until the 95th percentile of the noise in ΔE2000 is no more than this
        (:mod:`comparisons.render`).
    resolution
        ``(width, height)`` in place of the film's own.
    convention
        How roughplastic and phong are paired.
    heuristic
        Name of the declaration that shades the heuristic half (:mod:`heuristic.heuristics`).
    interpolation, tessellation
        How the heuristic half shades its surfaces, and how fine the meshes for it are.
    viewing
        How linear values are looked at.
    heuristic_variant
        Variant of the heuristic half where it is not the current one, as for RGB shading against a
        spectral reference.
    everything
        Switch off all pruning, in the kernel and in the reference.
    sensor
        Number of the sensor, of several, from 0.
    allow_empty
        Take a picture in which no pixel sees a surface, which is refused otherwise.

    Raises
    ------
    InputError
        For fewer than 2 samples, a noise target that is not positive, a negative seed, a
        resolution below 1, or a heuristic that is not declared.
    """

    seed: int = 0
    spp: int | None = None
    noise: float | None = None
    resolution: tuple[int, int] | None = None
    convention: Convention = Convention.MATCHED
    heuristic: str = heuristics.PHONG.name
    interpolation: Interpolation = Interpolation.PHONG
    tessellation: int | None = None
    viewing: Viewing = DEFAULT_VIEWING
    heuristic_variant: str | None = None
    everything: bool = False
    sensor: int = 0
    allow_empty: bool = False

    def __post_init__(self):
        heuristics.named(self.heuristic)
        if self.spp is not None and self.spp < 2:
            raise InputError(
                f"spp = {self.spp} is not allowed: the noise needs at least 2 samples."
            )
        if self.noise is not None and not self.noise > 0:
            raise InputError(
                f"noise = {self.noise} is not allowed: give a ΔE2000 above 0, such as 0.5."
            )
        if self.seed < 0:
            raise InputError(f"seed = {self.seed} is not allowed: give 0 or more.")
        if self.resolution is not None and min(self.resolution) < 1:
            width, height = self.resolution
            raise InputError(
                f"resolution {width}x{height} is not allowed: width and height are at least 1."
            )

    def pair(self, source: Source) -> Pair:
        """Derive both halves of a scene, for the current variant (:func:`reference.pair`)."""
        return pair(
            source,
            self.convention,
            self.resolution,
            self.interpolation,
            self.tessellation,
            prune=not self.everything,
            sensor=self.sensor,
            heuristic=self.heuristic,
        )
