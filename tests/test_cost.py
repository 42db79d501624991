"""The cost of accuracy on real scenes: methods, hybrids, sums, record, commands."""

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import mitsuba as mi
import numpy as np
import pytest
from msgspec import structs

from comparisons.case import open_case
from comparisons.compare import compare
from comparisons.cost import front, methods
from comparisons.cost.cost import cost
from comparisons.cost.cost_record import Method
from comparisons.cost.measure import WIDTH, Effort, measure_ladder, reduced
from comparisons.cost.methods import Ladder, declare, distinct
from comparisons.departure.metrics import METRICS, delta_e_2000
from comparisons.gallery.builtin import SCENES
from comparisons.hybrids.hybrids import LEAST_SPP, PREVIEW, HybridImages, HybridScenes
from comparisons.options import Options
from comparisons.prepared import guarded, prepare
from heuristic.errors import InputError
from heuristic.heuristics import Interpolation
from reference.planning.effects import EFFECTS, OCCLUSION, labelled
from reference.rendering.renderer import Stream, passes
from reference.rendering.sums import Accumulator
from reference.scene.graph import set_variant
from reference.scene.source import Source
from reports import cli
from reports.run import cost_files
from reports.terminal import cost_tables
from tests.misplanned import scene as described
from tests.schemas import schema
from tests.small_scene import SCENE
from tests.test_objects import shadowed

SCHEMA = schema("cost")
SHARP = {"reference_spp": 64, "replicates": 8, "replicate_spp": 64}
TINY = Effort(rounds=2, largest=4, depths=(3,), reference_spp=4, replicates=3, replicate_spp=4)
CORPUS = Path(__file__).parent / "corpus"

MADE_OF = {
    "cornell-box": {"occlusion", "extended lights", "interreflection"},
    "fig-6-10": {
        "distance attenuation", "polygon interpolation", "microfacets and Fresnel", "environment",
    },
    "narrow-band-lamp": {"occlusion", "spectral"},
}  # fmt: skip
"""Effects of scenes that between them have all that the built-in ones have."""


@pytest.fixture(
    scope="module",
    params=[
        "cornell-box",
        "fig-6-10",
        pytest.param("narrow-band-lamp", marks=pytest.mark.thorough),
    ],
)
def study(request):
    """A small study of one scene."""
    scene = SCENES[request.param]
    set_variant(scene.variant)
    options = Options(
        resolution=(24, 24),
        heuristic_variant=scene.heuristic_variant,
        interpolation=scene.interpolation,
        tessellation=scene.tessellation,
    )
    yield cost(scene.source(), options, TINY)
    set_variant("llvm_ad_rgb")


# -- A study ---------------------------------------------------------------------------------------


@pytest.mark.guarantee(
    "attribution",
    "Attributions and closure add up to the departure, in the mean and in every pixel.",
)
def test_attributions_add_up_to_the_departure_in_the_mean_and_in_every_pixel(study):
    whole, causes = study.record.attribution, study.causes
    removed = [one.removes.value for one in whole.effects]
    left = study.record.closure.mean
    assert sum(removed) + left == pytest.approx(whole.departure, abs=1e-9)
    total = sum(causes.maps.values()) + causes.left
    np.testing.assert_allclose(total, causes.departure, atol=1e-9)
    assert causes.departure.max() > 1
    assert (causes.departure[~study.counted] == 0).all()
    # Single precision: a few units in the last place of values around 1.
    assert whole.implementation < 1e-3


def test_the_departure_is_that_of_the_kernel_rendered_anew(study):
    """Noise of a few samples on both sides; the mean over all pixels is sharper than one."""
    names = {"flat": "flat kernel", "gouraud": "Gouraud kernel", "phong": "Phong kernel"}
    kernel = study.methods[names[study.record.interpolation.value]]
    error = delta_e_2000(kernel, study.reference, Options().viewing)[study.counted].mean()
    noise = 2 * study.record.reference.noise_floor
    found = study.causes.departure[study.counted].mean()
    assert found == pytest.approx(error, abs=0.05 * error + noise)
    first, *_, last = study.record.attribution.hybrids
    assert (first.effects, first.error) == ((), pytest.approx(found))
    assert set(last.effects) == set(study.causes.maps)
    assert set(study.causes.previews) == {each.effects for each in study.record.attribution.hybrids}


