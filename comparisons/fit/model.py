"""Images as functions of the parameters that are fitted, with their derivatives.

For Phong's model, in a vector of numbers:

=============  ======================================  ==================  ================
Parameter      Number in the vector                    Bounds              A natural change
=============  ======================================  ==================  ================
``k_a, k_d``   itself                                  0 to 1              1
``k_s``        the lobe's albedo at normal incidence,  0 to 1              1
               ``k_s`` over
               :func:`heuristic.terms.normalisation`
``n``          ``ln n``                                :data:`EXPONENTS`   a factor e
an intensity   ``ln`` of a factor on the paired one    :data:`FACTORS`     a factor e
=============  ======================================  ==================  ================

An image shows the lobe's albedo for any ``n``, so the two are nearly independent in the search. A
coefficient is one number if it is grey in the scene, and three if it has a colour. With a texture
it is a factor on it. If the loss sees luminance alone, it is its largest component, with the others
in proportion.

The model (8.10) is linear in its coefficients: an image is a sum of coefficients times *bases*,
images of the ambient, diffuse and specular term alone. The kernel renders them with coefficients of
1; Dr.Jit differentiates the specular one by ``n`` in forward mode. So one call of the kernel per
material gives an image with its whole Jacobian.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import log
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from comparisons.fit.surface import COEFFICIENTS, Surface
from heuristic.convention import Colour
from heuristic.heuristics import Heuristic
from heuristic.kernel import shade
from heuristic.materials import Material
from reference.pairing.factors import Phong, alpha_of, exponent_of, specular_albedo
from reference.rendering.renderer import Renderer, variant

EXPONENTS = (0.5, 4096.0)
"""Below, a lobe is as broad as the hemisphere; above, it is narrower than a pixel's view of it."""

FACTORS = (1 / 64, 64.0)

LARGEST_FACTOR = 4.0
"""On a texture, whose values are unknown here."""


@dataclass(frozen=True)
class FitParameter:
    """One number to be fitted.

    Attributes
    ----------
    name
        ``k_a``, ``k_d``, ``k_s``, ``n`` or ``intensity``, or a name that a heuristic declares.
    owner
        Index of the material, or of the light.
    paired, low, high
        Value by the pairing table, and bounds, as in the vector.
    tint
        RGB of which a coefficient is a multiple.
    channel
        ``R``, ``G`` or ``B`` of a coefficient with three numbers, otherwise empty.
    is_factor
        Whether the number is a factor on a texture.
    """

    name: str
    owner: int
    paired: float
    low: float
    high: float
    tint: tuple[float, ...] = (1.0, 1.0, 1.0)
    channel: Any = ""
    is_factor: bool = False

    @property
    def is_linear(self) -> bool:
        """Whether the image is linear in it."""
        return self.name in COEFFICIENTS


def parameters(
    surface: Surface, form: str, sees_colour: bool = True, intensities: bool = False
) -> tuple[FitParameter, ...]:
    """Return the parameters that a fit of one form has on a surface, material by material.

    If ``intensities`` are fitted, the first light keeps its own: only the products of intensities
    with ``k_d`` and ``k_s`` show.
    """
    fitted: list[FitParameter] = []
    for owner, material in enumerate(surface.materials):
        phong = Phong(material.k_d, material.k_s, material.n, material.form, material.normalised)
        paired = {"k_a": material.k_a, "k_d": material.k_d, "k_s": tuple(specular_albedo(phong))}
        if ambient_of(surface, intensities) is None:
            del paired["k_a"]
        for name, colour in paired.items():
            if name in surface.samples[owner]:
                value = float(colour[0])
                fitted.append(FitParameter(name, owner, value, 0.0, LARGEST_FACTOR, is_factor=True))
            else:
                fitted += _coefficients(name, owner, colour, sees_colour)
        n = exponent_of(alpha_of(material.n, material.form), form)
        low, high = EXPONENTS
        fitted.append(FitParameter("n", owner, log(min(max(n, low), high)), log(low), log(high)))
    if intensities:
        low, high = map(log, FACTORS)
        others = range(1, len(surface.lights))
        fitted += [FitParameter("intensity", light, 0.0, low, high) for light in others]
    return tuple(fitted)


def _coefficients(name: str, owner: int, paired: Colour, sees_colour: bool) -> list[FitParameter]:
    """Return the parameters of one coefficient without a texture."""
    largest = float(max(paired))
    if np.ptp(paired) <= 1e-6 * largest:
        return [FitParameter(name, owner, largest, 0.0, 1.0)]
    if not sees_colour:
        return [FitParameter(name, owner, largest, 0.0, 1.0, tuple(np.divide(paired, largest)))]
    return [
        FitParameter(name, owner, float(paired[i]), 0.0, 1.0, tuple(np.eye(3)[i]), channel)
        for i, channel in enumerate("RGB")
    ]


