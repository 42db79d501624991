"""docs/lessons.md: its numbers are fresh, and what its words say of them holds."""

import re

import numpy as np
import pytest

from docs.figures import lessons
from tests.shared.programs import ROOT

SECTIONS = re.split(r"^## ", (ROOT / "docs/lessons.md").read_text(), flags=re.MULTILINE)[1:]
TABLE = re.compile(r"<!-- (.*?): made by ./run docs -->(.*)<!-- end of \1 -->", re.DOTALL)


def same(values, expected, within=2e-3):
    return np.all(np.abs(values - expected) <= within)


def falls_off(t, p):
    """Is physics the textbook's 0.5 N.L over the distance squared from 4.24 to the unit sphere?"""
    distance = np.sqrt((2 * t) ** 2 - 1 + 4.24**2) - 2 * t
    return np.ptp(p / t * distance**2) < 0.02 * p[0] / t[0] * distance[0] ** 2


def computed(equation):
    """The value of products and powers as a lesson has them, such as ``0.5·0.9^{3}``."""
    total = 0.0
    for product in equation.strip("$").split(" + "):
        factors = (re.fullmatch(r"([\d.]+)(?:\^\{(\d+)\})?", f) for f in product.split("·"))
        total += np.prod([float(factor[1]) ** int(factor[2] or 1) for factor in factors])
    return total


CLAIMS = {
    "emission": lambda t, p: (same(t[0], p[0]), p[1] > 1.5 * t[1]),
    "fall-offs": lambda t, p: (p[0] > 2 * t[0], p[1] < t[1] / 3, same(t[2:], p[2:])),
    "far": lambda t, p: (same(t[:2], p[:2]), p[2] > 1.1 * t[2], t[1] > 2 * t[3]),
    "mirror": lambda t, p: (same(t, 0), p[0] > 0.1),
    "weights": lambda t, p: (p[0] - t[0] > 5 * abs(p[1] - t[1]), same(p[0], p[1])),
    "sky": lambda t, p: (same(t, 0.5), same(p, 0.5)),
    "distance": lambda t, p: (p[0] > t[0], p[1] < t[1], same(t[2], p[2]),
                              falls_off(t[:2], p[:2])),
    "rim": lambda t, p: (same(t[0], t[1], 0.02), 1.8 * 1.2 > p[0] / p[1] > 1.8),
    "shadow": lambda t, p: (same(t, 0.3), 0.35 < p[0] < 0.6),
    "sum": lambda t, p: (1 < t[0] <= 1.5, p[0] > 1),
    "exponent": lambda t, p: (same(t[0], t[1], 0.01), p[1] > 1.1 * p[0], t[3] < t[2], p[3] < p[2]),
    "half vector": lambda t, p: (t[1] > t[0], same(p[0], p[1])),
    "beam": lambda t, p: (t[2] < t[1] / 10 < t[0], t[2] > 0.01, p[2] == 0, p[0] > 0.5),
    "edges": lambda t, p: (t[0] > 1.3 * t[1], same(t[2], t[3], 0.02), same(p[0], p[1], 0.02)),
    "vertices": lambda t, p: (t[1] > 3 * t[0], p[0] > 3 * t[0]),
    "surfaces": lambda t, p: (t[0] == t[1] == 0, min(p[:2]) > 0.01, t[2] > 3 * p[2]),
}  # fmt: skip
"""What each lesson says of the means over RGB at its pixels, textbook and physics."""


@pytest.mark.thorough
@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.partition("\n")[0])
def test_a_lesson_says_what_a_rendering_shows(section):
    assert len(SECTIONS) == 17
    ((name, table),) = TABLE.findall(section)
    assert len(TABLE.sub("", section).split()) <= 170
    assert "**Try:** `./run compare " in section
    assert section.count("<details><summary>Exercise: ") == 1
    # The picture has a circle around each pixel of its scene, in all three parts.
    assert (ROOT / "docs" / lessons.file(name)).read_bytes()[8:12] == b"WEBP"
    found = lessons.values(name)
    pattern = r"^- `(.*)` at (\d+), (\d+): textbook ([^(;]+?)(?: \((\$.*\$)\))?; physical (.*)$"
    rows = re.findall(pattern, table, re.MULTILINE)
    pixels = [lessons.Pixel(scene, int(x), int(y)) for scene, x, y, *_ in rows]
    assert pixels == [*lessons.LESSONS[name]]
    for (*_, textbook, equation, physical), halves in zip(rows, found, strict=True):
        if equation:
            # The pixel is a mean over its square, the equation is that of its centre.
            assert halves[0][0] == pytest.approx(computed(equation), abs=0.02, rel=0.02), equation
        for shown, colour in zip((textbook, physical), halves, strict=True):
            assert colour == pytest.approx(np.float64(shown.split(", ")) * np.ones(3), 0.02, 2e-3)
    if name == "channels":  # the red lamp's is the white lamp's
        assert same(found[0, :, 0], found[1, :, 0])
        assert found[0, 0, 1] > 1.5 * found[0, 0, 0]
    else:
        assert all(CLAIMS[name](*found.mean(axis=2).T)), found
