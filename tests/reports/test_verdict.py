"""The verdict on a scene and on a run: one sentence for each case, on made-up records."""

from types import SimpleNamespace

import numpy as np
import pytest
from msgspec import structs

from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.records import cost as cost_records
from fotismos.comparisons.records.comparison import (
    Attribution,
    Contribution,
    EffectsThatPass,
    Price,
    SamplesThatPass,
    Saving,
)
from fotismos.comparisons.records.departure import VisibleShare
from fotismos.heuristic.heuristics import HEURISTICS, Point
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
    """Return an attribution of ``{effect: ΔE2000 removed}``, each to within 0.9."""
    removed = [
        Contribution(
            effect=effect,
            removes=Interval(value=value, low=value - 0.9, high=value + 0.9),
            alone=value,
            last=value,
            sampling_error=0.0,
        )
        for effect, value in effects.items()
    ]
    return Attribution(
        effects=tuple(removed),
        departure=sum(effects.values()),
        closure=Interval(value=0.0, low=0.0, high=0.0),
        implementation=0.0,
        resolution=(8, 6),
        spp=16,
        replicates=4,
        orders=0,
    )


def study(*points):
    """Return a study of the kernel and of methods ``(name, spp, ms, tolerance)``."""
    kernel = ("Phong kernel", 4, 3.9, 8.0)
    made = [
        cost_records.Point(
            method=name,
            spp=spp,
            seconds=Interval(value=ms / 1e3, low=0.95 * ms / 1e3, high=1.05 * ms / 1e3),
            error=Interval(value=1.0, low=1.0, high=1.0),
            tolerance=Interval(value=tolerance, low=tolerance, high=1.01 * tolerance),
        )
        for name, spp, ms, tolerance in (kernel, *points)
    ]
    methods = [SimpleNamespace(name=point.method) for point in made]
    return SimpleNamespace(points=made, at=(64, 48), resolution=(8, 6), methods=methods, stopped="")


def price(spp, effects=(), low=0, high=0):
    """Return the price of a picture of 100 pixels, whose physical half takes 8 times as long.

    ``low`` and ``high`` are the ends of the interval of its samples, if they are not ``spp``.
    """
    visible = Interval(value=0.03, low=0.02, high=0.04)
    found = EffectsThatPass(threshold=2.0, effects=effects, visible=visible)
    samples = SamplesThatPass(
        threshold=2.0, value=spp, low=low or spp, high=spp if high == 0 else high
    )
    return Price(
        ratio=Interval(value=8.0, low=7.5, high=8.5),
        reason="",
        heuristic_s=1e-4 / 8,
        reference_s=1e-4,
        pixels=100,
        samples=(samples,),
        needed=(found,),
    )


AMBIENT, PATH = ("hemisphere ambient", 16, 4.6, 1.8), ("path, depth 8", 64, 260, 1.2)
SAME = ("shadow map", 16, 4.7, 1.5)
RULES = {
    "passes": (scene(0.05), None, 2.0, "Nothing to do."),
    "undecided": (
        scene(0.03, 0.08), None, 2.0,
        "At most 5 % may differ. About `--spp 2048` decides.",
    ),
    "level": (
        scene(exposed=1.5), None, 2.0, "Brightening the picture is enough: ×1.11 makes it pass.",
    ),
    "level, if noise does not hide more": (
        scene(exposed=1.9, price=price(16)), None, 2.0,
        "16 samples per pixel pass: 32.0 times the textbook's time, 160 ms.",
    ),
    "level at another tolerance": (
        scene(exposed=1.5), study(PATH), 1.0,
        "No method passes at ΔE2000 1 at 64x48. The nearest is path, depth 8 with 64 samples in"
        " 260 ms, of which 5 % of the pixels exceed ΔE2000 1.20. To try more samples:"
        " `fotismos plan a --within 1 --spp 256`.",
    ),
    "cheapest": (
        scene(), study(PATH, AMBIENT), 2.0,
        "Hemisphere ambient with 16 samples is the cheapest that looks right: 4.60 ms at 64x48. In"
        " the textbook's time, 3.90 ms, Phong kernel reaches ΔE2000 8.00.",
    ),
    "times that cannot be told apart": (
        scene(), study(PATH, AMBIENT, SAME), 2.0,
        "Shadow map with 16 samples is the cheapest that looks right: 4.70 ms at 64x48. In the"
        " textbook's time, 3.90 ms, Phong kernel reaches ΔE2000 8.00.",
    ),
    "none is better": (
        scene(), study(("flat", 64, 4.0, 9.0)), 2.0,
        "No method looks right at 64x48. The nearest is Phong kernel with 4 samples in 3.90 ms, of"
        " which 5 % of the pixels exceed ΔE2000 8.00. To try more samples:"
        " `fotismos plan a --within 2 --spp 16`.",
    ),
    "effects and samples": (
        scene(why=why(occlusion=3.0, spectral=1.0), price=price(64, ("occlusion",))), None, 2.0,
        "It needs occlusion, but not spectral light. 64 samples per pixel pass: 128 times the"
        " textbook's time, 640 ms.",
    ),
    "all effects": (
        scene(why=why(occlusion=3.0, spectral=1.0), price=price(4, ("occlusion", "spectral"))),
        None, 2.0,
        "It needs occlusion and spectral light. 4 samples per pixel pass: 8.00 times the"
        " textbook's time, 40.0 ms.",
    ),
    "an interval of samples": (
        scene(price=price(64, low=16, high=256)), None, 2.0,
        "64 samples per pixel (16 to 256) pass: 128 times the textbook's time, 640 ms.",
    ),
    "samples without an upper end": (
        scene(price=price(64, high=None)), None, 2.0,
        "64 samples per pixel, or more, pass: 128 times the textbook's time, 640 ms.",
    ),
    "more samples than are named": (
        scene(price=price(None)), None, 2.0, "More than 65,536 samples per pixel pass.",
    ),
    "no time": (
        scene(price=structs.replace(price(64), ratio=None, reference_s=None)), None, 2.0,
        "64 samples per pixel pass.",
    ),
    "without a price": (scene(), None, 2.0, "The map shows where the pictures differ."),
    "caution": (scene(caution="No pixel sees light."), None, 2.0, "No pixel sees light."),
}  # fmt: skip


