"""Irradiance below lamps, and exchange between plates: direct light in closed form.

The floor is diffuse, of reflectance ``rho``: its radiance is ``rho E / pi``, and ``rho L F`` where
a lamp of radiance ``L`` sends it the irradiance ``E = pi L F``.
"""

import numpy as np

from tests.shared.parts import look_at
from tests.witnesses import configuration, stage
from tests.witnesses.stage import GREY
from tests.witnesses.witness import Witness

LAMBERT = "Lambert's contour integral"
CATALOGUE = "Howell's catalogue of configuration factors"


RECTANGLE = (-0.3, 0.5), (-0.2, 0.6)
HEIGHT = 0.8


def _below_a_rectangle():
    (x0, x1), (y0, y1) = RECTANGLE
    centre = ((x0 + x1) / 2, (y0 + y1) / 2, HEIGHT)
    lamp = stage.plate(
        centre, (*centre[:2], 0), (0, 1, 0), (x1 - x0) / 2, (y1 - y0) / 2, emitter=stage.shining()
    )
    return stage.scene(stage.above(), floor=stage.floor(), lamp=lamp)


UPRIGHT = (-0.4, 0.7), (0.2, 0.9)
"""Along y and z, of a lamp in the plane x = -1.2."""


def _beside_a_rectangle():
    (y0, y1), (z0, z1) = UPRIGHT
    centre = (-1.2, (y0 + y1) / 2, (z0 + z1) / 2)
    lamp = stage.plate(
        centre, (0, *centre[1:]), (0, 0, 1), (y1 - y0) / 2, (z1 - z0) / 2, emitter=stage.shining()
    )
    return stage.scene(stage.above(), floor=stage.floor(), lamp=lamp)


def _below_a_disc():
    to_world = look_at((0.2, 0, HEIGHT), (0.2, 0, 0), (0, 1, 0)).scale(0.4)
    lamp = {"type": "disk", "to_world": to_world, "bsdf": stage.BLACK, "emitter": stage.shining()}
    return stage.scene(stage.above(), floor=stage.floor(), lamp=lamp)


BALL = (0.3, 0.2, 1.0), 0.25


def _below_a_ball():
    centre, radius = BALL
    lamp = {
        "type": "sphere", "center": centre, "radius": radius,
        "bsdf": stage.BLACK, "emitter": stage.shining(),
    }  # fmt: skip
    return stage.scene(stage.above(), floor=stage.floor(), lamp=lamp)


def _of_a_ball(x, y):
    (a, b, height), radius = BALL
    distance = np.sqrt((x - a) ** 2 + (y - b) ** 2 + height**2)
    return GREY * configuration.sphere(height / distance, distance, radius)


SPOT = (0.3, -0.2, 1.2), (0.1, 0.1, 0.0)
"""Place, and where it points."""

CUTOFF, BEAM = 35.0, 20.0
INTENSITY = 3.0


def _spot(place, target):
    return {
        "type": "spot", "to_world": look_at(place, target, (0, 1, 0)), "intensity": INTENSITY,
        "cutoff_angle": CUTOFF, "beam_width": BEAM,
    }  # fmt: skip


def _below_a_slanted_spot():
    return stage.scene(stage.above(), floor=stage.floor(), spot=_spot(*SPOT))


def _of_a_slanted_spot(x, y):
    place, target = map(np.array, SPOT)
    offset = np.stack([x, y, np.zeros_like(x)], axis=1) - place
    distance = np.linalg.norm(offset, axis=1)
    axis = (target - place) / np.linalg.norm(target - place)
    angle = np.degrees(np.arccos(offset @ axis / distance))
    falloff = np.clip((CUTOFF - angle) / (CUTOFF - BEAM), 0, 1)
    return GREY / np.pi * INTENSITY * falloff * place[2] / distance**3


def _below_a_spot():
    return stage.scene(
        stage.above(), floor=stage.floor(), spot=_spot((0, 0, 1.3), (0, 0, 0))
    )  # the cone's circle has the radius 1.3 tan 35° = 0.91


def _of_all_of_a_spot(x, y):
    """The flux ``2 pi I (1 - (sin c - sin b) / (c - b))``, spread over the square of area 4."""
    c, b = np.radians((CUTOFF, BEAM))
    flux = 2 * np.pi * INTENSITY * (1 - (np.sin(c) - np.sin(b)) / (c - b))
    return GREY / np.pi * flux / 4


