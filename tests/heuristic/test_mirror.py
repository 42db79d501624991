"""The mirror of equation 8.7, ``n = inf``: kernel, plugin, pair and plan."""

import json
from itertools import product
from math import inf, pi

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from drjit.llvm.ad import Array3f, Float
from scipy import stats

from fotismos.comparisons.options import Options
from fotismos.comparisons.plain_scene import material_of
from fotismos.comparisons.prepared import prepare
from fotismos.heuristic import DirectionalLight, Material, PointLight, shade
from fotismos.reference import Convention, Source
from fotismos.reference.pairing import halves
from fotismos.reference.planning.effects import INTERREFLECTION, SPECULAR
from tests.shared.bsdfs import direction, interaction, spherical_grid
from tests.shared.misplanned import scene as described
from tests.shared.parts import camera, look_at, moved, rgb_of
from tests.shared.verification import verify

K_S = (0.8, 0.6, 0.3)
MIRROR = {"type": "phong", "k_s": rgb_of(*K_S), "n": inf}
VARIANTS = pytest.mark.parametrize(
    "variant", ["llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono"], indirect=True
)
BSDF = mi.ObjectType.BSDF


# --- The kernel ------------------------------------------------------------------------------


def test_the_kernel_shows_the_diffuse_part_of_a_mirror_alone():
    """Also exactly in the mirror direction of a light."""
    rng = np.random.default_rng(1)
    normal, other = rng.normal(size=(2, 3, 400)).astype(np.float32)
    up = normal / np.linalg.norm(normal, axis=0)
    toward = np.abs(other) * np.sign(up)
    view = 2 * (toward * up).sum(axis=0) * up - toward
    lights = [PointLight((0.0, 0.0, 9.0), 2.0), DirectionalLight((-1, -1, -1), 3.0)]
    for form, normalised in product(("phong", "blinn"), (False, True)):
        mirror = Material(k_d=0.5, k_s=0.9, n=inf, form=form, normalised=normalised)
        images = [
            np.array(shade(Array3f(0), Array3f(up), Array3f(view), material, lights))
            for material in (mirror, Material(k_d=0.5))
        ]
        np.testing.assert_array_equal(*images)
        assert images[0].max() > 0.5


def test_nothing_is_nan_however_sharp_the_lobe():
    """In the mirror direction and beside it, with gradients; ``n`` plain and at run time."""
    exponents = [(n, is_plain) for n in (1e5, 1e20, 1e30) for is_plain in (True, False)]
    for (n, is_plain), form, x in product(
        [*exponents, (inf, True)], ("phong", "blinn"), (0.0, 1e-20, 1e-4, 0.5)
    ):
        leaves = {"k_d": Float(0.5), "k_s": Float(0.4), "view": Array3f(x, 0, 1)}
        leaves |= {} if is_plain else {"n": Float(n)}
        dr.enable_grad(leaves)
        given = {"n": n} | {name: leaf for name, leaf in leaves.items() if name != "view"}
        light = PointLight((0.0, 0.0, 2.0), 1.0)
        for normalised in (False, True):
            material = Material(**given, form=form, normalised=normalised)
            value = shade(Array3f(0, 0, 0), Array3f(0, 0, 1), leaves["view"], material, [light])
            assert np.isfinite(np.array(value)).all(), (n, form, x)
            if normalised and n > 1e5:
                continue  # the lobe's own slope is beyond single precision
            dr.backward(value, flags=dr.ADFlag.Default | dr.ADFlag.AllowNoGrad)
            for name, leaf in leaves.items():
                assert np.isfinite(np.array(dr.grad(leaf))).all(), (name, n, form, x)


# --- The plugin ------------------------------------------------------------------------------


def reflected(bsdf, degrees, kinds=0x1FFF):
    """The mean weight of samples of these kinds, over channels."""
    u, context = np.random.default_rng(5).random((3, 20_000)), mi.BSDFContext()
    context.type_mask = kinds
    si = interaction(direction(degrees), 20_000)
    return float(np.mean(bsdf.sample(context, si, mi.Float(u[0]), mi.Point2f(u[1:]))[1]))


