"""A heuristic under audit, with one white material, one light and one viewer at a time."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from comparisons.audit.subject import ALPHAS, Setting, Subject, Tuned, random_and_mirrored
from comparisons.hard import furnace
from heuristic import heuristics, terms
from heuristic.errors import InputError, unknown
from heuristic.heuristics import Heuristic
from heuristic.lights import DirectionalLight, PointLight
from heuristic.materials import PairedMaterial
from heuristic.points import Given
from reference.pairing import albedo, factors

IOR = 1.5

UP = np.array([[0.0], [0.0], [1.0]])
COLOURS = ("k_i", "k_a", "k_d", "k_s", "base_color")

MIDDLE = {"k_i": 0, "k_a": 0.5, "k_d": 0.5, "k_s": 0.5, "n": 10, "base_color": 0.5, "alpha": 0.3,
          "ior": 1.5, "metallic": 0.5}  # fmt: skip
"""Where derivatives are taken, except with respect to values of 0."""

EXTREMES = (
    ("n = 0", {"n": 0.0}), ("n = 1e-3", {"n": 1e-3}), ("n = 1e7", {"n": 1e7}),
    ("alpha = 1e-4", {"alpha": 1e-4}), ("alpha = 1", {"alpha": 1.0}),
    ("ior = 1", {"ior": 1.0}), ("ior = 1000", {"ior": 1e3}),
    ("a black surface", dict.fromkeys(COLOURS, 0)), ("metallic = 1", {"metallic": 1.0}),
)  # fmt: skip

GRAZING = "grazing, head on and from behind"

LENGTHS = (0.0, 1e-30, 1e30)
"""Of normals."""

DISTANCES = (0.0, 1e-30, 1e-6, 1e6, 1e15, 1e30)


def white(form: str) -> dict[str, dict[str, float]]:
    """Return the white materials matte, glossy and metal by their names, as pairing makes them.

    Glossy ones are the counterparts of white rough plastic. A metal's lobe returns all light at
    normal incidence.
    """
    found = {"matte": {"k_a": 1.0, "k_d": 1.0, "base_color": 1.0}}
    for alpha in ALPHAS:
        for kind, material in _rough(form, alpha).items():
            found[f"{kind}, alpha {alpha:g}"] = material
    return found


def _rough(form: str, alpha: float) -> dict[str, dict[str, float]]:
    n = factors.exponent_of(alpha, form)
    lobe = float(terms.normalisation(form, n))
    plastic = albedo.of_roughplastic(albedo.RoughPlastic((1.0, 1.0, 1.0), alpha, IOR))
    diffuse, specular = float(plastic.diffuse[0]), float(plastic.specular[0])
    rough = {"base_color": 1.0, "n": n, "alpha": alpha, "ior": IOR}
    return {
        "glossy": {"k_a": diffuse, "k_d": diffuse, "k_s": specular * lobe, **rough},
        "metal": {"k_s": lobe, "metallic": 1.0, **rough},
    }


class Shaded(Subject):
    """A heuristic, with values for some of its parameters.

    Raises
    ------
    InputError
        For a parameter that it does not have, a value outside its bounds, or if it cannot prepare
        the scene, a white square under one light.
    """

    def __init__(self, heuristic: Heuristic, given: Mapping[str, float]) -> None:
        self.heuristic = heuristic
        if heuristic.needs == {"position"}:
            raise InputError(
                f"heuristic {heuristic.name} reads only positions, as a picture does, and cannot be"
                " audited over directions. Compare it on a scene."
            )
        known = {each.name: each for each in heuristic.parameters}
        for name in given:
            if name not in known:
                raise unknown(f"heuristic {heuristic.name}: parameter", name, known)
        self.values = {
            name: each.checked(given.get(name, each.default)) for name, each in known.items()
        }
        self.white = white(heuristic.form or "phong")
        prepared = {each.name: self.values[each.name] for each in known.values() if each.prepared}
        self.prepared = heuristic.prepared(_square(), prepared)
        super().__init__({name: each.get("alpha") for name, each in self.white.items()})
        if not heuristic.traced:
            self.untuned = "Dr.Jit cannot differentiate it"

    def evaluate(self, material: str, light: np.ndarray, view: np.ndarray) -> np.ndarray:
        return self._array(self.white[material], DirectionalLight(mi.Vector3f(-light), 1.0), view)

    def settings(self) -> Iterator[Setting]:
        light, view = random_and_mirrored()
        for words, change in EXTREMES:
            yield self._setting(words, light, view, **(MIDDLE | change))
        for distance in DISTANCES:
            near = PointLight(mi.Point3f(0, 0, distance), mi.Spectrum(1.0))
            yield Setting(
                f"a light at a distance of {distance:g}",
                partial(self._array, MIDDLE, near, view),
            )
        edge, edges = grazing()
        yield self._setting(GRAZING, edge, edges)
        nothing = np.zeros((3, 1))
        for length in LENGTHS:
            yield self._setting(f"a normal of length {length:g}", light, view, length * UP)
        yield self._setting("a viewer at the point itself", UP, nothing)
        dark = DirectionalLight((0.0, 0.0, -1.0), 0.0)
        yield Setting("a light of intensity 0", partial(self._array, MIDDLE, dark, view))
        if self.heuristic.prepare is None:  # it may prepare one item per light
            yield Setting("no light at all", partial(self._array, MIDDLE, None, view))

    def tuned(self) -> Iterator[Tuned]:
        if not self.heuristic.traced:
            return
        light, view = furnace.random_pairs(512)
        sun = DirectionalLight(mi.Vector3f(-light), 1.0)

        def by_material(name: str, number: Any) -> Any:
            return dr.mean(self._colour(MIDDLE | {name: number}, sun, view))

        def by_parameter(name: str, number: Any) -> Any:
            return dr.mean(self._colour(MIDDLE, sun, view, values={name: number}))

        read = [name for name, value in MIDDLE.items() if value]
        for name in read:
            yield Tuned(name, MIDDLE[name], partial(by_material, name))
        for each in self.heuristic.parameters:
            if not each.prepared and (centre := _within(each, self.values[each.name])):
                yield Tuned(each.name, centre, partial(by_parameter, each.name))

    def _setting(
        self,
        words: str,
        light: np.ndarray,
        view: np.ndarray,
        normal: np.ndarray = UP,
        **material: float,
    ) -> Setting:
        sun = DirectionalLight(mi.Vector3f(-light), 1.0)
        return Setting(
            words, partial(self._array, material or MIDDLE, sun, view, normal), (light, view)
        )

    def _array(
        self, material: Mapping[str, Any], light: Any, view: np.ndarray, normal: np.ndarray = UP
    ) -> np.ndarray:
        return np.array(self._colour(material, light, view, normal), float).reshape(3, -1)

    def _colour(
        self,
        material: Mapping[str, Any],
        light: Any,
        view: np.ndarray,
        normal: np.ndarray = UP,
        values: Mapping[str, Any] | None = None,
    ) -> Any:
        count = max(view.shape[1], dr.width(getattr(light, "direction", 0.0)))
        given = Given(
            dr.zeros(mi.Vector3f, count),
            mi.Vector3f(np.broadcast_to(normal, (3, count))),
            mi.Vector3f(np.broadcast_to(view, (3, count))),
            _material(material, self.heuristic.form or "phong"),
            [] if light is None else [light],
            mi.Spectrum(0.0),
            lambda toward, distance: dr.full(mi.Bool, True, count),
        )
        parameters = {
            name: mi.Float(value) for name, value in (self.values | dict(values or {})).items()
        }
        uv = mi.Point2f(0.5, 0.5)
        return mi.Spectrum(self.heuristic.evaluate(given, uv, parameters, self.prepared))


def opened(name: str, given: Mapping[str, float]) -> Shaded:
    """Return a heuristic, as `compare --heuristic` accepts it, for the current variant."""
    return Shaded(heuristics.named(name), given)


def _material(values: Mapping[str, Any], form: str) -> PairedMaterial:
    known = dict.fromkeys(COLOURS, 0.0) | {"n": 1.0, "alpha": 1.0, "ior": 1.0, "metallic": 0.0}
    # Opaque, as in a scene: Dr.Jit drops products with a literal 0, even of NaN.
    given = {
        name: value if dr.is_array_v(value) else dr.opaque(mi.Float, value)
        for name, value in (known | dict(values)).items()
    }
    return PairedMaterial(**given | {name: mi.Spectrum(given[name]) for name in COLOURS}, form=form)


def _within(parameter: heuristics.Parameter, value: float) -> float | None:
    """Return a value with room for differences on both sides; None if there is none."""
    low, high = max(parameter.low, -1e6), min(parameter.high, 1e6)
    inner = min(max(value, low + 0.1 * (high - low)), high - 0.1 * (high - low))
    centre = value if low < 0.9 * value and 1.1 * value < high else inner
    return centre or None


def grazing() -> tuple[np.ndarray, np.ndarray]:
    """Return lights and viewers (3, N) at the horizon and the normal, and lights below them."""
    azimuth = np.deg2rad([0.0, 90.0, 180.0])
    rows = [np.stack([np.cos(azimuth), np.sin(azimuth), np.full(3, z)]) for z in (0, 1e-7, 1e-3)]
    views = np.concatenate([UP, *rows], axis=1)
    lights = np.concatenate([views, -views], axis=1)
    return np.repeat(lights, views.shape[1], axis=1), np.tile(views, lights.shape[1])


def _square() -> Any:
    """Return the scene that a heuristic may prepare: a white square under one light, at night."""
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at((0, -2, 2), (0, 0, 0), (0, 0, 1)),
                "film": {"type": "hdrfilm", "width": 16, "height": 16},
            },
            "square": {"type": "rectangle", "bsdf": {"type": "phong", "k_a": 1.0, "k_d": 1.0}},
            "light": {"type": "heuristic_directional", "direction": [0, 0, -1], "intensity": 1.0},
            "night": {"type": "constant", "radiance": 0.0},
        },
        optimize=False,
    )  # fmt: skip
