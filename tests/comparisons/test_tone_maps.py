"""Tone maps: against what was published of each, in the sums of passes, and found in pictures."""

import json
import re
from functools import cache
from typing import get_args

import colour
import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import ArrayLike

from fotismos.comparisons import alignment, picture_mistakes
from fotismos.comparisons.case import open_case
from fotismos.comparisons.departure import tone_maps
from fotismos.comparisons.departure.colour import from_srgb, to_srgb
from fotismos.comparisons.departure.mapped_sums import MappedDifference, MappedReference
from fotismos.comparisons.departure.tone_maps import TONE_MAPS, aces, agx, neutral, reinhard
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options, ToneMapName
from fotismos.comparisons.picture_mistakes import Names, NoisyImage
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.records.images import Light
from fotismos.heuristic.errors import InputError
from fotismos.reference.rendering.sums import Accumulator
from tests.shared.outputs import write

LIGHT = np.random.default_rng(0).lognormal(-1, 2, (4096, 3))
GREY = np.geomspace(1e-4, 100, 200)[:, None].repeat(3, axis=1)


# --- As published --------------------------------------------------------------------------------


def test_all_show_light_from_0_to_1_and_greys_as_greys_that_rise():
    assert tuple(TONE_MAPS) == get_args(ToneMapName)
    for tone_map in TONE_MAPS.values():
        shown = tone_map(LIGHT)
        assert shown.min() >= 0
        assert shown.max() <= 1
        assert np.ptp(tone_map(GREY), axis=1).max() < 1e-4
        assert np.diff(tone_map(GREY).mean(axis=1)).min() >= 0
        assert_allclose(tone_map(-LIGHT), tone_map(0 * LIGHT))


def test_reinhard_halves_white():
    assert_allclose(
        reinhard(np.array([[1, 3, 0], [0.25, 9, 1]])), [[0.5, 0.75, 0], [0.2, 0.9, 0.5]]
    )


def test_the_matrices_of_aces_are_those_of_the_transforms():
    """From AP1, the D60 of ACES, and the saturations 0.96 and 0.93 of the Academy's transforms."""
    bt709 = colour.RGB_COLOURSPACES["ITU-R BT.709"]
    ap1 = colour.RGB_COLOURSPACES["ACEScg"]
    weights = ap1.matrix_RGB_to_XYZ[1]

    def saturation(amount: float) -> np.ndarray:
        return amount * np.eye(3) + (1 - amount) * weights

    into = saturation(0.96) @ colour.matrix_RGB_to_RGB(bt709, ap1, "Bradford")
    back = colour.matrix_RGB_to_RGB(ap1, bt709, "Bradford") @ saturation(0.93)
    x = np.maximum(LIGHT @ into.T, 0)
    fit = (x * (x + 0.0245786) - 0.000090537) / (x * (0.983729 * x + 0.4329510) + 0.238081)
    assert_allclose(aces(LIGHT), (fit @ back.T).clip(0, 1), atol=2e-3)
    # The Academy's transforms show middle grey at 4.8 of 48 cd/m², and white at 100 times white.
    assert_allclose(aces(np.full(3, 0.18)), 0.1, atol=0.01)
    assert_allclose(aces(np.full(3, 100.0)), 1, atol=1e-9)


def sobotka(x: ArrayLike) -> np.ndarray:
    """The contrast of AgX: slope 2 at the pivot, powers 3 below and 3.25 above, ends 0 and 1."""
    pivot = 10 / 16.5
    x = np.asarray(x, float)
    power = np.where(x > pivot, 3.25, 3.0)
    room = np.where(x > pivot, 1 - pivot, pivot)
    limit = ((2 * room / 0.5) ** power - 1) / room**power
    return 0.5 + 2 * (x - pivot) / (1 + limit * np.abs(x - pivot) ** power) ** (1 / power)


def test_agx_is_sobotkas_up_to_the_error_of_its_polynomial():
    """His sigmoid of 16.5 stops around 0.18, between the matrices of Blender, in BT.2020."""
    bt709 = colour.RGB_COLOURSPACES["ITU-R BT.709"]
    bt2020 = colour.RGB_COLOURSPACES["ITU-R BT.2020"]
    wide = LIGHT @ colour.matrix_RGB_to_RGB(bt709, bt2020).T
    # By columns, as three.js writes them.
    # fmt: off
    inset = np.array([[0.856627153315983, 0.137318972929847, 0.11189821299995],
                      [0.0951212405381588, 0.761241990602591, 0.0767994186031903],
                      [0.0482516061458583, 0.101439036467562, 0.811302368396859]])
    outset = np.array([[1.1271005818144368, -0.1413297634984383, -0.14132976349843826],
                       [-0.11060664309660323, 1.157823702216272, -0.11060664309660294],
                       [-0.016493938717834573, -0.016493938717834257, 1.2519364065950405]])
    # fmt: on
    stops = np.log2(wide @ inset / 0.18)
    shown = np.maximum(sobotka(((stops + 10) / 16.5).clip(0, 1)) @ outset, 0) ** 2.2
    expected = (shown @ colour.matrix_RGB_to_RGB(bt2020, bt709).T).clip(0, 1)
    apart = np.abs(to_srgb(agx(LIGHT)) - to_srgb(expected))
    assert apart.mean() < 0.004
    assert np.percentile(apart, 99) < 0.02
    assert_allclose(agx(np.full(3, 0.18)), 0.5**2.2, rtol=0.02)
    assert_allclose(agx(np.full(3, 0.18 * 2**6.5)), 1, atol=0.005)