@VARIANTS
def test_samples_are_mirrored_by_k_s_and_otherwise_those_of_the_diffuse_part(variant):
    """Below a two-sided surface, too, and beside a null component."""
    count = 100_000
    u = np.random.default_rng(3).random((3, count))
    grid, solid_angle = spherical_grid(150)
    context = mi.BSDFContext()
    for k_d, twosided, clear, degrees in (
        (0.0, False, 0.0, 35), (0.3, False, 0.0, 80), (0.3, True, 0.0, 145), (0.2, True, 0.3, 35),
    ):  # fmt: skip
        values = {"k_d": k_d, "twosided": twosided, "transmittance": clear}
        bsdf = mi.load_dict({"type": "phong", "k_s": 0.6, "n": inf} | values)
        plain = mi.load_dict({"type": "phong"} | values)
        wi = np.array(direction(degrees, 30))
        si = interaction(wi, count)
        si.wavelengths = 550.0 if mi.is_spectral else si.wavelengths
        bs, weight = bsdf.sample(context, si, mi.Float(u[0]), mi.Point2f(u[1:]))
        weight, wo = np.array(weight), np.array(bs.wo, float)
        kinds = np.array(bs.sampled_type)
        mirrored = kinds == int(mi.BSDFFlags.DeltaReflection)
        np.testing.assert_allclose(wo[:, mirrored].T, np.broadcast_to(
            wi * [-1, -1, 1], (mirrored.sum(), 3)), atol=1e-6)  # fmt: skip
        share = 0.6 / (0.6 + k_d + clear)
        assert abs(mirrored.mean() - share) < 5 * np.sqrt(0.25 / count)
        np.testing.assert_allclose(np.array(bs.pdf)[mirrored], share, rtol=1e-5)
        np.testing.assert_allclose(weight[:, mirrored] * share, 0.6, rtol=1e-3)
        diffuse = kinds == int(mi.BSDFFlags.DiffuseReflection)
        assert abs(weight[:, diffuse].sum() / len(weight) / count - k_d) < 0.01
        if diffuse.any():
            assert stats.kstest(wo[2, diffuse] ** 2, "uniform").pvalue > 1e-3
            assert (np.sign(wo[2, diffuse]) == np.sign(wi[2])).all()
        # Neither values nor densities know of single directions.
        si = interaction(wi, dr.width(grid))
        si.wavelengths = 550.0 if mi.is_spectral else si.wavelengths
        value, density = bsdf.eval_pdf(context, si, grid)
        np.testing.assert_allclose(np.array(value), np.array(plain.eval(context, si, grid)))
        total = np.array(density, float).sum() * solid_angle
        assert total == pytest.approx(1 - share - clear / (0.6 + k_d + clear), abs=2e-3)


def test_a_mirror_is_one_sided_and_its_component_can_be_left_out(rgb):
    bsdf = mi.load_dict(MIRROR | {"k_d": 0.4})
    assert reflected(bsdf, 120) == 0
    for kind, expected in (("DeltaReflection", np.mean(K_S)), ("DiffuseReflection", 0.4)):
        assert reflected(bsdf, 40, +getattr(mi.BSDFFlags, kind)) == pytest.approx(
            expected, rel=0.03
        )


def test_a_lobe_edited_to_be_infinite_is_a_mirror_and_back(rgb):
    bsdf = mi.load_dict(MIRROR | {"n": 10.0})
    for n in (inf, 10.0):
        params = mi.traverse(bsdf)
        params["n"] = n
        params.update()
        is_mirror = mi.has_flag(bsdf.flags(), mi.BSDFFlags.DeltaReflection)
        assert is_mirror == (n == inf) == (not mi.has_flag(bsdf.flags(), mi.BSDFFlags.Glossy))


# --- What is seen in it ----------------------------------------------------------------------


def pool(bsdf, **parts):
    """A floor in the plane z = 0 of a material, seen from an angle."""
    return described(
        (0, -4, 3), (0, 0, 0), size=48, floor={"type": "rectangle", "to_world": moved((0, 0, 0), 9),
                                               "bsdf": bsdf},
        **parts,
    )  # fmt: skip


def rendered(description, spp=64, **integrator):
    made = mi.load_dict(description)
    return np.array(mi.render(made, integrator=mi.load_dict(integrator), spp=spp, seed=1))


@VARIANTS
def test_an_even_sky_is_seen_times_k_s_and_k_d(variant):
    """As is the sky in a narrow lobe: ``(n + 2) / (n + 1) k_s``."""
    sky = {"type": "constant", "radiance": 2.0}
    for values, expected in (
        ({"k_s": 0.7, "n": inf}, 1.4),
        ({"k_s": 0.4, "k_d": 0.3, "n": inf}, 1.4),
        ({"k_s": 0.7, "n": 1e6, "normalised": True}, 1.4),
    ):
        image = rendered(pool({"type": "phong"} | values, sky=sky), 256, type="path", max_depth=2)
        channels = image.mean(axis=(0, 1))
        # Spectral images of an even spectrum have the colour of the sky.
        blank = rendered(pool({"type": "null"}, sky=sky), 256, type="path")
        np.testing.assert_allclose(channels / blank.mean(axis=(0, 1)), expected / 2, rtol=2e-3)


# --- The pair --------------------------------------------------------------------------------


