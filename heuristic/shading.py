"""The shading kernel: the whole illumination model at many points at once (8.10)."""

import drjit as dr

from heuristic import colours, terms
from heuristic.lighting import sum_lights


def shade(position, normal, view, material, lights, ambient=0, visible=None):
    """Equations 8.10-8.12, 6.11-6.15: the sum of all terms over all lights.

    ``I = k_i + I_a k_a + sum_k I_p0^k f_att^k [k_d (N.L^k) + k_s (R^k.V)^n]``, evaluated for each
    wavelength (8.11) or for RGB (8.12, 6.13-6.15). Lights at or below the horizon (``N.L <= 0``)
    give neither diffuse nor specular light. Only terms that can be other than zero are traced: a
    coefficient of 0, or an empty list of lights, leaves no instruction behind.

    Parameters
    ----------
    position, normal, view
        Dr.Jit arrays of three components, of any float type: ``P``, ``N`` and ``V``, in one space.
        Normals and views of any length are normalised; a zero vector receives no light.
    material : Material
        The coefficients.
    lights : sequence of PointLight, DirectionalLight or SpotLight
        Any number of them. Numbers in up to :data:`heuristic.lighting.BLOCK` lights, and in the
        material, are compiled into the kernel; opaque Dr.Jit values are not.
    ambient
        ``I_a``: a number, RGB, one value for each wavelength, or a Dr.Jit array.
    visible : callable, optional
        ``visible(toward, distance)`` returns a mask of the points that a light in that direction,
        at that distance, reaches. The chapters' model has no shadows; without it nothing is hidden.

    Returns
    -------
    Dr.Jit array
        The display-linear value: a float where all coefficients are single numbers, otherwise a
        colour with one component for each wavelength.

    Raises
    ------
    InputError
        For a negative or non-finite ``ambient``, or mixed numbers of wavelengths.

    Examples
    --------
    Two points under a light from straight above, the second of them tilted:

    >>> from heuristic import DirectionalLight, Material, shade
    >>> from drjit.auto import Array3f
    >>> sun = DirectionalLight(direction=(0, 0, -1), intensity=1.0)
    >>> normals = Array3f([0, 0.6], [0, 0], [1, 0.8])
    >>> shade(Array3f(0), normals, Array3f(0, 0, 1), Material(k_d=0.5), [sun])
    [0.5, 0.4]
    """
    ambient = colours.checked("ambient", ambient)
    _check_wavelengths(material, lights, ambient)
    vector_type = type(position)
    k_i, k_a, k_d, k_s, ambient = (
        colours.as_array(value, vector_type)
        for value in (material.k_i, material.k_a, material.k_d, material.k_s, ambient)
    )

    present = []
    if not colours.is_zero(material.k_i):
        present.append(terms.emission(k_i))
    if not (colours.is_zero(material.k_a) or colours.is_zero(ambient)):
        present.append(terms.ambient(ambient, k_a))
    if lights:
        if material.normalised:
            k_s = k_s * terms.normalisation(material.form, material.n)
        diffuse, specular = sum_lights(position, normal, view, material, lights, visible)
        present += [
            coefficient * term
            for coefficient, term in ((k_d, diffuse), (k_s, specular))
            if term is not None
        ]
    return _total(present, dr.value_t(vector_type))


def _total(present, float_type):
    """Add up terms of any kind into one value of at least the kernel's float type."""
    total = float_type(0)
    for term in present:
        total = total + term
    return total


def _check_wavelengths(material, lights, ambient):
    values = {name: getattr(material, name) for name in ("k_i", "k_a", "k_d", "k_s")}
    values |= {f"lights[{i}].intensity": light.intensity for i, light in enumerate(lights)}
    colours.common_wavelength_count(values | {"ambient": ambient})
