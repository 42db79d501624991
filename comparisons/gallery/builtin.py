"""The built-in scenes: the chapters' figures, and the project's own physical scenes.

A scene is a dictionary for ``mitsuba.load_dict``. The figures give every number but the field of
view and the up vector; one camera that frames the sphere serves them all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from heuristic.errors import InputError, suggestion

if TYPE_CHECKING:  # names are listed without importing Mitsuba
    from reference.scene.source import Source

RESOLUTION = 512
FIELD_OF_VIEW = 40.0

VIEWER_A = (-3, -3, 0)
VIEWER_C = (-3, 0, 1)
WHITE_LIGHT = (((-4.24, 0, 0), (1, 1, 1)),)
THREE_LIGHTS = (
    ((-4.24, 0, 0), (1, 0, 0)),
    ((-3.5, -3.5, 0), (0, 1, 0)),
    ((0, -4.24, 0), (0, 0, 1)),
)


@dataclass(frozen=True)
class Scene:
    """A built-in scene: a sentence on what it shows, and a function that makes its dictionary.

    ``variant`` is the variant that it needs, ``heuristic_variant`` the heuristic half's if
    different: RGB against the spectral reference. ``interpolation`` and ``tessellation`` are the
    heuristic half's.
    """

    name: str
    title: str
    make: Callable[[], dict]
    variant: str = "llvm_ad_rgb"
    heuristic_variant: str | None = None
    interpolation: str = "phong"
    tessellation: int | None = None

    def source(self) -> Source:
        """Return the scene for :func:`reference.pair`."""
        from reference.scene.source import Source

        return Source(self.name, self.make)


def builtin(name: str) -> Scene:
    """Return the built-in scene with a name.

    Raises
    ------
    InputError
        If there is none; the message lists the names.
    """
    if name not in SCENES:
        raise InputError(
            f"{name!r} is neither a file nor a built-in scene{suggestion(name, SCENES)}. Built-in"
            f" scenes: {', '.join(SCENES)}."
        )
    return SCENES[name]


def _camera(viewer):
    import mitsuba as mi

    return {
        "type": "perspective",
        "fov": FIELD_OF_VIEW,
        "to_world": mi.ScalarTransform4f().look_at(viewer, (0, 0, 0), (0, 0, 1)),
        "film": {
            "type": "hdrfilm",
            "width": RESOLUTION,
            "height": RESOLUTION,
            "rfilter": {"type": "box"},
        },
    }


def _figure(name, title, lights, viewer, **coefficients):
    """A unit sphere at the origin; lights with ``I_p0 = 1`` and ``f_att = 1``; ``I_a = 1``."""

    def make() -> dict[str, Any]:
        scene: dict[str, Any] = {
            "type": "scene",
            "integrator": {"type": "heuristic"},
            "sensor": _camera(viewer),
            "sphere": {
                "type": "sphere",
                "bsdf": {"type": "phong", "id": "sphere material", **coefficients},
            },
        }
        if "k_a" in coefficients:
            scene["integrator"]["ambient"] = 1.0
        for number, (position, colour) in enumerate(lights, 1):
            scene[f"light {number}"] = {
                "type": "heuristic_point",
                "position": position,
                "intensity": {"type": "rgb", "value": colour},
            }
        return scene

    return Scene(name, title, make)


def _figures() -> Iterator[Scene]:
    levels = {"a": 0.5, "b": 0.7, "c": 0.9}
    for letter, k in levels.items():
        title = f"Figure 8.5{letter}: ambient light alone, k_a = {k}"
        yield _figure(f"fig-8-5{letter}", title, (), VIEWER_A, k_a=k)
    for letter, k in levels.items():
        title = f"Figure 8.6{letter}: diffuse reflection, k_d = {k}"
        yield _figure(f"fig-8-6{letter}", title, WHITE_LIGHT, VIEWER_A, k_d=k)
    for letter, k in levels.items():
        title = f"Figure 8.7{letter}: specular reflection, k_s = {k}, n = 3"
        yield _figure(f"fig-8-7{letter}", title, WHITE_LIGHT, VIEWER_A, k_s=k, n=3)
    whole = {"k_a": 0.3, "k_d": 0.5, "k_s": 0.7}
    for letter, viewer in {"a": VIEWER_A, "b": VIEWER_C, "c": VIEWER_C}.items():
        title = f"Figure 8.8{letter}: ambient, diffuse and specular, n = 3, viewer {viewer}"
        if viewer == VIEWER_C:
            title += "; the chapter gives 8.8b and 8.8c the same viewer"
        yield _figure(f"fig-8-8{letter}", title, WHITE_LIGHT, viewer, **whole, n=3)
    title = "Figure 8.9: as 8.8c with a sharper highlight, n = 9"
    yield _figure("fig-8-9", title, WHITE_LIGHT, VIEWER_C, **whole, n=9)
    for n, reading in {9: "text", 3: "caption"}.items():
        title = f"Figure 8.11: red, green and blue light, n = {n} (from the {reading})"
        yield _figure(f"fig-8-11-n{n}", title, THREE_LIGHTS, VIEWER_C, **whole, n=n)


def _made_in(module: str, function: str, *arguments: float) -> Callable[[], dict]:
    """Return a function that imports another module of this folder and makes its scene."""

    def make() -> dict:
        return getattr(import_module(f"comparisons.gallery.{module}"), function)(*arguments)

    return make


def _chapter_six() -> Iterator[Scene]:
    for m in (1.0, 40.0):
        title = f"Figure 6.5: a spot of {'small' if m < 10 else 'large'} exponent, m = {m:g}"
        yield Scene(f"fig-6-5-m{m:g}", title, _made_in("chapter_six", "spot", m))
    yield Scene(
        "fig-6-10",
        "Figure 6.10: flat shading of a coarse sphere; see it with --interpolation gouraud, phong",
        _made_in("chapter_six", "coarse_sphere"),
        interpolation="flat",
        tessellation=4,
    )
    yield Scene(
        "fig-6-14",
        "Figure 6.14: a highlight inside a triangle, lost by Gouraud shading, kept by Phong's",
        _made_in("chapter_six", "highlight_in_a_triangle"),
        interpolation="gouraud",
        tessellation=1,
    )


def _cornell_box():
    import mitsuba as mi

    scene = mi.cornell_box()
    scene["sensor"]["film"]["rfilter"] = {"type": "box"}
    return scene


def _lambert_sphere():
    """A diffuse sphere under a point light: the pair is exact."""
    return {
        "type": "scene",
        "integrator": {"type": "path"},
        "sensor": _camera(VIEWER_C),
        "sphere": {
            "type": "sphere",
            "bsdf": {
                "type": "diffuse",
                "id": "sphere material",
                "reflectance": {"type": "rgb", "value": (0.7, 0.45, 0.2)},
            },
        },
        "light": {"type": "point", "position": (-4.24, -1, 3), "intensity": 60.0},
    }


def _plastic_spheres():
    """Three rough plastic spheres, from sharp to dull, on a floor under a small square lamp."""
    import mitsuba as mi

    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 8},
        "sensor": _camera((0, -9, 4)) | {"fov": 38.0},
        "floor": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate((0, 0, -1)).scale(12),
            "bsdf": {"type": "diffuse", "id": "floor material", "reflectance": 0.5},
        },
        "lamp": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f()
            .look_at((-3, -4, 7), (0, 0, 0), (0, 0, 1))
            .scale(0.5),
            "emitter": {"type": "area", "radiance": 250.0},
        },
    }
    for number, (place, alpha) in enumerate(((-2.2, 0.1), (0.0, 0.2), (2.2, 0.4)), 1):
        scene[f"sphere-{number}"] = {
            "type": "sphere",
            "center": (place, 0, 0),
            "bsdf": {
                "type": "roughplastic",
                "id": f"plastic {alpha:g}",
                "alpha": alpha,
                "diffuse_reflectance": {"type": "rgb", "value": (0.1, 0.27, 0.36)},
            },
        }
    return scene


def _physical() -> Iterator[Scene]:
    yield Scene(
        "lambert-sphere", "A diffuse sphere under a point light: an exact pair", _lambert_sphere
    )
    yield Scene(
        "plastic-spheres", "Rough plastic from sharp to dull under a lamp", _plastic_spheres
    )
    for name, title, make in (
        (
            "narrow-band-lamp",
            "Coloured spheres under a sodium lamp: RGB against spectra",
            _made_in("spectral", "narrow_band_lamp"),
        ),
        (
            "metameric-pair",
            "Two surfaces of one colour in daylight, under lamplight: RGB against spectra",
            _made_in("spectral", "metameric_pair"),
        ),
    ):
        yield Scene(name, title, make, "llvm_ad_spectral", "llvm_ad_rgb")
    yield Scene("cornell-box", "The Cornell box: a lamp, shadows and colour bleeding", _cornell_box)


SCENES = {scene.name: scene for scene in (*_figures(), *_chapter_six(), *_physical())}
