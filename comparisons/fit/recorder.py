"""Rendering the heuristic half for its surface: where each camera ray of each pass ends.

The rays are the reference's: the same sampler, seeds and film.
"""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from comparisons.fit.samples import VECTORS, Samples, Surface, gathered
from heuristic.errors import InputError
from heuristic.materials import Material
from heuristic.plugins.scene_materials import SceneMaterials
from heuristic.shading import shade
from reference.rendering.renderer import Renderer, variant
from reference.rendering.sums import Accumulator

COEFFICIENTS = ("k_a", "k_d", "k_s")
"""The coefficients that are fitted."""


class Recorder:
    """Renders passes of a heuristic half for their :class:`Surface`.

    Parameters
    ----------
    renderer
        Of the heuristic half, with Phong shading and a box filter.

    Raises
    ------
    InputError
        If a material is transparent, or ``n`` is a texture.
    """

    def __init__(self, renderer: Renderer):
        self._variant = renderer.variant
        with variant(self._variant):
            shading = renderer.integrator
            self._eye = _eye(shading)
            self._materials = SceneMaterials(renderer.scene, prune=False)
            self._names = _names(renderer.scene, self._materials.bsdfs)
            _require_fittable(self._names, self._materials.bsdfs)
            point = dr.zeros(mi.SurfaceInteraction3f)
            self._lights = shading.lights(renderer.scene, point, True)
            self._ambient = shading.ambient_at(point, True)
        self._renderer = Renderer(renderer.scene, self._eye, renderer.spp, "heuristic samples")
        self._fixed = Accumulator()
        self._parts: list[list[dict[str, Any]]] = [[] for _ in self._names]
        self._samples_per_pixel = 0

    def render(self, seed: int) -> None:
        """Keep the samples of the pass with this seed."""
        image = self._renderer.render(seed)
        self._fixed.add(image)
        seen, self._eye.seen = self._eye.seen, None
        spp = dr.width(seen["position"]) // (image.shape[0] * image.shape[1])
        self._samples_per_pixel += spp
        for number, parts in enumerate(self._parts):
            index = dr.compress(seen["facing"] & (seen["material"] == number))
            kept = {
                key: gathered(value, index)
                for key, value in seen.items()
                if key not in ("facing", "material")
            }
            parts.append(kept | {"pixel": np.array(index) // spp})

    def surface(self) -> Surface:
        """Return the surface that the passes so far have seen."""
        samples = []
        for bsdf, parts in zip(self._materials.bsdfs, self._parts, strict=True):
            whole = {key: _joined([part[key] for part in parts]) for key in parts[0]}
            shadows = (f"light {number}" for number in range(len(whole)))
            samples.append(
                Samples(
                    **{key: whole[key] for key in (*VECTORS, "pixel")},
                    textures={name: whole[name] for name in _textured(bsdf)},
                    visible=tuple(whole[key] for key in shadows if key in whole),
                )
            )
        fixed = self._fixed.estimate().mean.reshape(-1, 3)
        return Surface(
            tuple(self._names),
            tuple(map(_described, self._materials.bsdfs)),
            tuple(samples),
            tuple(self._lights),
            self._ambient,
            fixed,
            self._samples_per_pixel,
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
            facing = active & (self.twosided(scene, si, active) | (si.wi.z > 0))
            seen = {
                "position": mi.Vector3f(si.p),
                "normal": mi.Vector3f(normal),
                "view": mi.Vector3f(view),
                "facing": facing,
                "material": number + dr.zeros(mi.UInt32, dr.width(si.p)),
            }
            for name in {name for bsdf in materials.bsdfs for name in _textured(bsdf)}:
                seen[name] = _read(materials, number, name, si, active)
            if shading.occlusion:
                seen |= _visibility(shading, scene, si, active)
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


def _visibility(shading, scene, si, active):
    """Return a mask for each light, in the kernel's order."""
    test, masks = shading.visibility(scene, si, active), []

    def keeping(toward, distance):
        masks.append(test(toward, distance))
        return masks[-1]

    place = mi.Vector3f(si.p)
    shade(place, place, place, Material(k_d=1), shading.lights(scene, si, active), 0, keeping)
    return {f"light {number}": mask for number, mask in enumerate(masks)}


def _textured(bsdf):
    return [name for name in COEFFICIENTS if getattr(bsdf, name).is_spatially_varying()]


def _described(bsdf):
    """Return a ``phong`` as a material of plain numbers; a coefficient with a texture is 1."""

    def plain(values):
        # The scene's numbers are the shortest decimals of single precision.
        return tuple(float(str(np.float32(value))) for value in np.ravel(values))

    point = dr.zeros(mi.SurfaceInteraction3f)
    coefficients = {
        name: (1.0,) * 3
        if name in _textured(bsdf)
        else plain(mi.Color3f(getattr(bsdf, name).eval(point)))
        for name in COEFFICIENTS
    }
    return Material(**coefficients, n=plain(bsdf.n)[0], form=bsdf.form, normalised=bsdf.normalised)


def _joined(parts):
    """Concatenate the parts of the passes: Dr.Jit arrays of one or three rows, or NumPy's."""
    if isinstance(parts[0], np.ndarray):
        return np.concatenate(parts)
    kind = type(parts[0])
    parts = [part for part in parts if dr.width(part)]  # Dr.Jit cannot append nothing
    if not parts:
        return dr.zeros(kind, 0)
    if dr.depth_v(kind) == 1:
        return dr.concat(parts)
    return kind(*(dr.concat(rows) for rows in zip(*parts, strict=True)))


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
