"""What a picture seems to lack: the small rendering between the halves that it is nearest to."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from comparisons.comparison import Comparison, ComparisonRecord
from comparisons.departure.colour import Viewing
from comparisons.departure.metrics import LEADING
from comparisons.departure.regions import Region
from comparisons.hybrids.attribution import ErrorMeter
from comparisons.hybrids.hybrids import HybridImages, HybridScenes, Pairs, labels, subsets
from comparisons.hybrids.nearness import Effects, Nearest, Renderings, nearest
from comparisons.options import Options
from comparisons.pictures import picture_files
from comparisons.prepared import guarded
from reference.planning.effects import Effect
from reference.rendering.renderer import Progress
from reference.rendering.sums import Estimate
from reference.scene.source import Source

LARGEST = 64
"""Pixels of a small rendering's longer side, at most."""

REPLICATES, SPP = 4, 16
"""Replicates of each rendering, and samples per pixel of each replicate."""

EXACT_EFFECTS = 5
"""Effects up to which every combination is rendered. Of more, those with at most one effect, and
those without at most two."""

BETTER, LEVEL = 0.5, 1.04
"""An exposure is doubted if another leaves at most this share of the distance, and if it differs by
this factor at least."""

FINER = 4
"""Points along a side of a picture's pixel, when it is averaged down."""


@dataclass(frozen=True)
class Candidates:
    """The renderings between the halves of a scene, ``{simulated effects: (R, h, w, 3)}``.

    ``counted`` (h, w) are the pixels that see a surface; ``rows`` (h, H) and ``columns`` (w, W) the
    weights that average a picture down, as the scene's film would.
    """

    images: dict[Effects, NDArray]
    counted: NDArray[np.bool_]
    rows: NDArray
    columns: NDArray
    viewing: Viewing

    def reduced(self, image: NDArray) -> NDArray[np.float64]:
        """Return an image (H, W) or (H, W, 3) at the size of the renderings."""
        return np.einsum("yY,xX,YX...->yx...", self.rows, self.columns, image, optimize=True)

    def measured(self, pictures: Sequence[NDArray]) -> Callable[[NDArray], Nearest | None]:
        """Return a function of a mask (H, W): the rendering that pictures are nearest to there.

        It returns None if no small pixel sees the mask. The pictures are repeats; with fewer than
        :data:`REPLICATES`, their noise is unknown, and stays.
        """
        small = np.stack([self.reduced(picture) for picture in pictures])
        mean = small.mean(axis=0)
        groups = [mean] * REPLICATES
        if len(small) >= REPLICATES:
            groups = [small[place::REPLICATES].mean(axis=0) for place in range(REPLICATES)]
        none = np.zeros_like(mean)
        reference = Estimate(mean, none, none, REPLICATES)
        meter = ErrorMeter(reference, self.counted, self.viewing, groups=np.stack(groups))
        errors = {effects: meter.without_noise(image) for effects, image in self.images.items()}

        def within(mask: NDArray) -> Nearest | None:
            weights = self.reduced(mask.astype(float))[self.counted]
            if not weights.sum() > 0:
                return None
            share = weights / weights.sum()
            return nearest({effects: each @ share for effects, each in errors.items()})

        return within

    def exposure(self, picture: NDArray) -> str:
        """Return in words by which factor a picture would be much nearer; empty if by none."""
        small = self.reduced(picture)[self.counted]
        plain, (nearer, factor) = np.inf, (np.inf, 1.0)
        for images in self.images.values():
            image = images.mean(axis=0)[self.counted]
            distance = LEADING.against(image, ..., self.viewing)
            best = _factor(small, image)
            plain = min(plain, LEADING.mean(distance(small)))
            nearer, factor = min((nearer, factor), (LEADING.mean(distance(best * small)), best))
        if nearer > BETTER * plain or 1 / LEVEL < factor < LEVEL:
            return ""
        return (
            f"Times {factor:.3g}, the picture would be {nearer:.2g} away from a rendering of this"
            f" scene, and is {plain:.2g} away as it is: another exposure? It looks like a missing"
            " effect."
        )


