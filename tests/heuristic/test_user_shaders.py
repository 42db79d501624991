"""Heuristics in files of a user's: the same anywhere, and every mistake in words."""

import json
import re
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.heuristic import Range, user_shaders
from fotismos.heuristic.errors import FotismosError, InputError
from fotismos.heuristic.heuristics import HEURISTICS, Heuristic, Parameter, known_as, named
from fotismos.reference.pairing import halves
from fotismos.reference.scene.source import Source
from tests.shared import checks, oracle
from tests.shared.parts import camera, moved, rgb_of, shown_by
from tests.shared.wrong_shaders import SHADERS, SMALL, image, require_sizes


@pytest.fixture
def undeclared(monkeypatch):
    """What a test declares is forgotten after it."""
    monkeypatch.setattr(HEURISTICS, "added", {})


@pytest.mark.guarantee("kernel", "Phong's model in a Python file gives the kernel's image to 1e-5.")
def test_phong_in_a_file_is_phong():
    for scene, more in (
        ("fig-8-9", {"pairing": "literal"}),
        ("fig-8-11-n3", {"interpolation": "gouraud"}),
        ("fig-6-5-m40", {"interpolation": "flat"}),
        ("two-intensities", {}),
        ("cornell-box", {"everything": True}),
        ("narrow-band-lamp", {}),
    ):
        own, theirs = (image(scene, name, **more) for name in ("phong", str(SHADERS / "phong.py")))
        assert own.max() > 0.1
        np.testing.assert_allclose(theirs, own, rtol=1e-5, atol=1e-5, err_msg=f"{scene} {more}")


PAINT = {
    "type": "phong", "k_a": 0.2, "k_d": 0.5, "k_s": 0.4, "n": 9.0,
    "base_color": rgb_of(0.6, 0.3, 0.1), "alpha": 0.35, "ior": 1.6, "metallic": 0.25,
}  # fmt: skip


def angles(n, v, light):
    """Return the cosines of incidence and view, and the azimuth between light and view."""
    i, r = (np.sum(n * each, axis=1) for each in (light, v))
    flat = [oracle.unit(each - c[:, None] * n) for each, c in ((light, i), (v, r))]
    return i, r, np.sum(flat[0] * flat[1], axis=1)


def wrapped(n, v, light, wrap=0.5):
    return np.maximum((np.sum(n * light, axis=1) + wrap) / (1 + wrap), 0)[:, None]


def oren_nayar(n, v, light, sigma=0.5):
    """The published form, by angles."""
    i, r, cos_phi = angles(n, v, light)
    theta_i, theta_r = np.arccos(np.clip(i, -1, 1)), np.arccos(np.clip(r, -1, 1))
    alpha, beta = np.maximum(theta_i, theta_r), np.minimum(theta_i, theta_r)
    a = 1 - 0.5 * sigma**2 / (sigma**2 + 0.33)
    b = 0.45 * sigma**2 / (sigma**2 + 0.09)
    bright = np.maximum(cos_phi, 0) * np.sin(alpha) * np.tan(beta)
    return (np.maximum(i, 0) * (a + b * np.where(i > 0, bright, 0)))[:, None]


def ggx(n, v, light, a=0.35, ior=1.6, metallic=0.25):
    """Walter's distribution by the slope of the half vector, over the base colour."""
    base = np.array([0.6, 0.3, 0.1])
    h = oracle.unit(light + v)
    i, r, top, side = (np.sum(x * y, axis=1) for x, y in ((n, light), (n, v), (n, h), (h, v)))
    slope = 1 / top**2 - 1
    distribution = a**2 / (np.pi * top**4 * (a**2 + slope) ** 2)
    masking = [c / (c * (1 - a / 2) + a / 2) for c in (i, r)]
    f0 = (1 - metallic) * ((ior - 1) / (ior + 1)) ** 2 + metallic * base
    fresnel = f0 + (1 - f0) * ((1 - side) ** 5)[:, None]
    specular = (distribution * masking[0] * masking[1] / (4 * i * r))[:, None] * fresnel
    brdf = (1 - fresnel) * (1 - metallic) * base / np.pi + specular
    return np.where(i[:, None] > 0, np.pi * brdf * i[:, None], 0) / base


