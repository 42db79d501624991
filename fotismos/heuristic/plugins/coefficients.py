"""Coefficients and emitted spectra as Mitsuba's textures, and the materials of a scene."""

from collections.abc import Callable, Sequence
from functools import partial
from numbers import Real
from typing import Any, ClassVar

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic import materials
from fotismos.heuristic.convention import (
    Array,
    Colour,
    Direction,
    Interaction,
    Mask,
    Properties,
    Scene,
)
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.materials import COEFFICIENTS, PHYSICAL, Material, PairedMaterial


def coefficient(props: Properties, name: str) -> Any:
    """Read a reflection coefficient, 0 if omitted.

    Up to 1 it is an ordinary reflectance of Mitsuba, with the same spectrum for the same RGB; above
    1, as ``k_s`` may be for a sharp lobe, it needs Mitsuba's unbounded kind.
    """
    value = _plain(props, name, 0.0)
    if value is not None and max(value) > 1:
        return props.get_unbounded_texture(name)
    return props.get_texture(name, 0.0)


def emitted(props: Properties, name: str, default: Any) -> Any:
    """Read an emitted spectrum as Mitsuba's emitters do: a plain number is white.

    Zero is read as the unbounded kind, because Mitsuba cannot make a white spectrum of zero.
    """
    value = _plain(props, name, default)
    if value is not None and max(value) == 0:
        return props.get_unbounded_texture(name, 0.0)
    return props.get_emissive_texture(name, default)


def _plain(props: Properties, name: str, default: Any) -> tuple[float, ...] | None:
    """Return a number's or colour's components, None for textures and tabulated spectra."""
    value = props.get(name, default)
    if not isinstance(value, Real | mi.ScalarColor3f | mi.ScalarColor3d):
        return None
    components = (float(value),) if isinstance(value, Real) else tuple(map(float, value))
    materials.checked_colour(f"{props.plugin_name()}: {name}", components)
    return components


def may_be_nonzero(texture: Any) -> bool:
    """Return whether a texture can be non-zero anywhere; True if unknown."""
    if texture.is_spatially_varying():
        return True
    try:
        return bool(dr.max(texture.max()) > 0)
    except RuntimeError:
        return True


def require_positive(name: str, texture: Any) -> None:
    """Raise InputError if a texture that is one colour has a component below 0 or NaN."""
    if texture.is_spatially_varying():
        return
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wavelengths = mi.Spectrum(550.0) if mi.is_spectral else si.wavelengths
    components = np.ravel(dr.detach(texture.eval(si)))
    if not np.all(components >= 0):
        shown = ", ".join(f"{component:g}" for component in components)
        raise InputError(f"{name} = {shown} is not allowed: give finite values of 0 or more.")


