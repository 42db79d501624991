"""The departure, split into its causes: a chain of images from the kernel to the reference.

==================  ==========================================================================
Part                Between
==================  ==========================================================================
interpolation       the kernel as requested, and with an exact normal at each point
implementation      the kernel, and the ``phong`` plugin under Mitsuba's direct light: nothing
spectral            the heuristic half's variant, and the reference's
visibility          no shadows, and shadows
light form          the heuristic half's lights, and the physical ones
BSDF form           phong, and the physical BSDFs, both with direct light
transport           direct light, and all light
==================  ==========================================================================

Every part is a signed linear image, later minus earlier: the parts add up to reference minus kernel
in every pixel. A part that the scene does not have is left out; implementation, BSDF form and
transport are always there.
"""

import numpy as np
from numpy.typing import NDArray

from comparisons.cost.cost_record import Part
from comparisons.departure.metrics import delta_e_2000
from comparisons.departure.spaces import Viewing
from comparisons.effects.lattice import KERNEL, PLAIN_KERNEL, REFERENCE, Key, Lattice
from reference.effects.effect import PARTS, Effect
from reference.effects.kernel_terms import POLYGONS

ALWAYS = ("implementation", "BSDF form", "transport")


def split(
    lattice: Lattice, counted: NDArray[np.bool_], viewing: Viewing
) -> tuple[tuple[Part, NDArray[np.float64]], ...]:
    """Return ``(Part, image)`` of each cause of a lattice's departure, and last of the whole.

    Images are (H, W, 3), linear and signed.
    """
    chain = _chain(lattice)
    lattice.render(key for _, key in chain)
    images = [lattice.of(key).images.astype(float) for _, key in chain]
    parts = [
        _part(name, before, after, counted, viewing)
        for (name, _), before, after in zip(chain[1:], images, images[1:], strict=False)
    ]
    return (*parts, _part("departure", images[0], images[-1], counted, viewing))


def _chain(lattice: Lattice) -> list[tuple[str, Key]]:
    """Return ``(name of the step that leads there, image)`` from the kernel to the reference."""
    effects = set(lattice.effects)
    chain: list[tuple[str, Key]] = [("", KERNEL)]
    if POLYGONS in effects:
        chain.append((str(POLYGONS.part), PLAIN_KERNEL))
    simulated: frozenset[Effect] = frozenset()
    chain.append(("implementation", simulated))
    for name in PARTS[1:-1]:
        added = {effect for effect in effects if effect.part == name}
        if added or name in ALWAYS:
            simulated |= added
            chain.append((name, simulated))
    chain.append((PARTS[-1], REFERENCE))
    return chain


def _part(name, before, after, counted, viewing):
    signed = after - before
    each = signed[:, counted].mean(axis=(1, 2))
    mean = signed.mean(axis=0)
    distance = delta_e_2000(after.mean(axis=0), before.mean(axis=0), viewing)
    part = Part(
        name=name,
        mean=float(each.mean()),
        mean_stderr=float(each.std(ddof=1) / np.sqrt(len(each))),
        rms=float(np.sqrt(np.mean(mean[counted] ** 2))),
        dE2000=float(distance[counted].mean()),
    )
    return part, mean
