"""Albedos of plastics by their formulas, against quadratures of Mitsuba's plugins."""

from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest

from reference import Convention, Source
from reference.pairing import albedo, bsdfs, coat, factors
from reference.pairing.albedo import RoughPlastic
from reference.pairing.factors import Phong

GREY = (0.6,) * 3


def drawn(seed, number):
    """Draw plastics: common ones, smooth and rough ones, faint and strong ones, and bubbles."""
    rng = np.random.default_rng(seed)
    for _ in range(number):
        alpha, ratio = [
            (10 ** rng.uniform(-2, 0.2), rng.uniform(1.02, 3)),
            (10 ** rng.uniform(-3, 2), rng.uniform(1.02, 3)),
            (10 ** rng.uniform(-2, 0.2), 1 + 10 ** rng.uniform(-4, -1)),
            (10 ** rng.uniform(-2, 0.2), rng.uniform(3, 20)),
            (10 ** rng.uniform(-2, 0.2), rng.uniform(0.71, 0.98)),
        ][rng.integers(5)]
        ext_ior = rng.uniform(1, 1.5)
        yield RoughPlastic(
            (float(rng.uniform(0, 1)),) * 3,
            float(alpha),
            float(ratio * ext_ior),
            float(ext_ior),
            tuple(map(float, rng.uniform(0, 1, 3))),
            str(rng.choice(["beckmann", "ggx"])),
            bool(rng.integers(2)),
        )


def assert_as_by_plugin(plastic):
    found, expected = albedo.of_roughplastic(plastic), albedo.by_plugin(plastic)
    np.testing.assert_allclose(found.diffuse, expected.diffuse, rtol=0, atol=1e-5)
    np.testing.assert_allclose(found.specular, expected.specular, rtol=2e-6, atol=2e-7)


@pytest.mark.parametrize(
    ("variant", "number"),
    [("llvm_ad_rgb", 24), ("llvm_ad_spectral", 4), ("llvm_ad_mono", 4)],
    indirect=["variant"],
)
def test_the_albedos_of_a_roughplastic_are_what_its_plugin_reflects(variant, number):
    """The plugin's own sums, in single precision, are off by up to 1e-5."""
    for plastic in drawn(number, number):
        assert_as_by_plugin(plastic)


@pytest.mark.parametrize("distribution", ["beckmann", "ggx"])
@pytest.mark.parametrize("alpha", [1e-3, 1.0, 100.0])
@pytest.mark.parametrize("ratio", [1.0001, 20.0, 0.71])
def test_the_edges_of_what_is_computed_are_the_plugins_too(rgb, distribution, alpha, ratio):
    assert_as_by_plugin(RoughPlastic(GREY, alpha, ratio, distribution=distribution))


@pytest.mark.parametrize(
    "beyond", [{"alpha": 5e-4}, {"alpha": 300.0}, {"int_ior": 25.0}, {"int_ior": 0.7}]
)
def test_beyond_them_the_plugin_itself_is_asked(rgb, beyond):
    plastic = replace(RoughPlastic(GREY, 0.1, 1.5), **beyond)
    found, expected = albedo.of_roughplastic(plastic), albedo.by_plugin(plastic)
    np.testing.assert_array_equal(found.diffuse, expected.diffuse)
    np.testing.assert_allclose(albedo.specular_of(plastic), expected.specular, rtol=2e-6)


@pytest.mark.parametrize(
    "wrong", [{"distribution": "gaussian"}, {"int_ior": 1.0}, {"int_ior": -1.0}]
)
def test_what_mitsuba_refuses_is_refused(rgb, wrong):
    with pytest.raises(RuntimeError):
        albedo.of_roughplastic(replace(RoughPlastic(GREY, 0.1, 1.5), **wrong))


