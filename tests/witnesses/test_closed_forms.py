"""The reference against closed forms, at the samples that commands take, case by case."""

import numpy as np
import pytest

from tests.witnesses import configuration, corners, fresnel, furnaces, lamps
from tests.witnesses.witness import deviation

WITNESSES = (*lamps.WITNESSES, *corners.WITNESSES, *furnaces.WITNESSES)
BIAS = 3e-3

QUICK = ("below a rectangular lamp", "flux", "furnace: diffuse")
"""Parts of names of cases of the quick tier."""

cases = pytest.mark.parametrize(
    "witness",
    [
        pytest.param(
            witness,
            id=witness.name,
            marks=() if any(part in witness.name for part in QUICK) else pytest.mark.thorough,
        )
        for witness in WITNESSES
    ],
)


def require_agreement(found):
    np.testing.assert_array_less(np.abs(found.value), found.half_width)


@pytest.mark.guarantee("reference", "The reference matches 25 closed forms; a bias of 0.3 % fails.")
@cases
def test_the_reference_is_the_closed_form(rgb, witness):
    """In the mean over the image, known to the stated precision, and over its blocks."""
    found = deviation(witness)
    assert found.half_width[0] < witness.precision
    require_agreement(found)
    for factor in (1 - BIAS, 1 + BIAS):
        with pytest.raises(AssertionError):
            require_agreement(deviation(witness, factor=factor))


@pytest.mark.slow
@pytest.mark.parametrize("witness", WITNESSES, ids=lambda witness: witness.name)
def test_so_is_the_reference_that_leaves_nothing_out(rgb, witness):
    require_agreement(deviation(witness, everything=True))


def square_mean(function):
    nodes, weights = np.polynomial.legendre.leggauss(48)
    x, y = np.meshgrid((nodes + 1) / 2, (nodes + 1) / 2)
    return float(np.sum(np.outer(weights, weights) / 4 * function(x, y)))


def test_factors_between_plates_are_means_of_those_of_plane_elements():
    unit = (0, 1), (0, 1)
    opposite = square_mean(lambda x, y: configuration.parallel_rectangle(x, y, *unit, 0.7))
    assert configuration.between_parallel_squares(1, 0.7) == pytest.approx(opposite, rel=1e-9)
    upright = square_mean(lambda x, y: configuration.upright_rectangle(x, y, *unit))
    assert configuration.between_squares_of_a_corner() == pytest.approx(upright, rel=1e-6)


def test_the_factor_of_a_sphere_for_a_disc_is_the_mean_of_that_for_its_points():
    mean = square_mean(
        lambda s, _: 2 * s * configuration.sphere(0.9 / np.hypot(0.9, s), np.hypot(0.9, s), 0.3)
    )
    assert configuration.disc_to_sphere(1, 0.3, 0.9) == pytest.approx(mean, rel=1e-9)


def test_factors_of_all_that_surrounds_a_point_add_up_to_one():
    """The walls and the ceiling of a room, seen from a point of its floor."""
    x, y, height, far = 0.3, 0.45, 0.8, 1.0
    ceiling = configuration.parallel_rectangle(x, y, (0, far), (0, far), height)
    walls = sum(
        configuration.upright_rectangle(distance, along, (0, far), (0, height))
        for distance, along in ((x, y), (far - x, y), (y, x), (far - y, x))
    )
    assert ceiling + walls == pytest.approx(1, rel=1e-12)


def test_a_disc_and_a_rectangle_far_away_are_one_small_lamp():
    area, far = 0.01, 10.0
    disc = configuration.parallel_disc(3.0, np.sqrt(area / np.pi), far)
    side = np.sqrt(area) / 2
    square = configuration.parallel_rectangle(3.0, 0.0, (-side, side), (-side, side), far)
    lamp = area / np.pi * far**2 / (far**2 + 9) ** 2
    assert (disc, square) == pytest.approx((lamp, lamp), rel=1e-3)


@pytest.mark.thorough
def test_rough_surfaces_become_smooth_ones():
    cosine = np.array([0.3, 0.6, 0.9])
    smooth = fresnel.smooth_plastic(cosine, 0.0, 1.5, nonlinear=False)
    rough = fresnel.rough_plastic(cosine, 0.0, 0.002, 1.5)
    np.testing.assert_allclose(rough, smooth, rtol=2e-3)
    np.testing.assert_allclose(fresnel.rough_mirror(cosine, 0.002, "ggx"), 1, rtol=2e-3)
    assert fresnel.conductor(1.0, 0.2, 3.0) == pytest.approx((0.8**2 + 9) / (1.2**2 + 9))