def pair_of(bsdf, convention=Convention.MATCHED, **more):
    shape = {"type": "sphere", "b": bsdf}
    description = {"type": "scene", "sensor": camera((-3, 0, 1), size=8), "shape": shape}
    return halves.pair(
        Source("a test", description), halves.PairOptions(convention=convention, **more)
    )


def partner(bsdf, *arguments):
    pair = pair_of(bsdf, *arguments)
    (record,) = pair.pairing.bsdfs
    nodes = [pair.physical.instantiate(index) for index in pair.physical.nodes(BSDF)]
    return pair, record, nodes[-1]


def albedos(bsdf):
    """The diffuse albedo of a BSDF at normal incidence by midpoints, and its mirror's."""
    angle = (np.arange(4000) + 0.5) * pi / 8000
    si = interaction([0, 0, 1], len(angle))
    wo = mi.Vector3f(mi.Float(np.sin(angle)), 0, mi.Float(np.cos(angle)))
    level = np.array(bsdf.eval(mi.BSDFContext(), si, wo) + dr.zeros(mi.Float, len(angle)), float)
    context = mi.BSDFContext()
    context.type_mask = +mi.BSDFFlags.DeltaReflection
    _, weight = bsdf.sample(context, interaction([0, 0, 1]), 0.5, mi.Point2f(0.5))
    return level @ np.sin(angle) * pi**2 / 4000, np.ravel(weight)


def test_a_mirror_is_paired_with_the_smooth_bsdf_of_the_same_albedos(rgb):
    """And its lost image is said."""
    for convention in Convention:
        pair, record, metal = partner(MIRROR, convention)
        assert record.derived == "conductor"
        np.testing.assert_allclose(albedos(metal)[1], K_S, rtol=1e-5)
        (lost,) = pair.unrepresentable
        assert (lost.plugin, lost.lost) == ("phong", "mirror image")
        assert "traces no rays" in lost.nearest
    for k_d, k_s in (([0.5, 0.3, 0.1], [0.05, 0.04, 0.01]), ([0.05] * 3, [0.3] * 3)):
        given = {"type": "phong", "k_d": rgb_of(*k_d), "k_s": rgb_of(*k_s), "n": inf}
        pair, record, plastic = partner(given)
        assert (record.derived, pair.pairing.misses) == ("plastic", ())
        diffuse, specular = albedos(plastic)
        np.testing.assert_allclose(diffuse, k_d, rtol=1e-3)
        np.testing.assert_allclose(specular, k_s, rtol=1e-3)
    _, record, _ = partner(given, Convention.LITERAL)
    assert (record.derived, record.parameters["int_ior"]) == ("plastic", 1.5)


def test_what_no_smooth_bsdf_reaches_is_missed(rgb):
    pair, _, metal = partner({"type": "phong", "k_s": rgb_of(1.5, 0.5, 1.5), "n": inf})
    assert [(miss.wanted, miss.reached) for miss in pair.pairing.misses] == [(1.5, 1.0)]
    np.testing.assert_allclose(albedos(metal)[1], [1, 0.5, 1], rtol=1e-5)
    pair, _, plastic = partner({"type": "phong", "k_d": 0.5, "k_s": 0.7, "n": inf})
    reached = albedos(plastic)
    for miss in pair.pairing.misses:
        part = reached[miss.what.startswith("specular")]
        assert part.max() == pytest.approx(miss.reached, rel=1e-2)
    assert pair.pairing.misses
    assert np.all(np.concatenate(reached) > 0)


def test_a_mirror_inside_other_bsdfs_stays_one_where_one_exponent_allows(rgb):
    lobe = {"type": "phong", "k_s": 0.4, "n": 9.0}
    diffuse = {"type": "diffuse", "reflectance": 0.4}
    for outer, expected in (
        ({"type": "mask", "opacity": 0.5, "b": MIRROR}, ([0.4, 0.3, 0.15], inf)),
        ({"type": "twosided", "a": MIRROR}, (K_S, inf)),
        ({"type": "blendbsdf", "weight": 0.5, "a": diffuse, "b": MIRROR}, ([0.4, 0.3, 0.15], inf)),
        ({"type": "blendbsdf", "weight": 0.25, "a": MIRROR, "b": lobe}, ([0.1] * 3, 9)),
    ):  # fmt: skip
        graph = pair_of(outer).heuristic
        ((_, index),) = graph.children(graph.nodes(mi.ObjectType.Shape)[0], BSDF)
        props = graph.props(index)
        np.testing.assert_allclose(np.broadcast_to(props["k_s"], 3), expected[0], rtol=1e-6)
        assert props["n"] == expected[1]
    checks = {"type": "checkerboard", "color0": 0.2, "color1": 0.4}
    brushed = {"type": "roughconductor", "alpha": checks}
    graph = pair_of({"type": "blendbsdf", "weight": 0.0, "a": MIRROR, "b": brushed}).heuristic
    ((_, index),) = graph.children(graph.nodes(mi.ObjectType.Shape)[0], BSDF)
    assert reflected(graph.instantiate(index), 20) == 0
    graph = pair_of({"type": "twosided", "a": MIRROR, "b": diffuse}).heuristic
    ((_, index),) = graph.children(graph.nodes(mi.ObjectType.Shape)[0], BSDF)
    bsdf = graph.instantiate(index)
    for degrees, expected in ((20, np.mean(K_S)), (160, 0.4)):
        assert reflected(bsdf, degrees) == pytest.approx(expected, rel=0.03)


