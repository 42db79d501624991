"""Names the effect that carries most of each region, shape and material of a comparison."""

from functools import partial

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from comparisons.comparison import ComparisonRecord
from comparisons.departure.objects import means
from comparisons.effects.dominance import in_region, in_words
from comparisons.record import Comparison


def named(comparison: Comparison, effects: dict[str, NDArray]) -> ComparisonRecord:
    """Return a comparison's record in which regions, shapes and materials name their effect.

    ``effects`` are ``{name: (h, w)}``, the ΔE2000 that each removes; the maps may be smaller.
    """
    record, images = comparison.record, comparison.images
    regions = tuple(
        structs.replace(region, effect=in_region(region, record.resolution, effects))
        for region in record.regions
    )
    carried = partial(_carried, effects=effects)
    return structs.replace(
        record,
        regions=regions,
        objects=carried(record.objects, images.objects),
        materials=carried(record.materials, images.materials),
    )


def _carried(carriers, places, effects):
    """Name the effects of carriers, by the maps' cell in which each of their pixels lies."""
    seen = places >= 0
    found = {
        name: means(_enlarged(values, places.shape)[seen], places[seen], len(carriers))
        for name, values in effects.items()
    }
    return tuple(
        structs.replace(carrier, effect=in_words({name: each[row] for name, each in found.items()}))
        for row, carrier in enumerate(carriers)
    )


def _enlarged(values, shape):
    rows, columns = (
        np.arange(large) * small // large for large, small in zip(shape, values.shape, strict=True)
    )
    return values[np.ix_(rows, columns)]
