"""The surface that the camera sees, sample by sample, on which a fit evaluates the kernel.

Geometry does not change while parameters are fitted. So it is rendered once, with the reference's
rays (the same sampler, seeds and film), and an image then costs one call of the kernel, without a
ray.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from heuristic.convention import Colour
from heuristic.errors import InputError
from heuristic.kernel import shade
from heuristic.materials import Material
from heuristic.plugins.phong import SceneMaterials
from reference.rendering.renderer import Renderer, variant

COEFFICIENTS = ("k_a", "k_d", "k_s")
"""The coefficients that are fitted."""


@dataclass(frozen=True)
class Surface:
    """All of an image of the heuristic half but its parameters.

    Attributes
    ----------
    names, materials
        The paired materials, in plain numbers; a coefficient that varies over the surface is 1, a
        factor on its texture.
    samples
        Of each material, those that see it from the side that is shaded, as arrays (..., S):
        ``position``, ``normal``, ``view``; ``pixel``, the index in reading order; coefficients that
        have a texture; and ``light 0``, …, the visibility of each light if some can be hidden.
    lights, ambient
        See :func:`heuristic.shade`.
    fixed
        (N, 3), the light that no parameter changes: emission (8.1) and background.
    samples_per_pixel
        Over all passes; a pixel is their mean (box filter).
    """

    names: tuple[str, ...]
    materials: tuple[Material, ...]
    samples: tuple[dict[str, NDArray], ...]
    lights: tuple[Any, ...]
    ambient: Colour
    fixed: NDArray[np.float64]
    samples_per_pixel: int

    def within(self, counted: NDArray[np.bool_]) -> "Surface":
        """Return the part of the surface in a mask (N) of pixels, renumbered from 0."""
        places = np.cumsum(counted) - 1
        samples = []
        for part in self.samples:
            some = {key: values[..., counted[part["pixel"]]] for key, values in part.items()}
            samples.append(some | {"pixel": places[some["pixel"]]})
        return replace(self, samples=tuple(samples), fixed=self.fixed[counted])

    def pixels(self, owner: int, values: Colour) -> NDArray[np.float64]:
        """Return the image (N, 3) of one value for each sample of a material."""
        pixel, count = self.samples[owner]["pixel"], len(self.fixed)
        rgb = np.broadcast_to(np.atleast_2d(np.array(values, np.float64)), (3, len(pixel)))
        sums = [np.bincount(pixel, channel, count) for channel in rgb]
        return np.stack(sums, axis=1) / self.samples_per_pixel


def see(renderer: Renderer, seeds: Sequence[int]) -> Surface:
    """Return the surface that passes of a heuristic half with these seeds see.

    The half has Phong shading and a box filter. ``InputError`` if a material is transparent, or
    ``n`` is a texture.
    """
    with variant(renderer.variant):
        shading, scene = renderer.integrator, renderer.scene
        bsdfs = SceneMaterials(scene, prune=False).bsdfs
        names = _names(scene, bsdfs)
        _require_fittable(names, bsdfs)
        eye = _eye(shading)
        eyes = Renderer(scene, eye, renderer.spp, "heuristic samples")
        fixed: Any = 0.0
        passes, samples_per_pixel = [], 0
        for seed in seeds:
            image = np.array(eyes.render(seed), np.float64)
            fixed = fixed + image / len(seeds)
            seen = {key: np.array(values) for key, values in eye.seen.items()}
            spp = len(seen["facing"]) // image[..., 0].size
            passes.append(seen | {"pixel": np.arange(len(seen["facing"])) // spp})
            samples_per_pixel += spp
        eye.seen = None
        whole = {key: np.concatenate([one[key] for one in passes], axis=-1) for key in passes[0]}
        facing, material = whole.pop("facing"), whole.pop("material")
        samples = []
        for owner, bsdf in enumerate(bsdfs):
            without = set(COEFFICIENTS) - set(_textured(bsdf))
            own = facing & (material == owner)
            samples.append({k: v[..., own] for k, v in whole.items() if k not in without})
        point = dr.zeros(mi.SurfaceInteraction3f)
        return Surface(
            names=tuple(names),
            materials=tuple(map(_described, bsdfs)),
            samples=tuple(samples),
            lights=tuple(shading.lights(scene, point, True)),
            ambient=shading.ambient_at(point, True),
            fixed=np.reshape(fixed, (-1, 3)),
            samples_per_pixel=samples_per_pixel,
        )


def _require_fittable(names, bsdfs):
    """Reject transparent materials, since a sample has one surface, and varying exponents."""
    clear = [name for name, bsdf in zip(names, bsdfs, strict=True) if bsdf.is_clear]
    if clear:
        raise InputError(
            f"{', '.join(clear)}: a fit needs opaque materials; glass, masks and `null` let light"
            " pass. Replace them."
        )
    varying = [n for n, bsdf in zip(names, bsdfs, strict=True) if isinstance(bsdf.n, mi.Texture)]
    if varying:
        raise InputError(
            f"{', '.join(varying)}: n varies over the surface, and a fit has one n per material."
            " Give its roughness as a number."
        )


def _eye(shading):
    """Make an integrator that keeps the points that ``shading`` would shade, and shows emission."""

    class Eye(type(shading)):
        def shaded(self, scene, si, view, normal, active):
            materials = self.known(scene).materials
            number = materials.index(si, active) if len(materials.bsdfs) > 1 else mi.UInt32(0)
            seen = {
                "position": mi.Vector3f(si.p),
                "normal": mi.Vector3f(normal),
                "view": mi.Vector3f(view),
                "facing": active & (self.twosided(scene, si, active) | (si.wi.z > 0)),
                "material": number + dr.zeros(mi.UInt32, dr.width(si.p)),
            }
            for name in {name for bsdf in materials.bsdfs for name in _textured(bsdf)}:
                seen[name] = _read(materials, number, name, si, active)
            if shading.occlusion:
                test = shading.visibility(scene, si, active)

                def keep(toward, distance):
                    seen[f"light {len(seen) - before}"] = visible = test(toward, distance)
                    return visible

                before, place = len(seen), mi.Vector3f(si.p)
                lights = shading.lights(scene, si, active)
                shade(place, place, place, Material(k_d=1), lights, 0, keep)
            dr.schedule(seen)
            self.seen = seen
            return _read(materials, number, "k_i", si, active)

    props = mi.Properties("heuristic")
    props["hide_emitters"] = shading.hide_emitters
    return Eye(props)


def _read(materials, number, name, si, active):
    """Return one coefficient of the material at each sample, as the scene gives it."""

    def reader(bsdf):
        return lambda si, active: mi.Color3f(getattr(bsdf, name).eval(si, active))

    readers = [reader(bsdf) for bsdf in materials.bsdfs]
    if len(readers) == 1:
        return readers[0](si, active)
    return dr.switch(number, readers, si, active)


def _textured(bsdf):
    return [name for name in COEFFICIENTS if getattr(bsdf, name).is_spatially_varying()]


def _described(bsdf):
    """Return a ``phong`` as a material of plain numbers; a coefficient with a texture is 1."""

    def plain(values):
        # The scene's numbers are the shortest decimals of single precision.
        return tuple(float(str(np.float32(value))) for value in np.ravel(values))

    point, coefficients = dr.zeros(mi.SurfaceInteraction3f), dict.fromkeys(COEFFICIENTS, (1.0,) * 3)
    for name in set(COEFFICIENTS) - set(_textured(bsdf)):
        coefficients[name] = plain(mi.Color3f(getattr(bsdf, name).eval(point)))
    return Material(**coefficients, n=plain(bsdf.n)[0], form=bsdf.form, normalised=bsdf.normalised)


def _names(scene, bsdfs):
    """Return a name for each material: its id, the id of its first shape, or a number.

    Shapes of an instanced group are not among the scene's.
    """
    shapes = {}
    for shape in scene.shapes():
        shapes.setdefault(shape.bsdf(), shape.id())
    return [
        bsdf.id() or (f"material of {shapes[bsdf]}" if bsdf in shapes else f"material {number}")
        for number, bsdf in enumerate(bsdfs, start=1)
    ]
