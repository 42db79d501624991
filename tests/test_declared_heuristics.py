"""Heuristics declared from outside the package: shading, records, parameters, messages."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from comparisons.cost.ladder import Distinct, shaded_by
from comparisons.cost.rungs import DIRECT, FULL_PLAN, KERNELS
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options
from heuristic import Material, heuristics, meshes, shading
from heuristic.errors import InputError
from heuristic.heuristics import BLINN, HEURISTICS, PHONG, Heuristic, Parameter, declare, named
from heuristic.interpolation import Interpolation
from heuristic.mesh_shading import shading_points
from heuristic.plugins import integrator
from heuristic.points import Point
from reference.pairing import halves
from reference.rendering.renderer import Renderer
from reports.run.kept import key_of
from tests import checks, oracle


def toon(point):
    """Lambert's cosine in steps, and a black outline."""
    steps = point.parameters.steps
    value = point.ambient * point.material.k_a
    for light in point.lights:
        cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
        value += point.material.k_d * light.intensity * dr.ceil(cosine * steps) / steps
    return dr.select(dr.dot(point.normal, point.view) < point.parameters.outline, 0, value)


def wrapped(point):
    """Lambert's law, and the first light reaches beyond its horizon."""
    key, *others = point.lights
    wrap = point.parameters.wrap
    cosine = dr.maximum((dr.dot(point.normal, key.toward) + wrap) / (1 + wrap), 0)
    value = point.material.k_d * key.intensity * cosine
    for light in others:
        cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
        value += point.material.k_d * light.intensity * cosine
    return value


def shadowed(point):
    (light,) = point.lights
    return dr.select(light.visible(), light.intensity, 0.125)


def scaled(point):
    """What was prepared, as a colour."""
    return mi.Spectrum(point.prepared)


PREPARED = []


def prepare(scene):
    PREPARED.append(len(scene.shapes()))
    return float(len(scene.shapes()))


DECLARED = {
    "toon": Heuristic(
        "toon",
        toon,
        "Toon",
        parameters=(Parameter("steps", 3, 1, 8), Parameter("outline", 0.25, 0, 1)),
    ),
    "wrapped": Heuristic("wrapped", wrapped, parameters=(Parameter("wrap", 0.5, 0, 1),)),
    "shadowed": Heuristic("shadowed", shadowed, needs={"lights", "visible"}),
    "scaled": Heuristic("scaled", scaled, prepare=prepare),
}


@pytest.fixture
def declared(monkeypatch):
    """The toys are known while a test runs."""
    monkeypatch.setattr(HEURISTICS, "_others", {})
    for heuristic in DECLARED.values():
        declare(heuristic)


def rgb_of(*value):
    return {"type": "rgb", "value": list(value)}


def scene(model="phong", **integrator):
    """A sphere under two coloured lights, whose order can be told."""
    builtin = SCENES["fig-8-9"].make()
    bsdf = {"type": "phong", "k_a": 0.2, "k_d": rgb_of(0.5, 0.4, 0.1), "k_s": 0.4, "n": 9}
    lights = {
        "light1": {
            "type": "heuristic_point",
            "position": [-4, -2, 3],
            "intensity": rgb_of(1, 0.5, 0.25),
        },
        "light2": {
            "type": "heuristic_directional",
            "direction": [-1, 2, -1],
            "intensity": rgb_of(0.2, 0.4, 0.6),
        },
    }
    camera = {name: builtin[name] for name in ("type", "sensor")}
    sphere = builtin["sphere"] | {"bsdf": bsdf}
    chosen = {"type": "heuristic", "model": model, "ambient": 0.5, **integrator}
    return camera | {"sphere": sphere, "integrator": chosen} | lights


def toon_expected(p, n, v, material, lights, ambient, steps=3.0, outline=0.25):
    """The toy in NumPy, and where a rounding step decides."""
    value = np.zeros((len(p), 3)) + ambient * material.k_a
    edge = abs(np.sum(n * v, axis=1) - outline) < 1e-5
    for light in lights:
        toward, factor, _ = light.arriving(p)
        cosine = np.maximum(np.sum(n * toward, axis=1), 0)
        edge |= abs(cosine * steps - np.round(cosine * steps)) < 1e-5 * steps
        edge &= (cosine > 0) | (abs(np.sum(n * v, axis=1) - outline) < 1e-5)
        step = np.ceil(cosine * steps) / steps * factor
        value += np.array(material.k_d) * light.intensity * step[:, None]
    value[np.sum(n * v, axis=1) < outline] = 0
    return value, edge


