"""Reading the spectra of plugin parameters in the same way in all variants."""

from numbers import Real
from typing import Any

import drjit as dr
import mitsuba as mi

from heuristic import colours


def coefficient(props: Any, name: str) -> Any:
    """Read a reflection coefficient, 0 if omitted.

    Up to 1 it is an ordinary reflectance of Mitsuba, with the same spectrum for the same RGB; above
    1, as ``k_s`` may be for a sharp lobe, it needs Mitsuba's unbounded kind.
    """
    value = _plain(props, name, 0.0)
    if value is not None and max(value) > 1:
        return props.get_unbounded_texture(name)
    return props.get_texture(name, 0.0)


def emitted(props: Any, name: str, default: Any) -> Any:
    """Read an emitted spectrum as Mitsuba's emitters do: a plain number is white.

    Zero is read as the unbounded kind, because Mitsuba cannot make a white spectrum of zero.
    """
    value = _plain(props, name, default)
    if value is not None and max(value) == 0:
        return props.get_unbounded_texture(name, 0.0)
    return props.get_emissive_texture(name, default)


def _plain(props, name, default):
    """Return a number's or colour's components, None for textures and tabulated spectra."""
    value = props.get(name, default)
    if not isinstance(value, Real | mi.ScalarColor3f | mi.ScalarColor3d):
        return None
    components = (float(value),) if isinstance(value, Real) else tuple(map(float, value))
    colours.checked(f"{props.plugin_name()}: {name}", components)
    return components


def may_be_nonzero(texture: Any) -> bool:
    """Return whether a texture can be non-zero anywhere; True if unknown."""
    if texture.is_spatially_varying():
        return True
    try:
        return dr.max(texture.max()) > 0
    except RuntimeError:
        return True
