"""The cost of accuracy on real scenes: rungs, sums, record, command."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import mitsuba as mi
import numpy as np
import pytest

from comparisons.compare import prepare
from comparisons.cost.cost import cost
from comparisons.cost.effort import WIDTH, Effort, reduced
from comparisons.cost.ladder import ladder
from comparisons.cost.methods import Methods
from comparisons.cost.pairs import Pairs
from comparisons.departure.metrics import delta_e_2000
from comparisons.effects.between import Between
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options
from heuristic.errors import InputError
from heuristic.interpolation import Interpolation
from reference.effects import EFFECTS
from reference.effects.obstacles import OCCLUSION
from reference.rendering.sums import Accumulator
from reference.scene.graph import set_variant
from reference.scene.source import Source
from reports import cli
from reports.run import cost_files as results
from reports.terminal import cost_tables
from tests.schemas import schema
from tests.test_plan import scene as described

SCHEMA = schema("cost")
SHARP = {"reference_spp": 64, "replicates": 8, "replicate_spp": 64}
TINY = Effort(rounds=2, largest=4, depths=(3,), reference_spp=4, replicates=3, replicate_spp=4)


def options(name, size=24):
    scene = SCENES[name]
    return Options(
        resolution=(size, size),
        heuristic_variant=scene.heuristic_variant,
        interpolation=Interpolation(scene.interpolation),
        tessellation=scene.tessellation,
    )


ALWAYS = {"implementation", "BSDF form", "transport"}
MADE_OF = {
    "cornell-box": (
        {"occlusion", "extended lights", "interreflection"},
        ALWAYS | {"visibility", "light form"},
    ),
    "fig-6-10": (
        {
            "distance attenuation",
            "polygon interpolation",
            "microfacets and Fresnel",
            "environment",
        },
        ALWAYS | {"interpolation", "light form"},
    ),
    "narrow-band-lamp": (
        {"occlusion", "spectral"},
        ALWAYS | {"visibility", "spectral"},
    ),
}
"""Effects and parts of scenes that between them have all that the built-in ones have."""


@pytest.fixture(
    scope="module",
    params=["cornell-box", "fig-6-10", "narrow-band-lamp"],
)
def study(request):
    """A small study of one scene."""
    set_variant(SCENES[request.param].variant)
    yield cost(SCENES[request.param].source(), options(request.param), TINY)
    set_variant("llvm_ad_rgb")


@pytest.fixture(scope="module", params=["cornell-box", "fig-6-10"])
def sharp(request):
    """A study whose prices are sharp, of few pixels."""
    few = Options(resolution=(32, 32))
    return cost(SCENES[request.param].source(), few, replace(TINY, **SHARP)).record


@pytest.mark.guarantee(
    "prices",
    "With all effects simulated no departure remains: the closure's interval contains 0.",
)
def test_with_all_effects_nothing_is_left(rgb, sharp):
    closure = sharp.closure
    assert closure.low <= 0 <= closure.high or abs(closure.mean) < 0.02
    assert closure.high - closure.low < 0.1 * sharp.prices.departure


@pytest.mark.guarantee(
    "prices",
    "On the Cornell box, intervals of prices contain the converged price in at least 35 of 40"
    " runs.",
)
@pytest.mark.slow
def test_intervals_of_prices_hold_the_converged_price(rgb, capsys):
    def removes(seed, spp):
        effort = replace(TINY, **SHARP | {"reference_spp": spp, "replicate_spp": spp})
        asked = Options(resolution=(64, 64), seed=seed)
        record = cost(SCENES["cornell-box"].source(), asked, effort).record
        return {price.effect: price.removes for price in record.prices.effects}

    converged = removes(1_000, 8 * SHARP["replicate_spp"])
    found = [removes(seed, SHARP["replicate_spp"]) for seed in range(40)]
    for effect, price in converged.items():
        held = sum(one[effect].low <= price.value <= one[effect].high for one in found)
        width = np.median([one[effect].high - one[effect].low for one in found])
        with capsys.disabled():
            print(f"\n{effect}: {price.value:.3f}, held {held} of 40, median width {width:.3f}")
        assert held >= 35
        assert width < max(0.2, price.value / 2)


@pytest.mark.guarantee(
    "prices",
    "Prices and closure add up to the departure, in the mean and in every pixel.",
)
def test_prices_add_up_to_the_departure_in_the_mean_and_in_every_pixel(study):
    prices = study.record.prices
    removed = [price.removes.value for price in prices.effects]
    left = study.record.closure.mean
    assert sum(removed) + left == pytest.approx(prices.departure, abs=1e-9)
    np.testing.assert_allclose(sum(study.effects.values()) + study.left, study.error, atol=1e-9)
    assert study.error.max() > 1
    assert (study.error[~study.counted] == 0).all()
    added = [price.adds_s.value for price in prices.effects]
    assert sum(added) == pytest.approx(prices.reference_s - prices.kernel_s, abs=1e-9)


def test_the_departure_is_that_of_the_kernel_rendered_anew(study):
    """Noise of a few samples on both sides; the mean over all pixels is sharper than one."""
    kernel = study.rungs[_asked_for(study)]
    viewing = Options().viewing
    error = delta_e_2000(kernel, study.reference, viewing)[study.counted].mean()
    noise = study.record.prices.floor + study.record.reference.noise_floor
    assert study.error[study.counted].mean() == pytest.approx(error, abs=0.05 * error + noise)


@pytest.mark.guarantee("prices", "The parts add up to the departure in every pixel.")
def test_parts_add_up_to_the_departure_in_every_pixel(study):
    split = study.record.split
    total = sum(part.mean for part in split.parts)
    assert total == pytest.approx(split.departure.mean, abs=1e-12)
    np.testing.assert_allclose(sum(study.parts.values()), study.difference, atol=1e-12)
    assert split.departure.dE2000 > 0.1


def test_kernel_and_plugin_are_one(study):
    parts = {part.name: part for part in study.record.split.parts}
    # Single precision: a few units in the last place of values around 1.
    assert np.abs(study.parts["implementation"]).max() < 2e-5
    assert parts["implementation"].dE2000 < 1e-3


def test_the_difference_is_that_of_reference_and_kernel_rendered_anew(study):
    rendered = study.reference - study.rungs[_asked_for(study)]
    # Both are noisy, from seeds of their own: their means agree.
    assert study.difference.mean() == pytest.approx(
        rendered.mean(), abs=0.02 * np.abs(rendered).max()
    )


def _asked_for(study):
    names = {"flat": "flat kernel", "gouraud": "Gouraud kernel", "phong": "Phong kernel"}
    return names[study.record.interpolation.value]


def test_scenes_have_the_effects_and_parts_that_they_are_made_of(study):
    effects, parts = MADE_OF[study.record.scene]
    assert set(study.effects) == effects
    assert set(study.parts) == parts


def test_the_record_holds_to_its_schema_and_survives_json(study):
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    made = results.documents(study)
    record = json.loads(made["cost.json"])
    jsonschema.Draft202012Validator(SCHEMA).validate(record)
    assert made["cost.svg"].startswith(b"<svg")
    rungs = {name for name in made if name.startswith("cost-rung-")}
    assert len(rungs) == len(record["rungs"])


def test_every_method_and_effect_is_in_the_tables(study):
    text = "\n".join(cost_tables.lines(study.record))
    for rung in study.record.rungs:
        assert rung.name.split(",")[0] in text
    for price in study.record.prices.effects:
        assert price.effect in text


def whole(renderer, passes=8, seed=40):
    total = Accumulator()
    for number in range(passes):
        total.add(renderer.render(seed + number))
    return total.estimate()


@pytest.mark.parametrize("name", ["fig-8-9", "cornell-box", "open floor"])
def test_merged_rungs_are_equal_images(rgb, name):
    """Every name that a rung swallowed, rendered as if the scene could tell it apart."""
    if name == "open floor":
        # A convex diffuse shape alone: nothing shadows it, nothing lights it again, phong is exact.
        ball = {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": 0.6}}
        lamp = {"type": "point", "position": (3, -4, 5), "intensity": 60.0}
        source = type(SCENES["fig-8-9"].source())(name, described(ball=ball, lamp=lamp, size=24))
    else:
        source = SCENES[name].source()
    chosen = Options(resolution=(24, 24))
    ready = prepare(source, chosen)
    methods = Methods(source, chosen, ready)
    merged = [rung for rung in methods.rungs if len(rung.names) > 1]
    assert merged
    # A plan that calls for all, and a scope that has all, tell all methods apart.
    asked = tuple(replace(decision, called_for=True) for decision in ready.plan.decisions)
    telling = Methods(source, chosen, replace(ready, plan=replace(ready.plan, decisions=asked)))
    full = replace(methods.scope, effects=frozenset(EFFECTS), kernel_shadows=False)
    apart = {rung.name: rung.method for rung in ladder(full)}
    assert "direct" in apart
    for rung in merged:
        expected = whole(methods.renderer(rung.method, 16))
        for other in set(rung.names) & set(apart):
            found = whole(telling.renderer(apart[other], 16), seed=80)
            noise = np.hypot(expected.standard_error, found.standard_error)
            # Five standard errors of eight passes, and the pixel filter's own spread at edges.
            difference = np.abs(expected.mean - found.mean)
            assert (difference > 7 * noise + 1e-5).mean() < 5e-3, (rung.name, other)
            mean = np.abs((expected.mean - found.mean).mean())
            assert mean < 4 * np.sqrt(np.mean(noise**2) / noise.size) + 1e-6, (rung.name, other)


def test_a_scene_that_has_everything_keeps_its_rungs_apart(rgb):
    source = SCENES["plastic-spheres"].source()
    chosen = Options(resolution=(16, 16))
    methods = Methods(source, chosen, prepare(source, chosen))
    assert [rung.names for rung in methods.rungs] == [
        ("flat kernel",),
        ("Gouraud kernel",),
        ("Phong kernel",),
        ("kernel with shadows",),
        ("shadow map",),
        ("filtered shadow map",),
        ("constant ambient",),
        ("hemisphere ambient",),
        ("ambient occlusion",),
        ("ambient occlusion, depth image",),
        ("phong BSDF, full transport",),
        ("direct",),
        ("path 3",),
        ("path 4",),
        ("path 5",),
        ("full plan",),
    ]


class Shown:
    """Renders the image of some effects: the light that travels, and what glows."""

    def __init__(self, between, simulated, spp):
        made = between.travelling(simulated, spp), between.glowing(simulated, spp)
        self.parts = [renderer for renderer in made if renderer is not None]

    def render(self, seed):
        return sum(mi.TensorXf(part.render(seed)) for part in self.parts)


def test_with_no_effect_the_plugins_give_the_kernels_image(rgb):
    for name in ("fig-8-9", "cornell-box", "plastic-spheres", "fig-6-5-m40"):
        ready = prepare(SCENES[name].source(), Options(resolution=(24, 24)))
        between = Between(ready.pair, ready.plan, ready.scene)
        images = [
            np.array(renderer.render(3))
            for renderer in (Shown(between, (), ready.heuristic.spp), ready.heuristic)
        ]
        assert images[1].max() > 0.1
        np.testing.assert_allclose(*images, atol=2e-5)


def test_with_all_effects_it_gives_the_reference(rgb):
    for name in ("fig-8-9", "cornell-box"):
        ready = prepare(SCENES[name].source(), Options(resolution=(24, 24)))
        between = Between(ready.pair, ready.plan, ready.scene)
        found = whole(Shown(between, between.differences, 64))
        ready.reference.spp = 64
        expected = whole(ready.reference, seed=90)
        noise = np.hypot(found.standard_error, expected.standard_error)
        assert (np.abs(found.mean - expected.mean) > 7 * noise + 1e-5).mean() < 5e-3
        mean_noise = np.sqrt(np.mean(noise**2) / noise.size)
        assert abs((found.mean - expected.mean).mean()) < 4 * mean_noise + 1e-6


def test_light_without_shadows_passes_through_what_is_in_its_way(rgb):
    """A lamp behind a board: black with shadows, and without them what the lamp gives alone."""
    floor = {
        "type": "rectangle",
        "to_world": _scaled(2),
        "bsdf": {"type": "diffuse", "reflectance": 0.5},
    }
    board = {
        "type": "rectangle",
        "to_world": _scaled(4, (0, 0, 2)),
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
    }
    lamp = {
        "type": "rectangle",
        "to_world": _scaled(0.5, (0, 0, 3), turned=True),
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
        "emitter": {"type": "area", "radiance": 20.0},
    }
    images = {}
    # The camera stands under the board, which it does not see.
    view = {"viewer": (0, -3, 1.5), "size": 16, "floor": floor, "lamp": lamp}
    for key, parts in {"open": view, "hidden": view | {"board": board}}.items():
        source = type(SCENES["fig-8-9"].source())(key, described(**parts))
        ready = prepare(source, Options())
        between = Between(ready.pair, ready.plan, ready.scene)
        everything = set(between.differences)
        lit = whole(Shown(between, everything, 64)).mean
        unshadowed = whole(Shown(between, everything - {OCCLUSION}, 64))
        images[key] = lit, unshadowed
    assert images["open"][0].max() > 0.1
    assert images["hidden"][0].max() < 1e-6
    noise = images["hidden"][1].standard_error
    np.testing.assert_allclose(
        images["hidden"][1].mean, images["open"][0], atol=8 * noise.max() + 1e-4
    )


def _scaled(factor, place=(0, 0, 0), turned=False):
    transform = mi.ScalarTransform4f().translate(place)
    return (transform.rotate((1, 0, 0), 180) if turned else transform).scale(factor)


def test_the_default_size_keeps_the_films_shape(rgb):
    assert reduced(SCENES["fig-8-9"].source(), Options(), WIDTH) == (128, 128)
    wide = described(ball={"type": "sphere"}, size=64)
    wide["sensor"]["film"] |= {"width": 400, "height": 100}
    source = type(SCENES["fig-8-9"].source())("wide", wide)
    assert reduced(source, Options(), WIDTH) == (128, 32)
    wide["sensor"]["film"] |= {"width": 60, "height": 10}
    source = type(SCENES["fig-8-9"].source())("small", wide)
    assert reduced(source, Options(), WIDTH) == (60, 10)
    assert reduced(source, Options(resolution=(48, 24)), 12) == (12, 6)


def test_sample_counts_are_powers_of_four():
    assert Effort(largest=64).counts == (4, 16, 64)
    assert Effort(largest=100).counts == (4, 16, 64)
    assert Effort(largest=2).counts == (2,)
    with pytest.raises(InputError, match="rounds"):
        Effort(rounds=1)


def test_the_command_writes_and_prints(rgb, tmp_path, monkeypatch, capsys):
    words = ["cost", "fig-8-9", "--resolution", "16x16", "--rounds", "2", "-o", str(tmp_path)]
    monkeypatch.setattr("sys.argv", ["fotismos", *words])
    cli.main()
    printed = capsys.readouterr().out
    place = tmp_path / "cost/fig-8-9"
    record = json.loads((place / "cost.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(SCHEMA).validate(record)
    assert "Price of an effect" in printed
    assert record["command"].startswith("fotismos cost fig-8-9")
    assert "--rounds 2" in record["command"]
    assert {"cost.svg", "cost-reference.png", "cost-rung-phong-kernel.png"} <= {
        path.name for path in place.iterdir()
    }
    assert not list(tmp_path.rglob("*-partial"))


CORPUS = Path(__file__).parent / "corpus"


def test_a_camera_without_a_viewpoint_has_no_flat_and_gouraud_rungs(rgb):
    source = Source("orthographic", CORPUS / "sensor-orthographic.xml")
    study = cost(source, Options(resolution=(16, 12)), TINY)
    kernels = {point.rung for point in study.record.points if "kernel" in point.rung}
    assert kernels == {"Phong kernel", "kernel with shadows"}


def test_all_rungs_are_of_the_sensor_that_was_asked_for(rgb):
    several = described(ball={"type": "sphere"}, size=32)
    view = mi.ScalarTransform4f().look_at((4, 0, 1), (0, 0, 0), (0, 0, 1))
    film = {"type": "hdrfilm", "width": 16, "height": 24, "rfilter": {"type": "box"}}
    several["second"] = {"type": "perspective", "to_world": view, "film": film}
    source, seen = Source("several", several), Options(sensor=1)
    assert reduced(source, seen, 1000) != reduced(source, Options(), 1000)
    pairs = Pairs(source, seen, prepare(source, seen))
    first, flat = (
        pair.heuristic.instantiate().sensors()[0].world_transform().matrix.numpy()
        for pair in (pairs.interpolated(seen.interpolation), pairs.interpolated(Interpolation.FLAT))
    )
    other = prepare(source, Options()).pair.heuristic.instantiate().sensors()[0]
    np.testing.assert_array_equal(first, flat)
    assert (other.world_transform().matrix.numpy() != flat).any()
