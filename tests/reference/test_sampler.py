"""The sampler: stratified as it says, and right in the mean however long paths are."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.records import SAMPLER
from fotismos.reference.rendering.sampler import cells, permuted, register
from tests.shared.parts import camera

COUNTS = (1, 2, 3, 4, 7, 16, 48, 64)


def sphere(reflectance, width):
    """A bright sphere of radius 1, seen from inside, off its centre, where the light is."""
    return {
        "type": "scene",
        "integrator": {"type": "path"},
        "sphere": {"type": "sphere", "flip_normals": True,
                   "bsdf": {"type": "diffuse", "reflectance": reflectance}},
        "light": {"type": "point", "position": (0, 0, 0), "intensity": 1.0},
        "sensor": camera((0.3, 0.1, 0.2), (1, 0.2, 0), (0, 1, 0), width, 60.0),
    }  # fmt: skip


@pytest.fixture
def make(rgb):
    """Return a function that makes a sampler, seeded for a number of pixels."""
    register()

    def seeded(count, pixels, seed=1):
        sampler = mi.load_dict({"type": SAMPLER, "sample_count": count})
        sampler.seed(seed, pixels * count)
        return sampler

    return seeded


@pytest.mark.parametrize("count", COUNTS)
def test_each_pixel_has_one_sample_in_each_stratum_and_cell(make, count):
    sampler, pixels = make(count, 50), 50
    line = np.array(sampler.next_1d()).reshape(pixels, count)
    x, y = np.array(sampler.next_2d()).reshape(2, pixels, count)
    for numbers in (line, x, y):
        assert ((numbers >= 0) & (numbers < 1)).all()
        # A number beside a border may be rounded over it.
        strata = np.floor(np.sort(numbers) * count - np.arange(count))
        assert np.mean(strata == 0) > 0.99
    columns, rows = cells(count)
    cell = np.floor(x * columns) + columns * np.floor(y * rows)
    assert all(len(set(each)) == count for each in cell)


@pytest.mark.guarantee("reference", "Estimates are unbiased at any number of samples per pass.")
@pytest.mark.parametrize("count", [3, 16])
def test_one_sample_is_uniform_in_all_dimensions_together(make, count):
    """χ² of the joint strata of the first sample in two dimensions and in a pair, over pixels."""
    pixels = 20_000 * count
    sampler = make(count, pixels, seed=5)
    first = slice(0, None, count)
    numbers = [np.array(sampler.next_1d())[first] for _ in range(2)]
    numbers += list(np.array(sampler.next_2d())[:, first])
    bins = 4
    joint = np.zeros(pixels, int)
    for each in numbers:
        joint = joint * bins + np.minimum((each * bins).astype(int), bins - 1)
    counts = np.bincount(joint, minlength=bins ** len(numbers))
    assert stats.chisquare(counts).pvalue > 1e-4


def test_seeds_and_pixels_do_not_share_numbers(make):
    one, other = (np.array(make(16, 500, seed).next_1d()) for seed in (1, 2))
    assert len(np.unique(np.concatenate([one, other]))) > 0.99 * 16_000
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.05


@pytest.mark.guarantee(
    "reference", "Inside a bright sphere the reference is within 0.3 % of the closed form."
)
@pytest.mark.parametrize(
    ("reflectance", "spp"),
    [
        pytest.param(reflectance, spp, marks=() if reflectance == 0.8 else pytest.mark.thorough)
        for reflectance, spp in ((0.8, None), (0.95, None), (0.9, 64))
    ],
)
def test_the_reference_is_right_inside_a_bright_sphere(rgb, reflectance, spp):
    """L = ρ I / (π (1 − ρ)), by the plan and the samples that ``compare`` uses.

    A bias of 0.3 % fails: it is three standard errors where the samples are fewest.
    """
    width = 48 if spp is None else 96
    case = open_case(sphere(reflectance, width), Options(spp=spp), name="sphere")
    images = compare(case.source, case.options).images
    mean, error = images.reference.mean(), images.reference_stderr
    exact = reflectance / (np.pi * (1 - reflectance))
    error = np.sqrt((error**2).sum()) / error.size * np.sqrt(3)  # channels are one number
    assert abs(mean / exact - 1) < 0.003
    assert abs(mean - exact) < 4 * error


@pytest.mark.parametrize("count", [1, 2, 8, 64, 1024])
def test_powers_of_two_are_permuted_as_mitsuba_does(rgb, count):
    rng = np.random.default_rng(3)
    index = mi.UInt32(rng.integers(0, count, 20_000).astype(np.uint32))
    seed = mi.UInt32(rng.integers(0, 2**32, 20_000).astype(np.uint32))
    found = permuted(index, dr.opaque(mi.UInt32, count - 1), seed)
    assert dr.all(found == mi.permute_kensler(index, count, seed))


def test_powers_of_two_of_samples_share_a_kernel_and_other_numbers_do_not(rgb):
    ready = prepare(open_case(sphere(0.5, 16), Options(), name="sphere").source)
    kernels = {}
    for spp in (4, 16, 64, 6):
        half = ready.reference.sampled(spp)
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            dr.eval(half.integrator.render(half.scene, seed=dr.opaque(mi.UInt32, 1), spp=spp))
            history = dr.kernel_history([dr.KernelType.JIT])
        kernels[spp] = {str(entry["hash"]) for entry in history if entry["size"] == 256 * spp}
    assert len(kernels[4]) == 1
    assert kernels[4] == kernels[16] == kernels[64] != kernels[6]
