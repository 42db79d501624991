"""Lights of an export as KHR_lights_punctual has them, and what they lose.

glTF's lights fall off as ``1 / d^2``. A spot is even up to its inner angle ``i``, and beyond its
outer angle ``o``, at most 90 degrees, it is dark; between them it is ``((cos t - cos o) / (cos i -
cos o))^2``, the form that the extension recommends.
"""

from typing import Any

import drjit as dr
import numpy as np

from fotismos.comparisons.plain_scene import PlainScene
from fotismos.heuristic.convention import IRRADIANCE_PER_INTENSITY
from fotismos.heuristic.lights import INTENSITIES, PLUGINS, light_fields
from fotismos.reference.pairing.lamps import power_falloff, power_flux

WHITE = (1.0, 1.0, 1.0)

EVEN = 1 - 1e-4
"""Inner over outer angle of an even cone: glTF wants the inner one to be smaller."""


def light(given: dict[str, Any], scene: PlainScene) -> tuple[dict[str, Any], list[str]]:
    """Return a light of a scene as glTF, and its losses as sentences.

    Its intensity is ``pi I_p0 / k2``, candela, or ``pi I_p``, lux. With another fall-off the
    irradiance is the same on average over the surface that the camera sees, as in a pair.
    """
    intensity = given.get("diffuse_intensity", given["intensity"])
    exponent = given.get("exponent", 0.0)
    factor = IRRADIANCE_PER_INTENSITY
    losses = []
    cone: dict[str, float] = {}
    if "position" not in given:
        kind = "directional"
    elif "cutoff" not in given:
        kind = "point"
    elif given["cutoff"] > 90 and exponent == 0:
        kind = "point"
        losses.append(f"its cone of {given['cutoff']:.4g} degrees: glTF has none wider than 90")
    else:
        kind = "spot"
        inner, outer, error = cone_of(given["cutoff"], exponent)
        cone = {"innerConeAngle": inner, "outerConeAngle": outer}
        if exponent:
            losses.append(
                f"its fall-off cos^{exponent:.4g} becomes glTF's, of the same flux and intensity"
                f" ahead; elsewhere it differs by up to {100 * error:.2g} % of that"
            )
    if kind != "directional":
        k0, k1, k2 = given["attenuation"]
        if (k0, k1) == (0, 0) and not given.get("clamped"):
            factor /= k2
        else:
            factor *= _ratio(given, cone, scene)
            losses.append(
                f"its fall-off, attenuation ({k0:.4g}, {k1:.4g}, {k2:.4g}), becomes 1 / d^2, of the"
                " same mean irradiance over what the camera sees"
            )
    if given.get("specular_intensity", intensity) != intensity:
        losses.append("its specular intensity: glTF has one intensity, here the diffuse one")
    # glTF splits light into a colour up to 1 and an intensity; a dark light must not divide by 0.
    largest = max(*intensity, 1e-30)
    as_gltf = {
        "name": given["name"],
        "type": kind,
        "color": [value / largest for value in intensity],
        "intensity": factor * largest,
        "extras": {key: value for key, value in given.items() if key not in ("name", "type")},
    }
    if cone:
        as_gltf["spot"] = cone
    return as_gltf, [f"{given['name']}: {loss}" for loss in losses]


def cone_of(cutoff: float, exponent: float) -> tuple[float, float, float]:
    """Return inner and outer angle of the cone nearest to ``cos^m``, and its largest error.

    ``cutoff`` is in degrees, the angles are in radians. The intensity ahead and the flux stay: for
    the flux ``F = int cos^m d cos``, ``3 - 2 cos i - cos o = 3 F``. Of the cones that have it, the
    one of the least mean square error over the solid angle is taken. For ``m = 1`` to 90 degrees
    ``cos i`` is 3 / 4.
    """
    cutoff = min(cutoff, 90.0)
    if exponent == 0:
        even = float(np.radians(cutoff))
        return even * EVEN, even, 0.0
    edge = float(np.cos(np.radians(cutoff)))
    flux = power_flux(cutoff, exponent)
    # Beyond 12 times its flux, a sharp beam is below e^-12.
    cosine = np.linspace(max(edge, 1 - 12 * flux), 1, 4096)
    given = power_falloff(np.degrees(np.arccos(cosine)), exponent)
    outer_cosines = np.linspace(max(edge, 1 - 3 * flux), 1 - flux, 256, endpoint=False)
    inner_cosines = np.minimum((3 - 3 * flux - outer_cosines) / 2, 1)
    between = (cosine - outer_cosines[:, None]) / (inner_cosines - outer_cosines)[:, None]
    off = np.clip(between, 0, 1) ** 2 - given
    best = int(np.argmin(np.mean(off**2, axis=1)))
    inner = float(np.arccos(inner_cosines[best]))
    outer = float(np.arccos(outer_cosines[best]))
    return min(inner, outer * EVEN), outer, float(np.abs(off[best]).max())


def _ratio(given: dict[str, Any], cone: dict[str, float], scene: PlainScene) -> float:
    """Return the mean irradiance of a light over that of ``1 / d^2`` in glTF's cone."""
    seen = scene.layers["shape"] > 0
    offset = np.array(given["position"]) - scene.layers["P"][seen].astype(float)
    distance = np.maximum(np.linalg.norm(offset, axis=1), np.finfo(float).tiny)
    toward = offset / distance[:, None]
    lambert = np.maximum(np.sum(toward * scene.layers["N"][seen], axis=1), 0)
    physical = 1 / distance**2
    if cone:
        axis = np.array(given["direction"]) / np.linalg.norm(given["direction"])
        inner = np.cos(cone["innerConeAngle"])
        outer = np.cos(cone["outerConeAngle"])
        physical = physical * np.clip((-toward @ axis - outer) / (inner - outer), 0, 1) ** 2
    textbook = _arriving(given, scene.layers["P"][seen])
    here = float(np.sum(lambert * textbook))
    there = float(np.sum(lambert * physical))
    return here / there if there > 0 else 1.0


def _arriving(given: dict[str, Any], positions: np.ndarray) -> np.ndarray:
    """Return the light (N,) of a lamp of intensity 1 at positions (N, 3), by the kernel."""
    kind = PLUGINS[f"heuristic_{given['type']}"]
    fields = {name: given[name] for name in light_fields(kind) if name in given}
    lamp = kind(**fields | dict.fromkeys(fields.keys() & INTENSITIES, WHITE))
    arrival = lamp.illuminate(dr.llvm.Array3f64(positions.T.astype(float)))
    colours = np.broadcast_to(np.array(arrival.diffuse, float), (3, len(positions)))
    arriving: np.ndarray = colours[0]
    return arriving


def node(given: dict[str, Any], number: int) -> dict[str, Any]:
    """Return the node of a light, whose -z is the direction in which it shines."""
    matrix = np.eye(4)
    if "direction" in given:
        z = -np.array(given["direction"], float) / np.linalg.norm(given["direction"])
        side = np.cross([0, 1, 0] if abs(z[1]) < 0.9 else [1, 0, 0], z)
        side /= np.linalg.norm(side)
        matrix[:3, :3] = np.stack([side, np.cross(z, side), z], axis=1)
    matrix[:3, 3] = given.get("position", (0, 0, 0))
    extensions = {"KHR_lights_punctual": {"light": number}}
    return {"name": given["name"], "extensions": extensions, "matrix": matrix.T.ravel().tolist()}
