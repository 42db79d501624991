"""The price of a scene: what it takes to look right, in effects, samples and time.

A comparison has one (:mod:`fotismos.comparisons.price`), and pages, tables and charts read it.
"""

from fotismos.reference.records import Amount, Interval, Positive, Record, Size

FEWEST_SPP = 4
MOST_SPP = 65536
"""Samples per pixel: the fewest that smooth edges, and the most that a price names."""


class SamplesThatPass(Record):
    """The fewest samples per pixel with which the physical half passes at a threshold.

    They are powers of 4, from :data:`FEWEST_SPP` to :data:`MOST_SPP`; null means more.

    Attributes
    ----------
    low, high
        With fewer it fails for sure, and with ``high`` it passes for sure.
    """

    threshold: Positive
    value: Size | None
    low: Size | None
    high: Size | None


class EffectsThatPass(Record):
    """The fewest effects that must be simulated to pass surely at a threshold.

    Attributes
    ----------
    visible
        The share of pixels that still differ visibly, with its interval.
    """

    threshold: Positive
    effects: tuple[str, ...]
    visible: Interval


class Saving(Record):
    """What a plan saves over everything simulated: factors, above 1 where it does.

    Attributes
    ----------
    time
        Of a sample.
    noise
        Of the standard deviation of a sample; null if the plan has no noise.
    """

    time: Positive
    noise: Positive | None


class Price(Record):
    """What it takes to look right.

    Attributes
    ----------
    ratio
        Time per sample of the physical half over the textbook's; null if it is not known.
    reason
        Why there is no ratio; empty if there is one.
    heuristic_s, reference_s
        Seconds per sample and pixel; null of pictures.
    everything_s
        That of the physical half with everything simulated; null if its plan leaves out nothing.
    pixels
        Of the scene's picture.
    samples
        For each threshold; empty if they were not asked for.
    needed
        For each threshold; null without causes.
    left_out
        What the plan proved to change nothing, as nouns.
    saved
        What leaving it out saves; null if nothing was left out.
    """

    ratio: Interval | None
    reason: str
    heuristic_s: Amount | None
    reference_s: Amount | None
    everything_s: Amount | None = None
    pixels: Size
    samples: tuple[SamplesThatPass, ...] = ()
    needed: tuple[EffectsThatPass, ...] | None = None
    left_out: tuple[str, ...] = ()
    saved: Saving | None = None

    def samples_at(self, threshold: float) -> SamplesThatPass | None:
        """Return the samples that pass at a threshold, if they are known."""
        return next((found for found in self.samples if found.threshold == threshold), None)

    def needed_at(self, threshold: float) -> EffectsThatPass | None:
        """Return the effects that pass at a threshold, if they are known."""
        return next((found for found in self.needed or () if found.threshold == threshold), None)

    def seconds(self, spp: int) -> float | None:
        """Return the time of a physical picture with some samples per pixel, if it is known."""
        return None if self.reference_s is None else self.reference_s * self.pixels * spp

    def times(self, spp: int) -> float | None:
        """Return this time over that of the textbook picture with :data:`FEWEST_SPP` samples."""
        return None if self.ratio is None else self.ratio.value * spp / FEWEST_SPP
