"""Every comparison computes some colour differences with colour-science, too, and says how far."""

import numpy as np
import pytest
from colour.difference import delta_E_CIE2000
from colour.models import Lab_to_XYZ

import fotismos.comparisons.compare
from fotismos.comparisons.case import open_case
from fotismos.comparisons.departure import definitions
from fotismos.comparisons.departure.colour import BT709, ciede2000, rgb_to_xyz
from fotismos.comparisons.departure.definitions import AGREEMENT, DEFINED
from fotismos.comparisons.departure.metrics import LEADING, METRICS
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.comparison import Deviations
from fotismos.comparisons.records.departure import DEFAULT_VIEWING
from fotismos.reports import tables
from fotismos.reports.page import page
from tests.shared import records
from tests.shared.misplanned import SKY, scene, sphere


def compared(**options):
    case = open_case("fig-8-9", Options(spp=16, resolution=(24, 16), **options))
    return fotismos.comparisons.compare.compare(case.source, case.options)


@pytest.fixture(scope="module")
def usual():
    return compared()


@pytest.fixture
def broken(monkeypatch):
    """A formula that is wrong by 1 %."""
    monkeypatch.setitem(vars(LEADING), "difference", lambda a, b: 1.01 * ciede2000(a, b))


@pytest.mark.thorough
@pytest.mark.guarantee("means", "Every comparison computes 4,096 pixels with colour-science, too.")
def test_the_record_says_how_far_its_colour_differences_are_and_at_how_many_pixels(
    usual, monkeypatch
):
    found = usual.record.colour_science
    assert found.pixels == usual.record.pixels.counted
    assert set(found.largest) == set(DEFINED)
    assert min(found.largest.values()) > 0
    assert max(found.largest.values()) < AGREEMENT
    assert not usual.record.warnings
    monkeypatch.setattr(fotismos.comparisons.compare, "PIXELS_COMPUTED_TWICE", 5)
    assert compared().record.colour_science.pixels == 5


def test_a_formula_that_is_off_by_a_hundredth_is_found_and_named(broken):
    record = compared().record
    largest = record.colour_science.largest
    assert largest["dE2000"] == pytest.approx(record.metrics["dE2000"].max / 101, rel=1e-3)
    assert max(most for name, most in largest.items() if name != "dE2000") < AGREEMENT
    (warning,) = record.warnings
    assert f"ΔE2000 deviates from colour-science's by up to {largest['dE2000']:.2g}" in warning
    (line,) = (line for line in tables.details(record) if "colour-science, at" in line)
    assert f"at {record.pixels.counted} pixels: dE2000 {largest['dE2000']:.1e}" in line


@pytest.mark.thorough
def test_with_the_option_colour_science_computes_everything(broken, usual):
    found = compared(colour_science=True).record
    assert not found.warnings
    assert max(found.colour_science.largest.values()) < 1e-5
    for name in DEFINED:
        now, before = found.metrics[name], usual.record.metrics[name]
        for field in ("mean", "p50", "p95", "max", "debiased", "low", "high", "noise_floor"):
            assert getattr(now, field) == pytest.approx(getattr(before, field), abs=1e-3), field
    assert found.significant == usual.record.significant


def opposed(count=4000):
    """Linear colours whose hues, as ΔE2000 stretches them, are 180 degrees apart but for rounding.

    ``a' = (1 + G) a``, and G depends on the chroma of both, so it is found by repetition.
    """
    rng = np.random.default_rng(4)
    hue = rng.uniform(0, 2 * np.pi, count)
    chroma = 10.0 ** rng.uniform(-3, 1.3, (2, count)) * [[1], [-1]]
    a, b = chroma * np.cos(hue), chroma * np.sin(hue)
    stretch = 1.0
    for _ in range(60):
        power = np.hypot(a / stretch, b).mean(axis=0) ** 7
        stretch = 1.5 - 0.5 * np.sqrt(power / (power + 25.0**7))
    lightness = np.add(rng.uniform(40, 70, count), [[0], [5]])
    halves = np.stack([lightness, a / stretch, b], axis=-1)
    return Lab_to_XYZ(halves) @ np.linalg.inv(rgb_to_xyz(BT709)).T


@pytest.mark.guarantee("means", "A jump of ΔE2000 itself is not taken for a wrong formula.")
def test_colours_of_opposite_hue_deviate_by_rounding_alone_and_a_wrong_formula_still_does():
    halves = opposed()
    defined = delta_E_CIE2000(*(definitions.lab(half, DEFAULT_VIEWING) for half in halves))
    ours = {name: METRICS[name](*halves[:, None]).ravel() for name in DEFINED}
    assert (np.abs(ours["dE2000"] - defined) > 0.1).sum() > 100  # the jump
    assert max(definitions.deviations(*halves, ours).values()) < AGREEMENT
    wrong = ours | {"dE2000": 1.01 * ours["dE2000"]}
    found = definitions.deviations(*halves, wrong)["dE2000"]
    assert found == pytest.approx(ours["dE2000"].max() / 100, rel=0.01)


def test_details_give_the_largest_deviation_of_all_scenes():
    one, other = (
        records.record(colour_science=Deviations(pixels=4096, largest=dict.fromkeys(DEFINED, most)))
        for most in (1.25e-6, 3.75e-5)
    )
    text = page.details(records=[one, other])
    assert "at 8192 pixels" in text
    assert text.count('<data value="3.75e-05">') == len(DEFINED)
    assert "1.25e-06" not in text
    absent = [metric.label for name, metric in METRICS.items() if name not in DEFINED]
    assert f"It has no {'; '.join(absent)}." in text
    assert "Colours against" not in page.details(records=[records.record()])


@pytest.mark.thorough
def test_a_view_of_nothing_has_nothing_to_compute():
    away = scene(viewer=(0, -4, 0), target=(0, -9, 0), size=8, ball=sphere(), sky=SKY)
    case = open_case(lambda: away, Options(spp=4, allow_empty=True))
    found = fotismos.comparisons.compare.compare(case.source, case.options).record
    assert found.colour_science == Deviations(pixels=0, largest=dict.fromkeys(DEFINED, 0))
