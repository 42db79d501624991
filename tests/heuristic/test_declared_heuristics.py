"""Heuristics declared from outside the package: shading, records, parameters, messages."""

from types import SimpleNamespace

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.heuristic import heuristics, kernel, tessellation
from fotismos.heuristic.declared import Declared
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import HEURISTICS, PHONG, Heuristic, Parameter, declare, named
from fotismos.reference.pairing import halves
from fotismos.reference.rendering.renderer import Renderer
from tests.shared import checks
from tests.shared.parts import camera, moved, rgb_of, shown_by


def toon(point):
    """Diffuse light, and a black outline."""
    value = point.ambient * point.material.k_a
    for light in point.lights:
        cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
        value += point.material.k_d * light.intensity * cosine
    return dr.select(dr.dot(point.normal, point.view) < point.parameters.outline, 0, value)


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
    "toon": Heuristic("toon", toon, "Toon", parameters=(Parameter("outline", 0.25, 0, 1),)),
    "shadowed": Heuristic("shadowed", shadowed, needs={"lights", "visible"}),
    "scaled": Heuristic("scaled", scaled, prepare=prepare),
}


@pytest.fixture
def declared(monkeypatch):
    """The toys are known while a test runs."""
    monkeypatch.setattr(HEURISTICS, "added", {})
    for heuristic in DECLARED.values():
        declare(heuristic)


def scene(model="phong", **integrator):
    """A sphere under two coloured lights, whose order can be told."""
    bsdf = {"type": "phong", "k_a": 0.2, "k_d": rgb_of(0.5, 0.4, 0.1), "k_s": 0.4, "n": 9}
    return shown_by(model, bsdf, ambient=0.5, **integrator)


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
        mesh = tessellation.to_mesh(mi.load_dict(given["sphere"]), 4)
        given = {name: value for name, value in given.items() if name != "sphere"} | {"mesh": mesh}
    loaded = mi.load_dict(given, optimize=False)
    image, hashes = kernels(loaded)
    monkeypatch.setattr(Heuristic, "evaluate", lambda self, given, *_: kernel.shade(*given))
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
    small = {"type": "sphere", "to_world": moved((1, 0, 0.5), 0.4), "bsdf": plain}
    return given | {"sphere": given["sphere"] | {"bsdf": bsdf}, "small": small}


def test_blinn_is_the_blinn_lobe_whatever_the_material_says(rgb):
    for normalised, alone in ((False, False), (True, False), (True, True)):
        images = []
        for form, model in (("phong", "blinn"), ("blinn", "phong"), ("phong", "phong")):
            given = with_form(form, model, normalised)
            if alone:
                del given["small"]
            images.append(checks.render(checks.with_film(given, 48, 4), 4, 1))
        found, expected, other = images
        np.testing.assert_array_equal(found, expected)
        assert abs(found - other).max() > 0.05


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


def test_shadow_rays_are_cast_where_they_are_needed(rgb, declared):
    """Half of a floor is behind a wall, seen from the light."""
    bsdf = {"type": "phong", "k_d": 0.5}
    roof = moved((1, 0, 1)).rotate([0, 1, 0], 180)
    given = {
        "type": "scene",
        "integrator": {"type": "heuristic", "model": "shadowed"},
        "floor": {"type": "rectangle", "bsdf": bsdf},
        "roof": {"type": "rectangle", "to_world": roof, "bsdf": bsdf},
        "light": {"type": "heuristic_directional", "direction": [0, 0, -1], "intensity": 0.75},
        "sensor": camera((0, 0, 0.5), up=(0, 1, 0), size=4, type="orthographic"),
    }
    image = np.array(mi.render(mi.load_dict(given), spp=1))
    assert sorted(set(np.unique(image))) == [0.125, 0.75]
    # One that casts none itself is hidden by the integrator, where that is asked for.
    given["integrator"] = {"type": "heuristic", "model": "toon", "occlusion": True}
    image = np.array(mi.render(mi.load_dict(given), spp=1))
    assert sorted(set(np.unique(image))) == [0.0, 0.375]


def test_what_is_not_declared_to_be_needed_cannot_be_read(rgb, declared):
    for shade, missing in (
        (lambda point: point.uv.x, "uv"),
        (lambda point: point.lights[0].visible(), "visible"),
    ):
        declare(Heuristic("hasty", shade, needs={"position", "lights"}))
        loaded = mi.load_dict(checks.with_film(scene("hasty"), 8, 1), optimize=False)
        with pytest.raises(InputError, match=f"'{missing}' is read, but not declared"):
            Renderer(loaded, None, 1, "image").render(0)


