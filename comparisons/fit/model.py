"""Images of the heuristic model, and their derivatives by every parameter.

The model (8.10) is linear in its coefficients: an image is a sum of coefficients times *bases*,
images of the ambient, diffuse and specular term alone. The kernel renders them with coefficients of
1; Dr.Jit differentiates the specular one by ``n`` in forward mode, since one ``n`` acts on all
pixels. So one call of the kernel per material gives an image with its whole Jacobian.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from comparisons.fit.parameters import Parameter, ambient_of
from comparisons.fit.samples import Surface
from heuristic.materials import Material
from heuristic.shading import shade


class Model:
    """The heuristic half of a scene as a function of its parameters.

    Parameters
    ----------
    surface
        The surface that is seen.
    form
        Of the lobe, ``phong`` or ``blinn``.
    parameters
        The parameters in the vectors of the methods.
    """

    def __init__(self, surface: Surface, form: str, parameters: Sequence[Parameter]):
        self.surface = surface
        self.form = form
        self.parameters = parameters
        self.linear = np.array([parameter.is_linear for parameter in parameters], bool)
        self._groups = [list(surface.lights)] if surface.lights else []
        if any(parameter.name == "intensity" for parameter in parameters):
            self._groups = [[light] for light in surface.lights]
        self._ambient, self._diffuse = cache(self._ambient_basis), cache(self._diffuse_bases)
        self._lobes: dict[int, _Lobe] = {}
        self._last: tuple[bytes, NDArray] | None = None

    def image(self, x: NDArray) -> NDArray[np.float64]:
        """Return the image (N, 3) of the surface's pixels for a vector of parameters."""
        columns = self.columns(x)[self.linear]
        return self.surface.fixed + np.tensordot(x[self.linear], columns, 1)

    def columns(self, x: NDArray) -> NDArray[np.float64]:
        """Return the derivatives (number of parameters, N, 3) of the image."""
        key = x.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self._columns(x)
        return self._last[1]

    def coefficients(self, x: NDArray, name: str) -> dict[int, NDArray]:
        """Return RGB of a coefficient for each material (for ``k_s``, the lobe's albedo)."""
        sums = {owner: np.zeros(3) for owner in range(len(self.surface.samples))}
        for number, parameter in zip(x, self.parameters, strict=True):
            if parameter.name == name:
                sums[parameter.owner] += number * np.array(parameter.tint)
        return sums

    def exponent(self, x: NDArray, material: int) -> float:
        """Return ``n`` of a material."""
        (number,) = (
            number
            for number, parameter in zip(x, self.parameters, strict=True)
            if (parameter.name, parameter.owner) == ("n", material)
        )
        return float(np.exp(number))

    def _columns(self, x):
        result = np.empty((len(x), *self.surface.fixed.shape))
        factors = self._factors(x)
        diffuse, albedo = self.coefficients(x, "k_d"), self.coefficients(x, "k_s")
        lobes = [self._lobe(owner, self.exponent(x, owner)) for owner in albedo]
        for place, parameter in enumerate(self.parameters):
            owner = parameter.owner
            if parameter.name == "k_a":
                column = self._ambient(owner) * parameter.tint
            elif parameter.name == "k_d":
                column = self._diffuse(owner) @ factors * parameter.tint
            elif parameter.name == "k_s":
                column = lobes[owner].value @ factors * parameter.tint
            elif parameter.name == "n":
                column = lobes[owner].derivative @ factors * albedo[owner]
            else:
                column = factors[owner] * sum(
                    self._diffuse(material)[..., owner] * diffuse[material]
                    + lobes[material].value[..., owner] * albedo[material]
                    for material in albedo
                )
            result[place] = column
        return result

    def _factors(self, x):
        """Return the factor on each group of lights."""
        factors = np.ones(len(self._groups))
        for number, parameter in zip(x, self.parameters, strict=True):
            if parameter.name == "intensity":
                factors[parameter.owner] = np.exp(number)
        return factors

    def _ambient_basis(self, owner):
        """Return the ambient basis of a material, (N, 3)."""
        return self._basis(owner, "k_a", [], ambient_of(self.surface, intensities=True))

    def _diffuse_bases(self, owner):
        """Return the diffuse bases of a material, (N, 3, groups of lights)."""
        return self._stacked([self._basis(owner, "k_d", lights) for lights in self._groups])

    def _lobe(self, owner, n):
        """Return the specular bases of a material, and their derivatives by ``ln n``."""
        if owner not in self._lobes or self._lobes[owner].n != n:
            pairs = [self._specular(owner, n, lights) for lights in self._groups]
            bases, derivatives = zip(*pairs, strict=True) if pairs else ((), ())
            self._lobes[owner] = _Lobe(n, self._stacked(bases), self._stacked(derivatives))
        return self._lobes[owner]

    def _specular(self, owner, n, lights):
        float_type = dr.value_t(type(self.surface.samples[owner].position))
        exponent = dr.opaque(float_type, n)
        dr.enable_grad(exponent)
        lobe = {"n": exponent, "form": self.form, "normalised": True}
        value = self._shaded(owner, "k_s", lights, **lobe)
        if value is None:
            return (np.zeros_like(self.surface.fixed),) * 2
        dr.forward_from(exponent)
        slope = dr.grad(value)
        dr.eval(value, slope)
        samples = self.surface.samples[owner]
        pixels = (self.surface.pixels(samples, dr.detach(part)) for part in (value, slope))
        basis, derivative = pixels
        return basis, n * derivative

    def _basis(self, owner, name, lights, ambient=0):
        value = self._shaded(owner, name, lights, ambient)
        if value is None:
            return np.zeros_like(self.surface.fixed)
        return self.surface.pixels(self.surface.samples[owner], value)

    def _shaded(self, owner, name, lights, ambient=0, **lobe):
        """Call the kernel with one coefficient of 1; None if no sample sees the material."""
        samples = self.surface.samples[owner]
        if not len(samples.pixel):
            return None
        material = Material(**{name: samples.textures.get(name, 1.0)}, **lobe)
        return shade(
            samples.position,
            samples.normal,
            samples.view,
            material,
            lights,
            ambient,
            samples.shadow_test(),
        )

    def _stacked(self, bases):
        return np.stack(bases, axis=-1) if bases else np.zeros((*self.surface.fixed.shape, 0))


@dataclass(frozen=True)
class _Lobe:
    """Specular bases (N, 3, groups of lights) at ``n``, and their derivatives by ``ln n``."""

    n: float
    value: np.ndarray
    derivative: np.ndarray