def test_neutral_is_that_of_khronos():
    """Pixel by pixel, as the specification has it; and what it says that its curve does."""
    for light in LIGHT:
        f90, k_s, k_d = 0.04, 0.8 - 0.04, 0.15
        x = min(light)
        c = light - (x - x * x / (4 * f90) if x <= 2 * f90 else f90)
        p = max(c)
        if p <= k_s:
            expected = c
        else:
            p_n = 1 - (1 - k_s) ** 2 / (p + 1 - 2 * k_s)
            g = 1 / (k_d * (p - p_n) + 1)
            expected = g * c * p_n / p + (1 - g) * p_n
        assert_allclose(neutral(light), expected, atol=1e-12)
    # A base colour up to 0.8, lit by white that adds 0.04, is shown as it is.
    base = np.array([[0.1, 0.5, 0.76], [0.3, 0.2, 0.6]])
    assert_allclose(neutral(base + 0.04), base)


# --- Noise ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TONE_MAPS)
def test_the_noise_is_that_of_means_shown_by_the_curve(rgb, name):
    """Of 300 runs, whose pictures have noise of their own, the spread is what each run says.

    The mean of a run is the curve of the mean, to the bit, whatever the number of passes.
    """
    rng = np.random.default_rng(1)
    truth = np.array([[[0.05, 0.1, 0.3], [0.6, 0.5, 0.4], [2.0, 1.0, 0.2]]]).repeat(2, axis=0)
    counted = np.ones(truth.shape[:2], bool)
    count = 16
    found: dict[str, list[np.ndarray]] = {}
    for _ in range(300):
        reference = MappedReference(counted, TONE_MAPS[name])
        difference = MappedDifference(counted, reference)
        # Of all channels alike in the first row, of each by itself in the second.
        paths = rng.gamma(4.0, 1 / 4.0, (count, *truth.shape))
        paths[:, 0] = paths[:, 0, :, :1]
        passes = truth * (0.7 + 0.3 * paths)
        shown = TONE_MAPS[name](truth) + 0.01 * rng.normal(size=passes.shape)
        for image, less in zip(shown, passes, strict=True):
            reference.add(less)
            difference.add(image, less)
        estimate = difference.estimate()
        assert_allclose(reference.mean(), TONE_MAPS[name](passes.mean(axis=0)), atol=1e-12)
        assert_allclose(estimate.mean, shown.mean(axis=0) - reference.mean(), atol=1e-12)
        grouped = estimate.grouped
        mean = np.average(grouped.means, axis=0, weights=grouped.sizes)
        assert_allclose(mean, estimate.mean.reshape(-1, 3)[grouped.places], atol=1e-12)
        assert_allclose(estimate.noise, difference.noise(), atol=1e-12)
        for key, value in (
            ("mean", estimate.mean), ("noise", estimate.noise), ("third", estimate.third),
            ("error", estimate.standard_error), ("shown", reference.mean()),
            ("shown_error", reference.standard_error()),
        ):  # fmt: skip
            found.setdefault(key, []).append(value)
    arrays = {key: np.array(values) for key, values in found.items()}
    spread = arrays["mean"].std(axis=0)
    assert_allclose(arrays["noise"].std(axis=0), spread, rtol=0.15)
    for key, expected in (("error", spread), ("shown_error", arrays["shown"].std(axis=0))):
        error = np.sqrt((arrays[key] ** 2).mean(axis=0))
        assert_allclose(error, expected, rtol=0.15)


# --- In pictures ---------------------------------------------------------------------------------


@cache
def rendered(name):
    """Return the light of a scene's reference, another run of it, and the pixels that count."""
    options = Options(resolution=(32, 32), spp=256)
    ready = prepare(open_case(name).source, options)
    sums = Accumulator()
    other = Accumulator()
    for seed in range(ready.passes):
        sums.add(ready.reference.render(seed))
        other.add(ready.reference.render(1000 + seed))
    light = Light(mean=sums.mean(), standard_error=sums.standard_error())
    return light, other.mean(), ready.counted


