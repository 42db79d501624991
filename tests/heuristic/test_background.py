"""The environment that shaders see: Mitsuba's own, in Python and in GLSL; and what they prepare."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.heuristic import background, vectors
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import named
from fotismos.reference.pairing import halves
from fotismos.reference.scene.source import Source
from tests.shared.opengl import opengl
from tests.shared.parts import camera, rgb_of

PYTHON = "def shade(point): return point.environment(point.normal)\n"
GLSL = "vec3 shade(Point point) { return environment(3.0 * point.normal); }\n"
SKY = 0.5 + 0.4 * background.directions(32, 64)[..., [1, 2, 0]]
GRAIN = np.random.default_rng(5).uniform(0, 0.2, SKY.shape)
TEXELS = (SKY + GRAIN).astype(np.float32)
"""A map whose neighbours differ by 0.2: where columns meet, angles in single precision count."""


def emitters():
    turned = {"to_world": mi.ScalarTransform4f().rotate([0.6, 0, 0.8], 77)}
    around = {"type": "envmap", "bitmap": mi.Bitmap(TEXELS), "scale": 1.5}
    return {
        "constant": {"type": "constant", "radiance": rgb_of(0.2, 0.5, 0.8)},
        "map": around,
        "map, turned": around | turned,
        "sunsky": {"type": "sunsky", "sun_direction": [0.3, 0.4, 0.8]},
        "sunsky, turned": {"type": "sunsky", "sun_direction": [0.1, 0.2, 0.9]} | turned,
        "timed sunsky": {"type": "timed_sunsky", "window_start_time": 11.0},
    }


def scene(**more):
    ball = {"type": "sphere", "bsdf": {"type": "diffuse"}}
    lamp = {"type": "point", "position": [3, 3, 3]}
    sensor = camera((0, 0, 5), up=(0, 1, 0), size=16)
    return {"type": "scene", "ball": ball, "lamp": lamp, "sensor": sensor} | more


def seen(given, heuristic, toward):
    """Return what a shader returns for normals (N, 3), and both scenes."""
    pair = halves.pair(Source("around", given), halves.PairOptions(heuristic=heuristic))
    half, physical = pair.heuristic.instantiate(), pair.physical.instantiate()
    si = dr.zeros(mi.SurfaceInteraction3f, len(toward))
    si.shape = half.shapes_dr()[0]
    integrator = half.integrator().known(half)
    ((material, _),) = integrator.materials.at(si, True)
    model = integrator.model_at(half, si)
    normal = mi.Vector3f(*toward.T.astype(np.float32))
    ambient = integrator.ambient_at(si, True)
    value = model(si.p, normal, normal, material, integrator.lights(half, si, True), ambient, None)
    return np.broadcast_to(np.array(value).T, toward.shape), half, physical


def evaluated(emitter, toward):
    """Return Mitsuba's own value at directions, rounded as a point rounds its normal."""
    si = dr.zeros(mi.SurfaceInteraction3f, len(toward))
    si.wi = -vectors.normalise(mi.Vector3f(*toward.T.astype(np.float32)))
    return np.broadcast_to(np.array(emitter.eval(si), float).reshape(3, -1).T, toward.shape)


def some_directions(count=10_000):
    toward = np.random.default_rng(3).normal(size=(count, 3))
    toward[:4] = [(1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1)]  # a map's poles have no azimuth
    return toward / np.linalg.norm(toward, axis=1, keepdims=True)


def interpolated(texels, toward):
    """Return the documented interpolation of a map at directions of its own frame, in double."""
    height, width, _ = texels.shape
    x = np.arctan2(toward[:, 0], -toward[:, 2]) / (2 * np.pi) * width - 0.5
    y = np.arccos(np.clip(toward[:, 1], -1, 1)) / np.pi * (height - 1)
    left, top = np.floor(x).astype(int), np.minimum(y.astype(int), height - 2)
    a, b = (x - left)[:, None], (y - top)[:, None]
    rows = [
        (1 - a) * texels[row, left % width] + a * texels[row, (left + 1) % width]
        for row in (top, top + 1)
    ]
    return (1 - b) * rows[0] + b * rows[1]


