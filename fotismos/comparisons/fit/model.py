"""Images as functions of the parameters that are fitted, with their derivatives.

For Phong's model, in a vector of numbers:

=============  ==============================================  ==================  ================
Parameter      Number in the vector                            Bounds              A natural change
=============  ==============================================  ==================  ================
``k_a, k_d``   itself                                          0 to 1              1
``k_s``        the lobe's albedo at normal incidence:          0 to 1              1
               ``k_s`` over
               :func:`fotismos.heuristic.terms.normalisation`
``n``          ``ln n``                                        :data:`EXPONENTS`   a factor e
=============  ==============================================  ==================  ================

An image shows the lobe's albedo for any ``n``, so the two are nearly independent in the search. A
coefficient is one number if it is grey in the scene, and three if it has a colour. With a texture
it is a factor on it.

The model (8.10) is linear in its coefficients: an image is a sum of coefficients times *bases*,
images of the ambient, diffuse and specular term alone. The kernel renders them with coefficients of
1; Dr.Jit differentiates the specular one by ``n`` in forward mode. So one call of the kernel per
material gives an image with its whole Jacobian.

Geometry does not change while parameters are fitted. So the *surface* that the camera sees is
rendered once, sample by sample, with the reference's rays (the same sampler, seeds and film).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from math import log
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fotismos.comparisons.fit.search import FitParameter, Model, bounded_minimum
from fotismos.comparisons.records.fit import Channel
from fotismos.heuristic.convention import Colour, Doubles, Floats, Interaction, Mask, Scene
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import Heuristic
from fotismos.heuristic.kernel import BLOCK, shade
from fotismos.heuristic.materials import Material
from fotismos.reference.pairing.factors import alpha_of, exponent_of, specular_albedo
from fotismos.reference.rendering.renderer import Renderer, variant

COEFFICIENTS = ("k_a", "k_d", "k_s")

EXPONENTS = (0.5, 4096.0)
"""Below, a lobe is as broad as the hemisphere; above, it is narrower than a pixel's view of it."""

LARGEST_FACTOR = 4.0
"""On a texture, whose values are unknown here."""

STARTS = (2.0, 8.0, 32.0, 128.0, 512.0)
"""Exponents of the form ``phong`` to start from; ``blinn`` has four times as large ones."""

OWN_STARTS = 6
"""Places within the bounds to start from for a heuristic's own parameters."""

REACH = 4.0
"""Starts of a parameter without bounds lie within this many times its default, or its unit."""


# --- The surface -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Surface:
    """All of an image of the textbook half but its parameters.

    The paired materials are in plain numbers; a coefficient with a texture is 1, a factor on it.
    ``samples`` of each material are those that see it from the side that is shaded, as arrays
    (..., S): ``position``, ``normal``, ``view``; ``pixel``, the index in reading order;
    coefficients that have a texture; and ``light 0``, …, the visibility of each light if some can
    be hidden. ``fixed`` (N, 3) is the light that no parameter changes: emission (8.1) and
    background. A pixel is the mean of its ``samples_per_pixel`` (box filter).
    """

    names: tuple[str, ...]
    materials: tuple[Material, ...]
    samples: tuple[dict[str, Floats], ...]
    lights: tuple[Any, ...]
    ambient: Colour
    fixed: Doubles
    samples_per_pixel: int

    def pixels(self, owner: int, values: Colour) -> Doubles:
        """Return the image (N, 3) of one value for each sample of a material."""
        pixel = self.samples[owner]["pixel"]
        count = len(self.fixed)
        rgb = np.broadcast_to(np.atleast_2d(np.array(values, np.float64)), (3, len(pixel)))
        sums = [np.bincount(pixel, channel, count) for channel in rgb]
        return np.stack(sums, axis=1) / self.samples_per_pixel