@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("ratio", [0.4, 1.01, 1.5, 2.5, 6.0])
def test_the_albedos_of_a_smooth_plastic_are_what_its_plugin_reflects(rgb, nonlinear, ratio):
    bsdf = mi.load_dict(
        {"type": "plastic", "diffuse_reflectance": 0.6, "int_ior": 1.2 * ratio, "ext_ior": 1.2}
        | {"nonlinear": nonlinear}
    )
    theta, weight = albedo.nodes(1.0)
    si, wo = albedo._head_on(theta)
    expected = weight @ np.array(bsdf.eval(mi.BSDFContext(), si, wo)[0], float)
    diffuse, mirror = albedo.of_smooth_plastic(0.6, 1.2 * ratio, 1.2, nonlinear)
    assert diffuse == pytest.approx(max(expected, 0), abs=1e-5)
    assert mirror == pytest.approx(((ratio - 1) / (ratio + 1)) ** 2)


# --- Many at once ----------------------------------------------------------------------------


@pytest.fixture
def asked(monkeypatch):
    """What is asked of Mitsuba: kernels launched, and plugins made."""
    monkeypatch.setattr(coat, "_found", {})
    monkeypatch.setattr(factors, "_whites", {})
    bsdfs._roughplastic_of.cache_clear()
    counts = {"kernels": 0, "plugins": 0}

    def counting(name, function):
        def counted(*arguments, **keywords):
            counts[name] += 1
            return function(*arguments, **keywords)

        return counted

    monkeypatch.setattr(coat, "_sums", counting("kernels", coat._sums))
    monkeypatch.setattr(albedo, "by_plugin", counting("plugins", albedo.by_plugin))
    return counts


def graph_of(materials):
    shapes = {f"s{k}": {"type": "sphere", "bsdf": bsdf} for k, bsdf in enumerate(materials)}
    return Source("a test", {"type": "scene"} | shapes).parse()


def test_a_hundred_rough_plastics_take_a_few_kernels(rgb, asked):
    materials = [
        {"type": "roughplastic", "alpha": 0.05 + 0.004 * k, "int_ior": 1.3 + 0.005 * k}
        for k in range(100)
    ]
    bsdfs.to_heuristic(graph_of(materials * 2), Convention.MATCHED)
    assert asked == {"kernels": 4, "plugins": 0}  # two chunks, into the surface and out of it


def test_a_hundred_phongs_take_a_few_kernels(rgb, asked):
    materials = [{"type": "phong", "k_d": 0.1, "k_s": 0.4, "n": 9.0 + k} for k in range(100)]
    bsdfs.to_physical(graph_of(materials), Convention.MATCHED)
    assert asked == {"kernels": 4, "plugins": 0}


def test_searches_for_the_nearest_index_share_their_kernels(rgb, asked):
    phongs = [Phong((0.5 + 0.01 * k,) * 3, (0.7,) * 3, 3.0) for k in range(16)]
    alone = [factors.to_roughplastic(phong, Convention.MATCHED) for phong in phongs[:2]]
    one_by_one, asked["kernels"] = asked["kernels"] / 2, 0
    factors._whites.clear()
    coat._found.clear()
    factors.prepare(phongs, Convention.MATCHED)
    assert asked["kernels"] < 2 * one_by_one
    assert [factors.to_roughplastic(one, Convention.MATCHED) for one in phongs[:2]] == alone


def test_a_surface_has_the_same_sums_alone_and_among_others(rgb, monkeypatch):
    monkeypatch.setattr(coat, "_found", {})
    surfaces = [
        coat.Interface(alpha, eta, distribution)
        for distribution in ("beckmann", "ggx")
        for alpha, eta in [(0.02, 1.4), (0.3, 1.8), (0.9, 0.7)]
    ]
    alone = [coat.of(one) for one in surfaces]
    coat._found.clear()
    coat.prepare(surfaces)
    for one, expected in zip(surfaces, alone, strict=True):
        assert coat.of(one).returned == expected.returned
        np.testing.assert_array_equal(coat.of(one).transmittance, expected.transmittance)


def test_only_so_many_results_are_kept(monkeypatch):
    monkeypatch.setattr(coat, "KEPT", 3)
    found = {1: "a", 2: "b"}
    coat.keep(found, {3: "c", 4: "d"})
    assert list(found) == [2, 3, 4]
    coat.keep(found, {key: "e" for key in range(5, 10)})
    assert list(found) == [5, 6, 7, 8, 9]