@pytest.mark.guarantee(
    "kernel", "A shader's environment is Mitsuba's at 10,000 directions to 1e-5."
)
def test_the_environment_is_mitsubas(rgb, written):
    toward = some_directions()
    for name, emitter in emitters().items():
        shown, _, physical = seen(scene(around=emitter), written(PYTHON), toward)
        assert named("mine.py").reads == ("environment", "normal")
        expected = evaluated(physical.environment(), toward)
        np.testing.assert_allclose(shown, expected, rtol=1e-5, atol=1e-5, err_msg=name)
        assert shown.min() >= 0
        assert shown.max() > 0.1
    local = toward @ np.array(mi.ScalarTransform4f().rotate([0.6, 0, 0.8], 77).matrix)[:3, :3]
    long = written(PYTHON.replace("point.normal", "3 * point.normal"), "long.py")
    shown, _, _ = seen(scene(around=emitters()["map, turned"]), long, toward)
    away = abs(local[:, 1]) < 0.999  # near the poles Mitsuba's angle loses half of its digits
    expected = 1.5 * interpolated(TEXELS, local)
    np.testing.assert_allclose(shown[away], expected[away], atol=1e-5)


@opengl
@pytest.mark.thorough
def test_the_environment_is_the_same_in_glsl(rgb, written):
    toward = some_directions()
    for name, emitter in emitters().items():
        shown, _, physical = seen(scene(around=emitter), written(GLSL, "mine.glsl"), toward)
        assert named("mine.glsl").reads == ("environment", "normal")
        expected = evaluated(physical.environment(), toward)
        if "sunsky" in name:  # documented: a map of it, in the world's frame
            at = background.directions(background.ROWS, 2 * background.ROWS)
            texels = evaluated(physical.environment(), at.reshape(-1, 3)).reshape(at.shape)
            near = abs(interpolated(texels, toward) - expected).max(axis=1)
            assert np.percentile(near, 90) < 0.01
            expected = interpolated(texels, toward)
        if "map" in name:
            turn = np.array(emitter["to_world"].matrix)[:3, :3] if "turned" in name else np.eye(3)
            expected = 1.5 * interpolated(TEXELS, toward @ turn)
        # OpenGL's angles; beside the sun a sky's texels differ most.
        atol = 1e-4 if "sunsky" in name else 1e-5
        np.testing.assert_allclose(shown, expected, rtol=1e-5, atol=atol, err_msg=name)


def test_without_an_environment_it_is_the_ambient_light(rgb, written):
    toward = some_directions(16)
    figure = {"type": "heuristic", "ambient": rgb_of(0.1, 0.2, 0.3)}
    textbook = {"ball": {"type": "sphere", "bsdf": {"type": "phong", "k_d": 0.5, "k_a": 0.5}}}
    for given, expected in (
        (scene(), (0, 0, 0)),
        (scene(integrator=figure, **textbook), (0.1, 0.2, 0.3)),
    ):
        for suffix, text in ((".py", PYTHON), (".glsl", GLSL)):
            shown, half, _ = seen(given, written(text, f"mine{suffix}"), toward)
            np.testing.assert_allclose(shown, np.broadcast_to(expected, shown.shape), atol=1e-7)
            prepared = np.array(background.environment(half, mi.Vector3f(0, 0, 1))).ravel()
            np.testing.assert_allclose(prepared, expected, atol=1e-7)


def test_the_sun_can_be_left_out_of_a_preparation(rgb):
    sky = {"type": "sunsky", "sun_direction": [0.3, 0.4, 0.8]}
    loaded = mi.load_dict(scene(around=sky))
    bare = mi.load_dict(sky | {"sun_scale": 0.0})
    toward = some_directions(1000)
    toward[0] = np.array([0.3, 0.4, 0.8]) / np.linalg.norm([0.3, 0.4, 0.8])
    vectors = mi.Vector3f(*(2 * toward.T).astype(np.float32))
    before = np.array(background.environment(loaded, vectors)).T
    without = np.array(background.environment(loaded, vectors, sun=False)).T
    np.testing.assert_array_equal(np.array(background.environment(loaded, vectors)).T, before)
    np.testing.assert_allclose(without, evaluated(bare, toward), rtol=1e-5, atol=1e-6)
    assert before[0].min() > 1e3 * without[0].max()