def see(renderer: Renderer, seeds: Sequence[int]) -> Surface:
    """Return the surface that passes of a textbook half with these seeds see.

    The half has Phong shading and a box filter.
    """
    with variant(renderer.variant):
        shading = renderer.integrator
        scene = renderer.scene
        bsdfs = shading.known(scene).materials.bsdfs
        names = _names(scene, bsdfs)
        _require_fittable(names, bsdfs)
        eye = _eye(shading)
        eyes = Renderer(
            scene,
            eye,
            pass_spp=renderer.pass_spp,
            label="textbook samples",
            size=renderer.size,
            is_traced=True,  # else it would see nothing
        )
        # The passes: each gives the fixed light as its image, and its samples.
        fixed: Any = 0.0
        passes = []
        for seed in seeds:
            fixed = fixed + np.array(eyes.render(seed), np.float64) / len(seeds)
            passes.append({key: np.array(values) for key, values in eye.seen.items()})
        # The copies suffice: the last pass need not stay in Dr.Jit's memory.
        eye.seen = None
        fixed = np.reshape(fixed, (-1, 3))
        count = len(passes[0]["material"])
        whole = {}
        for key in passes[0]:
            arrays = [samples[key] for samples in passes]
            # An orthographic camera has one view for all.
            whole[key] = np.concatenate(
                [np.broadcast_to(values, (*values.shape[:-1], count)) for values in arrays], axis=-1
            )
        # The samples of a pixel follow each other.
        spp = count // len(fixed)
        whole["pixel"] = np.tile(np.arange(count) // spp, len(passes))
        facing = whole.pop("facing")
        material = whole.pop("material")
        # Samples by material; a side that is not shaded is black for any parameters.
        samples = []
        for owner, bsdf in enumerate(bsdfs):
            without = set(COEFFICIENTS) - set(_textured(bsdf))
            shown = facing & (material == owner)
            samples.append({k: v[..., shown] for k, v in whole.items() if k not in without})
        point = dr.zeros(mi.SurfaceInteraction3f)
        return Surface(
            names=tuple(names),
            materials=tuple(map(_described, bsdfs)),
            samples=tuple(samples),
            lights=tuple(shading.lights(scene, point, True)),
            ambient=shading.ambient_at(point, True),
            fixed=fixed,
            samples_per_pixel=spp * len(passes),
        )


def _require_fittable(names: Sequence[str], bsdfs: Sequence[Any]) -> None:
    """Reject transparent materials (a sample has one surface), mirrors, and varying exponents."""
    for name, bsdf in zip(names, bsdfs, strict=True):
        if bsdf.is_clear:
            raise InputError(
                f"{name}: a fit needs opaque materials; glass, masks and `null` let light pass."
                " Replace it."
            )
        if bsdf.is_mirror:
            raise InputError(f"{name}: n is infinite: a mirror has no lobe to fit. Give a number.")
        if isinstance(bsdf.n, mi.Texture):
            raise InputError(
                f"{name}: n varies over the surface, and a fit has one n per material. Give its"
                " roughness as a number."
            )


def _eye(shading: Any) -> Any:
    """Return an integrator with the rays of ``shading``, which shows emission and background.

    Each rendering puts the points that ``shading`` would shade into ``seen``, by the names of
    :class:`Surface`.
    """
    base: Any = type(shading)

    class Eye(base):
        """See above."""

        def surface_colour(self, scene: Scene, si: Interaction, view: Any, active: Mask) -> Colour:
            normal, is_shaded = self.seen_side(scene, si, active)
            materials = self.known(scene).materials

            def read(name: str) -> Any:
                """Return one coefficient of the material at each sample, as the scene gives it."""
                readers = [partial(_coefficient, bsdf, name) for bsdf in materials.bsdfs]
                return materials.switch(readers, si, active)

            position = mi.Vector3f(si.p)
            seen = {
                "position": position,
                "normal": mi.Vector3f(normal),
                "view": view,
                "facing": active & is_shaded,
                "material": materials.index(si, active),
            }
            for name in {name for bsdf in materials.bsdfs for name in _textured(bsdf)}:
                seen[name] = read(name)
            visible = self.visibility(scene, si, active)
            if visible is not None:
                for index, light in enumerate(self.lights(scene, si, active)):
                    arrival = light.illuminate(position)
                    seen[f"light {index}"] = visible(arrival.toward, arrival.distance)
            dr.schedule(seen)
            self.seen = seen
            return dr.select(active & is_shaded, read("k_i"), 0)

    props = mi.Properties("heuristic")
    props["hide_emitters"] = shading.hide_emitters
    props["occlusion"] = shading.occlusion
    return Eye(props)


def _coefficient(bsdf: Any, name: str, si: Any, active: Any = True) -> Any:
    return mi.Color3f(getattr(bsdf, name).eval(si, active))


def _textured(bsdf: Any) -> list[str]:
    return [name for name in COEFFICIENTS if getattr(bsdf, name).is_spatially_varying()]


def _described(bsdf: Any) -> Material:
    """Return a ``phong`` as a material of plain numbers; a coefficient with a texture is 1."""

    def plain(values: Any) -> Any:
        # The scene's numbers are the shortest decimals of single precision.
        return tuple(float(str(np.float32(value))) for value in np.ravel(values))

    point = dr.zeros(mi.SurfaceInteraction3f)
    coefficients: dict[str, Any] = dict.fromkeys(COEFFICIENTS, (1.0,) * 3)
    for name in set(COEFFICIENTS) - set(_textured(bsdf)):
        coefficients[name] = plain(_coefficient(bsdf, name, point))
    return Material(**coefficients, n=plain(bsdf.n)[0], form=bsdf.form, normalised=bsdf.normalised)


def _names(scene: Any, bsdfs: Sequence[Any]) -> list[str]:
    """Return a name for each material: its id, the id of its first shape, or a number.

    Shapes of an instanced group are not among the scene's.
    """
    shapes: dict[Any, str] = {}
    for shape in scene.shapes():
        shapes.setdefault(shape.bsdf(), shape.id())
    unnamed = {bsdf: f"unnamed material of {shape}" for bsdf, shape in shapes.items()}
    return [
        bsdf.id() or unnamed.get(bsdf, f"material {number}")
        for number, bsdf in enumerate(bsdfs, start=1)
    ]


# --- Phong's model -----------------------------------------------------------------------------


def phong_parameters(surface: Surface, form: str) -> tuple[FitParameter, ...]:
    """Return the parameters that a fit of one form has on a surface, material by material."""
    fitted: list[FitParameter] = []
    low, high = EXPONENTS
    for owner, material in enumerate(surface.materials):
        # As in the vector: the lobe by its albedo, not by `k_s`.
        paired = {"k_a": material.k_a, "k_d": material.k_d, "k_s": specular_albedo(material)}
        if isinstance(surface.ambient, int):  # no ambient light
            del paired["k_a"]
        for name, colour in paired.items():
            has_texture = name in surface.samples[owner]
            is_grey = has_texture or np.ptp(colour) <= 1e-6 * max(colour)
            channels: tuple[Channel, ...] = ("",) if is_grey else ("R", "G", "B")
            values = [max(colour)] if is_grey else colour
            is_scaled = name == "k_s" and not material.normalised
            fitted += [
                FitParameter(
                    name=name,
                    paired=float(value),
                    low=0.0,
                    high=LARGEST_FACTOR if has_texture else 1.0,
                    owner=owner,
                    held="albedo" if is_scaled else "itself",
                    channel=channel,
                    is_factor=has_texture,
                )
                for channel, value in zip(channels, values, strict=True)
            ]
        # The exponent of this form whose lobe is as wide as the scene's.
        n = exponent_of(alpha_of(material.n, material.form), form)
        fitted.append(
            FitParameter(
                name="n",
                paired=log(min(max(n, low), high)),
                low=log(low),
                high=log(high),
                owner=owner,
                held="logarithm",
            )
        )
    return tuple(fitted)


class PhongModel(Model):
    """The textbook half of a scene as a function of its parameters, for one form of the lobe.

    ``vector`` is the type of the kernel's arrays, such as one of double precision.
    """

    def __init__(
        self,
        surface: Surface,
        form: str,
        counted: NDArray[np.bool_] | None = None,
        vector: Any = None,
    ) -> None:
        self.surface = surface
        self.form = form
        self.names = surface.names
        self.counted = np.ones(len(surface.fixed), bool) if counted is None else counted
        seen = (np.unique(samples["pixel"]) for samples in surface.samples)
        self.reached = [int(self.counted[pixels].sum()) for pixels in seen]
        self.parameters = phong_parameters(surface, form)
        self.linear = np.array(
            [parameter.name in COEFFICIENTS for parameter in self.parameters], bool
        )
        self._vector = vector or mi.Vector3f
        self._points = cache(self._point)
        # Those of coefficients stay the same for all `x`; of the lobes, the last ones are kept.
        self._term = lru_cache(maxsize=4 * len(surface.names))(self._rendered)
        self._columns = lru_cache(maxsize=1)(self._derivatives)

    def whole(self, x: Floats) -> Doubles:
        # A sum over the coefficients; the rows by `n` are derivatives alone.
        columns = self.derivatives(x)[self.linear]
        return self.surface.fixed + np.tensordot(x[self.linear], columns, 1)

    def derivatives(self, x: Floats) -> Doubles:
        columns: Doubles = self._columns(tuple(x))
        return columns

    def starts(self, reference: Floats) -> list[Floats]:
        """Return the paired parameters, and lobes of several widths with coefficients to suit them.

        The latter are the best in linear RGB.
        """
        low, high = self.bounds
        paired = np.clip(self.paired, low, high)
        at_n = np.array([parameter.name == "n" for parameter in self.parameters])
        linear = self.linear
        starts: list[Floats] = [paired]
        for n in STARTS:
            x = np.where(at_n, log(n * 4 if self.form == "blinn" else n), paired)
            # At a given `n` the image is linear in its coefficients: a row (3 N,) for each.
            columns = self.columns(x)[linear].reshape(linear.sum(), -1)
            target = (reference - self.surface.fixed[self.counted]).ravel()
            x[linear] = bounded_minimum(
                columns @ columns.T, -columns @ target, low=low[linear], high=high[linear]
            )
            starts.append(x)
        return starts

    def coefficients(self, x: Floats, name: str) -> dict[int, Floats]:
        """Return RGB of a coefficient for each material (for ``k_s``, the lobe's albedo)."""
        sums: dict[int, Floats] = {owner: np.zeros(3) for owner in range(len(self.surface.samples))}
        for number, parameter in zip(x, self.parameters, strict=True):
            if parameter.name == name:
                sums[parameter.owner] += number * parameter.tint
        return sums

    def _derivatives(self, x: Floats) -> Any:
        result = np.empty((len(x), *self.surface.fixed.shape))
        albedo = self.coefficients(x, "k_s")
        for index, parameter in enumerate(self.parameters):
            owner = parameter.owner
            name = parameter.name
            if name in ("k_a", "k_d"):
                result[index] = self._term(owner, name)[0] * parameter.tint
                continue
            # A lobe of albedo 1: by `k_s` its basis, by `ln n` the slope times the albedo.
            n = float(np.exp(x[self.place_of_exponent(owner)]))
            basis, slope = self._term(owner, "k_s", n)
            result[index] = basis * parameter.tint if name == "k_s" else slope * albedo[owner]
        return result

    def _rendered(self, owner: int, name: str, n: float = 1.0) -> tuple[Doubles, Doubles]:
        """Return the basis (N, 3) of a material's coefficient, and its derivative by ``ln n``."""
        lights = () if name == "k_a" else self.surface.lights
        has_samples = len(self.surface.samples[owner]["pixel"])
        if not (has_samples and (lights or name == "k_a")):
            return (self.surface.pixels(owner, 0.0),) * 2
        position, normal, view, textures, masks = self._points(owner)
        # Opaque, so that another `n` compiles no kernel.
        exponent = dr.opaque(dr.value_t(self._vector), n)
        dr.enable_grad(exponent)
        coefficient = {name: textures.get(name, 1.0)}
        material = Material(**coefficient, n=exponent, form=self.form, normalised=True)
        ambient = self.surface.ambient if name == "k_a" else 0
        # Masks are in the order of the lights. The kernel asks for them in this order as long as
        # the lights fit into one block: more would be grouped by their kind.
        remaining = iter(masks)
        visible = (lambda toward, distance: next(remaining)) if masks else None
        value: Any = 0
        for begin in range(0, max(len(lights), 1), BLOCK):
            block = list(lights[begin : begin + BLOCK])
            value = value + shade(position, normal, view, material, block, ambient, visible)
        dr.forward_from(exponent)
        basis = dr.detach(value)
        slope = dr.grad(value)
        dr.eval(basis, slope)
        # `d / d ln n = n d / dn`.
        return self.surface.pixels(owner, basis), n * self.surface.pixels(owner, slope)

    def _point(self, owner: int) -> Any:
        """Return the kernel's arrays of a material: place, textures, and masks of the lights."""
        samples = self.surface.samples[owner]
        vectors = (self._vector(samples[key]) for key in ("position", "normal", "view"))
        textures = {key: mi.Color3f(samples[key]) for key in COEFFICIENTS if key in samples}
        lights = (f"light {number}" for number in range(len(self.surface.lights)))
        return *vectors, textures, [mi.Bool(samples[key]) for key in lights if key in samples]


# --- A heuristic's own parameters --------------------------------------------------------------


class OwnModel(Model):
    """The textbook half of a scene as a function of the parameters that a heuristic declares.

    An image is a rendering: the passes of the textbook half, with the reference's seeds, over the
    pixels of a mask (H, W). Dr.Jit differentiates it in forward mode, through the user's code. A
    step function has no derivative; that is one more reason for several starts.
    """

    def __init__(
        self,
        renderer: Renderer,
        heuristic: Heuristic,
        seeds: Sequence[int],
        counted: NDArray[np.bool_],
    ) -> None:
        self.parameters = tuple(
            FitParameter(
                name=parameter.name,
                paired=parameter.default,
                low=parameter.low,
                high=parameter.high,
            )
            for parameter in heuristic.parameters
        )
        self.form = heuristic.name
        self.names = (heuristic.name,)
        self.counted = counted.ravel()
        self.reached = [int(counted.sum())]
        self._renderer = renderer
        self._seeds = seeds
        # Room for an image, all its derivatives, and the image of a trial step.
        self._kept = lru_cache(maxsize=2 + len(self.parameters))(self._rendered)

    def whole(self, x: Floats) -> Doubles:
        return self._kept(tuple(x))

    def derivatives(self, x: Floats) -> Doubles:
        return np.stack([self._kept(tuple(x), index) for index in range(len(x))])

    def starts(self, reference: Floats) -> list[Floats]:
        """Return the defaults, and places within the bounds."""
        default = self.paired
        reach = REACH * np.maximum(np.abs(default), 1.0)
        low, high = self.bounds
        low = np.maximum(low, default - reach)
        high = np.minimum(high, default + reach)
        return [default, *np.random.default_rng(0).uniform(low, high, (OWN_STARTS, len(default)))]

    def _rendered(self, x: tuple[float, ...], by: int | None = None) -> Doubles:
        """Return the mean of the passes, or of their derivatives by one parameter."""
        integrator = self._renderer.integrator
        scene = self._renderer.scene
        total = np.zeros(())
        with variant(self._renderer.variant):
            values = {
                parameter.name: mi.Float(v) for parameter, v in zip(self.parameters, x, strict=True)
            }
            # Opaque, so that other values compile no kernel.
            dr.make_opaque(values)
            integrator.parameters = values
            if by is not None:
                varied = values[self.parameters[by].name]
                dr.enable_grad(varied)
            for seed in self._seeds:
                image = integrator.render(scene, seed=dr.opaque(mi.UInt32, seed),
                                          spp=self._renderer.pass_spp)  # fmt: skip
                if by is not None:
                    dr.set_grad(varied, 1)
                    dr.enqueue(dr.ADMode.Forward, varied)
                    dr.traverse(dr.ADMode.Forward, dr.ADFlag.ClearInterior)
                    image = dr.grad(image)
                total = total + np.array(image, float)
        return np.reshape(total, (-1, 3)) / len(self._seeds)
