"""A Mitsuba BSDF under audit, by its ``eval``, ``sample`` and ``pdf``."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from comparisons.audit.angles import checked
from comparisons.audit.audit_record import Checked
from comparisons.audit.subject import ALPHAS, Setting, Subject, Tuned, random_and_mirrored
from comparisons.hard import furnace
from heuristic.errors import InputError

LEVEL = 0.001
"""Chance that correct densities fail, over all angles together."""

INCIDENT = (0.0, 45.0, 75.0)
"""Degrees at which samples are compared with the density."""

GRAZING = 1e-7

WHITE: dict[str, dict[str, Any]] = {
    "diffuse": {"reflectance": 1.0},
    "roughplastic": {"diffuse_reflectance": 1.0},
    "principled": {"base_color": {"type": "rgb", "value": 1.0}},
    "roughconductor": {"material": "none"},
    "phong": {"k_d": 1.0},
}
"""Parameters that make BSDFs white; other types keep Mitsuba's defaults."""


NARROWEST = {"alpha": 0.1, "alpha_u": 0.1, "alpha_v": 0.1, "roughness": 0.32}
"""Roughness below which neither quadrature nor the cells of χ² resolve the lobe."""

SHARPEST = 50.0
"""Phong's exponent above which they do not."""


class Scattering(Subject):
    """A BSDF of some type, with its parameters; those omitted are of :data:`WHITE`.

    If no roughness is given, and it has one, it is evaluated at each of :data:`ALPHAS`.

    Raises
    ------
    InputError
        For a type or parameter that Mitsuba rejects, and for BSDFs that transmit light or reflect
        it as a mirror does: no quadrature over directions covers them.
    """

    def __init__(self, plugin: str, given: Mapping[str, Any]) -> None:
        self.plugin, self.given = plugin, dict(given)
        _require_resolved(plugin, given)
        self.bsdf = self._made()
        if mi.has_flag(self.bsdf.flags(), mi.BSDFFlags.Transmission) or mi.has_flag(
            self.bsdf.flags(), mi.BSDFFlags.Delta
        ):
            raise InputError(
                f"BSDF {plugin!r} transmits light or reflects it as a mirror; an audit needs"
                " reflection with a density: give roughplastic, roughconductor or the like."
            )
        self.bsdfs = {plugin: self.bsdf}
        materials: dict[str, float | None] = {plugin: None}
        if key := self._roughness():
            of = {f"{plugin}, alpha {alpha:g}": alpha for alpha in ALPHAS}
            self.bsdfs = {
                name: self._made(**{key: alpha if key == "alpha" else alpha**0.5})
                for name, alpha in of.items()
            }
            materials = dict(of)
        super().__init__(materials)

    def evaluate(self, material: str, light: np.ndarray, view: np.ndarray) -> np.ndarray:
        return self._values(self.bsdfs[material], light, view)

    def settings(self) -> Iterator[Setting]:
        azimuth = np.deg2rad([0.0, 90.0, 180.0])
        heights = (0, GRAZING, 1e-3, 1, -1e-3, -1)
        all_of = [np.stack([np.cos(azimuth), np.sin(azimuth), np.full(3, z)]) for z in heights]
        along = np.concatenate(all_of, axis=1)
        along /= np.linalg.norm(along, axis=0)
        light = np.repeat(along, along.shape[1], axis=1)
        view = np.tile(along, along.shape[1])
        yield self._setting("grazing and from behind", {}, light, view)
        nothing, up = np.zeros((3, 1)), np.array([[0.0], [0.0], [1.0]])
        yield self._setting("a direction of length 0", {}, nothing, up)
        light, view = random_and_mirrored()
        if "alpha" in self._keys():
            for alpha in (1e-4, 1.0):
                yield self._setting(f"alpha = {alpha:g}", {"alpha": alpha}, light, view)

    def tuned(self) -> Iterator[Tuned]:
        light, view = furnace.random_pairs(512)
        for key, value in self._differentiable():
            centre = float(np.array(value, float).ravel()[0])
            if centre:
                # Leave room for differences: reflectances must not exceed 1.
                centre = min(max(centre, 0.1), 0.9) if "reflectance" in key else centre
                yield Tuned(key, centre, partial(self._tuned, key, type(value), light, view))

    def sampling(self) -> Checked:
        """Check the density of samples against ``pdf``: χ² over directions (Mitsuba's test)."""
        light, view = furnace.random_pairs(256)
        if not self.response(next(iter(self.materials)), light, view).any():
            return Checked(
                name="sampling", verdict="not asked", value=None, expected="p of χ²",
                worst="it reflects nothing",
            )  # fmt: skip
        found = {angle: self._p_value(angle) for angle in INCIDENT}
        worst = min(found, key=lambda angle: found[angle])
        bound = 1 - (1 - LEVEL) ** (1 / len(INCIDENT))  # Šidák
        expected = f"p of χ² at least {bound:.2g}"
        where = f"viewer at {worst:g}°"
        return checked("sampling", found[worst] >= bound, found[worst], expected, where)

    def _p_value(self, degrees: float) -> float:
        wi = mi.Vector3f(furnace.direction(np.deg2rad(degrees), 0.3))
        parameters = {"type": self.plugin} | self._parameters()
        sample, density = mi.chi2.BSDFAdapter(self.plugin, parameters, wi=wi)

        def above(wo: Any) -> Any:
            # Samples below the horizon weigh nothing: roughplastic's density there is irrelevant.
            return dr.select(wo.z > 0, density(wo), 0)

        test = mi.chi2.ChiSquareTest(
            mi.chi2.SphericalDomain(), sample, above, sample_dim=3,
            sample_count=200_000, ires=32, res=100,
        )  # fmt: skip
        test.run(LEVEL, len(INCIDENT), quiet=True)
        p = 0.0 if test.fail else float(np.array(test.p_value).ravel()[0])
        return p if np.isfinite(p) else 0.0

    def _parameters(self) -> dict[str, Any]:
        return WHITE.get(self.plugin, {}) | self.given

    def _made(self, **instead: Any) -> Any:
        try:
            return mi.load_dict({"type": self.plugin} | self._parameters() | instead)
        except RuntimeError as error:
            reason = " ".join(str(error).split())
            raise InputError(
                f"BSDF {self.plugin!r} with {self.given} cannot be made: give a Mitsuba BSDF type,"
                f" and its parameters as -p name=value. Mitsuba reports: {reason}"
            ) from error

    def _roughness(self) -> str:
        """Return the name of the roughness if it was not given; empty if there is none."""
        keys = set() if NARROWEST.keys() & self.given.keys() else self._keys()
        return (
            "alpha" if keys & {"alpha", "alpha_u"} else "roughness" if "roughness" in keys else ""
        )

    def _keys(self) -> set[str]:
        return {key.partition(".")[0] for key, _ in mi.traverse(self.bsdf)}

    def _differentiable(self) -> Iterator[tuple[str, Any]]:
        parameters = mi.traverse(self.bsdf)
        for key in parameters.keys():  # noqa: SIM118 not a mapping
            value = parameters[key]
            is_smooth = not (parameters.flags(key) & mi.ParamFlags.NonDifferentiable)
            if is_smooth and isinstance(value, (mi.Float, mi.Color3f)) and dr.width(value) == 1:
                yield key, value

    def _tuned(self, key: str, kind: type, light: np.ndarray, view: np.ndarray, number: Any) -> Any:
        bsdf = self._made()
        parameters = mi.traverse(bsdf)
        parameters[key] = kind(number)
        parameters.update()
        return dr.mean(_evaluated(bsdf, light, view))

    def _setting(
        self, words: str, change: Mapping[str, Any], light: np.ndarray, view: np.ndarray
    ) -> Setting:
        return Setting(
            words, lambda: self._values(self._made(**change), light, view), (light, view)
        )

    def _values(self, bsdf: Any, light: np.ndarray, view: np.ndarray) -> np.ndarray:
        return np.array(_evaluated(bsdf, light, view), float).reshape(3, -1)


def _require_resolved(plugin: str, given: Mapping[str, Any]) -> None:
    """Reject lobes that the quadrature would miss."""
    for name, least in NARROWEST.items():
        value = given.get(name, least)
        if isinstance(value, float) and not value >= least:
            raise InputError(
                f"BSDF {plugin!r}: {name} = {value:g} makes a lobe too narrow for the audit: give"
                f" {least:g} or more."
            )
    if isinstance(given.get("n"), float) and not given["n"] <= SHARPEST:
        raise InputError(
            f"BSDF {plugin!r}: n = {given['n']:g} makes a lobe too narrow for the audit: give"
            f" {SHARPEST:g} or less."
        )


def _evaluated(bsdf: Any, light: np.ndarray, view: np.ndarray) -> Any:
    """Return ``pi f cos(theta_l)``; Mitsuba's ``wi`` is the viewer's side."""
    count = max(light.shape[1], view.shape[1])
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(np.broadcast_to(view, (3, count)))
    toward = mi.Vector3f(np.broadcast_to(light, (3, count)))
    return dr.pi * mi.Spectrum(bsdf.eval(mi.BSDFContext(), si, toward))
