"""False alarms and power of `fotismos check --picture`, and of three other gates, on equal cases.

Pictures are 64 x 48, of made-up noise and of built-in scenes at 16 samples per pixel. There are 100
runs per round, at most 1,000 of scenes, whose repeats are drawn from 64, and 200 of other gates.
"""

import csv
import sys
from dataclasses import replace

import numpy as np
from scipy import special

from fotismos.comparisons.case import open_case

from fotismos.comparisons.options import Options  # isort: skip  it finds LLVM first

from fotismos.comparisons.departure.colour import from_srgb, to_srgb
from fotismos.comparisons.departure.drift import Run, blocks, drift, level_of_each, sidak, whole
from fotismos.comparisons.departure.flip import ldr_flip
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.records.departure import DEFAULT_VIEWING
from fotismos.reference.rendering.passes import pass_seed

HEIGHT, WIDTH, BATCH, LEVEL, FACTOR = 48, 64, 25, 0.01, 1.01322
SHAPE, COUNTS, AXES = (HEIGHT, WIDTH, 1, BATCH), (2, 4, 8), (0, 1, 2)
HEAD = (
    "noise",
    *(f"fotismos: alarms, {count} repeats" for count in COUNTS),
    *(f"limit of the mean found, {count} repeats" for count in COUNTS),
    *(f"limit of a block found, {count} repeats" for count in COUNTS),
    "limit of the mean found in another run",
    "limit of a block found in another run",
    "size of the limit of the mean",
    "fotismos: factor found",
    *(
        f"{gate}: {told}"
        for gate in ("RMSE", "z-test", "FLIP")
        for told in ("alarms", "factor found")
    ),
)

Y, X = np.mgrid[:HEIGHT, :WIDTH, :1, :1][:2]
TRUTH = (0.2 + 0.6 * X / WIDTH) * (1 + 0.5 * np.sin(Y / 5)) * np.array([1, 0.8, 0.5])[:, None]
UNEVEN = np.exp(2 * np.random.default_rng(5).normal(size=(6, 8, 1, 1))).repeat(8, 0).repeat(8, 1)
DISC = (X - 30) ** 2 + (Y - 20) ** 2 < 100


def normal(rng):
    return rng.standard_normal(SHAPE, np.float32)


def filtered(rng):
    grain = 2 * rng.standard_gamma(0.5, (HEIGHT + 4, WIDTH + 4, 1, BATCH))
    taps = list(enumerate((0.018, 0.218, 0.528, 0.218, 0.018)))
    grain = sum(tap * grain[i : HEIGHT + i] for i, tap in taps)
    return sum(tap * grain[:, i : WIDTH + i] for i, tap in taps)


def png(image):
    return from_srgb(np.round(255 * to_srgb(image.clip(0, 1))) / 255)


NOISES = {
    "Gaussian, 10 %": lambda rng: TRUTH * (1 + 0.1 * normal(rng)),
    "gamma, skewness 6": lambda rng: TRUTH * 10 * rng.standard_gamma(0.1, SHAPE),
    "lognormal, skewness 33": lambda rng: TRUTH * np.exp(1.5 * normal(rng) - 1.125),
    "fireflies, 1 in 1,000": lambda rng: (
        TRUTH * (1 + 0.1 * normal(rng)) + 99 * (rng.random(SHAPE) < 1e-3)
    ),
    "filtered gamma": lambda rng: TRUTH * filtered(rng),
    "uneven over the picture": lambda rng: TRUTH * (1 + 0.02 * UNEVEN * normal(rng)),
    "in a disc alone": lambda rng: TRUTH * (1 + 0.3 * DISC * normal(rng)),
    "two values at 5 pixels": lambda rng: (
        TRUTH * (1 + ((X == 20) & (Y % 9 == 0)) * (rng.random(SHAPE) < 0.5))
    ),
    "zeros, 1 in 20 lit": lambda rng: TRUTH * 20 * (rng.random(SHAPE) < 0.05),
    "8-bit PNG, 1 %": lambda rng: png(TRUTH * (1 + 0.01 * normal(rng))),
}
SCENES = ("cornell-box", "plastic-spheres", "narrow-band-lamp", "fig-8-9", "fig-6-10",
          "lambert-sphere")  # fmt: skip