def wrapped_expected(p, n, v, material, lights, ambient, wrap=0.5):
    value = np.zeros((len(p), 3))
    for light, wraps in zip(lights, (wrap, 0.0), strict=True):
        toward, factor, _ = light.arriving(p)
        cosine = np.maximum((np.sum(n * toward, axis=1) + wraps) / (1 + wraps), 0)
        value += np.array(material.k_d) * light.intensity * (cosine * factor)[:, None]
    return value, np.zeros(len(p), bool)


EXPECTED = {"toon": toon_expected, "wrapped": wrapped_expected}


def check(name, **parameters):
    """Compare a toy, rendered by Mitsuba, with NumPy at the positions that it shaded."""
    given = checks.with_film(scene(name, **parameters), 64, 1)
    aovs = {"type": "aov", "aovs": "P:position,N:sh_normal", "image": given["integrator"]}
    channels = checks.render(given, 1, 5, aovs)
    colour, p, n = np.split(channels.reshape(-1, 9), 3, axis=1)
    hit = np.any(n != 0, axis=1)
    assert 0.2 < hit.mean() < 1
    assert not colour[~hit].any()
    material, lights, ambient, viewer = checks.described(given)
    v = oracle.unit(viewer - p[hit])
    expected, edge = EXPECTED[name](
        p[hit], oracle.unit(n[hit]), v, material, lights, ambient, **parameters
    )
    assert edge.mean() < 0.01
    assert expected.std() > 0.03
    oracle.require_close(colour[hit], expected, absolute=3e-6, where=~edge)


@pytest.mark.parametrize("name", ["toon", "wrapped"])
def test_a_heuristic_from_outside_is_rendered_as_it_says(rgb, declared, name):
    check(name)


@pytest.mark.parametrize(
    ("name", "parameters"), [("toon", {"steps": 5.0, "outline": 0.0}), ("wrapped", {"wrap": 1.0})]
)
def test_parameters_are_those_of_the_integrator(rgb, declared, name, parameters):
    check(name, **parameters)


@pytest.mark.parametrize("name", ["wrapped"])
def test_a_wrong_order_of_lights_is_found_out(rgb, declared, monkeypatch, name):
    right = Point.lights.func
    monkeypatch.setattr(Point, "lights", property(lambda point: right(point)[::-1]))
    with pytest.raises(AssertionError, match="values are off"):
        check(name)


@pytest.mark.parametrize("name", ["toon", "wrapped"])
def test_swapped_intensities_are_found_out(rgb, declared, monkeypatch, name):
    right = Point.lights.func

    def wrong(point):
        lights = right(point)
        return tuple(
            replace(light, intensity=lights[place - 1].intensity)
            for place, light in enumerate(lights)
        )

    monkeypatch.setattr(Point, "lights", property(wrong))
    with pytest.raises(AssertionError, match="values are off"):
        check(name)


# --- The built-in ones ---------------------------------------------------------------------------


