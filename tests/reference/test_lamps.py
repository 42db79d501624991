import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.reference.pairing import lamps
from fotismos.reference.pairing.halves import pair
from fotismos.reference.scene.source import Source
from tests.shared.parts import camera, mesh_of


def solid_angle_error(cutoff, exponent, beam_width, edge=None):
    """Mean square difference over the cone, by another quadrature: uniform in the cosine.

    At equal flux, which is the mean over the cone; the cone that is given keeps its own level.
    """
    cosine = np.linspace(np.cos(np.radians(cutoff)), 1, 20_001)
    theta = np.degrees(np.arccos(cosine))
    power = np.where(cosine > 0, cosine, 0) ** exponent
    linear = np.clip(((edge or cutoff) - theta) / ((edge or cutoff) - beam_width), 0, 1)
    given, other = (linear, power) if edge is None else (power, linear)
    return np.mean((other * (given.mean() / other.mean()) - given) ** 2)


def test_no_other_exponent_or_cone_fits_better():
    for cutoff, beam_width in ((20, 15), (20, 1), (45, 30), (80, 10)):
        m = lamps.exponent_for(cutoff, beam_width)
        best = solid_angle_error(cutoff, m, beam_width)
        for other in m * np.array([0.5, 0.9, 1.1, 2.0]):
            assert solid_angle_error(cutoff, other, beam_width) > best
    for cutoff, exponent in ((20, 10), (30, 3), (60, 40), (85, 2)):
        edge, beam_width = lamps.cone_for(cutoff, exponent)
        best = solid_angle_error(cutoff, exponent, beam_width, edge)
        for other_edge in np.linspace(0.1, 1, 12) * cutoff:
            for other in np.linspace(0, 0.999, 12) * other_edge:
                error = solid_angle_error(cutoff, exponent, other, other_edge)
                assert error >= best * (1 - 1e-3)


def flux_of(emitter, widest):
    """Integrate a light's own sampling over the cone about the z axis, as far as ``widest``."""
    count = 100_000
    theta = np.radians(widest) * (np.arange(count) + 0.5) / count
    it = dr.zeros(mi.SurfaceInteraction3f, count)
    it.p = mi.Point3f(mi.Float(np.sin(theta)), 0, mi.Float(np.cos(theta)))
    _, weight = emitter.sample_direction(it, mi.Point2f(0.5))
    return 2 * np.pi * np.sum(np.array(weight, float)[0] * np.sin(theta)) * theta[0] * 2


def random_spots(kind, count=12):
    rng = np.random.default_rng(8)
    for _ in range(count):
        cutoff = rng.uniform(3, 88)
        if kind == "spot":
            beam_width = cutoff * rng.uniform(0, 0.99)
            yield {"type": kind, "cutoff_angle": cutoff, "beam_width": beam_width}
        else:
            exponent = np.expm1(rng.uniform(0, np.log(300)))
            yield {"type": kind, "cutoff": cutoff, "exponent": exponent, "k0": 0.0, "k2": 1.0}


@pytest.mark.guarantee("pairing", "Spots keep their flux to 1e-4, both ways.")
@pytest.mark.parametrize("kind", ["spot", "heuristic_spot"])
def test_spots_keep_their_flux_both_ways(rgb, kind):
    """To 1e-4, by numeric integration of what the plugins of both halves send."""
    given = {f"light {number:02}": spot for number, spot in enumerate(random_spots(kind))}
    scene = {
        "type": "scene",
        "sensor": {"type": "perspective"},
        "wall": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
        **given,
    }
    made = pair(Source("spots", scene))
    assert not any(record.exact for record in made.pairing.emitters)
    heuristic, physical = (
        {emitter.id(): emitter for emitter in half.instantiate().emitters()}
        for half in (made.heuristic, made.physical)
    )
    assert heuristic.keys() == physical.keys() == given.keys()
    for name, spot in given.items():
        widest = spot.get("cutoff", spot.get("cutoff_angle"))
        fluxes = [flux_of(half[name], widest) for half in (heuristic, physical)]
        assert fluxes[0] == pytest.approx(fluxes[1], rel=1e-4), spot


def test_a_spot_of_another_attenuation_has_the_mean_irradiance_over_what_is_seen(rgb):
    """With each half's own fall-off within the cone: the two pictures have one mean."""
    scene = {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": camera((0, 0, 4), up=(0, 1, 0), size=192),
        "wall": {"type": "rectangle", "bsdf": {"type": "phong", "k_d": 0.5}},
        "light": {
            "type": "heuristic_spot", "position": (0.5, -1, 3), "direction": (-0.5, 1, -3),
            "cutoff": 14.0, "exponent": 30.0,
        },
    }  # fmt: skip
    made = pair(Source("a spot", scene))
    heuristic = mi.render(made.heuristic.instantiate(), spp=4, seed=0)
    direct = mi.load_dict({"type": "direct"})
    physical = mi.render(made.physical.instantiate(), integrator=direct, spp=4, seed=0)
    assert np.mean(heuristic) == pytest.approx(np.mean(physical), rel=2e-3)


def test_a_lamp_that_is_not_flat_keeps_its_flux_and_its_intensity_ahead(rgb, tmp_path):
    """A roof of two squares at 45 degrees: it sends ``pi L A``, and ``L A / sqrt(2)`` straight on.

    The spot ``I_0 cos^m`` sends ``2 pi I_0 / (m + 1)``.
    """
    height = np.sqrt(0.5)
    rows = [(-height, 0), (0, height), (height, 0)]
    points = [(x, y, z) for x, z in rows for y in (0, 1)]
    mesh = mesh_of(points, faces=[(0, 2, 1), (1, 2, 3), (2, 4, 3), (3, 4, 5)])
    mesh.write_ply(str(tmp_path / "roof.ply"))
    scene = {
        "type": "scene",
        "sensor": {"type": "perspective"},
        "roof": {
            "type": "ply", "filename": str(tmp_path / "roof.ply"), "face_normals": True,
            "emitter": {"type": "area", "radiance": 3.0},
        },
    }  # fmt: skip
    graph = pair(Source("a roof", scene)).heuristic
    (spot,) = (
        graph.props(index)
        for index in graph.nodes(mi.ObjectType.Emitter)
        if graph.plugin(index) == "heuristic_spot"
    )
    ahead, m = np.pi * spot["scale"], spot["exponent"]
    assert ahead == pytest.approx(2 / np.sqrt(2), rel=1e-3)
    assert 2 * np.pi * ahead / (m + 1) == pytest.approx(np.pi * 2, rel=1e-3)
