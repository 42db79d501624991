"""The cost of accuracy on real scenes: methods, times, files, commands."""

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import msgspec
import numpy as np
import pytest
from msgspec import structs

from fotismos.comparisons import turns
from fotismos.comparisons.case import open_case
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.ladder import climb, methods
from fotismos.comparisons.ladder import cost as studies
from fotismos.comparisons.ladder.climb import LARGEST_SPP, WIDTH, Climb, Effort, climbed, reduced
from fotismos.comparisons.ladder.cost import cost
from fotismos.comparisons.ladder.front import cheapest
from fotismos.comparisons.ladder.methods import BUILT_IN, Ladder, declare
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.records.cost import Cost, Method
from fotismos.comparisons.turns import Time
from fotismos.heuristic.errors import InputError
from fotismos.reference.records import Interval
from fotismos.reference.scene.graph import set_variant
from fotismos.reference.scene.source import Source
from fotismos.reports import cost_tables
from fotismos.reports.run import cost_files
from fotismos.reports.terminal.words import as_typed
from fotismos.reports.verdict import answer
from tests.shared.misplanned import scene as described
from tests.shared.noisy import require_equal, whole
from tests.shared.schemas import schema
from tests.shared.small_scene import PLAIN, SCENE

SCHEMA = schema("cost")
TINY = Effort(rounds=2, largest=4, goes_on=False)
CORPUS = Path(__file__).parents[1] / "corpus"


@pytest.fixture(autouse=True, scope="module")
def short():
    """Times of these scenes need not repeat."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(turns, "MOST_SAMPLES", 0)
        patched.setattr(climb, "REFERENCE_SPP", 4)
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
    assert "time at 160x100" in said
    place = tmp_path / "cost/lambert-sphere"
    text = (place / "cost.json").read_text()
    jsonschema.Draft202012Validator(SCHEMA).validate(json.loads(text))
    record = msgspec.json.decode(text, type=Cost)
    assert re.match("fotismos cost lambert-sphere .*--rounds 2", record.command)
    files = {path.name for path in place.iterdir()}
    assert {"cost.svg", "cost-reference.png", "cost-method-phong-kernel.png"} <= files
    assert (record.resolution, record.at) == ((128, 80), (160, 100))
    assert {point.method for point in record.points} == {row.name for row in record.methods}
    kernel = record.method("Phong kernel")
    (predicted,) = (p for p in record.points if (p.method, p.spp) == (kernel.name, 4))
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


# -- More samples ----------------------------------------------------------------------------------


class Judged(Climb):
    """A ladder of two methods whose tolerances follow a law, and whose kernels take a time."""

    def __init__(self, laws, seconds, size=(16, 16)):
        methods = [Method(name=name, family="physical", monte_carlo=True) for name in laws]
        self.ladder = SimpleNamespace(methods=methods)
        self.steps = (SimpleNamespace(before=methods[0]),)
        self.effort = Effort(rounds=6)
        self.ready = SimpleNamespace(size=size)
        self.stopped = ""
        self.total = SimpleNamespace(count=10**9)
        self.asked = []
        self._laws = laws
        self._errors = {name: {} for name in laws}
        turn = np.ones(6)
        self._times = {
            name: Time(per_sample=time * turn, overhead=1e-6 * turn, processors=1.0)
            for name, time in seconds.items()
        }
        first = SimpleNamespace(times=[1.0], preparation=0.0)
        self._renderers = dict.fromkeys(laws, first)
        self._progress = None
        for spp in (4, 16, 64):
            self._judge(list(laws), spp, 6)
        self.asked.clear()

    def _judge(self, names, spp, rounds):
        self.asked.append((tuple(names), spp))
        for name in names:
            left, noise = self._laws[name]
            tolerance = np.hypot(left, noise / np.sqrt(spp))
            near = Interval(value=tolerance, low=0.99 * tolerance, high=1.01 * tolerance)
            self._errors[name][spp] = near, near


def test_samples_grow_until_the_cheapest_that_passes_is_known():
    laws = {"biased": (9.0, 3.0), "slow": (0.0, 20.0), "fast": (0.0, 60.0)}
    climb = Judged(laws, {"biased": 1e-9, "slow": 50e-9, "fast": 1e-9})
    climb._go_on(2.0)
    # Slow passes with 256 samples, and fast with 1,024, which takes less time.
    assert climb.asked == [(("slow", "fast"), 256), (("fast",), 1024)]
    best = cheapest(climb.points(), 2.0)
    assert (best.method, best.spp, climb.stopped) == ("fast", 1024, "")


TOO_MANY = "are more than an image of this size is given"


@pytest.mark.parametrize(
    ("laws", "seconds", "stopped"),
    [
        ({"biased": (9.0, 3.0)}, 1e-9, ""),
        ({"noisy": (0.0, 2000.0)}, 1e-9, f"262,144 samples {TOO_MANY}"),
        ({"noisy": (0.0, 2000.0)}, 1e-3, "256 samples would take more than 60 s"),
    ],
)
def test_what_cannot_pass_or_takes_too_long_takes_no_more_samples(laws, seconds, stopped):
    climb = Judged(laws, dict.fromkeys(laws, seconds))
    climb._go_on(2.0)
    assert climb.stopped == stopped
    assert cheapest(climb.points(), 2.0) is None
    said = answer(climb.points(), textbook="none", size=(16, 16), stopped=climb.stopped)
    assert said.startswith("No method looks right at 16x16. The nearest is ")
    assert ("More samples may help" in said) is bool(stopped)


@pytest.mark.thorough
@pytest.mark.guarantee("attribution", "`cost` goes on in samples until a method looks right.")
def test_a_study_goes_on_until_a_method_looks_right(rgb):
    case = open_case("cornell-box", Options(resolution=(24, 24)))
    climb = climbed(case.source, case.options, Effort(rounds=2), lambda *_: None)
    points = climb.points()
    assert max(point.spp for point in points) > LARGEST_SPP
    best = cheapest(points, 2.0)
    assert best.tolerance.high <= 2.0
    assert best.method == "full plan"


@pytest.mark.thorough
def test_plan_within_names_the_cheapest_that_passes_and_exits_with_1_if_none_does(
    rgb, run, monkeypatch
):
    source, few = SCENES["lambert-sphere"].source(), Options(resolution=(12, 12))
    found = climbed(source, few, TINY, lambda *_: None)
    monkeypatch.setattr(studies, "climbed", lambda *_, **__: found)
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
    assert "is the cheapest that passes at ΔE2000 10: " in sentence
    assert "Errors are measured at 12x12." in said
    assert made["chosen"]["tolerance"]["high"] <= 10
    assert made["chosen"]["method"] in {point["method"] for point in made["points"]}
    assert {"shadow map", "hemisphere ambient"} <= made["left_out"].keys()
    none = Interval(value=20.0, low=19.0, high=21.0)
    points = tuple(structs.replace(point, tolerance=none) for point in found.points())
    found.points = lambda at=None: points
    code, said, _ = run(*words, "--within", 10)
    assert code == 1
    assert "\nNo method passes at ΔE2000 10 at 12x12. The nearest is " in said
    code, _, said = run(*words, "--within", 1.1)
    assert (code, "in steps of 0.25" in said) == (2, True)
