"""The verdict on a scene and on a run: one sentence for each case, on made-up records."""

from types import SimpleNamespace

import pytest
from msgspec import structs

from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.comparison import MeanError
from fotismos.comparisons.cost import cost_record
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.departure.noise import VisibleShare
from fotismos.comparisons.options import Options
from fotismos.comparisons.steps import steps
from fotismos.heuristic.heuristics import HEURISTICS, Interpolation, Point
from fotismos.reference.records import Interval
from fotismos.reports import verdict
from tests.shared import records
from tests.shared.small_scene import PLAIN


def scene(low=0.5, high=None, name="a", exposed=9.0, command="fotismos compare a", **changes):
    """Return a record of which a share of pixels differs at 2, and twice that share at 1."""
    record, high = records.record(), low if high is None else high
    lead = record.metrics[LEADING.name]
    shares = [VisibleShare(threshold=t, value=low, low=low, high=high) for t in (1.0, 2.0)]
    shares[0] = structs.replace(shares[0], value=2 * low, low=2 * low, high=2 * high)
    after = structs.replace(lead.after_exposure, exposure=1.11, p95=exposed)
    lead = structs.replace(lead, visible=tuple(shares), after_exposure=after, high=4.0)
    metrics = record.metrics | {LEADING.name: lead}
    return structs.replace(record, scene=name, metrics=metrics, command=command, **changes)


def why(**effects):
    """Return an attribution of ``{effect: ΔE2000 removed}``."""
    removed = [
        SimpleNamespace(effect=effect, removes=SimpleNamespace(value=value, low=value - 0.9))
        for effect, value in effects.items()
    ]
    return SimpleNamespace(effects=removed)


def study(*points):
    """Return a study of the kernel and of methods ``(name, spp, ms, tolerance)``."""
    kernel = ("Phong kernel", 4, 3.9, 8.0)
    methods = [
        SimpleNamespace(
            name=name, names=(name,), is_kernel=name == kernel[0], shadows=False, heuristic="",
            interpolation=Interpolation.PHONG,
        )
        for name, *_ in (kernel, *points)
    ]  # fmt: skip
    made = [
        cost_record.Point(
            method=name,
            spp=spp,
            seconds=Interval(value=ms / 1e3, low=0.95 * ms / 1e3, high=1.05 * ms / 1e3),
            error=MeanError(value=1.0, low=1.0, high=1.0),
            tolerance=MeanError(value=tolerance, low=tolerance, high=1.01 * tolerance),
        )
        for name, spp, ms, tolerance in (kernel, *points)
    ]
    return SimpleNamespace(
        predicted=made, points=(), at=(64, 48), resolution=(8, 6), methods=methods,
        interpolation=Interpolation.PHONG,
    )  # fmt: skip


AMBIENT, PATH = ("hemisphere ambient", 16, 4.6, 1.8), ("path, depth 8", 64, 260, 1.2)
SAME = ("shadow map", 16, 4.7, 1.5)
RULES = {
    "passes": (scene(0.05), None, 2.0, "Nothing to do."),
    "undecided": (
        scene(0.03, 0.08), None, 2.0,
        "Too close to call: 3.00 % to 8.00 % of the pixels differ, and 5.00 % may. More samples"
        " (--spp, --noise) decide.",
    ),
    "level": (
        scene(exposed=1.5), None, 2.0, "Brightening the picture is enough: ×1.11 makes it pass.",
    ),
    "level, if noise does not hide more": (
        scene(exposed=1.9), None, 2.0,
        "To find the cheapest method that passes: `fotismos plan a --within 2`.",
    ),
    "level at another tolerance": (
        scene(exposed=1.5), study(PATH), 1.0,
        "None of the 2 methods measured passes. Nearest: path, depth 8 with 64 samples, which"
        " passes at ΔE2000 1.21. To try more samples: `fotismos plan a --within 1 --spp 256`.",
    ),
    "cheapest": (
        scene(), study(PATH, AMBIENT), 2.0,
        "Hemisphere ambient passes: 4.60 ms, kernel 3.90 ms at 64x48.",
    ),
    "times that cannot be told apart": (
        scene(), study(PATH, AMBIENT, SAME), 2.0,
        "Shadow map passes: 4.70 ms, kernel 3.90 ms at 64x48.",
    ),
    "none is better": (
        scene(), study(("flat", 64, 4.0, 9.0)), 2.0,
        "None of the 2 methods measured is closer. To try more samples: `fotismos plan a --within 2"
        " --spp 16`.",
    ),
    "not measured": (
        scene(command="fotismos compare 'my scene.xml' --variant x -D a=1 --seed 3"), None, 1.0,
        "To find the cheapest method that passes: `fotismos plan 'my scene.xml' --within 1 -D"
        " a=1`.",
    ),
    "the scene's defaults are not repeated": (
        scene(command="fotismos compare fig-6-14 --heuristic phong --interpolation gouraud"), None,
        2.0, "To find the cheapest method that passes: `fotismos plan fig-6-14 --within 2`.",
    ),
    "other choices than the scene's are": (
        scene(command="fotismos compare fig-6-14 --heuristic blinn --interpolation phong"), None,
        2.0, "To find the cheapest method that passes: `fotismos plan fig-6-14 --within 2"
        " --heuristic blinn --interpolation phong`.",
    ),
    "caution": (scene(caution="No pixel sees light."), None, 2.0, "No pixel sees light."),
}  # fmt: skip


