"""The verdict on a run: what is counted as right, which causes are named, what would do."""

import pytest
from msgspec import structs

from comparisons.departure.metrics import LEADING
from heuristic.heuristics import HEURISTICS, Point
from reports import verdict
from reports.terminal import tables
from tests import cost_records, records
from tests.small_scene import PLAIN


def found(scene="a", mean=4.0, beyond=0.5, parts=(), remedies=None):
    parts = tuple(verdict.BarPart(effect, "#000000", size) for effect, size in parts)
    shares = dict.fromkeys(verdict.TOLERANCES, beyond)
    return verdict.Finding(scene, mean, shares, parts, remedies or {}, mean <= verdict.EXACT)


def of_record(mean, cost=None, **changes):
    record = records.record()
    metric = structs.replace(records.summary(mean), **changes)
    record = structs.replace(record, metrics=record.metrics | {LEADING.name: metric})
    return verdict.finding(record, cost)


@pytest.mark.parametrize(("share", "is_right"), [(0.0, True), (0.05, True), (0.0501, False)])
def test_a_scene_is_right_if_at_most_a_twentieth_of_its_pixels_departs(share, is_right):
    visible = records.visible({1.0: 1.0, 2.0: share, 5.0: 0.0})
    finding = of_record(3.0, visible=visible)
    assert finding.is_right(2.0) is is_right
    assert not finding.is_right(1.0)
    assert finding.is_right(5.0)


def test_parts_are_what_effects_surely_remove_and_fill_the_bar():
    finding = of_record(10.0, cost_records.record())
    assert [part.effect for part in finding.parts] == ["interreflection", "occlusion"]
    assert sum(part.size for part in finding.parts) == pytest.approx(10.0)
    assert finding.parts[0].size / finding.parts[1].size == pytest.approx(5.895 / 3.141)


def test_the_remedy_is_the_fastest_method_that_reaches_the_tolerance():
    remedies = of_record(10.0, cost_records.record()).remedies
    assert (remedies[2.0].method, remedies[2.0].seconds) == ("full plan", 0.0567)
    assert remedies[5.0].seconds == 0.0234
    assert remedies[1.0] is None


@pytest.mark.guarantee(
    "attribution", "The remedy is the cheapest method of all, the textbook's own kernel included."
)
def test_all_methods_are_judged_alike_also_the_kernel_itself():
    cost = cost_records.record()
    fast = structs.replace(
        cost.points[0], error=structs.replace(cost.points[0].error, mean=1.5)
    )  # of the kernel that was judged
    cost = structs.replace(cost, points=(fast, *cost.points[1:]))
    visible = records.visible({1.0: 1.0, 2.0: 0.12, 5.0: 0.0})
    finding = of_record(10.0, cost, visible=visible)
    assert finding.remedies[2.0] == verdict.Remedy("Phong kernel", fast.seconds.value, True)
    assert verdict.about(finding).endswith("Its mean is within ΔE2000 2 all the same.")
    assert verdict.advice([finding])[0].endswith("mean within ΔE2000 2: as it is")
    assert finding.remedies[1.0] is None


def test_what_cannot_be_seen_is_exact():
    assert of_record(0.0).is_exact
    assert of_record(0.009, high=0.009).is_exact
    assert not of_record(0.009, high=0.02).is_exact


def test_the_sentences_count_scenes_and_name_what_those_that_fail_lack():
    several = [
        found("a", parts=[("occlusion", 3.0), ("spectral", 1.0)]),
        found("b", parts=[("interreflection", 3.5)]),
        found("c", beyond=0.01, parts=[("environment", 9.0)]),
    ]
    assert verdict.sentences(several) == [
        "Textbook shading looks right in 1 of 3 scenes.",
        "What it lacks most is interreflection, then occlusion, then spectral light.",
    ]
    assert verdict.sentences([found("a", beyond=0.42)]) == [
        "Textbook shading is visibly wrong in 42 % of the pixels of a."
    ]
    assert verdict.sentences([found("a", beyond=0.0)]) == ["Textbook shading looks right in a."]


def test_a_scene_is_told_in_a_few_sentences():
    remedy = dict.fromkeys(verdict.TOLERANCES, verdict.Remedy("path 3", 0.041))
    told = verdict.about(found("a", parts=[("occlusion", 4.0)], remedies=remedy))
    assert told.startswith("Textbook shading is visibly wrong in 50 % of the pixels.")
    assert "mostly occlusion" in told
    assert "path 3, 41.0 ms" in told
    right = verdict.about(found("a", beyond=0.0, remedies=remedy))
    assert right == "Textbook shading looks right here."
    assert "exact" in verdict.about(found("a", mean=0.0))


def test_advice_names_cause_and_remedy_of_each_scene_that_fails():
    remedy = dict.fromkeys(verdict.TOLERANCES, verdict.Remedy("path 3", 0.041))
    none = dict.fromkeys(verdict.TOLERANCES)
    lines = verdict.advice(
        [
            found("a", parts=[("occlusion", 4.0)], remedies=remedy),
            found("b", remedies=none),
            found("c", beyond=0.0, remedies=none),
        ]
    )
    assert lines == [
        "a: mostly occlusion; mean within ΔE2000 2: path 3 in 41.0 ms",
        f"b: no cause is known; mean within ΔE2000 2: {verdict.NO_REMEDY}",
    ]
    (line,) = verdict.advice([found("a")])
    assert verdict.WITH_CAUSES in line


def test_a_run_ends_with_its_verdict_and_finds_causes_unless_told_not_to(
    run, causes, scene_file, tmp_path
):
    scene_file.write_text(PLAIN, encoding="utf-8")
    for words, has_causes in (((), True), (("--no-why",), False)):
        out = tmp_path / f"{has_causes}"
        small = ("--spp", 4, "--resolution", "12x8")
        code, printed, _ = run("compare", scene_file, "-o", out, *small, *words)
        assert code == 0
        assert "Textbook shading " in printed
        assert ("--why" in printed) is not has_causes  # advice to find them
        assert (out / "my-scene/cost.json").exists() is has_causes


def test_the_heuristics_called_textbook_are_those_of_the_package_that_shade_as_the_chapters_do():
    own = [one for one in HEURISTICS.values() if one.is_own]
    assert set(verdict.TEXTBOOK) == {one.name for one in own if one.shade is Point.textbook}


@pytest.mark.parametrize(
    ("heuristic", "names"),
    [
        ("blinn", ("Textbook shading", "Textbook", "textbook")),
        ("mean-ambient", ("mean-ambient",) * 3),
        ("shaders/toon.py:shade", ("toon.py:shade",) * 3),
    ],
)
def test_a_shader_is_called_by_its_name_and_not_textbook(heuristic, names):
    record = structs.replace(records.record(), heuristic=heuristic)
    found = verdict.judged(record)
    assert (found.subject, found.title, found.name) == names
    assert verdict.sentences([verdict.finding(record)])[0].startswith(f"{names[0]} ")


def test_verbose_lines_tell_losses_and_settings_that_are_not_used():
    lines = "\n".join(tables.details(records.record()))
    assert "  lost: pane (dielectric): refraction; seen straight through" in lines
    assert "  not used: sampler independent, but multijitter" in lines
