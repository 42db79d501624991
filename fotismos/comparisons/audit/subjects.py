"""What can be audited: a heuristic, or a Mitsuba BSDF, by its response to a light.

A heuristic has one white material, one light and one viewer at a time; a BSDF is known by its
``eval``, ``sample`` and ``pdf``. One in a user's file, ``FILE.py:NAME``, is the plugin that the
file registers by this name.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.comparisons.audit import furnace, samples
from fotismos.comparisons.audit.furnace import UP, Pairs
from fotismos.heuristic import heuristics, terms, user_shaders
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError, unknown
from fotismos.heuristic.heuristics import Heuristic, ShadingArguments
from fotismos.heuristic.lights import DirectionalLight, PointLight
from fotismos.heuristic.materials import PairedMaterial
from fotismos.heuristic.user_code import contained
from fotismos.reference.pairing import albedo, factors
from fotismos.reference.scene import checks

ALPHAS = (0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
"""Roughness of the materials; the quadrature resolves their lobes at every angle."""

CaseValues = tuple[str, Floats, Pairs | None]
"""Words, the values (C, N), and the directions if they identify a value."""

Number = tuple[str, float, Callable[[Any], Any]]
"""Name and value of a number to differentiate by, and the function of it, one value per point."""


class Subject(ABC):
    """A heuristic or a BSDF, with white materials and the roughness of those that have several.

    ``untuned`` and ``unsampled`` say why no derivative, and no sample, can be checked, where that
    is so. ``bsdfs`` are those whose samples are checked, ``scattering`` is the BSDF as Mitsuba
    reads it. ``faults`` describe values that light cannot have, from any check. ``eta`` is the
    relative index of refraction below what transmits light, None for others.
    """

    materials: dict[str, float | None]
    grid = furnace.GRID
    eta: float | None = None
    untuned = "it depends on no number"
    unsampled = "textbook shading is not sampled"

    def __init__(self) -> None:
        self.faults: list[str] = []
        self.scattering: dict[str, Any] = {}
        self.bsdfs: dict[str, Any] = {}

    @abstractmethod
    def evaluate(self, material: str, light: Floats, view: Floats) -> Floats:
        """Return what ``response`` returns, before it is checked."""

    @abstractmethod
    def hard_cases(self) -> Iterator[CaseValues]:
        """Evaluate the hard cases."""

    @abstractmethod
    def numbers(self) -> Iterator[Number]:
        """Yield the numbers that it depends on."""

    def both_sides(self, degrees: tuple[float, ...]) -> tuple[float, ...]:
        """Return angles from the normal; of what transmits light, also those from behind."""
        return degrees + tuple(180 - degree for degree in reversed(degrees) if self.eta)

    def response(self, material: str, light: Floats, view: Floats) -> Floats:
        """Return ``pi f cos(theta_l)``, (C, N): see :mod:`fotismos.comparisons.audit.furnace`.

        Values that are not finite, or negative, are noted and count as 0.
        """
        count = max(light.shape[1], view.shape[1])
        light = np.broadcast_to(light, (3, count))
        view = np.broadcast_to(view, (3, count))
        values = np.broadcast_to(self.evaluate(material, light, view), (3, count))
        self.note(material, values, Pairs(light, view))
        return np.where(np.isfinite(values) & (values > 0), values, 0.0)

    def note(self, description: str, values: Floats, pairs: Pairs | None) -> None:
        """Note the first value (C, N) that is not finite, or negative."""
        is_wrong = ~(np.isfinite(values) & (values >= -user_shaders.ROUNDING))
        if is_wrong.any():
            channel, index = np.argwhere(is_wrong)[0]
            where = f", {furnace.describe(pairs.light, pairs.view, index)}" if pairs else ""
            self.faults.append(f"{values[channel, index]:.3g} ({description}{where})")


# --- Heuristics --------------------------------------------------------------------------------

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

LENGTHS = (0.0, 1e-30, 1e30)
"""Of normals."""

DISTANCES = (0.0, 1e-30, 1e-6, 1e6, 1e15, 1e30)


def white(form: str) -> dict[str, dict[str, float]]:
    """Return the white materials matte, glossy, metal and mixed, as pairing makes them.

    Glossy ones are the counterparts of white rough plastic. A metal's lobe returns all light at
    normal incidence. Mixed ones are half glossy, half metal.
    """
    materials = {"matte": {"k_a": 1.0, "k_d": 1.0, "base_color": 1.0}}
    for alpha in ALPHAS:
        n = factors.exponent_of(alpha, form)
        lobe = float(terms.normalisation(form, n))
        plastic = albedo.of_roughplastic(albedo.RoughPlastic((1.0, 1.0, 1.0), alpha, 1.5))
        diffuse = float(plastic.diffuse[0])
        specular = float(plastic.specular[0])
        rough = {"base_color": 1.0, "n": n, "alpha": alpha, "ior": 1.5}
        glossy = {"k_a": diffuse, "k_d": diffuse, "k_s": specular * lobe, "metallic": 0.0, **rough}
        metal = {"k_a": 1.0, "k_d": 0.0, "k_s": lobe, "metallic": 1.0, **rough}
        mixed = {name: (glossy[name] + metal[name]) / 2 for name in glossy}
        for name, made in (("glossy", glossy), ("mixed", mixed), ("metal", metal)):
            materials[f"{name}, alpha {alpha:g}"] = made
    return materials


class ShadingSubject(Subject):
    """A heuristic, with values for some of its parameters."""

    def __init__(self, heuristic: Heuristic, parameters: Mapping[str, float]) -> None:
        super().__init__()
        self.heuristic = heuristic
        if heuristic.needs == {"position"}:
            raise InputError(
                f"heuristic {heuristic.name} reads only positions, as a picture does, and cannot be"
                " audited over directions. Compare it on a scene."
            )
        known = {parameter.name: parameter for parameter in heuristic.parameters}
        for name in parameters:
            if name not in known:
                raise unknown(f"heuristic {heuristic.name}: parameter", name, known)
        self.values = {
            name: parameter.checked(parameters.get(name, parameter.default))
            for name, parameter in known.items()
        }
        self.white = white(heuristic.form or "phong")
        self.materials = {name: material.get("alpha") for name, material in self.white.items()}
        prepared = {name: self.values[name] for name in known if known[name].prepared}
        self.prepared = heuristic.prepared(user_shaders.trial_scene(0.0), prepared)
        if not heuristic.traced:
            self.untuned = "Dr.Jit cannot differentiate it"

    def evaluate(self, material: str, light: Floats, view: Floats) -> Floats:
        return self._values(self.white[material], light, view)

    def hard_cases(self) -> Iterator[CaseValues]:
        around = furnace.random_and_mirrored()
        light, view = around
        for words, change in EXTREMES:
            yield words, self._values(MIDDLE | change, light, view), around
        for length in LENGTHS:
            values = self._values(MIDDLE, light, view, normal=length * UP)
            yield f"a normal of length {length:g}", values, around
        low = furnace.grazing()
        values = self._values(MIDDLE, low.light, low.view)
        yield "grazing, head on and from behind", values, low
        for far in DISTANCES:
            lamp = PointLight(mi.Point3f(0, 0, far), mi.Spectrum(1.0))
            values = self._values(MIDDLE, [lamp], view)
            yield f"a light at a distance of {far:g}", values, None
        dark = DirectionalLight((0.0, 0.0, -1.0), 0.0)
        yield "a light of intensity 0", self._values(MIDDLE, [dark], view), None
        if self.heuristic.prepare is None:  # it may prepare one item per light
            yield "no light at all", self._values(MIDDLE, [], view), None
        yield "a viewer at the point itself", self._values(MIDDLE, UP, np.zeros((3, 1))), None

    def numbers(self) -> Iterator[Number]:
        if not self.heuristic.traced:
            return
        light, view = furnace.random_pairs(512)

        # Both return the mean of the channels: one value per point.
        def of_material(name: str, number: Any) -> Any:
            return dr.mean(self._colour(MIDDLE | {name: number}, light, view))

        def of_parameter(name: str, number: Any) -> Any:
            return dr.mean(self._colour(MIDDLE, light, view, values={name: number}))

        for name, value in MIDDLE.items():
            if value:
                yield name, value, partial(of_material, name)
        # A preparation gets plain numbers, through which no derivative passes.
        for parameter in self.heuristic.parameters:
            centre = _within(parameter, self.values[parameter.name])
            if centre and not parameter.prepared:
                yield parameter.name, centre, partial(of_parameter, parameter.name)

    def _values(self, material: Mapping[str, Any], light: Any, view: Floats, **case: Any) -> Floats:
        """Return the colours (3, N)."""
        return np.array(self._colour(material, light, view, **case), float).reshape(3, -1)

    def _colour(
        self,
        material: Mapping[str, Any],
        light: Any,
        view: Floats,
        normal: Floats = UP,
        values: Mapping[str, Any] | None = None,
    ) -> Any:
        """Return the colours under lamps, or parallel light from directions (3, N)."""
        is_parallel = isinstance(light, np.ndarray)
        lights = [DirectionalLight(mi.Vector3f(-light), 1.0)] if is_parallel else light
        values = self.values | dict(values or {})
        point = (0 * UP, normal, view)
        return shaded(self.heuristic, point, material, lights, 0.0, values, self.prepared)


def shaded(
    heuristic: Heuristic,
    point: tuple[Floats, Floats, Floats],
    material: Mapping[str, Any],
    lights: list[Any],
    ambient: Any = 0.0,
    values: Mapping[str, Any] | None = None,
    prepared: Any = None,
) -> Any:
    """Return a heuristic's colours at points: position, normal and view, (3, N) or (3, 1) each.

    Numbers of the ``material`` may differ from point to point, (N,), and colours (3, N). Nothing
    hides a light. ``values`` are those of its parameters, if not the defaults.
    """
    count = max(vector.shape[1] for vector in point)
    position, normal, view = point
    known = dict.fromkeys(COLOURS, 0.0) | {"n": 1.0, "alpha": 1.0, "ior": 1.0, "metallic": 0.0}
    # Opaque, as in a scene: Dr.Jit drops products with a literal 0, even of NaN.
    opaque = {name: _opaque(value) for name, value in (known | dict(material)).items()}
    opaque |= {name: mi.Spectrum(opaque[name]) for name in COLOURS}
    arguments = ShadingArguments(
        position=mi.Vector3f(_single(np.broadcast_to(position, (3, count)))),
        normal=mi.Vector3f(_single(np.broadcast_to(normal, (3, count)))),
        view=mi.Vector3f(_single(np.broadcast_to(view, (3, count)))),
        material=PairedMaterial(**opaque, form=heuristic.form or "phong"),
        lights=lights,
        ambient=mi.Spectrum(ambient),
        visible=lambda toward, distance: dr.full(mi.Bool, True, count),
    )
    defaults = {parameter.name: parameter.default for parameter in heuristic.parameters}
    numbers = defaults | dict(values or {})
    parameters = {name: mi.Float(number) for name, number in numbers.items()}
    return mi.Spectrum(heuristic.evaluate(arguments, mi.Point2f(0.5), parameters, prepared))


def _opaque(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return (mi.Float if value.ndim == 1 else mi.Spectrum)(_single(value))
    return value if dr.is_array_v(value) else dr.opaque(mi.Float, value)


def _single(values: Floats) -> Floats:
    return np.ascontiguousarray(values, np.float32)


def _within(parameter: heuristics.Parameter, value: float) -> float | None:
    """Return a value with room for differences on both sides; None if there is none."""
    low = max(parameter.low, -1e6)
    high = min(parameter.high, 1e6)
    inner = min(max(value, low + 0.1 * (high - low)), high - 0.1 * (high - low))
    # A tenth to each side is ample: a difference steps by a fiftieth.
    room = 0.1 * abs(value)
    centre = value if low < value - room and value + room < high else inner
    return centre or None


# --- BSDFs -------------------------------------------------------------------------------------

WHITE: dict[str, dict[str, Any]] = {
    "diffuse": {"reflectance": 1.0},
    "roughplastic": {"diffuse_reflectance": 1.0},
    "principled": {"base_color": {"type": "rgb", "value": 1.0}},
    "principledthin": {"base_color": {"type": "rgb", "value": 1.0}},
    "roughconductor": {"material": "none"},
    "phong": {"k_d": 1.0},
}
"""Parameters that make BSDFs white; other types keep Mitsuba's defaults."""

