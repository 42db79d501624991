"""Stand-ins on random scenes: their pictures are finite and not negative, or refused with a reason.

    python -m tests.fuzzed_stand_ins FIRST COUNT [VARIANT]

renders the heuristic half of the seeds from FIRST on with each, and prints what is wrong.
"""

import sys
import tempfile

import heuristic  # noqa: F401  isort: skip

import mitsuba as mi
import numpy as np

from heuristic.errors import FotismosError
from heuristic.heuristics import named
from reference.pairing.halves import pair
from reference.rendering.renderer import Renderer
from reference.scene.source import Source
from tests.random_scenes import is_sound, random_scene

MODELS = (
    "mean-ambient",
    "hemisphere-ambient",
    "harmonics-ambient",
    "ambient-occlusion",
    "screen-occlusion",
    "shadow-map",
    "soft-shadow-map",
)


def rendered(seed, folder):
    """Yield the models of a random scene with their pictures, None where one is refused."""
    graph = pair(Source(f"seed {seed}", random_scene(seed, folder))).heuristic
    scene = graph.instantiate()
    for model in MODELS:
        other = graph.copy()
        (integrator,) = other.nodes(mi.ObjectType.Integrator)
        other.props(integrator)["model"] = model
        refuse = named(model).refuse
        if refuse is not None and refuse(scene):
            yield model, None
            continue
        renderer = Renderer(scene, other.instantiate().integrator(), 4, model)
        yield model, np.array(renderer.render(seed))


def wrong(seed, folder):
    """Yield a line for each model that goes wrong on a random scene."""
    try:
        for model, image in rendered(seed, folder):
            if image is not None and not is_sound(image):
                yield f"{seed} {model}: {np.isfinite(image).all()=}, {np.nanmin(image)=}"
    except FotismosError as error:
        yield f"{seed}: {error}"


if __name__ == "__main__":
    from heuristic import plugins

    mi.set_variant(*sys.argv[3:] or ["llvm_ad_rgb"])
    mi.set_log_level(mi.LogLevel.Error)
    plugins.register()
    begin, count = map(int, sys.argv[1:3])
    with tempfile.TemporaryDirectory() as place:
        for number in range(begin, begin + count):
            print(*wrong(number, place), sep="\n", end="", flush=True)
    print(f"{count} scenes")
