"""The design of a study: points in range, and mistakes refused before anything runs."""

import numpy as np
import pytest

from comparisons.study import design
from heuristic.errors import InputError


def parts(text):
    return design.parse(text).parts


def lobe(parameters, more=""):
    return f"[[part]]\nscene = 'lobe'\n{more}\n[part.parameters]\n{parameters}\n"


def test_a_grid_has_all_combinations_the_material_slowest():
    (part,) = parts(lobe("light_angle = [0, 30]\nalpha = {from = 0.1, to = 0.4, steps = 3}"))
    points = part.points()
    assert [(p["alpha"], p["light_angle"]) for p in points] == [
        (alpha, angle) for alpha in (0.1, 0.25, 0.4) for angle in (0, 30)
    ]
    assert all(p["int_ior"] == 1.5 and p["reflectance"] == 0.5 for p in points)
    assert part.varying == ("alpha", "light_angle")


def test_a_logarithmic_range_has_equal_ratios():
    (part,) = parts(lobe("alpha = {from = 0.1, to = 0.8, steps = 4, scale = 'log'}"))
    assert [p["alpha"] for p in part.points()] == pytest.approx([0.1, 0.2, 0.4, 0.8])


@pytest.mark.parametrize("kind", ["random", "sobol"])
def test_a_drawn_design_fills_its_ranges_evenly(kind):
    text = lobe(
        "alpha = {from = 0.1, to = 1, scale = 'log'}\nlight_angle = {from = 20, to = 60}",
        f"design = '{kind}'\npoints = 1024\nseed = 3",
    )
    points = parts(text)[0].points()
    assert points == parts(text)[0].points()
    alpha, angle = (np.array([p[name] for p in points]) for name in ("alpha", "light_angle"))
    assert all((alpha >= 0.1) & (alpha <= 1))
    assert all((angle >= 20) & (angle <= 60))
    counts = np.histogram2d(np.log10(alpha), angle, bins=8, range=((-1, 0), (20, 60)))[0]
    # Sobol's points are a net: each cell of 8 x 8 has its 16. Binomial spread is 4 for random ones.
    assert abs(counts - 16).max() <= (0 if kind == "sobol" else 24)


def test_random_points_are_not_a_lattice():
    text = lobe("alpha = {from = 0.1, to = 1}", "design = 'random'\npoints = 64")
    (other,) = parts(text.replace("points = 64", "points = 64\nseed = 1"))
    assert parts(text)[0].points() != other.points()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "there are no parts"),
        ("title = \n[[part]]", "not TOML.*line 1"),
        ("[[part]]\nname = 'a'", "no scene.*lobe"),
        (lobe(""), "no parameters are given"),
        (lobe("alfa = 1"), "'alfa' is not known.*alpha"),
        (lobe("alpha = 0"), "alpha = 0: give a number from 0.02 to 1"),
        (lobe("alpha = [0.1, 'rough']"), "alpha = 'rough'"),
        (lobe("alpha = nan"), "alpha = nan"),
        (lobe("alpha = true"), "alpha = True"),
        (lobe("alpha = []"), "at least one value"),
        (lobe("light_angle = 95"), "light_angle = 95: give a number from 0 to 89 deg"),
        (lobe("alpha = {from = 0.1, to = 1}"), "from, steps, to"),
        (lobe("alpha = {from = 0.5, to = 0.1, steps = 3}"), "from 0.5 to 0.1"),
        (lobe("alpha = {from = 0.1, to = 1, steps = 1}"), "steps = 1"),
        (lobe("alpha = {from = 0.1, to = 1, steps = 3, scale = 'cubic'}"), "linear or log"),
        (lobe("light_angle = {from = 0, to = 9, steps = 3, scale = 'log'}"), "above 0"),
        (lobe("alpha = 0.1\nn = 3"), "two materials"),
        (lobe("alpha = 0.1", "design = 'latin'"), "grid, random, sobol"),
        (lobe("alpha = 0.1", "pairing = 'fit'"), "matched, literal"),
        (lobe("alpha = 0.1", "resolution = [0, 5]"), "resolution"),
        (lobe("alpha = 0.1", "spp = 2"), "at least 4"),
        (lobe("alpha = 0.1", "colour = 1"), "'colour' is not known"),
        (lobe("alpha = {from = 0.1, to = 1}", "design = 'sobol'\npoints = 500"), "256 or 512"),
        (lobe("alpha = {from = 0.1, to = 1}", "design = 'random'"), "0 points"),
        (lobe("alpha = [0.1]", "design = 'random'\npoints = 4"), "no parameter has a range"),
        (lobe("alpha = 0.1") * 2, "its own name"),
    ],
)
def test_a_mistake_is_refused_with_what_is_allowed(text, expected):
    with pytest.raises(InputError, match=f"(?s){expected}"):
        design.parse(text)


def test_a_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(InputError, match=r"nix\.toml: No such file"):
        design.read(tmp_path / "nix.toml")
