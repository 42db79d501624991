"""The cost of accuracy on real scenes: methods, times, files, commands."""

import json
import re
from dataclasses import replace
from pathlib import Path

import jsonschema
import msgspec
import pytest
from msgspec import structs

from fotismos.comparisons.case import open_case
from fotismos.comparisons.cost import cost as studies
from fotismos.comparisons.cost import measure, methods
from fotismos.comparisons.cost.cost import cost
from fotismos.comparisons.cost.measure import WIDTH, Effort, measure_ladder, reduced
from fotismos.comparisons.cost.methods import BUILT_IN, Ladder, declare
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.records.cost import Cost, Method
from fotismos.heuristic.errors import InputError
from fotismos.reference.records import Interval
from fotismos.reference.scene.graph import set_variant
from fotismos.reference.scene.source import Source
from fotismos.reports import cost_tables
from fotismos.reports.run import cost_files
from fotismos.reports.terminal.words import as_typed
from tests.shared.misplanned import scene as described
from tests.shared.noisy import require_equal, whole
from tests.shared.schemas import schema
from tests.shared.small_scene import PLAIN, SCENE

SCHEMA = schema("cost")
TINY = Effort(rounds=2, largest=4)
CORPUS = Path(__file__).parents[1] / "corpus"


@pytest.fixture(autouse=True, scope="module")
def short():
    """Times of these scenes need not repeat."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(measure, "LEAST_S", 0.0)
        patched.setattr(measure, "REFERENCE_SPP", 4)
        yield


# -- A study ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["shadowed", pytest.param("narrow-band-lamp", marks=pytest.mark.thorough)]
)
def test_a_study_has_its_effects_files_and_tables(name, scene_file):
    scene_file.write_text(PLAIN)
    word = scene_file if name == "shadowed" else name
    case = open_case(word, Options(resolution=(24, 24)))
    study = cost(case.source, case.options, TINY)
    set_variant("llvm_ad_rgb")
    record, whole = study.record, study.record.attribution
    made = cost_files.documents(study)
    jsonschema.Draft202012Validator(SCHEMA).validate(json.loads(made["cost.json"]))
    assert sum(name.startswith("cost-method-") for name in made) == len(record.methods)
    text = "\n".join(cost_tables.lines(record))
    for named in (*(m.name for m in record.methods), *(e.effect for e in whole.effects)):
        assert named.split(",")[0] in text
    for left_out, reason in record.left_out.items():
        assert re.search(
            f"Left out: .*{re.escape(left_out)}.*, {re.escape(as_typed(reason))}", as_typed(text)
        )
    added = sum(one.adds_s.value for one in whole.effects) + whole.renderer_s.value
    assert added == pytest.approx(whole.plan_s.value - whole.kernel_s.value)
    assert record.methods[0].ratio.value == 1.0
    if name == "shadowed":
        assert record.method("shadow map").prepare_s > 0
        assert record.method("Phong kernel").prepare_s == record.method("direct").prepare_s == 0


# -- Methods ---------------------------------------------------------------------------------------


@pytest.fixture
def declared(monkeypatch):
    """Forget afterwards what a test declares."""
    monkeypatch.setattr(methods.METHODS, "added", {})


def ladder(source, **options):
    chosen = Options(**{"resolution": (12, 12)} | options)
    return Ladder(prepare(source, chosen))


@pytest.mark.parametrize(
    "name",
    [
        *(pytest.param(n, marks=pytest.mark.thorough) for n in ("fig-8-9", "cornell-box")),
        "open floor",
    ],
)
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
    found = Ladder(ready)
    merged = [method for method in found.methods if len(method.names) > 1]
    assert merged
    # A plan that calls for all tells all methods apart.
    effects = tuple(structs.replace(one, called_for=True) for one in ready.plan.effects)
    plan = structs.replace(ready.plan, effects=effects)
    telling = Ladder(replace(ready, plan=plan))
    apart = {method.name: method for method in BUILT_IN}
    for method in merged:
        expected = whole(found.renderer(method, 16))
        for other in set(method.names) & set(apart):
            image = whole(telling.renderer(apart[other], 16), seed=80)
            require_equal(expected, image, (method.name, other))


TOY = Method(name="no shadows", family="physical", without=("occlusion",), max_depth=2)
HALF = Method(
    name="half light",
    family="kernel",
    heuristic="hemisphere-ambient",
    stands_in_for=("interreflection",),
)


def test_methods_stand_in_order_with_declared_ones_before_the_full_plan(rgb, declared):
    declare(TOY)
    declare(HALF)
    everything = ladder(SCENES["plastic-spheres"].source())
    paths = ("direct", "path 3", "path 4", "path 5", TOY.name)
    assert [method.names for method in everything.methods] == [(name,) for name in (
        "Phong kernel", "kernel with shadows", "shadow map",
        "hemisphere ambient", "phong BSDF, full transport", *paths, HALF.name,
        "full plan",
    )]  # fmt: skip
    # Nothing shadows the one ball of the figure.
    figure = ladder(SCENES["fig-8-9"].source())
    assert figure.methods[-1].names == (*paths, "full plan")
    reason = "it replaces interreflection, which the scene does not have"
    assert figure.left_out[HALF.name] == reason


def test_a_declared_method_replaces_one_of_its_name_but_none_of_the_package(declared):
    declare(TOY)
    again = declare(Method(name=TOY.name, family="kernel", shadows=True))
    assert methods.all_methods()[-2:] == (again, methods.FULL_PLAN)
    with pytest.raises(InputError, match=r"'direct' is already declared .* give another"):
        declare(Method(name="direct", family="physical"))
    with pytest.raises(InputError, match=r"without extended lights .* bumps, microfacets"):
        declare(structs.replace(TOY, without=("extended lights",)))


def test_kernels_that_are_compared_have_the_same_mesh(rgb):
    source = SCENES["fig-8-9"].source()
    reason = ladder(source).left_out["flat kernel"]
    assert reason.endswith("give `tessellation` to measure all on one mesh")
    for options in ({"tessellation": 4}, {"interpolation": "gouraud"}):
        found = ladder(source, **options)
        names = [method.name for method in found.methods[:3]]
        assert names == ["flat kernel", "Gouraud kernel", "Phong kernel"]
        sizes = {
            found.renderer(each, 4).scene.shapes()[0].face_count() for each in found.methods[:3]
        }
        assert len(sizes) == 1


def test_steps_lead_from_the_kernel_to_the_full_plan_an_effect_at_a_time(rgb):
    for name in ("plastic-spheres", "cornell-box", "fig-6-10", "two-intensities"):
        scene = SCENES[name]
        options = {"interpolation": scene.interpolation, "tessellation": scene.tessellation}
        found = ladder(scene.source(), **options)
        steps = list(found.steps())
        weights = {}
        for step in steps:
            weights[step.effect] = weights.get(step.effect, 0.0) + step.weight
            if step.effect and not step.after.is_kernel:
                assert {*step.before.without} == {*step.after.without, step.effect}
        assert set(weights.values()) == {1.0}
        assert steps[0].before == found.methods[0]
        assert steps[-1].after.names[-1] == methods.FULL_PLAN.name
        expected = {effect.label for effect in found.scenes.differences} | {""}
        assert expected <= weights.keys()


def test_a_scene_says_why_it_cannot_have_a_method(rgb, tmp_path):
    path = tmp_path / "parallel.xml"
    path.write_text(SCENE.replace("perspective", "orthographic"))
    found = ladder(Source("parallel", path))
    assert "for meshes only" in found.left_out["Gouraud kernel"]
    assert found.left_out["path 4"] == "the scene's own paths end at depth 3"
    source = Source("orthographic", CORPUS / "sensor-orthographic.xml")
    kernels = {each.name for each in ladder(source).methods if "kernel" in each.name}
    assert kernels == {"Phong kernel", "kernel with shadows"}


def test_the_size_is_of_the_chosen_sensor(rgb):
    several = described(ball={"type": "sphere"}, size=32)
    other = described((4, 0, 1), size=16)["sensor"]
    source = Source("several", several | {"second": other})
    assert reduced(source, Options(sensor=1), WIDTH) == (16, 16)
    assert reduced(source, Options(sensor=1), 8) == (8, 8)
    assert reduced(source, Options(resolution=(48, 24)), 12) == (12, 6)


# -- Commands --------------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.guarantee("attribution", "`cost --at` predicts at a size of any shape.")
def test_the_command_predicts_at_another_shape_than_the_films(rgb, run, tmp_path):
    words = ("--spp", 4, "--rounds", 2, "--at", "160x100", "-o", tmp_path)
    code, said, _ = run("cost", "lambert-sphere", *words)
    assert code == 0
    assert "Predicted times at 160x100" in said
    place = tmp_path / "cost/lambert-sphere"
    text = (place / "cost.json").read_text()
    jsonschema.Draft202012Validator(SCHEMA).validate(json.loads(text))
    record = msgspec.json.decode(text, type=Cost)
    assert re.match("fotismos cost lambert-sphere .*--rounds 2", record.command)
    files = {path.name for path in place.iterdir()}
    assert {"cost.svg", "cost-reference.png", "cost-method-phong-kernel.png"} <= files
    assert (record.resolution, record.at) == ((128, 80), (160, 100))
    assert {point.method for point in record.predicted} == {row.name for row in record.methods}
    kernel = record.method("Phong kernel")
    (predicted,) = (p for p in record.predicted if (p.method, p.spp) == (kernel.name, 4))
    assert predicted.seconds.low <= predicted.seconds.value <= predicted.seconds.high
    assert predicted.seconds.value == pytest.approx(kernel.seconds(4 * 160 * 100).value)


def test_sizes_that_cannot_be_predicted_are_refused(run):
    for words, reason in (
        (("--at", "0x0"), "at least 1"),
        (("--at", "64x48", "--resolution", "32x32"), "differ in shape"),
    ):
        code, _, error = run("cost", "fig-8-9", *words)
        assert code == 2
        assert reason in error


@pytest.mark.thorough
def test_plan_within_names_the_fastest_that_passes_and_exits_with_1_if_none_does(
    rgb, run, monkeypatch
):
    source, few = SCENES["lambert-sphere"].source(), Options(resolution=(12, 12))
    found = measure_ladder(source, few, TINY, lambda *_: None)
    monkeypatch.setattr(studies, "measure_ladder", lambda *_, **__: found)
    words = "plan", "lambert-sphere", "--resolution", "12x12"
    code, said, _ = run(*words, "--within", 10, "--json")
    assert code == 0
    made = json.loads(said)
    _, said, _ = run("plan", "lambert-sphere", "--resolution", "64x64", "--within", 10)
    price, omitted, sentence, *_ = said.splitlines()
    assert price == ("At 64x64: Textbook shading passes at ΔE2000 10. No visible difference.")
    assert omitted.startswith("Left out, since it changes nothing: ")
    assert made["price"]["left_out"]
    assert {sample["threshold"] for sample in made["price"]["samples"]} >= {10.0}
    assert sentence.startswith("At 64x64: ")
    assert ": measured at 12x12, 5 % of the pixels exceed ΔE2000" in sentence
    best, full, chosen = (made[name]["tolerance"]["value"] for name in ("best", "full", "chosen"))
    assert 0 < best <= full < 10 > chosen
    assert made["chosen"]["seconds"]["low"] <= made["full"]["seconds"]["high"]
    assert {"shadow map", "hemisphere ambient"} <= made["left_out"].keys()
    none = Interval(value=20.0, low=19.0, high=21.0)
    points = tuple(structs.replace(point, tolerance=none) for point in found.points)
    monkeypatch.setattr(studies, "measure_ladder", lambda *_, **__: replace(found, points=points))
    code, said, _ = run(*words, "--within", 10)
    assert code == 1
    assert "\nAt 12x12 no method passes at ΔE2000 10 with the samples measured here" in said
    assert "More samples (--spp) decide" in said
    code, _, said = run(*words, "--within", 1.1)
    assert (code, "in steps of 0.25" in said) == (2, True)
