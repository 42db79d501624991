"""Two mistakes in one picture are both named, and nothing is said of right pictures."""

import re

import numpy as np
import pytest

from fotismos.comparisons import alignment, picture_mistakes
from fotismos.comparisons.departure.mapped_sums import Light
from fotismos.comparisons.picture_mistakes import MISREADINGS, Names, NoisyImage

SIDE = 64
POWER = "raised to the power|sRGB-encoded|decoded twice"


def painted(seed, gloss=0.3):
    """Return a picture of six spheres before a gradient, of one of two kinds."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:SIDE, :SIDE] / SIDE
    image = random.uniform(0.05, 0.4, 3) * (0.5 + 0.5 * y[..., None])
    for _ in range(6):
        centre = random.uniform(0.1, 0.9, 2)
        radius = random.uniform(0.1, 0.3)
        colour = random.uniform(0.05, 0.9, 3)
        across = (x - centre[0]) / radius
        down = (y - centre[1]) / radius
        height = np.sqrt(np.maximum(1 - across**2 - down**2, 0))
        light = random.normal(size=3)
        light[2] = abs(light[2]) + 0.3
        light /= np.linalg.norm(light)
        cosine = np.maximum(across * light[0] + down * light[1] + height * light[2], 0)[..., None]
        value = colour * (0.05 + cosine) + gloss * cosine**20
        image = np.where((height > 0)[..., None], value, image)
    if seed % 2:
        checks = ((8 * x).astype(int) + (8 * y).astype(int)) % 2
        image = image * (0.6 + 0.4 * checks)[..., None]
    return image


def sentences(picture, truth):
    """Return what is said of a picture beside the truth."""
    edges = [alignment.picture_edges(truth)]
    found = picture_mistakes.find(
        NoisyImage(picture),
        NoisyImage(truth),
        np.ones((SIDE, SIDE), bool),
        alignment.measure(picture, edges),
        lambda mend: alignment.measure(mend(picture), edges),
        False,
        Names(),
        Light(mean=truth, standard_error=0 * truth),
    )
    return [mistake.sentence for mistake in found]


def power(image, by):
    return np.maximum(image, 0) ** by


def spoiled(seed):
    """Yield pictures with two mistakes, and what is said of each of the two."""
    truth = painted(seed)
    random = np.random.default_rng(1000 + seed)
    gamma = float(random.choice([1 / 2.2, 1 / 1.8, 1.7, 2.2]))
    gain = float(random.choice([0.3, 0.5, 2, 3, np.pi]))
    offset = float(random.uniform(0.03, 0.1))
    space = str(random.choice(picture_mistakes.PRIMARIES))
    in_space = MISREADINGS[f"colours look like those of {space}"][1]
    yield gain * power(truth, gamma), (POWER, "multiplied by|times as bright")
    yield power(truth, gamma)[::-1], ("upside down", POWER)
    yield power(in_space(truth), gamma), (space, POWER)
    yield gain * truth + offset, ("times as bright", "too high")


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(10))
def test_both_of_two_mistakes_are_named(seed):
    truth = painted(seed)
    for picture, patterns in spoiled(seed):
        said = " ".join(sentences(picture, truth))
        assert [words for words in patterns if not re.search(words, said)] == [], said


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(10))
def test_nothing_is_said_of_right_pictures(seed):
    """Of noise, and of another shading: highlights that are missing, or twice as strong."""
    truth = painted(seed)
    noise = 0.02 * np.random.default_rng(seed).normal(size=truth.shape)
    assert sentences(truth + noise, truth) == []
    assert sentences(painted(seed, gloss=0.6 * (seed % 2)), truth) == []