@pytest.mark.guarantee("attribution", "A remedy passes the criterion that the scene failed.")
@pytest.mark.parametrize("rule", RULES)
def test_each_rule_has_its_sentence(rule):
    record, cost, threshold, expected = RULES[rule]
    assert verdict.sentence(record, cost, threshold) == expected


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        (
            "fotismos compare 'my scene.xml' --variant x -D a=1 --seed 3",
            "fotismos plan 'my scene.xml' --within 2 -D a=1",
        ),
        (
            "fotismos compare fig-6-14 --heuristic phong --interpolation gouraud",
            "fotismos plan fig-6-14 --within 2",
        ),
        (
            "fotismos compare fig-6-14 --heuristic blinn --interpolation phong",
            "fotismos plan fig-6-14 --within 2 --heuristic blinn --interpolation phong",
        ),
    ],
)
def test_the_command_that_finds_methods_repeats_what_is_not_the_default(command, expected):
    assert verdict.search(scene(command=command), 2.0) == expected


@pytest.mark.parametrize(
    ("record", "expected"),
    [
        (scene(0.01, price=price(64)), 1.0),
        (scene(exposed=1.5, price=price(64)), 1.0),
        (scene(price=price(64)), 128.0),
        (scene(price=price(None)), None),
        (scene(), None),
    ],
    ids=["passes", "passes if brighter", "samples", "too many samples", "no price"],
)
def test_the_price_is_over_the_textbook_picture(record, expected):
    assert verdict.price_at(record) == expected


def test_a_run_counts_the_scenes_in_which_looking_right_costs_little():
    made = [scene(0.01, price=price(4)), scene(price=price(64)), scene()]
    expected = "In 1 of 3 scenes, looking right takes at most 1.5 times the textbook's time."
    assert verdict.costs(made) == expected
    assert verdict.costs(made[:1]) == ""
    assert verdict.costs([scene(), scene()]) == ""


def test_a_run_says_what_its_plans_save():
    def saved(time):
        return structs.replace(price(4), saved=Saving(time=time, noise=None))

    made = [scene(price=saved(2.0)), scene(price=saved(6.0)), scene(price=saved(3.0)), scene()]
    assert verdict.savings(made) == (
        "In 3 of 4 scenes the plan leaves out what changes nothing; with it, a sample takes 3.00"
        " times as long (median)."
    )
    assert verdict.savings(made[:1]) == ""
    assert verdict.savings([scene(), scene()]) == ""


def test_a_scene_says_what_its_plan_leaves_out_and_saves():
    left_out = structs.replace(price(4), left_out=("shadow rays", "interreflection"))
    saved = structs.replace(left_out, saved=Saving(time=2.0, noise=6.0))
    sentence = "Left out, since it changes nothing: shadow rays, interreflection."
    assert verdict.saving(scene(price=price(4))) == ""
    assert verdict.saving(scene(price=left_out)) == sentence
    takes = "With it, a sample takes 2.00 times as long and has 6.00 times the noise."
    assert verdict.saving(scene(price=saved)) == f"{sentence} {takes}"