ROUGH = ("alpha", "alpha_u", "alpha_v", "roughness")
RESOLVED = {**dict.fromkeys(ROUGH[:3], (0.1, 1.0)), "roughness": (0.32, 1.0), "n": (0.0, 50.0)}
"""Parameters of which both the quadrature and the cells of χ² resolve the lobe."""

LEAST_BEND = 0.08
"""Least ``|1 - 1 / eta|`` of an interface whose transmitted lobes the quadrature resolves."""


def registered(word: str) -> str:
    """Return the name of a plugin; run the file of one that is named ``FILE.py:NAME``."""
    if (file := heuristics.in_file(word)) is None:
        return word
    path = Path(file[0])
    name = file[1]
    variant = mi.variant()
    content = f"that calls mitsuba.register_bsdf(NAME, class) in variant {variant}, as FILE.py:NAME"
    with contained(path):
        user_shaders.names_of(path, content)
    if mi.variant() != variant or not name:
        mi.set_variant(variant)
        raise InputError(f"{path}: give a file {content}.")
    return name


class ScatteringSubject(Subject):
    """A BSDF of some type; parameters that are omitted are of :data:`WHITE`.

    If no roughness is given, and it has one, it is evaluated at each of :data:`ALPHAS`. BSDFs that
    reflect or pass light in one direction alone are refused: no quadrature covers them.
    """

    def __init__(self, word: str, parameters: Mapping[str, Any]) -> None:
        super().__init__()
        self.plugin = plugin = registered(word)
        for name, value in parameters.items():
            for allowed in checks.objections(plugin, name, value):
                wrong = f"{name} = {checks.shown(value)}"
                raise InputError(f"BSDF {plugin!r}: {wrong} is not allowed: give {allowed}.")
        # Values whose lobes quadrature or χ² could not resolve are refused.
        for name, (least, most) in RESOLVED.items():
            value = parameters.get(name)
            if isinstance(value, float) and not least <= value <= most:
                raise InputError(
                    f"BSDF {plugin!r}: {name} = {value:g} makes a lobe too narrow for the audit, or"
                    f" too wide: give {least:g} to {most:g}."
                )
        self.parameters = dict(parameters)
        self.scattering = {"type": plugin} | WHITE.get(plugin, {}) | self.parameters
        self.bsdf = self._made()
        flags = self.bsdf.flags()
        if mi.has_flag(flags, mi.BSDFFlags.Delta):
            raise InputError(
                f"BSDF {plugin!r} reflects light as a mirror, or passes it in one direction: it has"
                " no density to audit. Give a rough one, such as roughconductor or roughdielectric."
            )
        if mi.has_flag(flags, mi.BSDFFlags.Transmission):
            eta = self.eta = samples.index_below(self.bsdf)
            if 0 < abs(1 - 1 / eta) < LEAST_BEND:
                raise InputError(
                    f"BSDF {plugin!r}: an index of refraction of {eta:.3g} makes a lobe too narrow"
                    f" for the audit: give one above {1 / (1 - LEAST_BEND):.2f}."
                )
        # One BSDF, or one for each roughness if that is left open.
        self.materials = {plugin: None}
        self.bsdfs = {plugin: self.bsdf}
        self.keys = {key.partition(".")[0] for key, _ in mi.traverse(self.bsdf)}
        if self.keys.intersection(ROUGH) and not parameters.keys() & set(ROUGH):
            self.materials = {f"{plugin}, alpha {alpha:g}": alpha for alpha in ALPHAS}
            # Where it is called `roughness`, it is the root of alpha.
            name, power = ("roughness", 0.5) if "roughness" in self.keys else ("alpha", 1)
            self.bsdfs = {
                material: self._made(**{name: alpha**power})
                for material, alpha in zip(self.materials, ALPHAS, strict=True)
            }
        light, view = furnace.random_pairs(256, self.eta)
        is_black = not furnace.of_bsdf(self.bsdf)(light, view).any()
        self.unsampled = "it scatters nothing" if is_black else ""

    def evaluate(self, material: str, light: Floats, view: Floats) -> Floats:
        return furnace.of_bsdf(self.bsdfs[material])(light, view)

    def hard_cases(self) -> Iterator[CaseValues]:
        response = furnace.of_bsdf(self.bsdf)
        light, view = furnace.grazing()
        # Each pair again, with the viewer on the other side.
        low = Pairs(np.hstack([light, light]), np.hstack([view, -view]))
        yield "grazing, head on and from behind", response(low.light, low.view), low
        yield "a direction of length 0", response(np.zeros((3, 1)), UP), None
        around = furnace.random_and_mirrored()
        for alpha in (1e-4, 1.0) if "alpha" in self.keys else ():
            response = furnace.of_bsdf(self._made(alpha=alpha))
            yield f"alpha = {alpha:g}", response(around.light, around.view), around

    def numbers(self) -> Iterator[Number]:
        light, view = furnace.random_pairs(512, self.eta)
        parameters = mi.traverse(self.bsdf)
        for key in parameters.keys():  # noqa: SIM118 not a mapping
            value = parameters[key]
            is_smooth = not (parameters.flags(key) & mi.ParamFlags.NonDifferentiable)
            is_one = isinstance(value, (mi.Float, mi.Color3f)) and dr.width(value) == 1
            if is_smooth and is_one and (centre := float(np.array(value, float).ravel()[0])):
                # Leave room for differences: reflectances must not exceed 1.
                is_share = "reflectance" in key or centre == 1
                centre = min(max(centre, 0.1), 0.9) if is_share else centre
                yield key, centre, partial(self._changed, key, type(value), light, view)

    def _made(self, **instead: Any) -> Any:
        try:
            made = mi.load_dict(self.scattering | instead)
        except RuntimeError as error:
            said = str(error).strip().splitlines()
            reason = " ".join(" ".join(said[-2:] if "Traceback" in str(error) else said).split())
            raise InputError(
                f"BSDF {self.plugin!r} with {self.parameters} cannot be made: give a BSDF type of"
                " Mitsuba or of a file, FILE.py:NAME, and its parameters as -p name=value. Mitsuba"
                f" reports: {reason}"
            ) from error
        if not isinstance(made, mi.BSDF):
            raise InputError(
                f"{self.plugin!r} is a plugin of Mitsuba, but not a BSDF. Give one, such as"
                " roughplastic."
            )
        return made

    def _changed(self, key: str, kind: type, light: Floats, view: Floats, number: Any) -> Any:
        # Made for each derivative: the one under audit keeps its values.
        bsdf = self._made()
        parameters = mi.traverse(bsdf)
        parameters[key] = kind(number)
        parameters.update()
        return dr.mean(furnace.evaluate(bsdf, light, view))