def ambient_of(surface: Surface, intensities: bool) -> Colour | None:
    """Return ``I_a``, None if there is none to fit.

    If intensities are fitted and the scene has no ambient light, it is 1: the image shows only
    ``I_a k_a``.
    """
    if isinstance(surface.ambient, int):
        return 1.0 if intensities else None
    return surface.ambient


def start(parameters: Sequence[FitParameter]) -> NDArray[np.float64]:
    """Return the paired values as a vector, moved into the bounds."""
    return np.array([min(max(p.paired, p.low), p.high) for p in parameters])


def bounds(parameters: Sequence[FitParameter]) -> NDArray[np.float64]:
    """Return the lower and upper bounds as two vectors."""
    return np.array([[p.low for p in parameters], [p.high for p in parameters]])


class PhongModel:
    """The heuristic half of a scene as a function of its parameters, for one form of the lobe.

    ``vector`` is the type of the kernel's arrays, such as one of double precision.
    """

    def __init__(
        self,
        surface: Surface,
        form: str,
        parameters: Sequence[FitParameter],
        vector: Any = None,
    ) -> None:
        self.surface, self.form, self.parameters = surface, form, parameters
        self.linear = np.array([parameter.is_linear for parameter in parameters], bool)
        self._vector = vector or mi.Vector3f
        # Lights by number, those of one factor together.
        numbers = list(range(len(surface.lights)))
        self._groups = [numbers] if numbers else []
        if any(parameter.name == "intensity" for parameter in parameters):
            self._groups = [[number] for number in numbers]
        self._ambient, self._diffuse = cache(self._ambient_basis), cache(self._diffuse_bases)
        self._points = cache(self._point)
        self._lobes: dict[int, tuple[float, NDArray, NDArray]] = {}
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

    def place_of_exponent(self, owner: int) -> int:
        """Return the index of a material's ``n``."""
        ((place, _),) = (
            (i, p) for i, p in enumerate(self.parameters) if (p.name, p.owner) == ("n", owner)
        )
        return place

    def _columns(self, x):
        result = np.empty((len(x), *self.surface.fixed.shape))
        factors = np.ones(len(self._groups))
        for number, parameter in zip(x, self.parameters, strict=True):
            if parameter.name == "intensity":
                factors[parameter.owner] = np.exp(number)
        diffuse, albedo = self.coefficients(x, "k_d"), self.coefficients(x, "k_s")
        exponents = {owner: float(np.exp(x[self.place_of_exponent(owner)])) for owner in albedo}
        lobes = {owner: self._lobe(owner, n) for owner, n in exponents.items()}
        for place, parameter in enumerate(self.parameters):
            owner = parameter.owner
            if parameter.name == "k_a":
                column = self._ambient(owner) * parameter.tint
            elif parameter.name == "k_d":
                column = self._diffuse(owner) @ factors * parameter.tint
            elif parameter.name == "k_s":
                column = lobes[owner][1] @ factors * parameter.tint
            elif parameter.name == "n":
                column = lobes[owner][2] @ factors * albedo[owner]
            else:
                column = factors[owner] * sum(
                    self._diffuse(material)[..., owner] * diffuse[material]
                    + lobes[material][1][..., owner] * albedo[material]
                    for material in albedo
                )
            result[place] = column
        return result

    def _ambient_basis(self, owner):
        """Return the ambient basis of a material, (N, 3)."""
        return self._basis(owner, "k_a", [], ambient_of(self.surface, intensities=True))

    def _diffuse_bases(self, owner):
        """Return the diffuse bases of a material, (N, 3, groups of lights)."""
        return self._stacked([self._basis(owner, "k_d", group) for group in self._groups])

    def _lobe(self, owner, n):
        """Return ``n``, the specular bases of a material, and their derivatives by ``ln n``."""
        if owner not in self._lobes or self._lobes[owner][0] != n:
            pairs = [self._specular(owner, n, group) for group in self._groups]
            bases, derivatives = zip(*pairs, strict=True) if pairs else ((), ())
            self._lobes[owner] = n, self._stacked(bases), self._stacked(derivatives)
        return self._lobes[owner]

    def _specular(self, owner, n, group):
        exponent = dr.opaque(dr.value_t(self._vector), n)
        dr.enable_grad(exponent)
        lobe = {"n": exponent, "form": self.form, "normalised": True}
        value = self._shaded(owner, "k_s", group, **lobe)
        if value is None:
            return (np.zeros_like(self.surface.fixed),) * 2
        dr.forward_from(exponent)
        slope = dr.grad(value)
        dr.eval(value, slope)
        basis, derivative = (self.surface.pixels(owner, dr.detach(part)) for part in (value, slope))
        return basis, n * derivative

    def _basis(self, owner, name, group, ambient=0):
        value = self._shaded(owner, name, group, ambient)
        if value is None:
            return np.zeros_like(self.surface.fixed)
        return self.surface.pixels(owner, value)

    def _shaded(self, owner, name, group, ambient=0, **lobe):
        """Call the kernel with one coefficient of 1; None if no sample sees the material."""
        if not len(self.surface.samples[owner]["pixel"]):
            return None
        *place, textures, visible = self._points(owner)
        material = Material(**{name: textures.get(name, 1.0)}, **lobe)
        lights = [self.surface.lights[number] for number in group]
        masks = iter([visible[number] for number in group] if visible else ())
        test = (lambda toward, distance: next(masks)) if visible else None
        return shade(*place, material, lights, ambient, test)

    def _point(self, owner):
        """Return the kernel's arrays of a material: place, textures, and masks of the lights."""
        samples = self.surface.samples[owner]
        place = (self._vector(samples[key]) for key in ("position", "normal", "view"))
        textures = {key: mi.Color3f(samples[key]) for key in COEFFICIENTS if key in samples}
        lights = (f"light {number}" for number in range(len(self.surface.lights)))
        return *place, textures, [mi.Bool(samples[key]) for key in lights if key in samples]

    def _stacked(self, bases):
        return np.stack(bases, axis=-1) if bases else np.zeros((*self.surface.fixed.shape, 0))


