"""The materials of a scene, read where a ray hits."""

from typing import ClassVar

import drjit as dr
import mitsuba as mi

from heuristic import terms
from heuristic.arrays import Array, Colour, Direction, Interaction, Mask, Scene
from heuristic.errors import InputError
from heuristic.materials import COEFFICIENTS, PHYSICAL, Material, PairedMaterial


class SceneMaterials:
    """The ``phong`` BSDFs of a scene, and their values at a surface interaction.

    ``prune`` leaves out the terms that no material has; ``form`` replaces the materials' own;
    ``physical`` also reads the parameters of the physical partners
    (:class:`heuristic.materials.PairedMaterial`).

    Raises
    ------
    InputError
        For a BSDF that is not a ``phong``.
    """

    DRJIT_STRUCT: ClassVar = {"table": object}  # what dr.freeze must know of

    def __init__(
        self, scene: Scene, prune: bool = True, form: str | None = None, physical: bool = False
    ):
        self.prune, self.form, self.physical = prune, form, physical
        self.bsdfs = list(dict.fromkeys(_bsdfs(scene)))
        for bsdf in self.bsdfs:
            if not hasattr(bsdf, "material"):
                raise InputError(
                    f"BSDF {bsdf.id()!r}: {bsdf.class_name()} is not a phong. The integrator"
                    " heuristic renders the heuristic half of a pair, which reference.pair makes."
                )
        places = {_registry_index(bsdf): number for number, bsdf in enumerate(self.bsdfs)}
        numbers = [places.get(index, 0) for index in range(max(places, default=0) + 1)]
        self.table = mi.UInt32(numbers)

    def at(self, si: Interaction, active: Mask) -> list[tuple[Material, Mask]]:
        """Return the materials at a surface interaction, as pairs of a material and a mask.

        There is one pair for each form of the lobe in the scene, since the form determines the
        kernel's code; the mask says where it applies.
        """
        if not self.bsdfs:
            return []  # a scene without shapes
        if len(self.bsdfs) == 1:
            chosen = self.prune, self.form, self.physical
            return [(self.bsdfs[0].material(si, active, *chosen), True)]
        present = sorted(set().union(*(bsdf.present for bsdf in self.bsdfs)))
        present = present if self.prune else list(COEFFICIENTS)
        readers = [_reader(bsdf, present, self.form, self.physical) for bsdf in self.bsdfs]
        *values, n, is_blinn = dr.switch(self.index(si, active), readers, si, active)
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
        readers = [_transmittance_of(bsdf) for bsdf in self.bsdfs]
        return dr.select(active, self._switch(readers, si, active), 0)

    def normal(self, si: Interaction, active: Mask) -> Direction:
        """Return the shading normal in world space, with bump and normal maps applied."""
        if not any(bsdf.tilt for bsdf in self.bsdfs):
            return mi.Vector3f(si.sh_frame.n)
        readers = [_normal_of(bsdf) for bsdf in self.bsdfs]
        return mi.Vector3f(self._switch(readers, si, active))

    def _switch(self, readers, si, active):
        if len(readers) == 1:
            return readers[0](si, active)
        return dr.switch(self.index(si, active), readers, si, active)

    def index(self, si: Interaction, active: Mask) -> Array:
        """Return the number in ``bsdfs`` of the material at a surface interaction."""
        bsdf = dr.reinterpret_array(mi.UInt32, si.bsdf())
        return dr.gather(mi.UInt32, self.table, bsdf, active)


def _reader(bsdf, present, form, physical):
    """Return the function that reads one BSDF's coefficients, normalisation included."""

    def read(si, active):
        material = bsdf.material(si, active, form=form, physical=physical)
        values = {name: mi.Spectrum(getattr(material, name)) for name in present}
        if bsdf.normalised and "k_s" in values:
            values["k_s"] *= terms.normalisation(material.form, material.n)
        if physical:
            values["base_color"] = mi.Spectrum(material.base_color)
            values |= {name: mi.Float(getattr(material, name)) for name in PHYSICAL[1:]}
        return (*values.values(), mi.Float(material.n), mi.Bool(material.form == "blinn"))

    return read


def _transmittance_of(bsdf):
    if not bsdf.is_clear:
        return lambda si, active: mi.Spectrum(0)
    return lambda si, active: mi.Spectrum(bsdf.transmittance.eval(si, active))


def _normal_of(bsdf):
    if bsdf.tilt is None:
        return lambda si, active: mi.Vector3f(si.sh_frame.n)
    return lambda si, active: si.to_world(mi.Vector3f(bsdf.tilt.eval_3(si, active)))


def _bsdfs(scene):
    """Return the BSDFs of a scene; only traversal finds those inside shape groups."""
    shapes = scene.shapes()
    if not any(shape.class_name() == "Instance" for shape in shapes):
        return [shape.bsdf() for shape in shapes]
    found = {}

    class Below(mi.TraversalCallback):
        """Collects the outermost BSDFs below an object."""

        def put(self, name, value, *details):
            if isinstance(value, mi.BSDF):
                found.setdefault(value)
            elif isinstance(value, mi.Object):
                value.traverse(Below())

    scene.traverse(Below())
    return list(found)


def _registry_index(bsdf):
    """Return Dr.Jit's number of a BSDF, as found in ``si.bsdf()``."""
    return int(dr.reinterpret_array(mi.UInt32, mi.BSDFPtr(bsdf))[0])
