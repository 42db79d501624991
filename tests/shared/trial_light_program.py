"""Prints where a kind of light is found that is declared and paired, and named nowhere else."""

from tests.shared.trial_light import TrialLight  # isort: skip  before anything lists lights

import mitsuba as mi

import fotismos
from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import Options
from fotismos.comparisons.plain_scene import plain_scene
from fotismos.heuristic.convention import IRRADIANCE_PER_INTENSITY
from fotismos.reference.pairing import kinds, lights
from fotismos.reference.scene.graph import properties
from fotismos.reports.files.export_files import gltf


def trial_to_physical(light):
    factor = 3.0 * IRRADIANCE_PER_INTENSITY
    irradiance = light.scaled_intensity(factor)
    travel = light.value("direction", None)
    light.replace(properties("directional", direction=travel, irradiance=irradiance), factor)


def scene(direction):
    """A ball under the trial light alone."""
    return {
        "type": "scene",
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
        "lamp": {"type": TrialLight.plugin, "direction": direction, "intensity": 0.2},
        "ball": {"type": "sphere", "center": (0, 0, 4), "bsdf": {"type": "phong", "k_d": 0.5}},
    }


def refusal(function, *arguments):
    """Return what a call is refused with."""
    try:
        function(*arguments)
    except fotismos.InputError as error:
        return str(error)
    return "nothing is refused"


if __name__ == "__main__":
    trial = lights.LightKind(
        plugins=(), model=TrialLight, to_physical=trial_to_physical, exact=True
    )
    kinds.BY_PLUGIN |= kinds.by_plugin([trial])
    record = fotismos.compare(scene((0, 0, 1)), why=False, spp=4).comparison.record
    (paired,) = record.pairing.emitters
    print(paired.given, "is paired as", paired.derived)
    print("departure:", round(record.metrics["dE2000"].mean, 2))
    print("exact:", record.plan.exact)
    case = open_case(scene((0, 0, 1)), Options())
    plain = plain_scene(case.source, case.options)
    (exported,) = gltf(plain)["extensions"]["KHR_lights_punctual"]["lights"]
    print(plain.lights[0]["type"], "is exported as", exported["type"])
    print(refusal(fotismos.compare, scene((0, 0, 0))))
    point = mi.Point3f(0, 0, 1)
    print(refusal(fotismos.shade, point, point, point, fotismos.Material(), "lamp"))