def test_a_study_has_its_effects_files_and_tables(study):
    record = study.record
    assert set(study.causes.maps) == MADE_OF[record.scene]
    made = cost_files.documents(study)
    jsonschema.Draft202012Validator(SCHEMA).validate(json.loads(made["cost.json"]))
    assert made["cost.svg"].startswith(b"<svg")
    pictures = [name for name in made if name.startswith("cost-method-")]
    assert len(pictures) == len(record.methods)
    text = "\n".join(cost_tables.lines(record))
    for name in (*(method.name for method in record.methods), *study.causes.maps):
        assert name.split(",")[0] in text
    reasons = {one.name: one.reason for one in record.left_out}
    for name, reason in reasons.items():
        assert f"left out: {name}: {reason}" in text
    if record.scene == "cornell-box":
        prepared = {point.method: point.prepare_s for point in record.points}
        assert prepared["constant ambient"] > 0
        assert prepared["Phong kernel"] == prepared["direct"] == 0


@pytest.mark.guarantee(
    "attribution",
    "With all effects simulated no departure remains: the closure's interval contains 0.",
)
def test_with_all_effects_nothing_is_left(rgb):
    few = Options(resolution=(32, 32))
    effort = replace(TINY, depths=(), stand_ins=False, **SHARP)
    record = cost(SCENES["cornell-box"].source(), few, effort).record
    closure = record.closure
    assert closure.low <= 0 <= closure.high or abs(closure.mean) < 0.02
    assert closure.high - closure.low < 0.1 * record.attribution.departure


@pytest.mark.slow
@pytest.mark.guarantee(
    "attribution",
    "The closure of a comparison is unbiased: below 1 % of the Cornell box's departure.",
)
def test_a_quick_closure_is_not_biased(rgb):
    source = SCENES["cornell-box"].source()
    small = Options(resolution=(48, 48), spp=16)
    found = [compare(source, small.changed(seed=seed), why=True).record.why for seed in range(5)]
    mean = np.mean([why.closure.mean for why in found])
    assert abs(mean) < 0.01 * found[0].departure


@pytest.mark.guarantee(
    "attribution",
    "On the Cornell box, intervals of attributions contain the converged value in at least 35 of"
    " 40 runs.",
)
@pytest.mark.slow
def test_intervals_of_attributions_hold_the_converged_value(rgb, capsys):
    def removes(seed, spp):
        effort = replace(TINY, **SHARP | {"reference_spp": spp, "replicate_spp": spp})
        options = Options(resolution=(64, 64), seed=seed)
        record = cost(SCENES["cornell-box"].source(), options, effort).record
        return {one.effect: one.removes for one in record.attribution.effects}

    converged = removes(1_000, 8 * SHARP["replicate_spp"])
    found = [removes(seed, SHARP["replicate_spp"]) for seed in range(40)]
    for effect, exact in converged.items():
        held = sum(one[effect].low <= exact.value <= one[effect].high for one in found)
        width = np.median([one[effect].high - one[effect].low for one in found])
        with capsys.disabled():
            print(f"\n{effect}: {exact.value:.3f}, held {held} of 40, median width {width:.3f}")
        assert held >= 35
        assert width < max(0.2, exact.value / 2)


# -- Methods ---------------------------------------------------------------------------------------


@pytest.fixture
def declared(monkeypatch):
    """Forget afterwards what a test declares."""
    monkeypatch.setattr(methods, "_DECLARED", {})


def ladder(source, depths=(3,), **options):
    chosen = Options(**{"resolution": (12, 12)} | options)
    return Ladder(source, chosen, prepare(source, chosen), depths)


def whole(renderer, count=8, seed=40):
    total = Accumulator()
    for number in range(count):
        total.add(renderer.render(seed + number))
    return total.estimate()