def test_parameters_can_be_edited_without_a_new_kernel(rgb, declared):
    loaded = mi.load_dict(checks.with_film(scene("toon"), 8, 1), optimize=False)
    parameters = mi.traverse(loaded)
    images, hashes = [], []
    for value in (0.25, 0.75):
        parameters["integrator.outline"] = value
        parameters.update()
        image, found = kernels(loaded)
        images.append(image)
        hashes.append(found)
    assert abs(images[0] - images[1]).max() > 0.01
    assert hashes[0] == hashes[1]
    for value in (1.5, -0.1, float("nan")):
        with pytest.raises(Exception, match=r"outline = .* not allowed: give a value from 0 to 1"):
            mi.load_dict({"type": "heuristic", "model": "toon", "outline": value})


def test_a_wrong_declaration_is_refused():
    for make, message in (
        (lambda: Heuristic("My toon", toon), "'My toon': a name has lower-case"),
        (lambda: Heuristic("a", toon, needs={"depth"}), "needs depth: choose from position"),
        (lambda: Heuristic("a", toon, form="ward"), "'ward' is not known"),
        (lambda: Heuristic("a", toon, parameters=(Parameter("x", 1, 0, 1),) * 2), "of one name"),
        (lambda: Parameter("ambient", 0, 0, 1), "'ambient' is not allowed"),
        (lambda: Parameter("two words", 0, 0, 1), "'two words' is not allowed"),
        (lambda: Parameter("x", 2, 0, 1), "x = 2 is not allowed: give a value from 0 to 1"),
        (lambda: declare(Heuristic("phong", toon)), "'phong' is already declared"),
        (lambda: named("fong"), "not declared: choose one of .*blinn, .*phong"),
        (lambda: named(""), "not declared: choose one of .*blinn, .*phong"),
    ):
        with pytest.raises(InputError, match=message):
            make()


def test_packages_declare_by_entry_points_that_are_loaded_once(monkeypatch):
    loads, late = [], Heuristic("late", toon)
    entry = SimpleNamespace(name="late", value="package:LATE", load=lambda: loads.append(1) or late)
    monkeypatch.setattr("fotismos.heuristic.declared.entry_points", lambda group: [entry])
    registry = Declared("heuristic", "fotismos.toys", phong="fotismos.heuristic.heuristics:PHONG")
    assert (registry["phong"], loads) == (PHONG, [])
    mine = registry.declare(Heuristic("mine", toon))
    assert list(registry) == ["phong", "mine", "late"]
    assert (len(registry), "none" in registry, loads) == (3, False, [1])
    assert (registry.is_builtin(PHONG), registry.is_builtin(mine)) == (True, False)
    again = registry.declare(Heuristic("mine", shadowed))
    assert registry["mine"] is again
    entry.load = lambda: 1 / 0
    with pytest.raises(InputError, match=r"late: the entry point package:LATE .*division by zero"):
        Declared("heuristic", "fotismos.toys").get("other")


def read(word):
    return f"{word} is read"


def test_packages_read_files_of_other_suffixes_by_entry_points(monkeypatch):
    entry = SimpleNamespace(name=".toy", value=f"{__name__}:read")
    for module in ("declared", "heuristics"):
        monkeypatch.setattr(f"fotismos.heuristic.{module}.entry_points", lambda group: [entry])
    monkeypatch.setattr(heuristics, "readers", heuristics.readers.__wrapped__)
    assert named("folder/mine.toy") == "folder/mine.toy is read"
    assert heuristics.in_file("mine.toy") == ("mine.toy", "")
    assert heuristics.in_file("mine.other") is None
    # It is no heuristic itself.
    assert list(Declared("heuristic", "fotismos.toys", phong="fotismos.heuristic:PHONG")) == [
        "phong"
    ]


def test_a_pair_says_what_its_heuristic_shades_with(rgb, declared):
    """The corners between the halves have the same lobe and the same shadows."""
    source = SCENES["fig-8-9"].source()
    props = {}
    for name in ("phong", "blinn", "shadowed"):
        graph = halves.pair(source, halves.PairOptions(heuristic=name)).heuristic
        (sphere,) = (index for index in graph.nodes(halves.BSDF) if graph.plugin(index) == "phong")
        integrator = graph.props(graph.nodes(halves.INTEGRATOR)[0])
        props[name] = graph.props(sphere).get("form", "phong"), integrator["occlusion"]
    assert props == {
        "phong": ("phong", False),
        "blinn": ("blinn", False),
        "shadowed": ("phong", True),
    }
