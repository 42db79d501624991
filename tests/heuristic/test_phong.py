"""The BSDF plugin ``phong``: values, sampling, parameters."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

import fotismos
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.heuristic.errors import InputError
from tests.shared import checks
from tests.shared.bsdfs import chi2, direction, interaction, phong, spherical_grid
from tests.shared.parts import rgb_of

MATERIALS = {
    "diffuse": {"k_d": 0.7},
    "specular n=100": {"k_s": 0.9, "n": 100},
    "mixed n=9": {"k_d": 0.5, "k_s": 0.7, "n": 9},
    "even lobe": {"k_d": 0.2, "k_s": 0.7, "n": 0},
    "blinn n=9": {"k_d": 0.5, "k_s": 0.7, "n": 9, "form": "blinn"},
    "normalised n=9": {"k_d": 0.5, "k_s": 0.3, "n": 9, "normalised": True},
}
ANGLES = [0, 35, 80]


def test_samples_follow_the_density(rgb):
    """Also on a two-sided surface seen from below, and of one component alone."""
    cases = [(values, degrees, None) for values in MATERIALS.values() for degrees in ANGLES]
    mixed = MATERIALS["mixed n=9"]
    cases += [({**mixed, "twosided": True}, degrees, None) for degrees in (150, 100)]
    for component in ("GlossyReflection", "DiffuseReflection"):
        context = mi.BSDFContext()
        context.type_mask = +getattr(mi.BSDFFlags, component)
        cases.append((mixed, 35, context))
    for values, degrees, context in cases:
        test = chi2(values, direction(degrees, 30), context)
        assert test.run(significance_level=0.01, test_count=len(cases)), test.messages


def test_weight_is_value_over_density_which_integrates_to_the_share_of_samples(rgb):
    """At most 1; what is missing is the part of the lobe that is cut off by the surface."""
    rng, count = mi.PCG32(40_000), 40_000
    wo, solid_angle = spherical_grid(200)
    context = mi.BSDFContext()
    for values in MATERIALS.values():
        bsdf = mi.load_dict(phong(**values, twosided=True))
        for degrees in (0, 80, 89, 120):
            si = interaction(direction(degrees), count)
            sample2 = mi.Point2f(rng.next_float32(), rng.next_float32())
            bs, weight = bsdf.sample(context, si, rng.next_float32(), sample2)
            value, density = bsdf.eval(context, si, bs.wo), bsdf.pdf(context, si, bs.wo)
            drawn = np.array(bs.pdf) > 0
            assert drawn.mean() > 0.3
            np.testing.assert_allclose(np.array(bs.pdf), np.array(density), rtol=1e-5)
            expected = np.array(value)[:, drawn] / np.array(density)[drawn]
            np.testing.assert_allclose(np.array(weight)[:, drawn], expected, rtol=1e-5)
            assert not np.array(weight)[:, ~drawn].any()
            grid = interaction(direction(degrees), dr.width(wo))
            total = np.array(bsdf.pdf(context, grid, wo), float).sum() * solid_angle
            assert total < 1 + 2e-3
            assert abs(drawn.mean() - total) < 5 * np.sqrt(0.25 / count) + 2e-3


DRAWN = 40_000
CASES = [
    (form, n, degrees)
    for form in ("phong", "blinn")
    for n in (0, 1e-3, 0.5, 1e3, 1e5)
    for degrees in (0, 60, 85, 89.5)
]


def lobe_samples(form, n, degrees):
    """Return places of samples in the lobe, ``wi.H``, the samples' densities and weights.

    The places (2, DRAWN) are even in [0, 1] for right samples: the share of the lobe within the
    angle to its axis, and the azimuth about that. The axis is the mirror image of ``wi``, and for
    ``blinn`` the normal, about which the half vector lies.
    """
    wi = np.float32(direction(degrees, 30)).astype(float)
    u = np.random.default_rng(5).random((3, DRAWN))
    bsdf, si = mi.load_dict(phong(k_s=0.9, n=n, form=form)), interaction(wi, DRAWN)
    bs, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(u[0]), mi.Point2f(u[1:]))
    wi /= np.linalg.norm(wi)
    vector, axis = np.array(bs.wo, float), wi * [-1, -1, 1]
    vector /= np.linalg.norm(vector, axis=0)
    both = np.linalg.norm(vector + wi[:, None], axis=0)
    if form == "blinn":
        vector, axis = (vector + wi[:, None]) / both, np.array([0.0, 0.0, 1.0])
        vector *= np.sign(vector[2])
    side = np.cross(axis, [0.3, 0.5, -0.8])
    side /= np.linalg.norm(side)
    logarithm = (n + 1) * np.log1p(-np.sum((vector - axis[:, None]) ** 2, axis=0) / 2)
    azimuth = np.arctan2(np.cross(axis, side) @ vector, side @ vector) / (2 * np.pi) % 1
    return (
        np.array([-np.expm1(logarithm), azimuth]),
        both / 2,
        np.array(bs.pdf),
        np.array(weight)[0],
    )


def evenness(places):
    """Return the chance of less even places, by Kolmogorov's and Smirnov's test."""
    return min(stats.kstest(place, "uniform").pvalue for place in places)


def test_samples_of_any_exponent_follow_the_density(rgb):
    """The density is ``(n + 1) / (2 pi) c^n``, for ``blinn`` over ``4 (wi.H)``, above the horizon.

    The weight is ``2 k_s / (n + 1)``, for ``blinn`` times ``4 (wi.H)``; and nothing is NaN.
    """
    for form, n, degrees in CASES:
        places, wi_h, density, weight = lobe_samples(form, n, degrees)
        assert evenness(places) > 1 - 0.99 ** (1 / (2 * len(CASES))), (form, n, degrees)
        drawn = density > 0
        assert drawn.mean() > 0.2
        spread = 4 * wi_h if form == "blinn" else np.ones(DRAWN)
        expected = (n + 1) / (2 * np.pi) * (1 - places[0]) ** (n / (n + 1)) / spread
        np.testing.assert_allclose(density[drawn], expected[drawn], rtol=1e-3)
        expected = np.where(drawn, 2 * 0.9 / (n + 1) * spread, 0)
        np.testing.assert_allclose(weight, expected, rtol=2e-5)


def test_the_lobes_albedo_under_light_from_the_normal(rgb):
    """``2 k_s / (n + 2)``, or ``k_s`` if normalised: light from the normal, summed as it leaves.

    Phong's lobe is not reciprocal, so that the sum over the light's directions is another number.
    """
    viewers, solid_angle = spherical_grid()
    si = interaction([0, 0, 1], dr.width(viewers))
    si.wi = viewers
    cases = [({"k_s": 0.7, "n": n}, 2 * 0.7 / (n + 2)) for n in (0, 1, 3, 9, 30)]
    for form in ("phong", "blinn"):
        for n in (0, 3, 9, 30):
            cases.append(({"k_s": 0.3, "n": n, "form": form, "normalised": True}, 0.3))
    for values, expected in cases:
        bsdf = mi.load_dict(phong(**values))
        radiance = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1)), float)[0]
        leaving = np.sum(radiance * np.maximum(np.array(viewers.z, float), 0)) * solid_angle
        assert leaving == pytest.approx(expected, rel=1e-3), values


EDITS = {
    "material": ({}, {"k_d.value": 0.25, "n": 30.0}),
    "point": ({"position": (-4, 0, 0), "k2": 0.1},
              {"position": (-3.0, 1.0, 0.0), "k2": 0.2, "intensity.value": 0.5, "scale": 2.0}),
    "spot": ({"position": (-4, 0, 0), "direction": (1, 0, 0), "k2": 0.1},
             {"direction": (1.0, 0.1, 0.0), "cutoff": 10.0, "exponent": 3.0, "k0": 2.0}),
    "directional": ({"direction": (1, 0, 0)},
                    {"direction": (1.0, 0.5, 0.0), "intensity.value": 0.5}),
}  # fmt: skip


@pytest.mark.parametrize("kind", EDITS)
def test_what_is_edited_is_as_if_made_so(rgb, kernel_history, kind):
    """And the kernel stays the same, so that fits and sweeps do not compile at each step."""
    given, edits = EDITS[kind]

    def scene(**more):
        figure = SCENES["fig-8-9"].make()
        if kind == "material":
            figure["sphere"]["bsdf"] |= more
        else:
            figure["light 1"] = {"type": f"heuristic_{kind}"} | given | more
        return checks.with_film(figure, 32, 4)

    edited = mi.load_dict(scene())
    params = mi.traverse(edited)
    own = "k_d.value" if kind == "material" else "intensity.value"
    (prefix,) = (key.removesuffix(own) for key, _ in params if key.endswith(own))

    def picture():
        return np.array(mi.render(edited, spp=4, seed=0))

    before = picture()
    kernels = kernel_history(picture)
    for name, value in edits.items():
        params[prefix + name] = value
    params.update()
    after = picture()
    again = kernel_history(picture)
    assert [kernel["hash"] for kernel in again] == [kernel["hash"] for kernel in kernels]
    made = {name.removesuffix(".value"): value for name, value in edits.items()}
    np.testing.assert_allclose(after, checks.render(scene(**made), 4, 0), atol=1e-6)
    assert np.abs(after - before).max() > 0.05


def test_values_that_mean_nothing_are_refused(rgb):
    wrong = [{"n": n} for n in (-1.0, float("nan"), -float("inf"))]
    for name in ("k_i", "k_a", "k_d", "k_s"):
        colour = rgb_of(0.5, -1.0, 0.5)
        wrong += [{name: value} for value in (-0.1, float("nan"), colour)]
    for values in wrong:
        with pytest.raises(RuntimeError, match=rf"phong: {next(iter(values))} = .*0 or more"):
            mi.load_dict(phong(**values))
    with pytest.raises(RuntimeError, match=r"form = 'cook' is not known: .*phong, blinn"):
        mi.load_dict(phong(k_s=0.5, form="cook"))
    with pytest.raises(RuntimeError, match="shininess"):
        mi.load_dict(phong(k_d=0.5, shininess=9))


@pytest.mark.guarantee("kernel", "A coefficient or exponent edited below 0 is refused.")
def test_a_value_edited_below_zero_is_refused(rgb):
    rgb_value = rgb_of(0.5, 0.4, 0.3)
    for name, value in {"k_d.value": mi.Color3f(0.5, -0.3, 0.2), "n": -2.0}.items():
        bsdf = mi.load_dict(phong(k_d=rgb_value, k_s=0.2, n=10))
        params = mi.traverse(bsdf)
        params[name] = value
        with pytest.raises(InputError, match=rf"phong: {name[:3].rstrip('.')} = .* not allowed"):
            params.update()


def test_an_exponent_beyond_single_precision_is_refused_not_a_mirror(rgb):
    for n in (3.5e38, 1e39, 1e300):
        with pytest.raises(RuntimeError, match=r"phong: n = .* .*at most 3\.4e\+38; inf"):
            mi.load_dict(phong(k_s=0.2, n=n))
    for n in (3.4e38, float("inf")):
        flags = mi.load_dict(phong(k_s=0.2, n=n)).flags()
        assert mi.has_flag(flags, mi.BSDFFlags.DeltaReflection) == (n == float("inf"))


def test_scalar_variants_are_refused(rgb):
    with mi.scoped_set_variant("scalar_rgb"), pytest.raises(InputError, match="they trace arrays"):
        fotismos.register()
