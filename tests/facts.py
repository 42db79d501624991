"""What the documents say of tests and benchmarks, for ``./run docs``, which imports no test.

``python -m tests.facts NAME FILE ...`` writes one of :data:`FACTS` to a file, as JSON.
"""

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from fotismos.comparisons.case import open_case

from fotismos.comparisons.options import Options  # isort: skip  it finds LLVM first

from fotismos.comparisons.plain_scene import plain_scene
from fotismos.heuristic import plugins
from fotismos.reference.rendering import direct
from fotismos.reference.scene.graph import set_variant
from tests.benchmarks import kernel, prediction
from tests.shared import noisy_scenes
from tests.shared.verification import verify
from tests.witnesses import noise, page, povray, povray_scenes

FINER = 4
"""POV-Ray's rays along each side of a pixel."""


def witnesses():
    """The tables of docs/witnesses.md by their parts."""
    set_variant("llvm_ad_rgb")
    plugins.register()
    direct.register()
    return {
        part.replace("_", " "): list(getattr(page, part)())
        for part in ("closed_forms", "figures", "whole_scenes")
    }


def intervals_in_noise():
    """How many intervals hold the truth in scenes that are hard to sample."""
    return list(noise.table([noise.measured(make) for make in noisy_scenes.SCENES]))


def predictions(rounds):
    """The size that costs were predicted for, and how well."""
    found = prediction.run(int(rounds))
    return {"size": prediction.TARGET, "summary": list(prediction.summary(found))}


def speed(rounds):
    """The kernel's times."""
    return kernel.run(int(rounds))


def gains(*scenes):
    """How many times sooner each scene's plan is as quiet as with everything simulated."""
    gain = {}
    for scene in scenes:
        # Opening a scene sets its variant, so the next is opened when this one is done.
        case = open_case(scene, Options())
        gain[scene] = verify(case.source, case.options).gain
    return gain


def drawn(scene, side):
    """POV-Ray's picture of a scene, (H, W, 3)."""
    side = int(side)
    case = open_case(scene, Options(resolution=(side, side), tessellation=48))
    with TemporaryDirectory() as folder:
        text = povray_scenes.translated(plain_scene(case.source, case.options))
        picture = povray.drawn(text, FINER * side, Path(folder))
    return picture.reshape(side, FINER, side, FINER, 3).mean(axis=(1, 3)).tolist()


FACTS = {
    fact.__name__: fact
    for fact in (witnesses, intervals_in_noise, predictions, speed, gains, drawn)
}

if __name__ == "__main__":
    name, file, *words = sys.argv[1:]
    Path(file).write_text(json.dumps(FACTS[name](*words), default=float))
