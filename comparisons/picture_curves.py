"""Finds the tone map by which a picture shows the light of its reference."""

from dataclasses import dataclass

import numpy as np

from fotismos.comparisons.departure.colour import to_srgb
from fotismos.comparisons.departure.mapped_sums import Light
from fotismos.comparisons.departure.minimum import minimum
from fotismos.comparisons.departure.tone_maps import TONE_MAPS, ToneMap

CURVES: dict[str | None, ToneMap] = {None: lambda light: np.clip(light, 0, 1)}
CURVES.update(TONE_MAPS.items())
"""The curves that a picture may show light by; without a name, linearly, up to display white."""

STOPS = np.arange(-8.0, 9.0)
"""Exposures, in stops, from which the search for a picture's own begins."""

CURVE_PIXELS = 4096
"""Pixels at which curves are tried, at most."""

LEAST_CURVE = 1 / 255
BETTER_CURVE = 0.3
"""Mean difference of sRGB-encoded values from which another curve is looked for, and the largest
share of it that a credible one leaves: curves resemble each other, and some wrong shading."""


@dataclass(frozen=True)
class FittedCurve:
    """A curve at the exposure at which it shows light most like a picture.

    ``distance`` is the mean difference of sRGB-encoded values that is left and is not noise, if the
    picture has as much as the reference.
    """

    name: str | None
    exposure: float
    distance: float


@dataclass(frozen=True)
class Curves:
    """Pixels of a picture and of the light of the reference, to fit curves to; all (N, 3)."""

    picture: np.ndarray
    light: np.ndarray
    standard_error: np.ndarray

    @classmethod
    def of(cls, picture: np.ndarray, light: Light, counted: np.ndarray) -> "Curves":
        """Draw counted pixels of images (H, W, 3), always the same."""
        places = np.flatnonzero(counted)
        some = np.random.default_rng(0).permutation(places)[:CURVE_PIXELS]
        images = (picture, light.mean, light.standard_error)
        drawn = [image.reshape(-1, 3)[some].astype(float) for image in images]
        return cls(picture=drawn[0], light=drawn[1], standard_error=drawn[2])

    def fit(self, name: str | None) -> FittedCurve:
        """Return a curve at its best exposure."""
        encoded = to_srgb(self.picture)

        def shown(stops: float, light: np.ndarray) -> np.ndarray:
            return to_srgb(CURVES[name](2.0**stops * light))

        def distance(stops: float) -> float:
            return float(np.abs(encoded - shown(stops, self.light)).mean())

        start = min(STOPS, key=distance)
        stops, left = minimum(distance, start - 1, start + 1)
        # Two images whose noise is normal and alike are 2 / √π of their standard error apart.
        above = shown(stops, self.light + self.standard_error)
        below = shown(stops, self.light - self.standard_error)
        noise = np.abs(above - below).mean() / np.sqrt(np.pi)
        return FittedCurve(
            name=name,
            exposure=float(2.0**stops),
            distance=float(np.sqrt(max(left**2 - noise**2, 0.0))),
        )

    def shown(self, curve: FittedCurve) -> np.ndarray:
        """Return the light as a curve shows it, (N, 3)."""
        return CURVES[curve.name](curve.exposure * self.light)

    def other(self, given: FittedCurve) -> FittedCurve | None:
        """Return the curve that leaves the least of the difference; None if none leaves far less.

        ``given`` is the curve under which picture and reference are compared.
        """
        if given.distance < LEAST_CURVE:
            return None
        others = [self.fit(name) for name in CURVES if name != given.name]
        best = min(others, key=lambda curve: curve.distance)
        return best if best.distance <= BETTER_CURVE * given.distance else None