def drawn(name):
    """Return a function that draws so many repeats (H, W, 3, BATCH) of a noise or a scene."""
    if name in NOISES:
        return lambda rng, count: [NOISES[name](rng) for _ in range(count)]
    case = open_case(name, Options(resolution=(WIDTH, HEIGHT)))
    half = prepare(case.source, case.options).reference
    half.pass_spp = 16
    pool = np.array([np.array(half.render(pass_seed(9, number))) for number in range(64)])

    def draw(rng, count):
        order = rng.permuted(np.tile(np.arange(len(pool)), (BATCH, 1)), axis=1)
        return [np.moveaxis(pool[places], 0, -1) for places in order.T[:count]]

    return draw


def drifts(before, after):
    """Return what a check tests: means of the picture, and of its blocks."""
    return [drift(before, after, parts((HEIGHT, WIDTH))) for parts in (whole, blocks)]


def level_of_kind():
    return level_of_each(LEVEL, 2)


def ours(before, after):
    found = drifts(before, after)
    return np.any([each.moved(level_of_kind()).any(axis=(0, 1)) for each in found], axis=0)


def rmse(before, after):
    return np.sqrt(((after.mean - before.mean) ** 2).mean(AXES)) > 0.02 * before.mean.mean(AXES)


def z_test(before, after):
    """As in Mitsuba's test_renders: more than 1 pixel in 400 differs, at 1 % over all (Šidák)."""
    z = np.abs(after.mean - before.mean) * np.sqrt(after.count / before.variance.clip(1e-4))
    return (sidak(2 * special.ndtr(-z), HEIGHT * WIDTH) > LEVEL).mean(axis=AXES) < 0.9975


def flip(before, after):
    pairs = zip(np.moveaxis(after.mean, -1, 0), np.moveaxis(before.mean, -1, 0), strict=True)
    return np.array([ldr_flip([new], old, DEFAULT_VIEWING)[0].mean() > 0.05 for new, old in pairs])


def measured(draw, count, runs, *gates):
    """Return shares (2, gates) of runs that alarm, unchanged and with a factor; and our power.

    Power (2, 2) is the share of means, of the picture and of blocks, that a shift by the limit of
    the same run moves, or of another run; the last number is the limit of the picture's mean.
    """
    rng, alarms, power, sizes = np.random.default_rng(1), [], [], []
    for _ in range(-(-runs // BATCH)):
        repeats = draw(rng, 2 * count)
        before, after = Run.of(repeats[:count]), Run.of(repeats[count:])
        scaled = after.changed(lambda image: image * FACTOR)
        scaled = replace(scaled, variance=after.variance * FACTOR**2)
        alarms.append([[gate(before, one).mean() for gate in gates] for one in (after, scaled)])
        for each in drifts(before, after):
            limit = each.limit(level_of_kind())
            sizes.append(np.median(limit.sum((0, 1)) / each.before.sum((0, 1))))
            shifted = (
                replace(each, after=each.after + one) for one in (limit, np.roll(limit, 1, -1))
            )
            power.append([one.moved(level_of_kind())[each.error > 0].mean() for one in shifted])
    power = np.nanmean(np.reshape(power, (-1, 2, 2)), axis=0)
    return np.mean(alarms, axis=0), power, np.median(sizes[::2])


def row(name, rounds):
    draw, runs = drawn(name), min(100 * rounds, 1000 if name in SCENES else 10**6)
    alarms, power, sizes = zip(*(measured(draw, n, runs, ours) for n in COUNTS), strict=True)
    cells = [[each[0, 0] for each in alarms], *np.array(power)[:, :, 0].T, power[1][:, 1]]
    cells += [sizes[1:2], alarms[1][1], *measured(draw, 4, min(runs, 200), rmse, z_test, flip)[0].T]
    return name, *(f"{100 * v:.3g}" for each in cells for v in each)


def run(rounds):
    """Print docs/data/gates.csv, in percent: for 2, 4 and 8 repeats on each side, else for 4."""
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(HEAD)
    table.writerows(row(name, rounds) for name in (*NOISES, *SCENES))