def kernels(loaded):
    """Return the image of a scene, and the hashes of the kernels that made it."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        image = np.array(mi.render(loaded, spp=4, seed=3))
        return image, [kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel]


@pytest.mark.parametrize("interpolation", ["phong", "gouraud", "flat"])
def test_phong_is_the_kernel_itself(rgb, monkeypatch, interpolation):
    """The declaration leaves no instruction behind: a bare call of the kernel has the same hash."""
    given = checks.with_film(scene(interpolation=interpolation), 32, 4)
    if interpolation != "phong":
        mesh = meshes.to_mesh(mi.load_dict(given["sphere"]), 4)
        given = {name: value for name, value in given.items() if name != "sphere"} | {"mesh": mesh}
    loaded = mi.load_dict(given, optimize=False)
    image, hashes = kernels(loaded)
    monkeypatch.setattr(Heuristic, "evaluate", lambda self, given, *_: shading.shade(*given))
    bare, bare_hashes = kernels(loaded)
    np.testing.assert_array_equal(image, bare)
    assert image.max() > 0.1
    assert hashes == bare_hashes != []


def with_form(form, model, normalised=False):
    """Two spheres of different forms, or of the same, so that materials are read by a switch."""
    given = scene(model)
    lobe = {"form": form, "normalised": normalised}
    bsdf = given["sphere"]["bsdf"] | lobe
    plain = given["sphere"]["bsdf"] | {"n": 4, "form": "blinn", "normalised": True}
    transform = mi.ScalarTransform4f().translate([1, 0, 0.5]).scale(0.4)
    small = {"type": "sphere", "to_world": transform, "bsdf": plain}
    return given | {"sphere": given["sphere"] | {"bsdf": bsdf}, "small": small}


@pytest.mark.parametrize("normalised", [False, True])
@pytest.mark.parametrize("alone", [False, True])
def test_blinn_is_the_blinn_lobe_whatever_the_material_says(rgb, alone, normalised):
    found, expected, other = (
        with_form(form, model, normalised)
        for form, model in (("phong", "blinn"), ("blinn", "phong"), ("phong", "phong"))
    )
    if alone:
        for given in (found, expected, other):
            del given["small"]
    found, expected, other = (
        checks.render(checks.with_film(given, 48, 4), 4, 1) for given in (found, expected, other)
    )
    np.testing.assert_array_equal(found, expected)
    assert abs(found - other).max() > 0.05


# --- What a declaration owns ----------------------------------------------------------------------


@pytest.mark.parametrize("interpolation", [Interpolation.FLAT, Interpolation.GOURAUD])
def test_vertices_and_faces_are_shaded_by_the_heuristic(rgb, declared, interpolation):
    given = checks.with_film(scene("wrapped", interpolation=interpolation.value), 16, 1)
    sphere = given.pop("sphere")
    given["mesh"] = meshes.to_mesh(mi.load_dict(sphere), 4)
    loaded = mi.load_dict(given, optimize=False)
    assert np.array(mi.render(loaded, spp=1)).max() > 0.1
    (mesh,) = loaded.shapes()
    at = shading_points(mesh, interpolation)
    name = "face_heuristic" if interpolation is Interpolation.FLAT else "vertex_heuristic"
    stored = np.array(mesh.attribute_buffer(name)).reshape(-1, 3)
    material, lights, ambient, viewer = checks.described(given | {"sphere": sphere})
    p, n = np.array(at.p, float).T, np.array(at.n, float).T
    expected, _ = wrapped_expected(p, n, viewer - p, material, lights, ambient)
    oracle.require_close(stored, expected, absolute=3e-6)


def test_a_spectral_variant_shades_at_the_corners(spectral, declared):
    given = checks.with_film(scene("wrapped", interpolation="gouraud"), 16, 4)
    given["mesh"] = meshes.to_mesh(mi.load_dict(given.pop("sphere")), 4)
    assert checks.render(given, 4, 1).max() > 0.1


def test_what_is_prepared_is_prepared_once_for_a_scene(rgb, declared):
    PREPARED.clear()
    given = checks.with_film(scene("scaled"), 8, 1)
    first = mi.load_dict(given, optimize=False)
    for seed in range(3):
        assert np.array(mi.render(first, spp=1, seed=seed)).max() == 1
    assert PREPARED == [1]
    second = mi.load_dict(given | {"ball": {"type": "sphere", "bsdf": given["sphere"]["bsdf"]}})
    assert np.array(mi.render(second, integrator=first.integrator(), spp=1)).max() == 2
    assert PREPARED == [1, 2]


def test_the_materials_of_a_scene_are_found_once(rgb, monkeypatch):
    """What is clear, two-sided and mapped is asked for in turn, layer by layer."""
    found = []

    class Counted(integrator.SceneMaterials):
        def __init__(self, scene, *options):
            found.append(scene.shapes()[0])
            super().__init__(scene, *options)

    monkeypatch.setattr(integrator, "SceneMaterials", Counted)
    glass = {"type": "phong", "k_d": 0.2, "transmittance": 0.5, "twosided": True}
    given = checks.with_film(scene("phong"), 8, 1)
    given["pane"] = {"type": "rectangle", "bsdf": glass}
    made = mi.load_dict(given)
    for seed in range(2):
        mi.render(made, spp=1, seed=seed)
    assert len(found) == 1
    other = mi.load_dict(given)
    mi.render(other, integrator=made.integrator(), spp=1)
    assert len(found) == 2


def test_shadow_rays_are_cast_where_they_are_needed(rgb, declared):
    """Half of a floor is behind a wall, seen from the light."""
    bsdf = {"type": "phong", "k_d": 0.5}
    up = mi.ScalarTransform4f()
    given = {
        "type": "scene",
        "integrator": {"type": "heuristic", "model": "shadowed"},
        "floor": {"type": "rectangle", "bsdf": bsdf},
        "roof": {
            "type": "rectangle",
            "to_world": up.translate([1, 0, 1]).rotate([0, 1, 0], 180),
            "bsdf": bsdf,
        },
        "light": {"type": "heuristic_directional", "direction": [0, 0, -1], "intensity": 0.75},
        "sensor": {
            "type": "orthographic",
            "to_world": up.look_at([0, 0, 0.5], [0, 0, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}},
        },
    }
    image = np.array(mi.render(mi.load_dict(given), spp=1))
    assert sorted(set(np.unique(image))) == [0.125, 0.75]
    # One that casts none itself is hidden by the integrator, where that is asked for.
    given["integrator"] = {"type": "heuristic", "model": "wrapped", "occlusion": True, "wrap": 0.0}
    image = np.array(mi.render(mi.load_dict(given), spp=1))
    assert sorted(set(np.unique(image))) == [0.0, 0.375]


@pytest.mark.parametrize(
    ("shade", "missing"),
    [(lambda point: point.uv.x, "uv"), (lambda point: point.lights[0].visible(), "visible")],
)
def test_what_is_not_declared_to_be_needed_cannot_be_read(rgb, declared, shade, missing):
    declare(Heuristic("hasty", shade, needs={"position", "lights"}))
    loaded = mi.load_dict(checks.with_film(scene("hasty"), 8, 1), optimize=False)
    with pytest.raises(InputError, match=f"'{missing}' is read, but not declared"):
        Renderer(loaded, None, 1, "image").render(0)


def test_the_material_is_that_of_a_plain_lobe(rgb):
    given = heuristics.Given(0, 0, 0, Material(k_s=0.5, n=10, normalised=True), [])
    point = Point(frozenset({"material"}), given, None, SimpleNamespace())
    assert (point.material.k_s, point.material.normalised) == (3.0, False)


def test_parameters_can_be_edited_without_a_new_kernel(rgb, declared):
    loaded = mi.load_dict(checks.with_film(scene("wrapped"), 8, 1), optimize=False)
    parameters = mi.traverse(loaded)
    images, hashes = [], []
    for value in (0.25, 0.75):
        parameters["integrator.wrap"] = value
        parameters.update()
        image, found = kernels(loaded)
        images.append(image)
        hashes.append(found)
    assert abs(images[0] - images[1]).max() > 0.01
    assert hashes[0] == hashes[1]


# --- Messages ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["fong", ""])
def test_an_unknown_name_lists_what_there_is(name):
    with pytest.raises(InputError, match=r"not declared: choose one of .*blinn, .*phong"):
        Options(heuristic=name)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Heuristic("My toon", toon), "'My toon': a name has lower-case"),
        (lambda: Heuristic("a", toon, needs={"depth"}), "needs depth: choose from position"),
        (lambda: Heuristic("a", toon, form="ward"), "'ward' is not known"),
        (lambda: Heuristic("a", toon, parameters=(Parameter("x", 1, 0, 1),) * 2), "of one name"),
        (lambda: Parameter("ambient", 0, 0, 1), "'ambient' is not allowed"),
        (lambda: Parameter("two words", 0, 0, 1), "'two words' is not allowed"),
        (lambda: Parameter("x", 2, 0, 1), "x = 2 is not allowed: give a value from 0 to 1"),
        (lambda: declare(Heuristic("phong", toon)), "'phong' is already declared"),
    ],
)
def test_a_wrong_declaration_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize("value", [1.5, -0.1, float("nan")])
def test_a_parameter_out_of_bounds_is_refused(rgb, declared, value):
    with pytest.raises(Exception, match=r"wrap = .* is not allowed: give a value from 0 to 1"):
        mi.load_dict({"type": "heuristic", "model": "wrapped", "wrap": value})


def test_a_package_declares_its_own_by_an_entry_point(declared, monkeypatch):
    here = __name__.rpartition(".")[2]
    entries = [SimpleNamespace(name="late", value=f"{here}:LATE", load=lambda: late)]
    late = Heuristic("late", toon)
    monkeypatch.setattr("heuristic.declared.entry_points", lambda group: entries)
    monkeypatch.setattr(HEURISTICS, "_loaded", False)
    assert named("late") is late
    entries[0].load = lambda: 1 / 0
    monkeypatch.setattr(HEURISTICS, "_loaded", False)
    with pytest.raises(InputError, match=r"late: the entry point .*division by zero"):
        named("other")


# --- Along the way to the page --------------------------------------------------------------------


def test_the_record_the_page_and_the_terminal_name_it(run, declared, tmp_path, scene_file):
    words = ("compare", scene_file, "--spp", 4, "--heuristic", "toon")
    code, said, _ = run(*words, "-o", tmp_path / "out")
    assert code == 0
    (path,) = (tmp_path / "out").glob("*/comparison.json")
    record = json.loads(path.read_text(encoding="utf-8"))
    assert record["heuristic"] == "toon"
    assert "--heuristic toon" in record["command"]
    assert "heuristic toon" in said
    page = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    assert "Shaded by the heuristic <strong>toon</strong>" in page


def test_the_command_refuses_an_unknown_one(run, tmp_path):
    code, _, said = run("compare", "fig-8-9", "--heuristic", "fong", "-o", tmp_path / "out")
    assert code == 2
    words = " ".join(said.split())
    assert re.search(r"'fong' is not declared: choose one of .*blinn, .*phong", words)


def test_its_picture_is_another_one_than_that_of_phong(rgb, declared):
    from comparisons.compare import prepare

    source = SCENES["fig-8-9"].source()
    images = {
        name: np.array(
            prepare(source, Options(resolution=(24, 24), spp=4, heuristic=name)).heuristic.render(0)
        )
        for name in ("phong", "blinn", "toon")
    }
    assert abs(images["phong"] - images["toon"]).max() > 0.05
    assert abs(images["phong"] - images["blinn"]).max() > 0.05


def test_finished_results_are_those_of_one_heuristic_and_its_code(rgb, declared, monkeypatch):
    source = SCENES["fig-8-9"].source()
    keys = [key_of(source, Options(heuristic=h), "v", {}) for h in ("phong", "toon", "toon")]
    monkeypatch.setattr(Heuristic, "digest", lambda self: "edited")
    keys.append(key_of(source, Options(heuristic="toon"), "v", {}))
    assert keys[1] == keys[2]
    assert len(set(keys)) == 3


def test_rungs_of_the_kernel_say_its_label(declared):
    kernel = Distinct((KERNELS[2], KERNELS[3]), KERNELS[2].method, False)
    assert shaded_by(PHONG, kernel) is kernel
    assert shaded_by(BLINN, kernel).name == "Phong kernel: Blinn"
    full = Distinct((DIRECT, FULL_PLAN), FULL_PLAN.method, True)
    assert shaded_by(DECLARED["toon"], full) is full


def test_a_fit_refuses_other_heuristics(run):
    code, _, said = run("fit", "fig-8-9", "--heuristic", "blinn")
    assert code == 2
    assert "heuristic blinn cannot be fitted" in " ".join(said.split())


def test_a_pair_says_what_its_heuristic_shades_with(rgb, declared):
    """The corners between the halves have the same lobe and the same shadows."""
    source = SCENES["fig-8-9"].source()
    props = {}
    for name in ("phong", "blinn", "shadowed"):
        graph = halves.pair(source, heuristic=name).heuristic
        (sphere,) = (index for index in graph.nodes(halves.BSDF) if graph.plugin(index) == "phong")
        integrator = graph.props(graph.nodes(halves.INTEGRATOR)[0])
        props[name] = graph.props(sphere).get("form", "phong"), integrator["occlusion"]
    assert props == {
        "phong": ("phong", False),
        "blinn": ("blinn", False),
        "shadowed": ("phong", True),
    }
