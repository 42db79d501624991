"""A tree over the bounding boxes of shapes, to find those that a surface may see in a region.

A binary tree is kept as one set of arrays per level. Shapes are sorted along a curve through
positions and facing directions (Morton's order), and each node of a level holds two neighbours of
the level below: their common box, and bounds of the half spaces that they look into. If a node
fails a bound, so does every shape in it, even with rounding: products and sums of rounded numbers
keep their order.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from reference.planning.forms import ROUNDING
from reference.planning.shapes import ShapeFacts

BITS = 8
"""Bits of each of the six coordinates that sort shapes."""

LARGEST_STEP = 2**22
"""Pairs of a query and a shape per step, at most; it bounds memory."""

FIRST_STEP = 16
"""Queries of the first step: it settles most scenes."""


@dataclass(frozen=True)
class Level:
    """Nodes of one level, or the shapes themselves; every array has one row per node.

    Attributes
    ----------
    low, high
        Box, (N, 3).
    margin
        How far in front of a plane a box must reach to count, (N,): the least of the shapes within.
    least, most
        Bounds of the directions of the half spaces that the shapes look into, (N, 3); for a shape
        both are its own direction.
    offset
        The least offset of these half spaces, (N,); -inf if a shape may receive light from
        anywhere.
    """

    low: np.ndarray
    high: np.ndarray
    margin: np.ndarray
    least: np.ndarray
    most: np.ndarray
    offset: np.ndarray

    @classmethod
    def of(cls, shapes: Sequence[ShapeFacts]) -> "Level":
        """Return the level of the shapes themselves."""
        count = len(shapes)
        low, high = (
            np.array([getattr(shape, end) for shape in shapes], float).reshape(count, 3)
            for end in ("low", "high")
        )
        direction, offset = np.zeros((count, 3)), np.full(count, -np.inf)
        for number, shape in enumerate(shapes):
            if shape.facing is not None:
                direction[number], offset[number] = shape.facing
        margin = ROUNDING * np.maximum((high - low).max(axis=1, initial=0), 1e-30)
        return cls(low, high, margin, direction, direction, offset)

    def take(self, rows: np.ndarray) -> "Level":
        """Return some of the nodes."""
        return Level(**{name: values[rows] for name, values in vars(self).items()})

    def paired(self) -> "Level":
        """Return the level above, in which each node holds two neighbours, the last perhaps one."""
        starts = np.arange(0, len(self.low), 2)
        smallest, largest = np.minimum.reduceat, np.maximum.reduceat
        return Level(
            low=smallest(self.low, starts),
            high=largest(self.high, starts),
            margin=smallest(self.margin, starts),
            least=smallest(self.least, starts),
            most=largest(self.most, starts),
            offset=smallest(self.offset, starts),
        )


@dataclass(frozen=True)
class Queries:
    """Queries for what surfaces may see in boxes: one row per query, by priority.

    Attributes
    ----------
    receiver
        (Q,): the shape that looks.
    low, high
        (Q, 3): the box that an answer must touch.
    other
        (Q,): one more shape that is not an answer, -1 for none. The receiver never is.
    """

    receiver: np.ndarray
    low: np.ndarray
    high: np.ndarray
    other: np.ndarray

    @classmethod
    def everywhere(cls, receiver: np.ndarray) -> "Queries":
        """Return queries for everything in front of some shapes, at any distance."""
        end = np.full((len(receiver), 3), np.inf)
        return cls(receiver, -end, end, np.full(len(receiver), -1))

    def steps(self, shapes: int) -> Iterator["Queries"]:
        """Yield the queries in parts of growing size."""
        begin, size, most = 0, FIRST_STEP, max(LARGEST_STEP // max(shapes, 1), 1)
        while begin < len(self.receiver):
            part = slice(begin, begin + min(size, most))
            yield Queries(**{name: values[part] for name, values in vars(self).items()})
            begin, size = part.stop, 2 * size


@dataclass(frozen=True)
class ShapeTree:
    """The shapes of a scene, in a tree.

    Attributes
    ----------
    shapes
        The level of the shapes, in the scene's order.
    order
        The shapes' numbers along the curve.
    """

    shapes: Level
    order: np.ndarray

    @classmethod
    def of(cls, shapes: Sequence[ShapeFacts]) -> "ShapeTree":
        """Return the tree of some shapes, which their positions identify from then on."""
        level = Level.of(shapes)
        return cls(level, _sorted(level, np.arange(len(shapes))))

    def holding(self, shapes: np.ndarray) -> "ShapeTree":
        """Return the tree that finds only some of the shapes, given their numbers."""
        return ShapeTree(self.shapes, _sorted(self.shapes, shapes))

    @property
    def largest_coordinate(self) -> float:
        """The largest distance from the origin along an axis."""
        ends = self.shapes.take(self.order)
        return float(max(np.abs(end).max(initial=0) for end in (ends.low, ends.high)))

    @cached_property
    def levels(self) -> tuple[Level, ...]:
        """Levels from the root, which holds all, to the shapes along the curve."""
        levels = [self.shapes.take(self.order)]
        while len(levels[0].low) > 1:
            levels.insert(0, levels[0].paired())
        return tuple(levels)

    def first(self, queries: Queries, mutual: bool = False) -> tuple[int, int] | None:
        """Return the first query that has an answer, and the first shape that is one.

        An answer touches the query's box and lies in front of the receiver's only reflecting side.

        Parameters
        ----------
        queries
            The queries.
        mutual
            Whether the receiver must also lie in front of the answer's only reflecting side.
        """
        begin = 0
        for part in queries.steps(len(self.order)):
            query, shape = self._answers(part, mutual)
            if len(query):
                found = int(query.min())
                return begin + found, int(shape[query == found].min())
            begin += len(part.receiver)
        return None

    def answered(self, queries: Queries) -> np.ndarray:
        """Return which queries have an answer, (Q,)."""
        found = [np.zeros(0, bool)]
        for part in queries.steps(len(self.order)):
            has_answer = np.zeros(len(part.receiver), bool)
            has_answer[self._answers(part, False)[0]] = True
            found.append(has_answer)
        return np.concatenate(found)

    def _answers(self, queries: Queries, mutual: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return all pairs of a query, counted within these, and a shape that answers it."""
        query = np.arange(len(queries.receiver)) if len(self.order) else np.arange(0)
        node = np.zeros(len(query), int)
        for level, below in zip(self.levels, (*self.levels[1:], None), strict=True):
            kept = self._may_hold(level, node, queries, query, mutual)
            query, node = query[kept], node[kept]
            if below is not None:
                query, node = np.repeat(query, 2), np.repeat(2 * node, 2)
                node[1::2] += 1
                inside = node < len(below.low)
                query, node = query[inside], node[inside]
        shape = self.order[node]
        kept = (shape != queries.receiver[query]) & (shape != queries.other[query])
        return query[kept], shape[kept]

    def _may_hold(
        self, level: Level, node: np.ndarray, queries: Queries, query: np.ndarray, mutual: bool
    ) -> np.ndarray:
        """Return whether nodes may hold an answer; for shapes, whether they are one."""
        receiver = queries.receiver[query]
        own = self.shapes.take(receiver)
        there = level.take(node)
        holds = np.all(queries.low[query] <= there.high, axis=1)
        holds &= np.all(there.low <= queries.high[query], axis=1)
        holds &= _reach(there.low, there.high, own.least, own.most) - own.offset > there.margin
        if mutual:
            far = _reach(own.low, own.high, there.least, there.most)
            holds &= far - there.offset > own.margin
        return holds


