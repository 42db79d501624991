"""Reading the spectra of plugin parameters, alike in all variants."""

from numbers import Real

import drjit as dr
import mitsuba as mi

from heuristic import colours


def coefficient(props, name):
    """Read a reflection coefficient, 0 where it is not given.

    Up to 1 it is a reflectance like any other of Mitsuba's, with the same spectrum for the same
    RGB; above 1, as ``k_s`` may be for a sharp lobe, it needs Mitsuba's unbounded kind.
    """
    value = _plain(props, name, 0.0)
    if value is not None and max(value) > 1:
        return props.get_unbounded_texture(name)
    return props.get_texture(name, 0.0)


def emitted(props, name, default):
    """Read an emitted spectrum as Mitsuba's emitters do: a plain number is white.

    Zero is read as the unbounded kind, because Mitsuba cannot make a white spectrum out of nothing.
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


def may_be_nonzero(texture):
    """Tell whether a texture can be other than zero anywhere; one that cannot tell counts as so."""
    if texture.is_spatially_varying():
        return True
    try:
        return dr.max(texture.max()) > 0
    except RuntimeError:
        return True
