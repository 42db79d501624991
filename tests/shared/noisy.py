"""Noise that is hard to judge: synthetic passes of known truth, and scenes of skewed noise.

A rendered pool holds many independent passes of one scene; runs are disjoint groups of them, and
the truth is the mean of all others. A test image that is the truth differs nowhere: whatever is
marked then is marked wrongly.
"""

from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from fotismos.comparisons.departure import marks
from fotismos.comparisons.departure.metrics import LEADING, leading_distance
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.records.departure import DEFAULT_VIEWING
from fotismos.reference.rendering.gbuffer import gbuffer
from fotismos.reference.rendering.passes import pass_seed
from fotismos.reference.rendering.sums import Accumulator, DifferenceSums
from fotismos.reference.scene.source import Source
from tests.shared.parts import camera, look_at, moved, rgb_of

SIZE = 40


def estimate(differences, counted=None):
    """Return the estimate of passes (n, H, W, 3) of a difference."""
    counted = np.ones(differences.shape[1:3], bool) if counted is None else counted
    sums = DifferenceSums(counted)
    for one in differences:
        sums.add(mi.TensorXd(np.ascontiguousarray(one, np.float64)))
    return sums.estimate()


def whole(renderer, count=8, seed=40):
    """Return the estimate of passes of a renderer."""
    total = Accumulator()
    for number in range(count):
        total.add(renderer.render(seed + number))
    return total.estimate()


def require_equal(one, other, what=None):
    """Require that two estimates of eight passes are of one image.

    Pixels may be seven standard errors apart, but for a few at edges, where the pixel filter
    spreads samples; means of images four.
    """
    noise = np.hypot(one.standard_error, other.standard_error)
    difference = one.mean - other.mean
    assert (np.abs(difference) > 7 * noise + 1e-5).mean() < 5e-3, what
    assert abs(difference.mean()) < 4 * np.sqrt(np.mean(noise**2) / noise.size) + 1e-6, what


def found(differences, test, counted=None, **options):
    """Return the marks of a test image, from passes of its difference from a reference."""
    counted = np.ones(test.shape[:2], bool) if counted is None else counted
    distance = leading_distance(DEFAULT_VIEWING)
    return marks.find(estimate(differences, counted), test, counted, distance, **options).image