def candidates(
    source: Source, options: Options, shape: tuple[int, ...], progress: Progress | None = None
) -> Candidates:
    """Render the combinations of effects for pictures of a shape (H, W, ...)."""
    height, width = shape[:2]
    size = small_size(width, height)
    small = options.changed(image=(), transfer=None, resolution=size, spp=None, noise=None)
    ready = guarded(source, small.changed(allow_empty=False))
    pairs = Pairs(source, small, ready)
    scenes = HybridScenes(pairs.plain(), ready.plan, ready.scene)
    hybrids = HybridImages(pairs, scenes, REPLICATES, SPP, options.seed)
    sets = combinations(hybrids.effects)
    progress = progress or (lambda *_: None)
    progress("renderings between the halves", 0, 1)
    hybrids.render(key for each in sets for key in hybrids.needed(each))
    progress("renderings between the halves", 1, 1)
    scene: Any = ready.scene
    rfilter = scene.sensors()[0].film().rfilter()
    return Candidates(
        images={labels(hybrids.effects, each): hybrids.simulating(each).images for each in sets},
        counted=ready.counted,
        rows=filter_weights(height, size[1], rfilter),
        columns=filter_weights(width, size[0], rfilter),
        viewing=options.viewing,
    )


def with_nearest(
    comparison: Comparison, source: Source, options: Options, progress: Progress | None = None
) -> ComparisonRecord:
    """Return the record of a picture's comparison, with the rendering that it is nearest to.

    The picture as a whole, and each region, shape and material name theirs.
    """
    record, images = comparison.record, comparison.images
    between = candidates(source, options, images.counted.shape, progress)
    of = between.measured(picture_files.read_all(options))
    doubt = between.exposure(images.heuristic)
    odd = (doubt,) if doubt else ()

    def each_of(shares: Sequence[Any], places: NDArray) -> tuple[Any, ...]:
        masks = (places == row for row in range(len(shares)))
        return tuple(structs.replace(s, nearest=of(m)) for s, m in zip(shares, masks, strict=True))

    _, height, width, _ = between.images[()].shape
    assert record.picture, "the comparison is of a picture"
    count, spp = len(between.images), REPLICATES * SPP
    return structs.replace(
        record,
        picture=structs.replace(
            record.picture,
            odd=(*record.picture.odd, *odd),
            nearest=of(images.counted),
            renderings=Renderings(count=count, resolution=(width, height), spp=spp),
        ),
        warnings=(*odd, *record.warnings),
        regions=tuple(
            structs.replace(region, nearest=of(_inside(region, images.counted)))
            for region in record.regions
        ),
        objects=each_of(record.objects, images.objects),
        materials=each_of(record.materials, images.materials),
    )


def combinations(effects: Sequence[Effect]) -> list[frozenset[Effect]]:
    """Return the sets of effects that are rendered, the reference among them."""
    count = len(effects)
    return [
        each
        for each in subsets(effects)
        if count <= EXACT_EFFECTS or len(each) <= 1 or len(each) >= count - 2
    ]


def small_size(width: int, height: int) -> tuple[int, int]:
    """Return the size of the renderings: the largest of those that keep the proportions best."""
    longer, shorter = max(width, height), min(width, height)
    if longer <= LARGEST:
        return width, height
    exact = {side: side * shorter / longer for side in range(LARGEST, LARGEST // 2, -1)}
    long = min(exact, key=lambda side: abs(max(1, round(exact[side])) - exact[side]))
    short = max(1, round(exact[long]))
    return (long, short) if width >= height else (short, long)


def _factor(image: NDArray, rendering: NDArray) -> float:
    """Return the factor between two images (N, 3): a median, which lamps do not move."""
    shown, other = (each @ (0.2126, 0.7152, 0.0722) for each in (image, rendering))
    bright = np.minimum(shown / max(shown.mean(), 1e-9), other / max(other.mean(), 1e-9)) > 1e-3
    return float(np.median(other[bright] / shown[bright])) if bright.any() else 1.0


def filter_weights(large: int, small: int, rfilter: mi.ReconstructionFilter) -> NDArray[np.float64]:
    """Return the weights (small, large) of a film's filter on larger pixels of the same image."""
    if large == small:
        return np.eye(small)
    places = (np.arange(FINER * large) + 0.5) * (small / (FINER * large))
    offsets = places - (np.arange(small) + 0.5)[:, None]
    values = np.array(rfilter.eval(mi.Float(offsets.ravel()))).reshape(small, large, FINER)
    weights = values.sum(axis=2, dtype=float)
    return weights / weights.sum(axis=1, keepdims=True)


def _inside(region: Region, counted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    mask = np.zeros_like(counted)
    box = np.s_[region.y : region.y + region.height, region.x : region.x + region.width]
    mask[box] = counted[box]
    return mask