@pytest.mark.guarantee("attribution", "A remedy passes the criterion that the scene failed.")
@pytest.mark.parametrize("rule", RULES)
def test_each_rule_has_its_sentence(rule):
    record, cost, threshold, expected = RULES[rule]
    assert verdict.sentence(record, cost, threshold) == expected


def test_what_cannot_be_seen_is_exact():
    lead = records.summary(0.009)
    visible = records.visible({2.0: 0.0})
    for high, expected in ((0.009, "Exact, as far as can be seen."), (0.02, "Nothing to do.")):
        metrics = {LEADING.name: structs.replace(lead, high=high, visible=visible)}
        record = structs.replace(records.record(), metrics=metrics)
        assert verdict.sentence(record) == expected


def test_a_run_counts_scenes_and_names_what_those_that_fail_lack_by_pixels():
    effects = why(interreflection=3.0, spectral=1.0, environment=0.5)
    scenes = [
        (scene(0.8, name="a", why=effects), study()),
        (scene(0.1, name="b", why=why(occlusion=2.0)), None),
        (scene(0.01, name="c", why=why(specular=9.0)), None),
        (scene(0.04, 0.06, name="d"), None),
    ]
    made = [record for record, _ in scenes]
    assert verdict.missing(made[0]) == {"interreflection": 0.75, "spectral": 0.25}
    expected = "Textbook shading looks right in 1 of 4 scenes; 1 is too close to call."
    assert verdict.headline(made) == expected
    expected = "Mostly missing: interreflection, spectral light, occlusion."
    assert verdict.most_missing(made) == expected
    assert verdict.most_missing([scene()]) == ""
    lines = list(verdict.advice(scenes))
    assert [line.partition(":")[0] for line in lines] == ["a", "b", "d"]
    assert lines[0].startswith("a: Mostly missing: interreflection. None of the ")


def test_a_run_ends_with_its_verdict_and_finds_causes_unless_told_not_to(
    run, causes, scene_file, tmp_path
):
    scene_file.write_text(PLAIN)
    for words, has_causes in (((), True), (("--no-why",), False)):
        small = ("--spp", 4, "--resolution", "12x8", "-o", tmp_path / f"{has_causes}")
        code, printed, _ = run("compare", scene_file, *small, *words)
        assert code == 0
        assert "Textbook shading " in printed
        assert ("Mostly missing: " in printed) is has_causes


def test_the_heuristics_called_textbook_are_those_of_the_package_that_shade_as_the_chapters_do():
    own = [one for one in HEURISTICS.values() if one.is_builtin]
    assert set(verdict.TEXTBOOK) == {one.name for one in own if one.shade is Point.textbook}
    named = {"hemisphere-ambient": "hemisphere-ambient", "shaders/toon.py:shade": "toon.py:shade"}
    for heuristic, name in named.items():
        record = structs.replace(records.record(), heuristic=heuristic)
        assert set(vars(verdict.judged(record)).values()) == {name}
        assert verdict.headline([record]).startswith(f"{name} ")


def test_a_chosen_threshold_decides_on_the_terminal_and_where_the_page_begins(run, tmp_path):
    words = ("compare", "fig-8-9", "--spp", 4, "--resolution", "12x8", "-o", tmp_path)
    code, printed, _ = run(*words, "--within", 10)
    assert code == 0
    assert "differ: above ΔE2000 10" in printed
    assert "Textbook shading looks right in fig-8-9." in printed
    assert 'value="10.0"' in (tmp_path / "index.html").read_text()
    assert run(*words, "--within", 2.1)[0] == 2


def test_a_material_that_reflects_more_than_it_receives_is_the_cause(rgb, tmp_path):
    bright = (
        '<bsdf type="phong"><float name="k_d" value="2.5"/><float name="k_s" value="0.4"/></bsdf>'
    )
    text = PLAIN.replace('<bsdf type="diffuse"/>', bright, 1)
    assert bright in text
    path = tmp_path / "bright.xml"
    path.write_text(text)
    case = open_case(path, Options(resolution=(12, 8), spp=16))
    then = steps(case.options, True)
    record = compare(case.source, case.options, command=case.command(), then=then).record
    assert verdict.missing(record)
    said = f"{verdict.about(record)} {verdict.most_missing([record])}"
    assert "A material reflects 2.50 times the light that it receives" in said
    assert "microfacets" not in said


def test_a_warning_stands_once_in_what_is_said_about_a_scene():
    text = verdict.about(records.record(caution="It is black."))
    assert text.count("It is black.") == 1
