"""Closed forms of lobes, with which an audit compares a heuristic or a BSDF.

Each is a response ``pi f |cos(theta_l)|`` (:mod:`fotismos.comparisons.audit.furnace`): that of
Mitsuba's plugin where there is one, else of the paper.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from fotismos.comparisons.audit import furnace
from fotismos.comparisons.audit.furnace import UP
from fotismos.comparisons.audit.subjects import Subject, white
from fotismos.comparisons.textbook import COSINES, lobe
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import unknown

ROUGHNESS = 0.3
"""Roughness of a BSDF's or a metal's lobe, and sigma of Oren and Nayar's, that are compared."""

LIGHTS = (0.0, 30.0, 60.0)
VIEWS = np.arange(-80.0, 81.0, 5.0)
"""Degrees from the normal, in the plane of incidence; the light's side is negative."""

SEEN_SHARE = 0.02
"""Values below this share of the lobe's largest are left out."""

LARGEST_DIFFERENCE = 0.05
"""Largest relative difference of a lobe that is the closed form's."""

Response = Callable[[float, Floats, Floats], Floats]
"""Of a roughness, and of directions to light and viewer (3, N): values (C, N) or (N,)."""


@dataclass(frozen=True)
class ClosedForm:
    """A lobe by its name and source; if it ``is_rough``, of white metal, else matte."""

    name: str
    source: str
    response: Response
    is_rough: bool


def _conductor(distribution: str) -> Response:
    def response(alpha: float, light: Floats, view: Floats) -> Floats:
        plugin = {"type": "roughconductor", "material": "none", "alpha": alpha}
        return furnace.of_bsdf(mi.load_dict(plugin | {"distribution": distribution}))(light, view)

    return response


def _textbook(form: str) -> Response:
    def response(alpha: float, light: Floats, view: Floats) -> Floats:
        metal = white(form)[f"metal, alpha {alpha:g}"]
        along = COSINES[form](UP.T, light.T, view.T)
        value: Floats = metal["k_s"] * lobe(along, metal["n"], light.T[:, 2:])[:, 0]
        return value

    return response


def _oren_nayar(sigma: float, light: Floats, view: Floats) -> Floats:
    """Return the qualitative model of Oren and Nayar (SIGGRAPH 1994), equation 30."""
    square = sigma**2
    even = 1 - 0.5 * square / (square + 0.33)
    towards_light = 0.45 * square / (square + 0.09)
    incidence = light[2]
    s = (light * view).sum(axis=0) - incidence * view[2]
    bright = np.maximum(s, 0) / np.maximum(np.maximum(incidence, view[2]), 1e-6)
    value: Floats = incidence * (even + towards_light * bright)
    return value


CLOSED_FORMS = {
    form.name: form
    for form in (
        ClosedForm("ggx", "Mitsuba's roughconductor", _conductor("ggx"), is_rough=True),
        ClosedForm("beckmann", "Mitsuba's roughconductor", _conductor("beckmann"), is_rough=True),
        ClosedForm("phong", "equation 8.7, normalised", _textbook("phong"), is_rough=True),
        ClosedForm("blinn", "Blinn (1977), normalised", _textbook("blinn"), is_rough=True),
        ClosedForm("lambert", "equation 8.3", lambda alpha, light, view: light[2], is_rough=False),
        ClosedForm("oren-nayar", "Oren and Nayar (1994)", _oren_nayar, is_rough=False),
    )
}


@dataclass(frozen=True)
class Ratio:
    """A lobe over its closed form, where it differs most."""

    light: float
    value: float
    case: str


def ratios(subject: Subject, name: str) -> Iterator[Ratio]:
    """Yield how a subject's lobe differs from a closed form, for each angle of the light."""
    form = CLOSED_FORMS.get(name)
    if form is None:
        raise unknown("closed form", name, CLOSED_FORMS)
    rough = [
        material
        for material, alpha in subject.materials.items()
        if alpha == ROUGHNESS and not material.startswith(("glossy", "mixed"))
    ]
    material = rough[0] if form.is_rough and rough else next(iter(subject.materials))
    view = furnace.direction(np.deg2rad(VIEWS), 0.0)
    for degrees in LIGHTS:
        light = np.broadcast_to(furnace.direction(np.deg2rad(-degrees), 0.0), view.shape)
        expected = np.broadcast_to(form.response(ROUGHNESS, light, view), (3, len(VIEWS))).max(
            axis=0
        )
        shown = subject.response(material, light, view).max(axis=0)
        is_seen = expected > SEEN_SHARE * expected.max()
        ratio = shown[is_seen] / expected[is_seen]
        # Half as bright is as wrong as twice as bright.
        worst = int(np.abs(np.log(np.maximum(ratio, 1e-9))).argmax())
        yield Ratio(
            light=degrees,
            value=float(ratio[worst]),
            case=f"{material}, viewer at {VIEWS[is_seen][worst]:g}°",
        )
