"""Stopping at a noise target, and going on after an interruption."""

import signal

import numpy as np
import pytest

from comparisons.compare import compare, prepare
from comparisons.departure.metrics import METRICS
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options
from comparisons.render import LIMIT_SPP, WAVEFRONT, is_checked, schedule
from heuristic.errors import InputError
from reference.planning.plan import PASSES
from reports.run.kept import KeptPasses, key_of
from tests.programs import python

SMALL = (24, 24)

INTERRUPTED = """
import heuristic
import os, signal, sys
from comparisons.compare import compare
from comparisons.options import Options
from comparisons.gallery.builtin import SCENES
from reference.scene.graph import set_variant
from reports.run.kept import KeptPasses

set_variant("llvm_ad_rgb")

def progress(stage, done, total):
    if done == 5:
        os.kill(os.getpid(), signal.SIGKILL)

kept = KeptPasses(sys.argv[1], "key", interval=0)
options = Options(resolution=(24, 24), spp=64)
compare(SCENES["cornell-box"].source(), options, progress, kept=kept)
"""


def arrays(result):
    images = result.images
    halves = [images.heuristic, images.reference, images.reference_stderr]
    return [*halves, images.significant, *images.maps.values()]


@pytest.mark.guarantee("runs", "A killed run resumes to the same image, bit for bit.")
def test_a_killed_run_goes_on_to_the_same_image_bit_for_bit(rgb, tmp_path):
    file = tmp_path / "passes.npz"
    assert python("-c", INTERRUPTED, file).returncode == -signal.SIGKILL
    kept = KeptPasses(file, "key", interval=0)
    done = int(kept.load()["sum0_count"])
    assert 1 <= done <= 5
    source, options = SCENES["cornell-box"].source(), Options(resolution=SMALL, spp=64)
    seen = []
    resumed = compare(source, options, lambda stage, done, total: seen.append(done), kept=kept)
    assert min(seen) == done
    whole = compare(source, options)
    assert all(map(np.array_equal, arrays(resumed), arrays(whole)))
    assert resumed.record.metrics == whole.record.metrics
    assert resumed.record.time.reference.passes == PASSES


def test_kept_passes_of_something_else_are_not_used(tmp_path):
    file = tmp_path / "passes.npz"
    KeptPasses(file, "one", interval=0).offer(1, lambda: {"a": np.zeros(2)})
    assert KeptPasses(file, "one").load()["a"].shape == (2,)
    assert KeptPasses(file, "other").load() is None
    file.write_bytes(file.read_bytes()[:100])
    assert KeptPasses(file, "one").load() is None


def test_removing_leaves_nothing(tmp_path):
    kept = KeptPasses(tmp_path / "passes.npz", "key", interval=0)
    kept.offer(1, lambda: {"a": np.zeros(2)})
    kept.remove()
    assert not list(tmp_path.iterdir())


def test_short_runs_write_nothing(tmp_path):
    KeptPasses(tmp_path / "passes.npz", "key").offer(1, dict)
    assert not list(tmp_path.iterdir())


def test_the_key_tells_scene_options_and_versions_apart(rgb):
    source, options = SCENES["fig-8-9"].source(), Options()
    keys = [
        key_of(source, options, "llvm_ad_rgb", {"mitsuba": "1"}),
        key_of(SCENES["fig-8-8c"].source(), options, "llvm_ad_rgb", {"mitsuba": "1"}),
        key_of(source, Options(seed=1), "llvm_ad_rgb", {"mitsuba": "1"}),
        key_of(source, options, "llvm_ad_rgb", {"mitsuba": "2"}),
        key_of(source, Options(noise=1.0), "llvm_ad_rgb", {"mitsuba": "1"}),
    ]
    assert len(set(keys)) == len(keys)
    assert key_of(source, Options(), "llvm_ad_rgb", {"mitsuba": "1"}) == keys[0]
    lower = key_of(source, Options(noise=0.5), "llvm_ad_rgb", {"mitsuba": "1"})
    assert lower == keys[4], "a lower target goes on with the same passes"


def test_the_run_ends_once_the_noise_is_under_the_target(rgb):
    options = Options(resolution=SMALL, noise=6.0)
    result = compare(SCENES["cornell-box"].source(), options)
    stop, plan = result.record.noise_target, result.record.plan
    assert stop.stopped_by == "target"
    assert 0 < stop.reached <= 6.0
    assert stop.limit_spp == LIMIT_SPP
    assert plan.spp < LIMIT_SPP
    # The noise that was predicted is that between this run and one of other seeds, by √2.
    other = compare(SCENES["cornell-box"].source(), Options(resolution=SMALL, noise=6.0, seed=900))
    assert other.record.plan.spp == plan.spp
    between = METRICS["dE2000"](result.images.reference, other.images.reference)
    measured = np.percentile(between[result.images.counted], 95) / np.sqrt(2)
    assert stop.reached == pytest.approx(measured, rel=0.25)


def test_a_limit_on_samples_stops_first_and_says_so(rgb):
    result = compare(SCENES["cornell-box"].source(), Options(resolution=SMALL, noise=0.01, spp=40))
    stop, plan = result.record.noise_target, result.record.plan
    assert stop.stopped_by == "samples"
    assert stop.reached > 0.01
    assert plan.spp <= 40
    assert plan.spp == stop.limit_spp


@pytest.mark.parametrize("noise", [0.0, -1.0, float("nan")])
def test_a_target_that_cannot_be_met_is_refused(noise):
    with pytest.raises(InputError, match="noise"):
        Options(noise=noise)


def test_the_noise_is_looked_at_in_steps_of_a_half_at_most():
    looked = [done for done in range(2, 1000, 2) if is_checked(done, 10_000)]
    assert looked[:8] == [4, 6, 8, 12, 16, 24, 32, 48]
    assert not any(is_checked(done, 10_000) for done in range(3, 1000, 2))
    assert is_checked(10_000, 10_000)


def test_a_pass_holds_no_more_samples_than_the_wavefront(rgb):
    plan = prepare(SCENES["fig-8-9"].source(), Options(resolution=SMALL)).plan
    for side in (64, 512, 2048, 4096):
        for spp in (None, 2, 8, 100, 1024):
            found = schedule(plan, side * side, spp)
            wanted = spp or plan.spp
            assert found.passes % 2 == 0
            assert found.passes >= 2
            assert found.spp == 1 or found.spp * side * side <= WAVEFRONT
            assert found.spp * found.passes >= wanted - found.passes
    assert schedule(plan, 24 * 24, 64).spp * schedule(plan, 24 * 24, 64).passes == 64