def test_what_cannot_be_seen_is_exact():
    lead = records.summary(0.009)
    visible = records.visible({2.0: 0.0})
    for high, expected in ((0.009, "No visible difference."), (0.02, "Nothing to do.")):
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
    expected = "Textbook shading looks right in 1 of 4 scenes; 1 is undecided."
    assert verdict.headline(made) == expected
    expected = "Mostly missing: interreflection, spectral light, occlusion."
    assert verdict.most_missing(made) == expected
    assert verdict.most_missing([scene()]) == ""
    lines = list(verdict.advice(scenes))
    assert [line.partition(":")[0] for line in lines] == ["a", "b", "d"]
    assert lines[0].startswith("a: Mostly missing: interreflection. No method looks right at ")


def test_effects_whose_intervals_overlap_are_tied():
    for effects, expected in (
        ({"interreflection": 3.0, "occlusion": 1.3}, "interreflection and occlusion alike"),
        ({"interreflection": 3.0, "occlusion": 1.1}, "interreflection"),
        ({"occlusion": 1.0, "spectral": 0.8}, "occlusion"),  # the second may remove nothing
        ({"occlusion": 0.8}, ""),
    ):
        record = scene(why=why(**effects))
        assert verdict.because(record) == expected
        assert verdict.cause(record) == (f"Mostly missing: {expected}." if expected else "")


def test_an_effect_that_may_remove_nothing_is_not_needed():
    found = scene(why=why(occlusion=3.0, spectral=0.5), price=price(4, ("occlusion", "spectral")))
    assert verdict.needs(found) == "occlusion"
    assert verdict.sentence(found).startswith("It needs occlusion, but not spectral light.")


def test_scenes_in_doubt_are_counted_and_named():
    doubtful = scene(0.01, name="b", caution="Both pictures are black.")
    made = [scene(0.01), doubtful]
    assert verdict.headline(made).endswith("looks right in 1 of 2 scenes; 1 is in doubt.")
    assert list(verdict.advice([(record, None) for record in made])) == [
        "b: Both pictures are black."
    ]
    assert list(verdict.advice([(doubtful, None)])) == []  # the headline has it


def test_two_pictures_are_judged_once_and_without_noise_that_is_not_known(run, tmp_path):
    picture = np.random.default_rng(3).uniform(0.1, 0.5, (24, 32, 3)).astype(np.float32)
    np.save(tmp_path / "a.npy", 2 * picture)
    np.save(tmp_path / "b.npy", picture)
    words = ("--image", tmp_path / "a.npy", "--reference", tmp_path / "b.npy")
    code, printed, _ = run("compare", *words, "-o", tmp_path / "out")
    said = " ".join(printed.split())
    assert code == 0
    assert said.count("times as bright") == 1
    assert said.index("differs visibly") < said.index("times as bright")
    assert "is not moved; its" in said
    assert "because of" not in printed  # columns without a word are left out
    page = (tmp_path / "out/index.html").read_text()
    assert "The noise of single pictures is not known." in page
    assert "is not moved; its" in page


def test_a_run_ends_with_its_verdict_and_finds_causes(
    run, causes, scene_file, tmp_path, two_scenes
):
    """Such as a material that reflects more than it receives."""
    bright = (
        '<bsdf type="phong"><float name="k_d" value="2.5"/><float name="k_s" value="0.4"/></bsdf>'
    )
    text = PLAIN.replace('<bsdf type="diffuse"/>', bright, 1)
    assert bright in text
    scene_file.write_text(text)
    small = ("--spp", 16, "--resolution", "12x8", "-o", tmp_path / "out")
    code, printed, _ = run("compare", scene_file, *small)
    assert code == 0
    said = " ".join(printed.split())
    assert "Textbook shading " in said
    assert "Mostly missing: " in said
    assert "A material reflects 2.50 times the light that it receives" in said
    assert "microfacets" not in said
    assert "Textbook shading " in two_scenes.printed
    assert "Mostly missing: " not in two_scenes.printed


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
    assert "differs visibly: above ΔE2000 10" in printed
    assert "Textbook shading looks right in fig-8-9." in printed
    assert 'value="10.0"' in (tmp_path / "index.html").read_text()
    assert run(*words, "--within", 2.1)[0] == 2


def test_a_warning_stands_once_in_what_is_said_about_a_scene():
    text = verdict.about(records.record(caution="It is black."))
    assert text.count("It is black.") == 1