def _reach(low: np.ndarray, high: np.ndarray, least: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Return how far boxes reach along directions, (N,): the most that their bounds allow."""
    with np.errstate(invalid="ignore"):  # the empty box of a mesh without faces
        ends = [np.maximum(low * towards, high * towards) for towards in (least, most)]
        return np.maximum(*ends).sum(axis=1)


def _sorted(level: Level, numbers: np.ndarray) -> np.ndarray:
    """Return numbers of shapes along Morton's curve, without meshes that have no faces."""
    has_faces = np.all(level.low <= level.high, axis=1)
    numbers = numbers[has_faces[numbers]]
    if not len(numbers):
        return numbers
    some = level.take(numbers)
    place = np.hstack([(some.low + some.high) / 2, some.least])
    extent = np.repeat(np.ptp(place, axis=0).reshape(2, 3).max(axis=1), 3)
    cell = (place - place.min(axis=0)) / np.maximum(extent, 1e-300) * (2**BITS - 1)
    cell, key = cell.astype(np.uint64), np.zeros(len(place), np.uint64)
    for bit in reversed(range(BITS)):
        for axis in range(6):
            key = (key << np.uint64(1)) | ((cell[:, axis] >> np.uint64(bit)) & np.uint64(1))
    return numbers[np.argsort(key, kind="stable")]