def _opposite_squares():
    lamp = stage.plate((0, 0, 1.5), (0, 0, 0), (0, 1, 0), 1, 1, emitter=stage.shining())
    return stage.scene(stage.above(), floor=stage.floor(half=1.0), lamp=lamp)


def _squares_of_a_corner():
    lamp = stage.plate((-1, 0, 1), (0, 0, 1), (0, 0, 1), 1, 1, emitter=stage.shining())
    return stage.scene(stage.above(), floor=stage.floor(half=1.0), lamp=lamp)


def _disc_below_a_ball():
    ball = {
        "type": "sphere", "center": (0, 0, 0.9), "radius": 0.3,
        "bsdf": stage.BLACK, "emitter": stage.shining(),
    }  # fmt: skip
    disc = {"type": "disk", "bsdf": stage.diffuse()}
    return stage.scene(stage.above(), disc=disc, ball=ball)


def _beside_a_black_wall():
    wall = stage.plate((-1, 0, 0.6), (0, 0, 0.6), (0, 0, 1), 0.8, 0.6)
    sky = {"type": "constant", "radiance": 1.0}
    return stage.scene(stage.above(height=2.0), floor=stage.floor(), wall=wall, sky=sky)


WITNESSES = (
    Witness(
        "floor below a rectangular lamp",
        "E = π L F, F of a parallel rectangle",
        LAMBERT,
        _below_a_rectangle,
        lambda x, y: GREY * configuration.parallel_rectangle(x, y, *RECTANGLE, HEIGHT),
    ),
    Witness(
        "floor beside an upright rectangular lamp",
        "E = π L F, F of a perpendicular rectangle",
        LAMBERT,
        _beside_a_rectangle,
        lambda x, y: GREY * configuration.upright_rectangle(x + 1.2, y, *UPRIGHT),
    ),
    Witness(
        "floor below a disc",
        "E = π L / 2 (1 − (s² + h² − r²) / √((s² + h² + r²)² − 4 s² r²))",
        CATALOGUE,
        _below_a_disc,
        lambda x, y: GREY * configuration.parallel_disc(np.hypot(x - 0.2, y), 0.4, HEIGHT),
    ),
    Witness(
        "floor below a shining ball", "E = π L (r / d)² cos θ", CATALOGUE, _below_a_ball, _of_a_ball
    ),
    Witness(
        "floor below a slanted spot",
        "E = I g(θ) cos θ′ / d², g linear from beam width to cutoff",
        "the spot's definition",
        _below_a_slanted_spot,
        _of_a_slanted_spot,
    ),
    Witness(
        "flux of a spot",
        "Φ = 2 π I (1 − (sin c − sin b) / (c − b))",
        "the integral of g over the cone",
        _below_a_spot,
        _of_all_of_a_spot,
        mean_only=True,
    ),
    Witness(
        "parallel squares, 2 wide and 1.5 apart",
        "ρ L F, F between equal opposite rectangles",
        CATALOGUE,
        _opposite_squares,
        lambda x, y: GREY * configuration.between_parallel_squares(2, 1.5),
        mean_only=True,
    ),
    Witness(
        "perpendicular squares with a common side",
        "ρ L F, F = (π/2 − √2 arctan(1/√2) + ln(3/4)/4) / π",
        CATALOGUE,
        _squares_of_a_corner,
        lambda x, y: GREY * configuration.between_squares_of_a_corner(),
        mean_only=True,
    ),
    Witness(
        "disc below a ball on its axis",
        "ρ L F, F = 2 (r / R)² (1 − 1 / √(1 + (R / h)²))",
        CATALOGUE,
        _disc_below_a_ball,
        lambda x, y: GREY * configuration.disc_to_sphere(1, 0.3, 0.9) * np.pi / 4,
        mean_only=True,
    ),
    Witness(
        "floor beside a black wall under an even sky",
        "E = π L (1 − F), F of the wall",
        LAMBERT,
        _beside_a_black_wall,
        lambda x, y: (
            GREY * (1 - configuration.upright_rectangle(x + 1, y, (-0.8, 0.8), (0.0, 1.2)))
        ),
    ),
)
