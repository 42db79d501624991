"""Pictures thrown by a point: ``projector``. The nearest form is the even cone of the same flux."""

from dataclasses import replace

import mitsuba as mi

from reference.pairing.factors import INTENSITY_FACTOR
from reference.pairing.lights import measured
from reference.pairing.lights.kind import Given, LightKind, PairedEmitter, heuristic


def even_cone(light: Given) -> PairedEmitter:
    """Replace a light by the even cone of the same solid angle and flux, as its sampling shows."""
    label, origin, axis = light.label, light.column(3), light.column(2)
    beam = measured.beam(light.graph, light.emitter, origin, axis)
    if beam is None:
        return light.leave_out()
    props = heuristic(
        "heuristic_spot",
        position=mi.ScalarPoint3f(*origin),
        direction=mi.ScalarVector3f(*axis),
        cutoff=beam.cutoff,
        exponent=0.0,
        intensity=beam.intensity,
    )
    note = f"an even cone of {beam.cutoff:.4g} deg, of the same solid angle and flux"
    record = light.replace(props, INTENSITY_FACTOR, exact=False, note=note)
    return replace(record, name=label, lost="its picture")


KIND = LightKind(plugins=("projector",), to_heuristic=even_cone)