class OwnModel:
    """The heuristic half of a scene as a function of the parameters that a heuristic declares.

    The heuristic need not be linear in anything, so an image is a rendering: the passes of the
    heuristic half, with the reference's seeds, over the pixels of a mask (H, W). Dr.Jit
    differentiates it by a parameter in forward mode, through the user's code. A step function
    (``ceil``, ``select``) has no derivative; that is one more reason to begin the search from
    several places.
    """

    def __init__(
        self, renderer: Renderer, heuristic: Heuristic, seeds: Sequence[int], counted: NDArray
    ) -> None:
        self.parameters = tuple(
            FitParameter(each.name, 0, each.default, each.low, each.high)
            for each in heuristic.parameters
        )
        self._renderer, self._seeds, self._counted = renderer, seeds, counted
        self._images: dict[bytes, NDArray] = {}
        self._columns: dict[bytes, NDArray] = {}

    def whole(self, x: NDArray) -> NDArray:
        """Return the whole image, (H, W, 3)."""
        key = x.tobytes()
        if key not in self._images:
            self._images = {key: self._rendered(x, None)}
        return self._images[key]

    def image(self, x: NDArray) -> NDArray:
        """Return the image (N, 3) of the counted pixels."""
        return self.whole(x)[self._counted]

    def columns(self, x: NDArray) -> NDArray:
        """Return the derivatives (number of parameters, N, 3) of the image."""
        key = x.tobytes()
        if key not in self._columns:
            images = [self._rendered(x, place)[self._counted] for place in range(len(x))]
            self._columns = {key: np.stack(images)}
        return self._columns[key]

    def _rendered(self, x: NDArray, by: int | None) -> NDArray:
        """Return the mean of the passes, or of their derivatives by one parameter."""
        integrator, scene = self._renderer.integrator, self._renderer.scene
        total = np.zeros(())
        with variant(self._renderer.variant):
            values = {one.name: mi.Float(v) for one, v in zip(self.parameters, x, strict=True)}
            dr.make_opaque(values)
            integrator.parameters = values
            if by is not None:
                varied = values[self.parameters[by].name]
                dr.enable_grad(varied)
            for seed in self._seeds:
                image = integrator.render(scene, seed=dr.opaque(mi.UInt32, seed),
                                          spp=self._renderer.spp)  # fmt: skip
                if by is not None:
                    dr.set_grad(varied, 1)
                    dr.enqueue(dr.ADMode.Forward, varied)
                    dr.traverse(dr.ADMode.Forward, dr.ADFlag.ClearInterior)
                    image = dr.grad(image)
                total = total + np.array(image, float)
        return total / len(self._seeds)