# --- Plans, and whole comparisons ------------------------------------------------------------


def room(bsdf, **more):
    """A mirror that shows a coloured wall, which the camera does not see."""
    wall = look_at((0, 4, 2), (0, 0, 2)).scale(3)
    red = {"type": "diffuse", "reflectance": rgb_of(0.8, 0.2, 0.1)}
    lamp = {"type": "point", "position": [0, 1, 5], "intensity": 40.0}
    wall = {"type": "rectangle", "to_world": wall, "bsdf": red}
    floor = {"type": "rectangle", "to_world": moved((0, 0, 0), 3), "bsdf": bsdf}
    target = (0, 0, 0)
    lens = {"fov": 14.0}
    return described((0, -5, 2.5), target, lens=lens, size=24, floor=floor, wall=wall, lamp=lamp,
                     **more)  # fmt: skip


def test_what_a_mirror_shows_is_not_pruned(rgb):
    """The wall's colour, in proportion: red by ``K_S[0] 0.8``, blue by ``K_S[2] 0.1``."""
    source = Source("a room", room(MIRROR))
    ready = prepare(source, Options(spp=64))
    assert ready.plan.calls_for(INTERREFLECTION)
    assert not ready.plan.calls_for(SPECULAR)
    rule = next(decision.rule for decision in ready.plan.effects if decision.name == "specular")
    assert "traces no rays" in rule
    image = np.array(ready.reference.render(0)).mean(axis=(0, 1))
    np.testing.assert_allclose(image[2] / image[0], K_S[2] * 0.1 / (K_S[0] * 0.8), rtol=1e-3)
    assert not np.array(ready.heuristic.render(0)).any()
    assert verify(source, Options(spp=64)).significant == 0


def test_a_mirror_alone_under_a_sky_is_the_same_with_everything(rgb):
    ball = {"type": "sphere", "bsdf": MIRROR | {"k_d": 0.2}}
    source = Source("a ball", described(ball=ball, sky={"type": "constant", "radiance": 1.0}))
    assert prepare(source).plan.tabulated_environment
    assert verify(source, Options(spp=256)).significant == 0


SCENE = """<scene version="3.0.0">
  <integrator type="path"/>
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="0, -5, 2" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm">
      <integer name="width" value="24"/><integer name="height" value="16"/>
    </film>
  </sensor>
  <shape type="sphere">
    <bsdf type="phong" id="chrome">
      <rgb name="k_s" value="0.8, 0.6, 0.3"/><float name="n" value="inf"/>
    </bsdf>
  </shape>
  <shape type="rectangle">
    <transform name="to_world"><translate z="-1"/><scale x="5" y="5"/></transform>
    <bsdf type="phong"><float name="k_d" value="0.5"/></bsdf>
  </shape>
  <emitter type="point">
    <point name="position" x="2" y="-3" z="4"/><rgb name="intensity" value="60"/>
  </emitter>
</scene>
"""


def test_a_file_with_a_mirror_is_compared(run, written, tmp_path):
    words = ("--spp", 4, "-o", tmp_path / "out")
    code, _, messages = run("compare", written(SCENE, "mirror.xml"), *words)
    assert code in (0, 1), messages
    (record,) = (tmp_path / "out").rglob("comparison.json")
    (lost,) = json.loads(record.read_text())["unrepresentable"]
    assert (lost["name"], lost["lost"]) == ("chrome", "mirror image")
    page = "".join(path.read_text() for path in (tmp_path / "out").rglob("*.html"))
    assert "the kernel traces no rays" in page


def test_a_mirror_is_exported_without_k_s_and_not_fitted(run, rgb, written, tmp_path):
    made = mi.load_dict({"type": "scene", "s": {"type": "sphere", "bsdf": MIRROR}})
    material = material_of(made.shapes()[0].bsdf(), 0, made)
    assert not any(material["k_s"])
    assert np.isfinite(material["n"])
    code, _, messages = run("fit", written(SCENE, "mirror.xml"), "--spp", 16, "-o", tmp_path)
    assert code == 2
    assert "chrome: n is infinite" in messages