def said(picture, light, counted, tone_map=None):
    """Return what is said of an aligned picture."""
    reference = light.mean if tone_map is None else TONE_MAPS[tone_map](light.mean)
    place = alignment.Place(shift=(0.0, 0.0), correlation=1.0, gain=0.0)
    mistakes = picture_mistakes.find(
        NoisyImage(picture),
        NoisyImage(reference),
        counted,
        in_place=place,
        locate=lambda mend: place,
        is_encoded=True,
        names=Names(),
        light=light,
        tone_map=tone_map,
    )
    return " ".join(mistake.sentence for mistake in mistakes)


def saved(image):
    """Return an image as a PNG keeps it."""
    return from_srgb(np.round(255 * to_srgb(image.clip(0, 1))) / 255)


@pytest.mark.thorough
@pytest.mark.guarantee("runs", "The tone map of a picture is named, and none of a linear one.")
def test_the_curve_of_a_picture_is_named_at_any_exposure(rgb):
    """Unless light shown linearly is within a code value of it, or another curve within a tenth."""
    rng = np.random.default_rng(2)
    named = 0
    for scene in SCENES:
        light, other, counted = rendered(scene)
        for name, tone_map in TONE_MAPS.items():
            exposure = 2 ** rng.uniform(-3, 3)
            picture = saved(tone_map(exposure * other))
            words = said(picture, light, counted)
            fits = {key: tone_maps.Curves.of(picture, light, counted).fit(key)
                    for key in tone_maps.CURVES}  # fmt: skip
            best = min(fits.values(), key=lambda fit: fit.distance)
            is_linear = fits[None].distance < tone_maps.LEAST_CURVE
            is_another = fits[name].distance - best.distance < 0.1 * tone_maps.LEAST_CURVE
            assert f"tone_map={name}`" in words or is_linear or is_another
            named += f"tone_map={name}`" in words
            # Nothing is said where the right curve is given.
            assert said(saved(tone_map(other)), light, counted, tone_map=name) == ""
    assert named > 0.8 * len(SCENES) * len(TONE_MAPS)


@pytest.mark.thorough
def test_no_curve_is_named_for_right_pictures(rgb):
    rng = np.random.default_rng(3)
    for scene in SCENES:
        light, other, counted = rendered(scene)
        for exposure in (1, *2 ** rng.uniform(-3, 3, 4)):
            for picture in (exposure * other, saved(exposure * other)):
                assert "tone-mapped" not in said(picture, light, counted)


def test_another_curve_than_the_given_one_is_named(rgb):
    light, other, counted = rendered("cornell-box")
    for name, tone_map in TONE_MAPS.items():
        for given in TONE_MAPS.keys() - {name}:
            assert f"tone_map={name}`" in said(saved(tone_map(2 * other)), light, counted, given)
    for given in TONE_MAPS:
        assert "omit `tone_map`" in said(saved(other), light, counted, given)
    # With the right curve, the exposure is that of the light, not of what is shown.
    words = said(saved(agx(np.pi * other)), light, counted, "agx")
    assert re.search(r"3\.1\d times as bright as the reference: a missing division by pi", words)


@pytest.mark.thorough
def test_a_picture_is_compared_under_its_curve(run, tmp_path, monkeypatch):
    """A tone-mapped picture of another run is as far as a linear one is: only by noise."""
    monkeypatch.chdir(tmp_path)
    options = Options(resolution=(64, 48))
    ready = prepare(open_case("plastic-spheres").source, options)
    light = np.mean([ready.reference.render(seed) for seed in range(100, 116)], axis=0)
    files = {}
    for name, image in (("linear", light.clip(0)), ("agx", agx(light))):
        files[name] = write(tmp_path / f"{name}.exr", image)
    words = ("compare", "plastic-spheres", "--spp", 64, "--resolution", "64x48", "--no-why")
    records = {}
    for name, more in (("linear", ()), ("agx", ("--tone-map", "agx")), ("wrong", ())):
        file = files["agx" if name == "wrong" else name]
        code, text, _ = run(*words, "--image", file, *more, "-o", name)
        assert code == 0
        assert ("shown by the tone map agx" in text) == (name == "agx")
        path = tmp_path / name / "plastic-spheres/comparison.json"
        records[name] = json.loads(path.read_text())
    assert records["agx"]["picture"]["tone_map"] == "agx"
    assert "--tone-map agx" in records["agx"]["command"]
    assert any("give `tone_map=agx`" in words for words in records["wrong"]["warnings"])
    means = {name: found["metrics"]["dE2000"]["mean"] for name, found in records.items()}
    assert means["agx"] < 1.2 * means["linear"] < 0.3 * means["wrong"]
    assert records["agx"]["significant"]["fraction"] < 0.05
    assert "shown by the tone map agx" in (tmp_path / "agx/index.html").read_text()


def test_a_tone_map_needs_a_picture(rgb):
    case = open_case("fig-8-9", Options(tone_map="agx"))
    with pytest.raises(InputError, match=r"tone_map = agx and no image: .* Give an `image`"):
        prepare(case.source, case.options)
    with pytest.raises(InputError, match="tone_map 'filmic' is not known"):
        Options(image=("x.exr",), tone_map="filmic")