@pytest.mark.parametrize("name", ["fig-8-9", "cornell-box", "open floor"])
def test_merged_methods_are_equal_images(rgb, name):
    """Every name that a method swallowed, rendered as if the scene could tell it apart."""
    if name == "open floor":
        # A convex diffuse shape alone: nothing shadows it, nothing lights it again, phong is exact.
        ball = {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": 0.6}}
        lamp = {"type": "point", "position": (3, -4, 5), "intensity": 60.0}
        source = Source(name, described(ball=ball, lamp=lamp, size=24))
    else:
        source = SCENES[name].source()
    chosen = Options(resolution=(24, 24))
    ready = prepare(source, chosen)
    found = Ladder(source, chosen, ready)
    merged = [method for method in found.methods if len(method.names) > 1]
    assert merged
    # A plan that calls for all, and traits that have all, tell all methods apart.
    effects = tuple(structs.replace(one, called_for=True) for one in ready.plan.effects)
    plan = structs.replace(ready.plan, effects=effects)
    telling = Ladder(source, chosen, replace(ready, plan=plan))
    labels = frozenset(effect.label for effect in EFFECTS)
    full = replace(found.traits, effects=labels, kernel_shadows=False)
    apart = {method.name: method for method in distinct(full, {})}
    assert "direct" in apart
    for method in merged:
        expected = whole(found.renderer(method, 16))
        for other in set(method.names) & set(apart):
            image = whole(telling.renderer(apart[other], 16), seed=80)
            noise = np.hypot(expected.standard_error, image.standard_error)
            # Five standard errors of eight passes, and the pixel filter's own spread at edges.
            difference = np.abs(expected.mean - image.mean)
            assert (difference > 7 * noise + 1e-5).mean() < 5e-3, (method.name, other)
            mean = np.abs((expected.mean - image.mean).mean())
            assert mean < 4 * np.sqrt(np.mean(noise**2) / noise.size) + 1e-6, (method.name, other)


TOY = Method(name="no shadows", family="physical", without=("occlusion",), max_depth=2)
HALF = Method(
    name="half light",
    family="kernel",
    heuristic="mean-ambient",
    stands_in_for=("interreflection",),
)


def test_methods_stand_in_order_with_declared_ones_before_the_full_plan(rgb, declared):
    declare(TOY)
    declare(HALF)
    everything = ladder(SCENES["plastic-spheres"].source(), (3, 4, 5))
    assert [method.names for method in everything.methods] == [
        ("flat kernel",),
        ("Gouraud kernel",),
        ("Phong kernel",),
        ("kernel with shadows",),
        ("shadow map",),
        ("filtered shadow map",),
        ("constant ambient",),
        ("hemisphere ambient",),
        ("phong BSDF, full transport",),
        ("direct",),
        ("path 3",),
        ("path 4",),
        ("path 5",),
        (TOY.name,),
        (HALF.name,),
        ("full plan",),
    ]
    # Nothing shadows the one ball of the figure.
    figure = ladder(SCENES["fig-8-9"].source())
    assert figure.methods[-1].names == ("direct", "path 3", TOY.name, "full plan")
    reason = "it stands in for interreflection, which the scene does not have"
    assert figure.left_out[HALF.name] == reason


def test_a_declared_method_replaces_one_of_its_name_but_none_of_the_package(declared):
    declare(TOY)
    again = declare(Method(name=TOY.name, family="kernel", shadows=True))
    assert methods.all_methods()[-2:] == (again, methods.FULL_PLAN)
    with pytest.raises(InputError, match=r"'direct' is already declared .* give another"):
        declare(Method(name="direct", family="physical"))
    with pytest.raises(InputError, match=r"without extended lights .* occlusion, microfacets"):
        declare(structs.replace(TOY, without=("extended lights",)))


def test_a_scene_says_why_it_cannot_have_a_method(rgb, tmp_path):
    path = tmp_path / "parallel.xml"
    path.write_text(SCENE.replace("perspective", "orthographic"), encoding="utf-8")
    found = ladder(Source("parallel", path), (3, 4))
    assert "has no single viewpoint" in found.left_out["Gouraud kernel"]
    assert found.left_out["path 4"] == "the scene's own paths end at depth 3"
    source = Source("orthographic", CORPUS / "sensor-orthographic.xml")
    kernels = {each.name for each in ladder(source).methods if "kernel" in each.name}
    assert kernels == {"Phong kernel", "kernel with shadows"}


def test_size_and_methods_are_of_the_chosen_sensor(rgb):
    several = described(ball={"type": "sphere"}, size=32)
    view = mi.ScalarTransform4f().look_at((4, 0, 1), (0, 0, 0), (0, 0, 1))
    film = {"type": "hdrfilm", "width": 16, "height": 24, "rfilter": {"type": "box"}}
    several["second"] = {"type": "perspective", "to_world": view, "film": film}
    source = Source("several", several)
    assert reduced(source, Options(sensor=1), WIDTH) == (16, 24)
    assert reduced(source, Options(sensor=1), 8) == (8, 12)
    assert reduced(source, Options(resolution=(48, 24)), 12) == (12, 6)

    def place(sensor, interpolation):
        pairs = ladder(source, sensor=sensor).pairs
        graph = pairs.of(interpolation).heuristic
        return graph.instantiate().sensors()[0].world_transform().matrix.numpy()

    flat = place(1, Interpolation.FLAT)
    np.testing.assert_array_equal(place(1, Interpolation.PHONG), flat)
    assert (place(0, Interpolation.PHONG) != flat).any()


# -- Hybrids ---------------------------------------------------------------------------------------


class Shown:
    """Renders the hybrid of some effects: transported light, and the emission pass."""

    def __init__(self, scenes, simulated, spp):
        made = scenes.transport(simulated, spp), scenes.emission(simulated, spp)
        self.parts = [renderer for renderer in made if renderer is not None]

    def render(self, seed):
        return sum(mi.TensorXf(part.render(seed)) for part in self.parts)


def hybrid_scenes(source, size=24):
    ready = prepare(source, Options(resolution=(size, size)))
    return ready, HybridScenes(ready.pair, ready.plan, ready.scene)


def test_without_effects_the_plugins_give_the_kernels_image(rgb):
    for name in ("fig-8-9", "plastic-spheres", "fig-6-5-m40"):
        ready, scenes = hybrid_scenes(SCENES[name].source())
        found = np.array(Shown(scenes, (), ready.heuristic.spp).render(3))
        expected = np.array(ready.heuristic.render(3))
        assert expected.max() > 0.1
        np.testing.assert_allclose(found, expected, atol=2e-5)


def test_with_all_effects_they_give_the_reference(rgb):
    for name in ("fig-8-9", "cornell-box"):
        ready, scenes = hybrid_scenes(SCENES[name].source())
        found = whole(Shown(scenes, scenes.differences, 64))
        ready.reference.spp = 64
        expected = whole(ready.reference, seed=90)
        noise = np.hypot(found.standard_error, expected.standard_error)
        assert (np.abs(found.mean - expected.mean) > 7 * noise + 1e-5).mean() < 5e-3
        mean_noise = np.sqrt(np.mean(noise**2) / noise.size)
        assert abs((found.mean - expected.mean).mean()) < 4 * mean_noise + 1e-6


def test_light_without_shadows_passes_through_what_is_in_its_way(rgb):
    """A lamp behind a board: black with shadows, and without them what the lamp gives alone."""

    def board(factor, place=(0, 0, 0), turned=False, **more):
        transform = mi.ScalarTransform4f().translate(place)
        transform = transform.rotate((1, 0, 0), 180) if turned else transform
        return {"type": "rectangle", "to_world": transform.scale(factor), **more}

    def diffuse(reflectance):
        return {"type": "diffuse", "reflectance": reflectance}

    # The camera stands under the board, which it does not see.
    view = {
        "viewer": (0, -3, 1.5),
        "size": 16,
        "floor": board(2, bsdf=diffuse(0.5)),
        "lamp": board(
            0.5,
            (0, 0, 3),
            turned=True,
            bsdf=diffuse(0.0),
            emitter={"type": "area", "radiance": 20.0},
        ),
    }
    images = {}
    for key, parts in (("open", {}), ("hidden", {"board": board(4, (0, 0, 2), bsdf=diffuse(0.0))})):
        _, scenes = hybrid_scenes(Source(key, described(**view | parts)), 16)
        everything = set(scenes.differences)
        shown = (Shown(scenes, each, 64) for each in (everything, everything - {OCCLUSION}))
        images[key] = [whole(each) for each in shown]
    assert images["open"][0].mean.max() > 0.1
    assert images["hidden"][0].mean.max() < 1e-6
    found = images["hidden"][1]
    np.testing.assert_allclose(
        found.mean, images["open"][0].mean, atol=8 * found.standard_error.max() + 1e-4
    )


@pytest.mark.guarantee(
    "attribution", "A preview of the switchboard equals a rendering that simulates its effects."
)
def test_a_preview_is_the_same_image_in_finer_pixels(rgb):
    """By the kernel's own shadow rays, where the hybrid has Mitsuba's direct light."""
    scene = shadowed(24)
    scene["sensor"]["film"]["rfilter"] = {"type": "box"}
    case = open_case(scene, Options.of({"resolution": (24, 24)}), "shadowed")
    found = Ladder(case.source, case.options, guarded(case.source, case.options))
    for spp, finer in ((1, 1), (8, 1), (64, 4), (4096, 4), (16, 2)):
        hybrids = HybridImages(found.pairs, found.scenes, 3, spp, 0, (24, 24))
        assert hybrids.finer == finer
        assert finer * 24 <= PREVIEW
        assert finer == 1 or spp / finer**2 >= LEAST_SPP
    for effects in ((), ("occlusion",)):
        image = hybrids.simulating({labelled(effect) for effect in effects})
        assert image.preview.shape == (48, 48, 3)
        blocks = image.preview.reshape(24, 2, 24, 2, 3).mean(axis=(1, 3))
        np.testing.assert_allclose(blocks, image.images.mean(axis=0), rtol=1e-5, atol=1e-6)
    for rendered in (found.ready.scene, found.ready.heuristic.scene):
        assert tuple(rendered.sensors()[0].film().size()) == (24, 24)
    shadows = Method(name="shadows", family="kernel", shadows=True)
    loop = passes([found.renderer(shadows, 4, (48, 48))], 0, 3, stream=Stream.REPLICATES)
    expected = np.mean([np.array(one.images[0]) for one in loop], axis=0)
    np.testing.assert_allclose(image.preview, expected, rtol=1e-3, atol=1e-4)
    assert abs(image.preview - hybrids.simulating(()).preview).max() > 0.05


# -- Commands --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def predicted(tmp_path_factory):
    """The command's folder and record of a prediction that is measured."""
    out = tmp_path_factory.mktemp("cost")
    words = ["cost", "lambert-sphere", "--spp", "4", "--rounds", "2", "--at", "64x40", "--measure"]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("sys.argv", ["fotismos", *words, "-o", str(out)])
        patched.setattr("reports.jobs.IN_PROCESSES", False)
        cli.main()
    place = out / "cost/lambert-sphere"
    return place, json.loads((place / "cost.json").read_text(encoding="utf-8"))


@pytest.mark.guarantee(
    "attribution", "`cost --at` predicts, and with `--measure` measures, at a size of any shape."
)
def test_the_command_predicts_and_measures_at_another_shape_than_the_films(predicted):
    place, record = predicted
    jsonschema.Draft202012Validator(SCHEMA).validate(record)
    assert record["command"].startswith("fotismos cost lambert-sphere")
    assert "--rounds 2" in record["command"]
    assert {"cost.svg", "prediction.svg", "cost-reference.png", "cost-method-phong-kernel.png"} <= {
        path.name for path in place.iterdir()
    }
    prediction, names = record["prediction"], {method["name"] for method in record["methods"]}
    assert prediction["resolution"] == [64, 40]
    assert {row["method"] for row in prediction["forecasts"] if row["measured"]} == names
    for row in prediction["forecasts"]:
        assert row["seconds"]["low"] < row["seconds"]["value"] < row["seconds"]["high"]
        assert row["error"]["low"] <= row["error"]["mean"] <= row["error"]["high"]
        if row["method"] == "Phong kernel" and row["measured"]:
            assert row["error"]["mean"] == pytest.approx(row["measured"]["error"]["mean"], abs=0.05)


def test_sizes_without_pixels_or_prediction_are_refused(run):
    for words, reason in (
        (("--at", "0x0"), "at least 1"),
        (("--measure",), "give one with --at"),
        (("--at", "8x8"), "too small for a prediction"),
    ):
        code, _, error = run("cost", "fig-8-9", *words)
        assert code == 2
        assert reason in error


@pytest.fixture(scope="module")
def by_rmse():
    """A figure's ladder, judged by another metric."""
    set_variant("llvm_ad_rgb")
    source, few = SCENES["fig-8-9"].source(), Options(resolution=(12, 12))
    return measure_ladder(source, few, TINY, lambda *_: None, METRICS["rmse"])


def test_plan_within_names_the_cheapest_and_exits_with_1_if_there_is_none(
    rgb, run, monkeypatch, by_rmse
):
    monkeypatch.setattr(front, "measure_ladder", lambda *_: by_rmse)
    words = "plan", "fig-8-9", "--resolution", "12x12"
    code, said, _ = run(*words, "--within", 0.5, "--metric", "rmse", "--json")
    assert code == 0
    found = json.loads(said)
    chosen, full, best = found["chosen"], found["full"], found["best"]
    errors = [one["error"]["mean"] for one in (best, full, chosen)]
    assert 0 < errors[0] <= errors[1] < 0.5 > errors[2]
    assert chosen["seconds"]["value"] <= full["seconds"]["value"]
    assert {"shadow map", "constant ambient"} <= {one["name"] for one in found["left_out"]}
    code, said, _ = run(*words, "--within", 1e-9)
    assert code == 1
    assert said.startswith("At 12x12 no measured method stays within")
    for more, reason in (
        (("--verify",), "give one"),
        (("--metric", "rms"), "metric 'rms' is not known"),
    ):
        code, _, said = run(*words, "--within", 1, *more)
        assert code == 2
        assert reason in said
