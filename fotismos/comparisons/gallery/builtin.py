"""The built-in scenes: the chapters' figures, and the project's own physical scenes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

from fotismos.heuristic import program
from fotismos.heuristic.errors import InputError, suggestion

if TYPE_CHECKING:  # names are listed without importing Mitsuba
    from fotismos.comparisons.options import VertexWeights
    from fotismos.reference.scene.source import Source  # loaded late: names need no Mitsuba

VIEWER_A = (-3, -3, 0)
VIEWER_C = (-3, 0, 1)
WHITE_LIGHT = (((-4.24, 0, 0), (1, 1, 1)),)
FAR_LIGHT = (((-424, 0, 0), (1, 1, 1)),)
THREE_LIGHTS = (
    ((-4.24, 0, 0), (1, 0, 0)),
    ((-3.5, -3.5, 0), (0, 1, 0)),
    ((0, -4.24, 0), (0, 0, 1)),
)


@dataclass(frozen=True)
class BuiltIn:
    """A built-in scene: a sentence on what it shows, and a function that makes its dictionary.

    ``variant`` is the variant that it needs, ``heuristic_variant`` the textbook half's if
    different: RGB against the spectral reference. ``interpolation``, ``tessellation`` and
    ``vertex_weights`` are the textbook half's.
    """

    name: str
    title: str
    make: Callable[[], dict[str, Any]]
    variant: str = "llvm_ad_rgb"
    heuristic_variant: str | None = None
    interpolation: str = "phong"
    tessellation: int | None = None
    vertex_weights: VertexWeights | None = None

    def source(self) -> Source:
        """Return the scene for :func:`fotismos.reference.pair`."""
        from fotismos.reference.scene.source import Source  # loaded late: names need no Mitsuba

        return Source(self.name, self.make)


def builtin(name: str) -> BuiltIn:
    """Return the built-in scene with a name."""
    if name not in SCENES:
        raise InputError(
            f"{name!r} is neither a file nor a built-in scene{suggestion(name, SCENES)}."
            f" `{program.command('scenes')}` lists the built-in scenes."
        )
    return SCENES[name]


def _scene(function: str, **values: Any) -> dict[str, Any]:
    """Make a scene by a function of the gallery, which is loaded here: it imports Mitsuba."""
    maker = import_module("fotismos.comparisons.gallery.scenes")
    scene: dict[str, Any] = getattr(maker, function)(**values)
    return scene


def _named(name: str, title: str, **settings: Any) -> BuiltIn:
    """Return the scene that the function of its name makes."""
    return BuiltIn(name, title, partial(_scene, name.replace("-", "_")), **settings)


def _figure(name: str, title: str, lights: Any, viewer: Any, **coefficients: float) -> BuiltIn:
    make = partial(_scene, "figure", lights=lights, viewer=viewer, **coefficients)
    return BuiltIn(name, title, make)


def _figures() -> Iterator[BuiltIn]:
    levels = {"a": 0.5, "b": 0.7, "c": 0.9}
    for letter, k in levels.items():
        title = f"Figure 8.5{letter}: ambient light alone, k_a = {k}"
        yield _figure(f"fig-8-5{letter}", title, lights=(), viewer=VIEWER_A, k_a=k)
    for letter, k in levels.items():
        title = f"Figure 8.6{letter}: diffuse reflection, k_d = {k}"
        yield _figure(f"fig-8-6{letter}", title, lights=WHITE_LIGHT, viewer=VIEWER_A, k_d=k)
    for letter, k in levels.items():
        title = f"Figure 8.7{letter}: specular reflection, k_s = {k}, n = 3"
        yield _figure(f"fig-8-7{letter}", title, lights=WHITE_LIGHT, viewer=VIEWER_A, k_s=k, n=3)
    whole = {"k_a": 0.3, "k_d": 0.5, "k_s": 0.7}
    for letter, viewer in {"a": VIEWER_A, "b": VIEWER_C, "c": VIEWER_C}.items():
        title = f"Figure 8.8{letter}: ambient, diffuse and specular, n = 3, viewer {viewer}"
        if viewer == VIEWER_C:
            title += "; the chapter gives 8.8b and 8.8c the same viewer"
        yield _figure(f"fig-8-8{letter}", title, lights=WHITE_LIGHT, viewer=viewer, **whole, n=3)
    title = "Figure 8.9: as 8.8c with a sharper highlight, n = 9"
    yield _figure("fig-8-9", title, lights=WHITE_LIGHT, viewer=VIEWER_C, **whole, n=9)
    for n, reading in {9: "text", 3: "caption"}.items():
        title = f"Figure 8.11: red, green and blue light, n = {n} (from the {reading})"
        yield _figure(f"fig-8-11-n{n}", title, lights=THREE_LIGHTS, viewer=VIEWER_C, **whole, n=n)

    title = "The far lamp: as figure 8.6b, a hundred times as far; its light is as good as parallel"
    yield _figure("far-lamp", title, lights=FAR_LIGHT, viewer=VIEWER_A, k_d=levels["b"])
    yield _named("emission", "Equation 8.1: a ball that glows, and lights nothing in the model")
    yield _named("mirror", "Equation 8.7: a ball that mirrors a matt one")


def _chapter_six() -> Iterator[BuiltIn]:
    yield _named(
        "fall-offs",
        "Equation 6.1 and the text at 8.6: constant, linear, quadratic and clamped fall-off",
    )
    yield _named(
        "two-intensities",
        "Equations 6.6 and 6.8: an orange diffuse and a white specular intensity of one light",
    )
    for m in (1.0, 40.0):
        title = f"Figure 6.5: a spot of {'small' if m < 10 else 'large'} exponent, m = {m:g}"
        yield BuiltIn(f"fig-6-5-m{m:g}", title, partial(_scene, "spot", exponent=m))
    yield BuiltIn(
        "fig-6-10",
        "Figure 6.10: flat shading of a coarse sphere; see it with gouraud or phong interpolation",
        partial(_scene, "coarse_sphere"),
        interpolation="flat",
        tessellation=4,
    )
    yield BuiltIn(
        "fig-6-14",
        "Figure 6.14: a highlight inside a triangle, lost by Gouraud shading, kept by Phong's",
        partial(_scene, "highlight_in_a_triangle"),
        interpolation="gouraud",
        tessellation=1,
    )
    yield _named(
        "vertex-normals",
        "Equations 6.32 to 6.34: a block of twelve triangles; see it with other vertex weights",
        vertex_weights="mean",
    )


def _physical() -> Iterator[BuiltIn]:
    for name, title, is_spectral in (
        ("lambert-sphere", "A diffuse sphere under a point light: an exact pair", False),
        ("plastic-spheres", "Rough plastic from sharp to dull under a lamp", False),
        ("narrow-band-lamp", "Coloured spheres under a sodium lamp: RGB against spectra", True),
        ("metameric-pair", "Two surfaces of one colour in daylight, under lamplight: RGB against"
         " spectra", True),
        ("cornell-box", "The Cornell box: a lamp, shadows and colour bleeding", False),
    ):  # fmt: skip
        yield _named(
            name,
            title,
            variant="llvm_ad_spectral" if is_spectral else "llvm_ad_rgb",
            heuristic_variant="llvm_ad_rgb" if is_spectral else None,
        )


SCENES = {scene.name: scene for scene in (*_figures(), *_chapter_six(), *_physical())}
