"""Settings of another renderer: how they are written, their errors, and their front."""

import json
import re
import shlex
from dataclasses import replace
from decimal import Decimal

import jsonschema
import msgspec
import numpy as np
import pytest

import fotismos
from fotismos.comparisons import turns
from fotismos.comparisons.case import open_case
from fotismos.comparisons.ladder import engine
from fotismos.comparisons.ladder.climb import REFERENCE_PASSES, Effort, climbed, converge
from fotismos.comparisons.ladder.cost import compared, require_other_names
from fotismos.comparisons.ladder.front import fronted
from fotismos.comparisons.ladder.timed_pictures import EngineTimes, TimedPicture, seconds_of
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.cost import Cost
from fotismos.heuristic.errors import InputError
from fotismos.reference.rendering.sums import Accumulator
from fotismos.reference.scene.graph import set_variant
from tests.shared.schemas import schema

SIDE = 32
SINGLE = "The picture is one file, so its noise is unknown"


@pytest.fixture(autouse=True, scope="module")
def short():
    """Times of these scenes need not repeat."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(turns, "MOST_SAMPLES", 0)
        yield


# -- Words -----------------------------------------------------------------------------------------

LETTERS = "abc XYZ 019 @@@ === ,.:;'\"`$\\|&<>[]*?()% äßñ 中文 µπ ✓ 🙂 \u00a0"
POWERS = {"s": 0, "ms": -3, "us": -6, "µs": -6, "μs": -6}


def text_of(rng, most):
    return "".join(rng.choice(list(LETTERS), rng.integers(1, most)))


def test_random_settings_are_read_and_come_back_from_the_command_of_a_record():
    """Names of any characters, but for an at sign that an equals sign follows."""
    rng, count = np.random.default_rng(1), 0
    for _ in range(300):
        name, pattern = text_of(rng, 20).strip(), f"{text_of(rng, 15)}.exr"
        if not name or re.search("@.*=", name):
            continue
        number = f"{rng.integers(1, 10_000)}{rng.choice(['', '.', '.5', '.07', 'e-2', 'E1'])}"
        unit = rng.choice(list(POWERS))
        blank, other = rng.choice(["", " ", "  "], 2)
        word = f"{name}{blank}@{other}{number}{blank}{unit}{other}={pattern}"
        found = TimedPicture.of(word)
        assert (found.name, found.patterns, found.word) == (name, (pattern,), word)
        exact = Decimal(number.rstrip(".")) * Decimal(10) ** POWERS[unit]
        assert found.seconds == pytest.approx(float(exact), rel=1e-12)
        machine = text_of(rng, 9)
        given = EngineTimes.of([word], machine, "2.1 ms")
        typed = shlex.split(Options().command("cost", "hall.xml", **given.as_options()))
        options = dict(zip(typed[3::2], typed[4::2], strict=True))
        words = [options["--picture"]]
        assert EngineTimes.of(words, options["--machine"], options["--kernel-time"]) == given
        count += 1
    assert count > 200


def test_a_name_ends_at_the_first_time():
    found = TimedPicture.of("a=b @ c = d @ 2ms=dir@3ms=x/*.exr")
    assert (found.name, found.seconds) == ("a=b @ c = d", 2e-3)
    assert found.patterns == ("dir@3ms=x/*.exr",)
    assert seconds_of(" .5 s ") == 0.5


@pytest.mark.parametrize(
    ("word", "reason"),
    [
        ("PCSS=low_*.exr", "has no time"),
        ("PCSS low", "has no time"),
        ("", "has no time"),
        ("@ 3ms=low.exr", "has no name"),
        ("PCSS @ 3ms=", "has no picture"),
        *(
            (f"k=3 @ {time}=low.exr", f"'{time.strip()}' is not a time")
            for time in ("", "6", "ms", "6,3ms", "-1ms", "0ms", "nanms", "infs", "1e9s", "1e-9ms")
        ),
        *((f"PCSS @ {time}=x.exr", "is not a time") for time in ("6 parsec", "1_0ms", "٣ms")),
    ],
)
def test_a_setting_without_a_part_is_refused_with_an_example(word, reason):
    with pytest.raises(InputError, match=re.escape(reason)) as refused:
        TimedPicture.of(word)
    assert "such as 'PCSS low @ 6.3ms=low_*.exr'" in str(refused.value)
    if "not a time" in reason:
        assert "a number with s, ms or us, from 1e-9s to 1e6s, such as 6.3ms" in str(refused.value)


def test_names_that_are_taken_and_times_of_nothing_are_refused(rgb):
    with pytest.raises(InputError, match="2 pictures are called 'a'"):
        EngineTimes.of(["a @ 1ms=x.exr", " a @ 2ms=y.exr"], None, None)
    for machine, kernel in (("RTX 3060", None), (None, "2ms")):
        with pytest.raises(InputError, match="Give a picture"):
            EngineTimes.of([], machine, kernel)
    with pytest.raises(InputError, match="'2' is not a time"):
        EngineTimes.of(["a @ 1ms=x.exr"], None, "2")
    with pytest.raises(InputError, match="UTF-8"):
        TimedPicture.of("a\udcff @ 1ms=x.exr")
    assert EngineTimes.of([], None, None) is None
    for name in ("full plan", "Phong kernel"):
        times_of = EngineTimes.of([f"{name} @ 1ms=x.exr"], None, None)
        with pytest.raises(InputError, match="is a method of the study"):
            require_other_names(times_of)


# -- Errors ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found():
    """The measured methods of a scene whose reference has some noise."""
    set_variant("llvm_ad_rgb")
    case = open_case("plastic-spheres", Options(resolution=(SIDE, SIDE)))
    effort = Effort(rounds=2, largest=4, goes_on=False)
    return climbed(case.source, case.options, effort, lambda *_: None)


def judged(found, folder, repeats, seconds=None, kernel_time=None):
    """The settings of pictures, ``{name: [repeats]}``, by their names."""
    words = []
    for number, (name, images) in enumerate(repeats.items()):
        for place, image in enumerate(images):
            np.save(folder / f"{number}_{place}.npy", image)
        time = (seconds or {}).get(name, 0.001)
        words.append(f"{name} @ {time}s={folder / str(number)}_*.npy")
    times_of = EngineTimes.of(words, "its own", kernel_time)
    read = engine.read(times_of, found.ready.options)
    made = engine.engine(compared(read, times_of, found.ready), times_of)
    return {setting.method: setting for setting in made.settings}


def changed(image, counted, share, by=0.3):
    """An image of which a share of the counted pixels is brighter."""
    places = np.argwhere(counted)
    chosen = np.random.default_rng(3).permutation(len(places))[: round(share * len(places))]
    other = np.array(image)
    other[tuple(places[chosen].T)] += by
    return other


def test_the_right_picture_passes_at_the_smallest_threshold_and_a_changed_one_does_not(
    found, tmp_path
):
    """The right one is rendered with other seeds, and its own little noise counts."""
    total = Accumulator()
    options = found.ready.options.changed(seed=91)
    converge(replace(found.ready, options=options), total, REFERENCE_PASSES)
    right = total.mean()
    tenth = changed(right, found.ready.counted, 0.1)
    settings = judged(found, tmp_path, {"right": [right], "tenth": [tenth]})
    assert settings["right"].passes_at <= 1.5
    error = settings["right"].error
    assert 0 <= error.low < error.value < error.high < 4 * found.converged().noise_floor
    changes = settings["tenth"]
    assert changes.passes_at is None
    assert changes.p95 > 10
    for share in changes.visible:
        assert share.low <= 0.11
        assert share.high >= 0.1 or share.threshold > 4
        assert share.high > 0.05
    added = changes.error.value - error.value
    assert added == pytest.approx(changes.p95 / 10, rel=0.5)
    # In between, noise decides: what may be above 5 % does not pass.
    few = judged(found, tmp_path, {"few": [changed(right, found.ready.counted, 0.04, by=0.02)]})
    sure = [share.threshold for share in few["few"].visible if share.high <= 0.05]
    assert few["few"].passes_at == sure[0]
    assert few["few"].visible[0].value < 0.05 < few["few"].visible[0].high
    for setting in settings.values():
        assert setting.picture.repeats == 1
        assert any(odd.startswith(SINGLE) for odd in setting.agreement.odd)


def test_a_mistake_in_a_picture_is_named(found, tmp_path):
    right = found.reference.mean
    settings = judged(found, tmp_path, {"mirrored": [right[:, ::-1]], "right": [right]})
    assert any("mirrored left to right" in one for one in settings["mirrored"].agreement.mistakes)
    assert settings["right"].agreement.mistakes == ()


# -- The front -------------------------------------------------------------------------------------


def test_given_times_make_a_front_of_their_own_and_no_ratio(found, tmp_path):
    """Whatever is given, what is measured stays."""
    right = found.reference.mean
    images = {
        name: [changed(right, found.ready.counted, share)]
        for name, share in (("fast", 0.3), ("slow", 0.1), ("beaten", 0.2))
    }
    seconds = {"fast": 1e-9, "slow": 100.0, "beaten": 1000.0}
    settings = judged(found, tmp_path, images, seconds)
    assert [settings[name].front for name in images] == [True, True, False]
    measured = {point.method for point in fronted(found.points())}
    for setting in settings.values():
        assert setting.ratio is None
        assert setting.seconds.low == setting.seconds.high
        assert not set(setting.ties) & measured
    related = judged(found, tmp_path, {"a": [right]}, {"a": 0.0063}, "2.1ms")
    assert related["a"].ratio == pytest.approx(3.0)


# -- The command -----------------------------------------------------------------------------------


def test_the_command_puts_pictures_on_a_front_at_their_size(rgb, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(8)
    for name, size in (("low", 20), ("high", 20), ("small", 16)):
        for repeat in range(2):
            image = rng.uniform(0, 1 if name == "low" else 0.5, (size, size, 3))
            np.save(f"{name}_{repeat}.npy", image.astype(np.float32))
    low, high = "PCSS = low @ 6.3ms=low_*.npy", "high @ 9.1 ms=high_*.npy"
    words = ("cost", "lambert-sphere", "--spp", 4, "--rounds", 2, "--picture", low)
    code, said, _ = run(*words, "--picture", high, "--machine", "RTX 3060", "--kernel-time", "2ms")
    assert code == 0
    text = (tmp_path / "out/cost/lambert-sphere/cost.json").read_text()
    jsonschema.Draft202012Validator(schema("cost")).validate(json.loads(text))
    record = msgspec.json.decode(text, type=Cost)
    assert record.resolution == (20, 20)
    assert record.engine.machine == "RTX 3060"
    assert [round(one.ratio, 3) for one in record.engine.settings] == [3.15, 4.55]
    assert record.engine.settings[0].picture.files == ("low_0.npy", "low_1.npy")
    typed = shlex.split(record.command)
    assert [typed[n + 1] for n, word in enumerate(typed) if word == "--picture"] == [low, high]
    assert "Given pictures: times as given, on RTX 3060; the front is their own" in said
    assert (tmp_path / "out/cost/lambert-sphere/cost-picture-2.png").exists()
    for more, reason in (
        (
            ("--picture", "small @ 1ms=small_*.npy"),
            "pictures of 16x16 (small_0.npy), 20x20 (low_0.npy): the last is 1.25 times as",
        ),
        (("--resolution", "24x24"), "it has 20x20 pixels, and --resolution 24x24 is requested"),
        (("--picture", "none @ 1ms=none_*.npy"), "none_*.npy: no file matches"),
    ):
        code, _, error = run(*words, *more)
        assert code == 2
        assert reason in error
    code, _, error = run("cost", "lambert-sphere", "--over", "black")
    assert (code, "--over: it says how pictures are read" in error) == (2, True)


def test_python_puts_arrays_on_a_front_beside_a_scene():
    """A reference, which the scene has, is refused."""
    grey = np.full((8, 8, 3), 0.5)
    pictures = {"low @ 6.3ms": [0.9 * grey, grey], "high @ 9ms": 1.1 * grey}
    record = fotismos.cost("lambert-sphere", spp=4, pictures=pictures, kernel_time="2.1ms")
    assert record.resolution == (8, 8)
    low, high = record.engine.settings
    assert (low.method, low.picture.repeats, low.ratio) == ("low", 2, pytest.approx(3.0))
    assert high.picture.files == ("picture 2 1.npy",)
    with pytest.raises(InputError, match="`reference` is for pictures without a scene"):
        fotismos.cost("lambert-sphere", pictures=pictures, reference=grey)


def test_repeats_of_one_seed_are_refused_and_equal_ones_have_no_noise(found, tmp_path):
    image = found.reference.mean
    with pytest.raises(InputError, match="3 repeats, of which only 2 differ"):
        judged(found, tmp_path, {"a": [image, image, image + 0.1]})
    both = judged(found, tmp_path, {"a": [image + 0.1] * 3, "b": [image + 0.1]})
    assert both["a"].error.value == pytest.approx(both["b"].error.value, rel=0.02)