def test_a_spectral_scene_has_an_environment_for_each_ray_but_none_to_prepare(spectral, written):
    toward = some_directions(64)
    pair = halves.pair(
        Source("around", scene(around={"type": "constant", "radiance": 0.5})),
        halves.PairOptions(heuristic=written(PYTHON)),
    )
    half = pair.heuristic.instantiate()
    shown = np.array(mi.render(half, spp=16))
    assert shown[8, 8].min() > 0.3
    with pytest.raises(InputError, match="no colour in llvm_ad_spectral"):
        background.environment(half, mi.Vector3f(*toward.T.astype(np.float32)))


SLOW = """import time
import fotismos
import mitsuba as mi

def prepare(scene):
    time.sleep(0.5)
    return fotismos.environment(scene, mi.Vector3f(0, 0, 1))

def shade(point):
    return point.prepared * point.material.base_color
"""


@pytest.mark.thorough
def test_a_preparation_is_a_stage_of_its_own(rgb, written):
    """Its 0.5 s stand in the record, and in no pass."""
    name = written(SLOW)
    assert named(name).reads == ("material", "material.base_color")
    sky = scene(around={"type": "constant", "radiance": 0.5})
    case = open_case(sky, Options(heuristic=name, resolution=(24, 24), spp=16))
    found = compare(case.source, case.options)
    assert found.record.time.stages["preparation"] > 0.5
    assert found.record.metrics["rmse"].mean < 0.01


WRONG = {
    "fails": ("def prepare(scene):\n    return 1 / 0\n", r"^mine.py, line 2: ZeroDivisionError"),
    "variant": (
        "import mitsuba as mi\ndef prepare(scene): mi.set_variant('llvm_ad_mono')\n",
        r"^mine.py, line 2: heuristic mine.py switched Mitsuba to llvm_ad_mono",
    ),
    "no function": ("prepare = 3\n", r"'int' object is not callable"),
}


def test_a_mistake_in_a_preparation_is_named_by_its_line(rgb, written):
    for text, message in WRONG.values():
        with pytest.raises(InputError, match=f"(?s){message}"):
            named(written(text + "def shade(point): return point.ambient\n"))


TABLE = """import numpy as np

def prepare(scene):
    rows, columns = np.mgrid[0:8, 0:4]
    return np.stack([columns / 3, rows / 7, columns * rows / 21], axis=-1)
"""
READING = """uniform sampler2D ramp;  // ramp.py
vec3 shade(Point point) { return texture(ramp, (point.uv * vec2(3, 7) + 0.5) / vec2(4, 8)).rgb; }
"""


@opengl
@pytest.mark.thorough
def test_a_shader_in_glsl_has_a_table(rgb, written):
    """A bilinear table gives back the bilinear function (u, v, u v) that fills it."""
    written(TABLE, "ramp.py")
    heuristic = named(written(READING, "mine.glsl"))
    assert heuristic.digest() is None  # what the script reads is not known
    assert [path.name for path in heuristic.files] == ["mine.glsl", "ramp.py"]
    toward = some_directions(400)
    pair = halves.pair(
        Source("flat", scene(ball={"type": "rectangle"})), halves.PairOptions(heuristic="mine.glsl")
    )
    half = pair.heuristic.instantiate()
    integrator = half.integrator().known(half)
    si = dr.zeros(mi.SurfaceInteraction3f, len(toward))
    si.uv = mi.Point2f(*(toward.T[:2].astype(np.float32) / 2 + 0.5))
    ((material, _),) = integrator.materials.at(si, True)
    value = integrator.model_at(half, si)(si.p, si.p, si.p, material, [], 0, None)
    u, v = np.array(si.uv)
    np.testing.assert_allclose(np.array(value), [u, v, u * v], atol=2e-3)  # OpenGL's own weights
    written(TABLE.replace("columns / 3", "columns / 6"), "ramp.py")
    assert named("mine.glsl").code != heuristic.code
    for text, more, message in (
        ("def make(scene): return 1\n", "", r"ramp\.py: there is no function `prepare\(scene\)`"),
        ("def prepare(scene): return 1\n", "", r"array of shape \(\) for the table ramp"),
        ("def prepare(scene):\n    return 1 / 0\n", "", r"ramp\.py, line 2: ZeroDivisionError"),
        (TABLE, "uniform sampler2D two;  // ramp.py\n", "line 2: a shader has one table"),
        (TABLE, "uniform sampler2D two;\n", "line 2: a uniform is a parameter"),
    ):
        written(text, "ramp.py")
        with pytest.raises(InputError, match=message):
            named(written(READING.replace("vec3", f"{more}vec3", 1), "mine.glsl"))
