"""The sampler plugin ``rotated_multijitter``: stratified, with the right mean at any depth.

A pixel's n samples are stratified in every dimension: sample i falls into stratum π(i), with one
permutation π per dimension. An estimate is unbiased if each single sample is uniform in all
dimensions together. So π(i) must be uniform, and independent from one dimension to the next.
Mitsuba's ``multijitter`` hashes π with too few outcomes if n is small. Its dimensions then depend
on each other, and a product of many, such as a long path, is biased: by −2.2 % inside a sphere of
albedo 0.9 with 16 samples per pixel. Here a random number rotates the strata ::

    π(i) = (p(i) + r) mod n,    r uniform in 0 … n − 1, by pixel, dimension and seed

which is uniform and independent for any permutation p. Pairs of dimensions are stratified in each
axis and in cells, like correlated multi-jittered samples; the place within a cell is rotated in the
same way. Any ``sample_count`` will do; best are two nearly equal factors.

Sources: A. Kensler, *Correlated multi-jittered sampling*, 2013, for p and the cells; R. Cranley and
T. N. L. Patterson, *Randomization of number theoretic methods for multiple integration*, 1976, for
the rotation.
"""

from functools import cache
from math import isqrt
from typing import Any

import drjit as dr
import mitsuba as mi

from fotismos.heuristic.convention import Array, Mask
from fotismos.reference.rendering.integrators import SAMPLER
from fotismos.reference.scene.graph import Graph, properties

_ALONG = 0x68BC21EB
_ACROSS = 0x02E5BE93
"""Odd numbers that distinguish the permutations of one dimension."""


def register() -> None:
    """Register the plugin with Mitsuba for the current variant. Calling it again does nothing."""
    _define(mi.variant())


def with_sampler(graph: Graph, plugin: str) -> Graph:
    """Return a copy of a graph whose sensors have a sampler of the given kind."""
    register()
    copy = graph.copy()
    for sensor in copy.nodes(mi.ObjectType.Sensor):
        for key, _ in copy.children(sensor, mi.ObjectType.Sampler):
            copy.detach(sensor, key)
        copy.attach(sensor, "sampler", copy.add(mi.ObjectType.Sampler, properties(plugin)))
    return copy


def cells(count: int) -> tuple[int, int]:
    """Return the two factors of a number of samples nearest to its root, the smaller first."""
    small = next(factor for factor in range(isqrt(count), 0, -1) if count % factor == 0)
    return small, count // small


@cache
def _define(_variant: str) -> None:
    class RotatedMultijitter(mi.Sampler):
        """See the module's docstring."""

        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.forget()

        def forget(self) -> None:
            # Nothing is computed: Mitsuba may make a scene's plugins in several threads.
            self.dimension: Any = None
            self.index: Any = None
            self.pixel: Any = None
            self.jitter: Any = None

        def seed(self, seed: Any, wavefront_size: int = 0xFFFFFFFF) -> None:
            super().seed(seed, wavefront_size)
            index = dr.arange(mi.UInt32, self.wavefront_size())
            # The samples of a pixel follow each other in the wavefront.
            pixel = index // self.sample_count()
            self.index = index - pixel * self.sample_count()
            self.pixel, _ = mi.sample_tea_32(mi.UInt32(seed), pixel)
            # One stream per sample: the pairs of numbers differ wherever seed or place do.
            state, stream = mi.sample_tea_32(mi.UInt32(seed), index)
            self.jitter = mi.PCG32(len(index), mi.UInt64(state), mi.UInt64(stream))
            self.dimension = dr.opaque(mi.UInt32, 0)

        def next_1d(self, active: Any = True) -> Any:
            count = self.sample_count()
            stratum, _, _ = self._stratum(active)
            return _under_one((mi.Float(stratum) + self._within()) * (1 / count))

        def next_2d(self, active: Any = True) -> Any:
            columns, rows = cells(self.sample_count())
            stratum, permutation, turn = self._stratum(active)
            # Each sample has a cell; its column is split by rows, and its row by columns.
            row = stratum // columns
            column = stratum - row * columns
            along = turned(row, rows, permutation * _ALONG, turn * _ALONG, active)
            across = turned(column, columns, permutation * _ACROSS, turn * _ACROSS, active)
            x = mi.Float(column) + (mi.Float(along) + self._within()) * (1 / rows)
            y = mi.Float(row) + (mi.Float(across) + self._within()) * (1 / columns)
            return mi.Point2f(_under_one(x * (1 / columns)), _under_one(y * (1 / rows)))

        def _stratum(self, active: Any) -> Any:
            permutation, turn = mi.sample_tea_32(self.pixel, self.dimension)
            self.dimension += 1
            stratum = turned(self.index, self.sample_count(), permutation, turn, active)
            return stratum, permutation, turn

        def _within(self) -> Any:
            return mi.Float(self.jitter.next_float32())

        def clone(self) -> Any:
            copy = self.fork()
            if self.dimension is not None:
                copy.dimension, copy.index = mi.UInt32(self.dimension), mi.UInt32(self.index)
                copy.pixel, copy.jitter = mi.UInt32(self.pixel), mi.PCG32(self.jitter)
            return copy

        def fork(self) -> Any:
            props = mi.Properties()
            props["sample_count"] = self.sample_count()
            return RotatedMultijitter(props)

        def schedule_state(self) -> None:
            super().schedule_state()
            dr.schedule(self.dimension, self.index, self.pixel, self.jitter)

        def to_string(self) -> str:
            return f"RotatedMultijitter[sample_count={self.sample_count()}]"

    mi.register_sampler(SAMPLER, RotatedMultijitter)


def _under_one(number: Any) -> Any:
    """Keep a number below 1, which it could reach by rounding."""
    return dr.minimum(number, dr.one_minus_epsilon(mi.Float))


def turned(index: Array, count: int, permutation: Array, turn: Array, active: Mask) -> Array:
    """Return ``(p(index) + r) mod count`` for a hash of p, and one of r: integers below count."""
    if count == 1:
        return mi.UInt32(0)
    # The high word of the product is uniform in 0 … count - 1, without a division.
    cell = mi.permute_kensler(index, count, permutation, active) + dr.mul_hi(turn, count)
    # Both terms are below count, so subtracting it once is enough.
    return dr.select(cell >= count, cell - count, cell)