class SceneMaterials:
    """The ``phong`` BSDFs of a scene, and their values at a surface interaction.

    ``prune`` leaves out the terms that no material has; ``form`` replaces the materials' own;
    ``physical`` also reads the parameters of the physical partners
    (:class:`fotismos.heuristic.materials.PairedMaterial`).
    """

    DRJIT_STRUCT: ClassVar = {"table": object}  # what dr.freeze must know of

    def __init__(
        self, scene: Scene, prune: bool = True, form: str | None = None, physical: bool = False
    ):
        self.prune = prune
        self.form = form
        self.physical = physical
        self.bsdfs = list(dict.fromkeys(_bsdfs(scene)))
        places = {}
        for number, bsdf in enumerate(self.bsdfs):
            if not hasattr(bsdf, "material"):
                raise InputError(
                    f"BSDF {bsdf.id()!r}: {bsdf.class_name()} is not a phong. The integrator"
                    " heuristic renders the textbook half of a pair,"
                    " which fotismos.reference.pair makes."
                )
            # A pointer is a number in Dr.Jit's registry; the table maps it to a place in `bsdfs`.
            places[int(dr.reinterpret_array(mi.UInt32, mi.BSDFPtr(bsdf))[0])] = number
        self.table = mi.UInt32([places.get(i, 0) for i in range(max(places, default=0) + 1)])

    def at(self, si: Interaction, active: Mask) -> list[tuple[Material, Mask]]:
        """Return the materials at a surface interaction, as pairs of a material and a mask.

        There is one pair for each form of the lobe in the scene, since the form determines the
        kernel's code; the mask says where it applies.
        """
        if not self.bsdfs:
            return []  # a scene without shapes
        present = sorted({name for bsdf in self.bsdfs for name in bsdf.present})
        present = present if self.prune else list(COEFFICIENTS)
        readers = [partial(self._read, bsdf, present) for bsdf in self.bsdfs]
        *values, n, is_blinn = self.switch(readers, si, active)
        kind = PairedMaterial if self.physical else Material
        names = (*present, *(PHYSICAL if self.physical else ()))
        forms = sorted({self.form or bsdf.form for bsdf in self.bsdfs})
        is_moderate = all(bsdf.n_is_moderate for bsdf in self.bsdfs)
        coefficients = dict(zip(names, values, strict=True))
        return [
            (
                kind(**coefficients, n=n, form=form, n_is_moderate=is_moderate),
                len(forms) == 1 or is_blinn == (form == "blinn"),
            )
            for form in forms
        ]

    def _read(self, bsdf: Any, present: Sequence[str], si: Interaction, active: Mask) -> Any:
        material = bsdf.material(si, active, True, self.form, self.physical)
        # `dr.switch` needs the same types, in the same order, from every reader.
        values = {name: mi.Spectrum(getattr(material, name)) for name in present}
        if self.physical:
            values["base_color"] = mi.Spectrum(material.base_color)
            values |= {name: mi.Float(getattr(material, name)) for name in PHYSICAL[1:]}
        return (*values.values(), mi.Float(material.n), mi.Bool(material.form == "blinn"))

    def twosided(self, si: Interaction, active: Mask) -> bool | Mask:
        """Return whether the surface is two-sided; a plain value where all agree."""
        sides = [bsdf.twosided for bsdf in self.bsdfs]
        if len(set(sides)) <= 1:
            return any(sides)
        return dr.gather(mi.Bool, mi.Bool(sides), self.index(si, active), active)

    def transmittance(self, si: Interaction, active: Mask) -> Colour:
        """Return the share of light that passes straight through; a plain 0 if none can."""
        if not any(bsdf.is_clear for bsdf in self.bsdfs):
            return 0
        readers = [bsdf.eval_null_transmission for bsdf in self.bsdfs]
        return dr.select(active, self.switch(readers, si, active), 0)

    def normal(self, si: Interaction, active: Mask) -> Direction:
        """Return the shading normal in world space, with bump and normal maps applied."""
        if not any(bsdf.tilt for bsdf in self.bsdfs):
            return mi.Vector3f(si.sh_frame.n)
        return self.switch([bsdf.shading_normal for bsdf in self.bsdfs], si, active)

    def switch(
        self, readers: Sequence[Callable[[Interaction, Mask], Any]], si: Interaction, active: Mask
    ) -> Any:
        """Return what the reader of the material at a surface interaction returns."""
        if len(readers) == 1:
            return readers[0](si, active)
        return dr.switch(self.index(si, active), readers, si, active)

    def index(self, si: Interaction, active: Mask) -> Array:
        """Return the number in ``bsdfs`` of the material at a surface interaction."""
        bsdf = dr.reinterpret_array(mi.UInt32, si.bsdf())
        return dr.gather(mi.UInt32, self.table, bsdf, active)


def _bsdfs(scene: Scene) -> list[Any]:
    """Return the BSDFs of a scene; only traversal finds those inside shape groups."""
    shapes = scene.shapes()
    if not any(shape.class_name() == "Instance" for shape in shapes):
        return [shape.bsdf() for shape in shapes]
    return [node for node in mi.traverse(scene).hierarchy if isinstance(node, mi.BSDF)]