def truth(size=SIZE, contrast=0.7):
    """Return an image of blocks of one hue (H, W, 3), whose brightness varies lognormally."""
    rng = np.random.default_rng(2)
    blocks = np.exp(contrast * rng.normal(size=(size // 8, size // 8))) / 4
    return blocks.repeat(8, 0).repeat(8, 1)[..., None] * np.array([1.0, 0.8, 0.5])


def skewed(kind, passes, samples, rng, size=SIZE):
    """Return factors (passes, H, W, 1) of mean 1: passes of so many samples of a distribution."""
    shape = (passes, size, size, 1)
    if kind == "lognormal":  # the mean of a pass, of skewness about 2
        return np.exp(rng.normal(0, 0.6, shape) - 0.18)
    if kind == "poisson":  # one sample in 50 brings anything
        return rng.poisson(0.02 * samples, shape) / (0.02 * samples)
    # A tenth of the light comes by one sample in a thousand, of exponential size.
    count = rng.poisson(0.001 * samples, shape)
    rare = np.where(count, rng.gamma(np.maximum(count, 1)), 0.0) / (0.001 * samples)
    return 0.9 * rng.normal(1.0, 0.5 / np.sqrt(samples), shape) + 0.1 * rare


def kinds(passes, rng, size=SIZE):
    """Yield names and deviations (passes, H, W, C) of mean 0 and size 1 or so, eight kinds.

    Only the first and the last two fall as ``1 / √n``.
    """
    shape = (passes, size, size, 1)
    rare = np.exp(2 * rng.normal(size=shape) - 2) - 1
    y, x = np.mgrid[:size, :size] - size / 2
    inside = (x**2 + y**2 < (size / 8) ** 2)[..., None]
    heavy = np.abs(rng.standard_t(2.2, size=shape))
    blotches = rng.normal(size=(passes, size // 4, size // 4, 1))
    yield "normal", rng.normal(size=shape)
    yield "lognormal", rare / 7.3
    yield "fireflies", (300.0 * (rng.random(shape) < 1e-3) - 0.3) / 9.5
    yield "poisson", (rng.poisson(0.05, shape) / 0.05 - 1) / 4.4
    yield "a disc", np.where(inside, rare / 1.8, 0.02 * rng.normal(size=shape))
    yield "heavy tails", (heavy - heavy.mean()) / 3
    yield "coloured", rng.normal(size=(*shape[:3], 3))
    yield "blotches", blotches.repeat(4, axis=1).repeat(4, axis=2)


@dataclass(frozen=True)
class Pool:
    """Passes (N, H, W, 3) of a reference, a few of the heuristic's of the same camera rays.

    ``counted`` are the pixels that see a surface.
    """

    passes: np.ndarray
    heuristic: np.ndarray
    counted: np.ndarray

    def runs(self, passes):
        """Yield the passes of each run, and the mean of those of all others."""
        total = self.passes.sum(axis=0, dtype=np.float64)
        for start in range(0, len(self.passes) - passes + 1, passes):
            own = self.passes[start : start + passes].astype(np.float64)
            yield own, (total - own.sum(axis=0)) / (len(self.passes) - passes)


def power(pool, passes):
    """Return the share that a run marks of the pixels that depart by more than 3; 0 of none."""
    test = pool.heuristic[:passes].mean(axis=0)
    clearly = pool.counted & (LEADING(test, pool.passes.mean(axis=0, dtype=float)) > 3)
    marked = found(pool.heuristic[:passes] - pool.passes[:passes], test, pool.counted)
    return float((marked[clearly] == marks.MARKED).mean()) if clearly.any() else 0.0


def render(name, samples, count, size=SIZE):
    """Render a pool of passes of so many samples per pixel."""
    options = Options(resolution=(size, size), spp=16 * samples, everything=name == "lights")
    ready = prepare(Source(name, CASES[name]), options)
    ready.reference.pass_spp = ready.heuristic.pass_spp = samples
    images = np.empty((count, size, size, 3), np.float32)
    for number in range(count):
        images[number] = np.array(ready.reference.render(pass_seed(777, number)))
    heuristic = [np.array(ready.heuristic.render(pass_seed(777, n)), float) for n in range(16)]
    return Pool(images, np.array(heuristic), gbuffer(ready.scene, (size, size)).hit)


def _lights():
    """A diffuse sphere under forty point lights of unequal strength: an exact pair."""
    rng = np.random.default_rng(5)
    scene = SCENES["lambert-sphere"].make()
    del scene["light"]
    for number in range(40):
        x, y, z = rng.normal(size=3)
        place = np.array([-abs(x), y, z]) * 4.5 / np.linalg.norm([x, y, z])
        strength = 1.5 * np.exp(1.2 * rng.normal() - 0.72)
        scene[f"light {number}"] = {
            "type": "point",
            "position": place.tolist(),
            "intensity": float(strength),
        }
    return scene


def _on_a_floor(floor, ball, lamp_at, side, radiance):
    """A ball on a floor under a small lamp."""
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 8},
        "sensor": camera((0, -7, 4), fov=35.0),
        "floor": {"type": "rectangle", "to_world": moved((0, 0, -1), 12), "bsdf": floor},
        "lamp": {
            "type": "rectangle",
            "to_world": look_at(lamp_at).scale(side),
            "emitter": {"type": "area", "radiance": radiance},
        },
        "ball": {"type": "sphere", "center": (0.3, 0, 0), "bsdf": ball},
    }
    return scene


def _caustic():
    """A mirror ball gathers the light of a lamp on a diffuse floor."""
    floor, ball = {"type": "diffuse", "reflectance": 0.5}, {"type": "conductor", "material": "Al"}
    return _on_a_floor(floor, ball, (-3, -2, 5), 0.35, 330.0)


def _glossy():
    """A glossy floor under a small lamp."""
    floor = {"type": "roughconductor", "alpha": 0.15, "material": "Al"}
    ball = {"type": "diffuse", "reflectance": rgb_of(0.6, 0.3, 0.2)}
    return _on_a_floor(floor, ball, (-3, 3, 5), 0.2, 400.0)


RUNS = (
    ("cornell", 4, 16),
    ("cornell", 16, 16),
    ("cornell", 64, 16),
    ("cornell", 64, 4),
    ("lights", 16, 16),
    ("caustic", 16, 16),
    ("caustic", 64, 4),
    ("glossy", 16, 16),
)
"""Scene, samples per pass, and passes, of which marks are tried."""

CASES = {
    "cornell": SCENES["cornell-box"].make,
    "lights": _lights,
    "caustic": _caustic,
    "glossy": _glossy,
}