FORMULAS = {
    "wrapped": (wrapped, {"wrap": 0.8}),
    "oren_nayar": (oren_nayar, {"sigma": 0.9}),
    "cook_torrance": (ggx, {}),
}


POWER = """
import drjit as dr


def shade(point):
    light = point.lights[0]
    mirrored = 2 * dr.dot(point.normal, light.toward) * point.normal - light.toward
    cosine = dr.maximum(dr.dot(mirrored, point.view), {floor})
    return point.material.k_s * light.intensity * dr.power(cosine, point.material.n)
"""


@pytest.mark.parametrize("floor", [0, 1e-6])
def test_a_power_that_is_nan_for_an_exponent_of_0_is_a_remark(rgb, tmp_path, floor):
    path = tmp_path / "mine.py"
    path.write_text(POWER.format(floor=floor))
    remarks = named(str(path)).remarks
    assert len(remarks) == (floor == 0)
    assert all(re.search(r"mine: it is NaN at \d+ of 256 points .* n = 0", one) for one in remarks)


def test_a_power_of_what_is_negative_is_refused(rgb, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(POWER.format(floor=-1))
    with pytest.raises(InputError, match="the bases of powers above 0"):
        named(str(path))


def test_a_shader_of_the_documentation_is_its_formula(rgb):
    for name, (formula, parameters) in FORMULAS.items():
        given = checks.with_film(
            shown_by(SHADERS / f"{name}.py", PAINT, ambient=0.1, **parameters), 48, 1
        )
        aovs = {"type": "aov", "aovs": "P:position,N:sh_normal", "image": given["integrator"]}
        channels = checks.render(given, 1, 5, aovs).reshape(-1, 9).astype(float)
        colour, p, n = np.split(channels, 3, axis=1)
        hit = np.any(n != 0, axis=1)
        colour, p, n = colour[hit], p[hit], oracle.unit(n[hit])
        _, lights, ambient, viewer = checks.described(given)
        v = oracle.unit(viewer - p)
        base = np.array([0.6, 0.3, 0.1])
        expected = np.zeros_like(colour) + ambient * base
        for light in lights:
            toward, factor, _ = light.arriving(p)
            expected += (
                base * light.intensity * factor[:, None] * formula(n, v, toward, **parameters)
            )
        edge = np.sum(n * v, axis=1) < 0.02  # where the shaders bound their divisors
        assert edge.mean() < 0.05
        assert expected.std() > 0.03
        oracle.require_close(colour, expected, absolute=2e-5, where=~edge)


PARTNERS = {
    "diffuse": ({"type": "diffuse", "reflectance": rgb_of(0.1, 0.2, 0.3)},
                (0.1, 0.2, 0.3), 1, 1, 0),
    "roughplastic": ({"type": "roughplastic", "alpha": 0.3, "int_ior": 1.8, "ext_ior": 1.2,
                      "diffuse_reflectance": 0.4}, 0.4, 0.3, 1.5, 0),
    "plastic": ({"type": "plastic", "int_ior": 1.7, "ext_ior": 1.0}, 0.5, 1e-4, 1.7, 0),
    "principled": ({"type": "principled", "base_color": rgb_of(0.7, 0.5, 0.2),
                    "roughness": 0.6, "metallic": 0.25, "eta": 1.4},
                   (0.7, 0.5, 0.2), 0.36, 1.4, 0.25),
    "mirror": ({"type": "conductor", "material": "none"}, 1, 1e-4, 1, 1),
    "rough mirror": ({"type": "roughconductor", "material": "none", "alpha": 0.2,
                      "specular_reflectance": 0.5}, None, 0.2, 1, 1),
    "twosided": ({"type": "twosided", "bsdf": {"type": "roughplastic", "alpha": 0.25,
                  "int_ior": 1.5, "ext_ior": 1.0}}, 0.5, 0.25, 1.5, 0),
    "blend": ({"type": "blendbsdf", "weight": 0.25,
               "a": {"type": "diffuse", "reflectance": 0.2},
               "b": {"type": "principled", "base_color": 0.6, "metallic": 1.0, "eta": 1.5}},
              0.3, 0.75 + 0.25 * 0.25, 0.75 + 0.25 * 1.5, 0.25),
    "matte phong": ({"type": "phong", "k_d": 0.6}, 0.6, 1, 1, 0),
}  # fmt: skip


def test_the_partners_parameters_are_the_physical_ones(rgb, written):
    names = ("base_color", "alpha", "ior", "metallic")
    written("import mitsuba as mi\n" + "".join(
        f"def {one}(point): return mi.Spectrum(point.material.{one})\n" for one in names
    ))  # fmt: skip
    for name, (given, *expected) in PARTNERS.items():
        scene = {
            "type": "scene",
            "floor": {"type": "rectangle", "bsdf": given},
            "light": {"type": "point", "position": [0, 0, 3]},
            "sensor": camera((0, 0, 2), up=(0, 1, 0), size=4, type="orthographic"),
        }
        for one, value in zip(names, expected, strict=True):
            if value is not None:
                half = halves.pair(
                    Source(name, scene), halves.PairOptions(heuristic=f"mine.py:{one}")
                ).heuristic
                shown = np.array(mi.render(half.instantiate(), spp=1))
                oracle.require_close(shown.reshape(-1, 3), np.broadcast_to(value, (16, 3)), 2e-3)


def test_a_light_has_the_size_of_its_lamp(rgb, written):
    require_sizes(written(
        "import drjit as dr, mitsuba as mi\ndef shade(point):\n"
        "    light = point.lights[0]; size = light.extent\n"
        "    first = size.radius + 10 * dr.norm(size.v)\n"
        "    return mi.Color3f(first, dr.abs(size.u.x), light.distance)\n"
    ))  # fmt: skip


@pytest.mark.thorough
def test_a_representative_point_is_nearer_to_a_lamps_highlight():
    file, found = SHADERS / "representative_point.py", []
    for name in (f"{file}", f"{file}:center"):
        asked = Options(heuristic=name, resolution=(96, 64), spp=64)
        case = open_case(str(file), asked)
        found.append(compare(case.source, case.options).record.metrics)
    nearer, without = ([one[name].mean for name in ("dE2000", "rmse")] for one in found)
    assert nearer[0] < 0.95 * without[0]
    assert nearer[1] < without[1] / 2


MISTAKES = {
    "branch": (
        "import drjit as dr\n"
        "def shade(point):\n"
        "    cosine = dr.dot(point.normal, point.lights[0].toward)\n"
        "    if cosine > 0:\n        return cosine\n    return 0\n",
        r"^mine.py, line 4: RuntimeError.*All points are shaded at once.*drjit.select",
    ),
    "not finite": (
        "def shade(point): return point.ambient / 0\n",
        r"^mine.py, line 1: .* returned \(inf, inf, inf\) on trial, .*components must be finite",
    ),
    "negative": (
        "import drjit as dr\n"
        "def shade(point): return dr.dot(point.normal, point.lights[1].toward)\n",
        r"^mine.py, line 2: .* components must be 0 or more.*drjit.maximum\(cosine",
    ),
    "shape": (
        "def shade(point): return (1, 2, 3)\n",
        r"^mine.py, line 1: .* returned a value of type tuple of 3; return one colour per point",
    ),
    "too few points": (
        "import mitsuba as mi\ndef shade(point): return mi.Float([1, 2, 3])\n",
        r"^mine.py, line 2: .* returned 3 values for 256 points",
    ),
    "an attribute": (
        "def shade(point):\n    return point.normals.x\n",
        r"^mine.py, line 2: AttributeError: 'Point' .*'normals' \(did you mean normal\?\)",
    ),
    "raises": (
        "def shade(point):\n    return helper(point)\n\n\n"
        "def helper(point):\n    raise ValueError('no idea')\n",
        r"^mine.py, line 6: ValueError: no idea",
    ),
    "syntax": ("def shade(point)\n    return 1\n", r"^mine.py, line 1: SyntaxError: expected ':'"),
    "exit": ("import sys\nsys.exit(3)\n", r"^mine.py, line 2: SystemExit: 3"),
    "no function": (
        "def shadow(point): return 1\n",
        r"no function `shade` \(did you mean shadow\?\)\. It has shadow: give mine.py:shadow",
    ),
    "a name in a signature": (
        "def shade(point, gloss: 'Gloss' = 1.0): return gloss\n",
        r"^mine.py, line 1: its signature cannot be read: name 'Gloss' is not defined",
    ),
    "no default": (
        "def shade(point, gloss): return gloss\n",
        r"^mine.py, line 1: 'gloss' has no number as its default.*gloss: Range\(0, 1\) = 0.5",
    ),
    "bounds": (
        "from fotismos.heuristic import Range\n"
        "def shade(point, gloss: Range(0, 1) = 2): return gloss\n",
        r"^mine.py, line 2: gloss = 2.0 is not allowed: give a value from 0 to 1",
    ),
    "writes to the material": (
        "def shade(point):\n    point.material.k_d = 3\n    return 1\n",
        r"^mine.py, line 2: FrozenInstanceError: cannot assign to field 'k_d'",
    ),
}  # fmt: skip


@pytest.mark.guarantee(
    "runs", "A mistake in your heuristic is one message with file, line and remedy."
)
def test_a_mistake_is_named_with_file_and_line(rgb, written):
    for text, message in MISTAKES.values():
        with pytest.raises(InputError, match=f"(?s){message}"):
            named(written(text))
    with pytest.raises(InputError, match=r"^none.py: there is no such file. Give a Python file"):
        named("none.py")


@pytest.mark.parametrize("name", ["round.py", "round.glsl"])
def test_a_link_that_goes_round_is_no_file(rgb, tmp_path, name):
    (tmp_path / name).symlink_to(name)
    with pytest.raises(InputError, match="there is no such file"):
        named(str(tmp_path / name))


def test_values_that_only_a_scene_shows_name_pixel_and_file(rgb, written):
    scene = {
        "type": "scene",
        "floor": {"type": "rectangle", "to_world": moved(0, 40), "bsdf": {"type": "diffuse"}},
        "light": {"type": "constant"},
        "sensor": camera((0, 0, 30), up=(0, 1, 0)),
    }
    for value, kind in (("-1", "negative"), ("dr.nan", "NaN or infinite")):
        name = written(
            "import drjit as dr\ndef shade(point):\n"
            f"    return dr.select(dr.abs(point.position.x) > 6, {value}, point.ambient)\n"
        )
        with pytest.raises(FotismosError, match=rf"\(mine.py\).* pixels are {kind}, the first at"):
            image(scene, name)


def record_of(folder):
    (path,) = folder.glob("*/comparison.json")
    return json.loads(path.read_text(encoding="utf-8"))


READING = {
    "a file": "from pathlib import Path\nlevel = float(Path('level').read_text())",
    "environment": "import os\nlevel = float(os.environ['LEVEL'])",
    "import": "import importlib\nlevel = importlib.import_module('level_module').LEVEL",
    "late": "def level_of():\n    with open('level') as f:\n        return float(f.read())",
}


@pytest.mark.guarantee("runs", "No result of a Python shader is reused, whatever it reads.")
@pytest.mark.parametrize(
    "way",
    [pytest.param(way, marks=() if way == "a file" else pytest.mark.thorough) for way in READING],
)
def test_a_shader_that_reads_something_is_rendered_again(way, rgb, run, written, monkeypatch):
    level = "level_of()" if way == "late" else "level"
    name = written(f"{READING[way]}\ndef shade(point): return point.ambient * 0 + {level}\n")
    words = ("compare", "lambert-sphere", "--heuristic", name, "--resolution", "8x8", "--spp", 4)
    means = []
    for text in ("0.25", "0.75"):
        written(text, "level")
        written(f"LEVEL = {text}\n", "level_module.py")
        monkeypatch.setenv("LEVEL", text)
        user_shaders.forget()  # as in a new process
        code, _, messages = run(*words, "-o", "out")
        assert (code, messages) == (0, "")
        means.append(record_of(Path("out"))["metrics"]["rmse"]["mean"])
    assert means[0] != means[1]


@pytest.mark.parametrize(
    "variant", ["llvm_ad_spectral", pytest.param("scalar_rgb", marks=pytest.mark.thorough)]
)
def test_a_shader_does_not_change_the_variant(rgb, run, written, variant):
    switch = f"import mitsuba as mi\nmi.set_variant('{variant}')\n"
    words = ("compare", "lambert-sphere", "--resolution", "8x8", "--spp", 4, "-o", "out")
    for options in ((), ("--variant", "llvm_ad_rgb")):
        name = written(f"{switch}def shade(point): return point.ambient\n")
        assert run(*words, "--heuristic", name, *options)[0] == 0
        assert record_of(Path("out"))["variant"] == "llvm_ad_rgb"
    inside = f"import mitsuba as mi\ndef shade(point):\n    mi.set_variant('{variant}')\n"
    name = written(f"{inside}    return 1.0\n", "inside.py")
    code, _, messages = run(*words, "--heuristic", name)
    assert code == 2
    assert f"inside.py switched Mitsuba to {variant}, but the comparison is in" in messages
    assert mi.variant() == "llvm_ad_rgb"


@pytest.mark.thorough
def test_a_shader_does_not_change_how_numpy_handles_errors(rgb, run, written):
    before = np.geterr()
    raising = "import numpy as np\nnp.seterr(all='raise')\n"
    name = written(
        f"{raising}def shade(point):\n    np.seterr(all='raise')\n    return point.ambient\n"
    )
    words = ("compare", "fig-8-9", "--resolution", "8x8", "--spp", 4, "-o", "out")
    assert run(*words, "--heuristic", name)[0] == 0
    assert np.geterr() == before


def test_an_object_in_a_file_keeps_its_declaration(rgb, written):
    name = written(
        "from fotismos.heuristic import Heuristic, Parameter\n"
        "def glow(point): return point.parameters.level\n"
        "mine = Heuristic('x', glow, 'A glow', {'uv'}, (Parameter('level', 0.5, 0, 1),))\n"
    )
    found = named(f"{name}:mine")
    assert (found.name, found.label, found.needs) == (f"{name}:mine", "A glow", {"uv"})
    assert image("fig-8-9", f"{name}:mine").max() == pytest.approx(0.5)


@pytest.mark.thorough
def test_the_plan_and_the_record_say_what_is_read(run, written, tmp_path):
    name = written("def shade(point): return point.material.k_d * point.ambient\n")
    words = ("fig-8-9", "--heuristic", name, "--resolution", "8x8")
    code, said, _ = run("plan", *words)
    assert code == 0
    assert f"{name}, which reads ambient, material, material.k_d" in said
    assert run("compare", *words, "--spp", 4, "-o", "out")[0] == 0
    record = record_of(tmp_path / "out")
    assert record["heuristic"] == name
    assert record["plan"]["heuristic_reads"] == ["ambient", "material", "material.k_d"]
    code, said, _ = run("plan", "fig-8-9")
    assert "phong, which reads ambient, lights, material, normal, position, view" in said


@pytest.mark.thorough
def test_a_program_gives_a_function_or_an_object(undeclared):
    from fotismos.reports.notebook import compare

    def half_lambert(point, gain: Range(0, 2) = 1):
        """A wrapped cosine, squared."""
        import drjit as dr

        cosines = [dr.dot(point.normal, light.toward) / 2 + 0.5 for light in point.lights]
        return sum(c * c for c in cosines) * gain * point.material.base_color

    shown = compare("fig-8-9", heuristic=half_lambert, why=False, **SMALL).comparison
    assert shown.record.heuristic == "half-lambert"
    assert shown.images.heuristic.max() > 0.1
    flat = Heuristic("flat-grey", lambda point: 0.5, parameters=(Parameter("x", 0, 0, 1),))
    shown = compare("fig-8-9", heuristic=flat, why=False, **SMALL).comparison
    assert shown.images.heuristic.max() == 0.5
    assert known_as("blinn") == "blinn"
