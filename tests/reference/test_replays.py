"""Passes after the first replay its kernels: the images must be those of tracing each pass."""

import drjit as dr
import drjit.ast
import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.case import open_case
from fotismos.comparisons.ladder.methods import Ladder
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.rendering.renderer import Renderer, variant
from tests.shared.parts import camera
from tests.shared.programs import python

SEEDS = (1, 2, 3)


def methods(name, is_short=False):
    """Return a renderer of each method of a scene's ladder."""
    case = open_case(name, Options(resolution=(24, 16)))
    mi.set_variant(case.variant)
    ready = prepare(case.source, case.options)
    found = Ladder(ready, is_short)
    return {method.name: found.renderer(method, 4) for method in found.methods}


def traced(renderer, seed):
    """Render a pass by tracing everything again."""
    with variant(renderer.variant):
        given = {"integrator": renderer.integrator, "spp": renderer.pass_spp, "seed": seed}
        image = np.array(mi.render(renderer.scene, **given))
    return image if image.shape[2] == 3 else np.repeat(image, 3, axis=2)


def is_traced(renderer):
    """Render some passes, and return whether the last one is as if traced again, bit for bit."""
    *_, image = (np.array(renderer.render(seed)) for seed in SEEDS)
    return np.array_equal(image, traced(renderer, SEEDS[-1]))


# A plain pair, many materials, an environment from a table, meshes.
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name == "fig-8-9" else pytest.mark.thorough)
        for name in ("lambert-sphere", "cornell-box", "fig-8-9", "fig-6-14")
    ],
)
def test_replayed_passes_are_traced_ones_bit_for_bit(name):
    for method, renderer in methods(name, is_short=True).items():
        assert is_traced(renderer), method


REPLAYED = """
from tests.reference.test_replays import is_traced, methods
for name in ("plastic-spheres", "fig-8-9"):
    for method, renderer in methods(name).items():
        answers = is_traced(renderer), renderer._replayed.n_recordings
        print(name, method, *answers, sep="|")
"""


@pytest.mark.thorough
def test_later_passes_are_replayed_in_a_process_of_their_own():
    # What other tests leave alive, such as a BSDF without a scene, keeps Dr.Jit from it.
    done = python("-c", REPLAYED)
    rows = [line.split("|") for line in done.stdout.splitlines() if line.count("|") == 3]
    assert len(rows) > 10
    assert [row for row in rows if row[2] != "True"] == []
    assert sum(row[3] == "1" for row in rows) > len(rows) / 2  # other scenes' ends disturb some


def test_where_dr_jit_cannot_replay_each_pass_is_traced(caplog):
    caplog.set_level("INFO")
    renderer = methods("metameric-pair")["full plan"]  # Mitsuba's spectral tables are in the way
    images = [np.array(renderer.render(seed)) for seed in SEEDS]
    assert renderer._replayed is None
    assert not caplog.records  # nobody can help it
    assert all(np.array_equal(a, traced(renderer, s)) for a, s in zip(images, SEEDS, strict=True))


@pytest.mark.parametrize(
    ("parameter", "value"),
    [("lamp.emitter.radiance.value", 0.5), ("ball.bsdf.reflectance.value", 0.1)],
)
def test_edits_between_passes_show(rgb, parameter, value):
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3},
            # Wider filters add samples to pixels in any order, which changes the last bit.
            "sensor": camera((0, -4, 1), size=8),
            "ball": {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": 0.8}},
            "lamp": {
                "type": "sphere",
                "center": [0, -2, 4],
                "emitter": {"type": "area", "radiance": 3.0},
            },
        }
    )
    renderer = Renderer(scene, None, 4, "image")
    before = [np.array(renderer.render(seed)) for seed in SEEDS]
    parameters = mi.traverse(scene)
    parameters[parameter] = value
    parameters.update()
    after = [np.array(renderer.render(seed)) for seed in SEEDS]
    for seed, old, new in zip(SEEDS, before, after, strict=True):
        assert new.mean() < 0.7 * old.mean()
        assert np.array_equal(new, traced(renderer, seed))


def test_a_switch_of_the_variant_transforms_no_code_twice_and_leaves_drjit_as_it_is(
    rgb, monkeypatch
):
    with variant("llvm_ad_spectral"):
        pass
    transformed = []

    def syntax(function=None, **options):
        transformed.append(function)
        return drjit.ast.syntax(function, **options)

    monkeypatch.setattr(dr, "syntax", syntax)
    with variant("llvm_ad_spectral"):
        assert dr.syntax is syntax
    assert dr.syntax is syntax
    assert not transformed
    mi.set_variant("llvm_ad_spectral")
    assert transformed  # Mitsuba's own switch
