"""The comparisons of the kernel with the oracle and with Mitsuba's ``direct``.

Each raises AssertionError where the two differ. They stand apart from the tests because the tests
of wrong kernels (`test_mutations`) run the very same ones.
"""

from dataclasses import dataclass, replace

import drjit as dr
import drjit.llvm
import drjit.llvm.ad
import drjit.scalar
import mitsuba as mi
import numpy as np

import fotismos
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.heuristic import kernel
from tests.shared import oracle
from tests.shared.parts import rgb_of

POINTS = 20_000

OWN = ("diffuse_intensity", "specular_intensity")

LIGHTS = (
    oracle.Light("point", 0.6, position=(2.0, -1.5, 4.0)),
    oracle.Light("point", 3.0, (-3.0, 2.0, 2.5), attenuation=(0.25, 0.5, 0.125),
                 diffuse_intensity=2.0),
    oracle.Light("point", 0.5, (-2.5, -2.5, -3.0), attenuation=(0.25, 0.0, 0.0625), clamped=True),
    oracle.Light("directional", 0.4, direction=(1.0, 2.0, -2.0), specular_intensity=0.9),
    oracle.Light("spot", 0.5, (4.0, 0.0, 3.0), (-1.0, 0.25, -0.75), cutoff=20.0),
    oracle.Light("spot", 9.0, (0.0, 4.0, 0.0), (0.0, -1.0, 0.0), 75.0, 2.5, (0, 0, 1),
                 diffuse_intensity=6.0, specular_intensity=12.0),
)  # fmt: skip
COEFFICIENTS = {
    "one": dict(k_i=0.05, k_a=0.3, k_d=0.5, k_s=0.7),
    "rgb": dict(k_i=(0.0, 0.1, 0.0), k_a=(0.3, 0.2, 0.1), k_d=(0.5, 0.4, 0.1), k_s=0.7),
    "five": dict(
        k_i=0.05, k_a=(0.1, 0.2, 0.3, 0.2, 0.1), k_d=(0.5, 0.4, 0.3, 0.2, 0.1), k_s=(0.7,) * 5
    ),
}
TINTS = {"one": 1.0, "rgb": (1.0, 0.5, 0.25), "five": (1.0, 0.5, 0.25, 0.5, 1.0)}


@dataclass(frozen=True)
class Points:
    """Points with normals and views, exact in single precision, that look every way."""

    position: np.ndarray
    normal: np.ndarray
    view: np.ndarray


def random_points(count=POINTS, seed=7):
    """Draw points from a cube about the origin; normals and views of any direction and length."""
    rng = np.random.default_rng(seed)
    position = rng.uniform(-1, 1, (count, 3))
    normal, view = rng.normal(size=(2, count, 3))
    return Points(*(array.astype(np.float32) for array in (position, normal, view)))


def tinted(lights, tint):
    """Give lights a colour, each another where it has components."""

    def colours(light, place):
        for turn, name in enumerate(("intensity", *OWN), place):
            value = getattr(light, name)
            if value is not None:
                yield name, _times(value, np.roll(tint, turn))

    return [replace(light, **dict(colours(light, place))) for place, light in enumerate(lights)]


def _times(intensity, tint):
    product = intensity * np.asarray(tint)
    return tuple(map(float, product)) if product.ndim and product.size > 1 else float(product.sum())


def kernel_light(light):
    """Turn an oracle's light into the kernel's."""
    own = {name: getattr(light, name) for name in OWN}
    if light.kind == "directional":
        return fotismos.DirectionalLight(light.direction, light.intensity, **own)
    own |= {"attenuation": light.attenuation, "clamped": light.clamped}
    if light.kind == "point":
        return fotismos.PointLight(light.position, light.intensity, **own)
    return fotismos.SpotLight(
        light.position,
        light.direction,
        light.intensity,
        light.cutoff,
        light.exponent,
        **own,
    )


def check_kernel(vector_type, tolerance, coefficients="rgb"):
    """Compare `fotismos.shade` with the oracle over random points, under every kind of light.

    Points of scalar types are shaded one by one, so there are few of them.
    """
    is_scalar = not dr.is_dynamic_v(vector_type)
    points = random_points(50 if is_scalar else POINTS)
    lights = tinted(LIGHTS, TINTS[coefficients])
    values = COEFFICIENTS[coefficients] | {"n": 9}
    ambient = 0.5
    material, lamps = fotismos.Material(**values), [kernel_light(light) for light in lights]
    arrays = points.position, points.normal, points.view
    if is_scalar:
        rows = (map(vector_type, row) for row in zip(*arrays, strict=True))
        found = [np.atleast_1d(kernel.shade(*row, material, lamps, ambient)) for row in rows]
    else:
        given = (vector_type(vectors.T) for vectors in arrays)
        found = as_rows(kernel.shade(*given, material, lamps, ambient))
    expected = oracle.shade(*arrays, oracle.Material(**values), lights, ambient)
    edges = oracle.near_an_edge(points.position, points.normal, lights, 1e-5)
    assert edges.sum() <= 1 + 1e-3 * len(edges), "too many points are left out to mean much"
    oracle.require_close(found, expected, absolute=tolerance, where=~edges)


def as_rows(value):
    """Return a Dr.Jit float or colour as an array (N, C)."""
    array = np.array(value, float)
    return array[:, None] if array.ndim == 1 else array.T


def with_film(scene, resolution, spp):
    """Give a scene dictionary a square film and a stratified sampler."""
    sensor = dict(scene["sensor"])
    sensor["film"] = {**sensor["film"], "width": resolution, "height": resolution}
    sensor["sampler"] = {"type": "multijitter", "sample_count": spp}
    return {**scene, "sensor": sensor}


def render(scene, spp, seed, integrator=None):
    """Render a scene dictionary to an array of double precision."""
    made = mi.load_dict(scene, optimize=False)
    integrator = mi.load_dict(integrator) if integrator else None
    return np.array(mi.render(made, integrator=integrator, spp=spp, seed=seed), float)


def check_figure(scene, resolution=96, seed=5, tolerance=1e-5):
    """Compare the integrator ``heuristic`` with the oracle at the positions that it shaded.

    One sample a pixel and a box filter, so that a pixel is one evaluation of 8.10.
    """
    scene = with_film(scene, resolution, 1)
    aovs = {"type": "aov", "aovs": "P:position,N:sh_normal", "image": scene["integrator"]}
    channels = render(scene, 1, seed, aovs)
    colour, position, normal = np.split(channels.reshape(-1, 9), 3, axis=1)
    hit = np.any(normal != 0, axis=1)
    assert 0.2 < hit.mean() < 1, "the picture should hold both surface and background"
    assert not colour[~hit].any(), "the background should be black"
    material, lights, ambient, viewer = described(scene)
    expected = oracle.shade(
        position[hit], normal[hit], viewer - position[hit], material, lights, ambient
    )
    # Positions in single precision cannot tell the side of a horizon that they lie on.
    edges = oracle.near_an_edge(position[hit], normal[hit], lights, 2e-6)
    assert edges.mean() < 1e-3, "too many pixels were left out for the comparison to mean much"
    expected = np.broadcast_to(expected, colour[hit].shape)
    oracle.require_close(colour[hit], expected, absolute=tolerance, where=~edges)


def described(scene):
    """Read material, lights, ambient light and viewer out of a scene dictionary of one sphere."""
    bsdf = scene["sphere"]["bsdf"]
    material = oracle.Material(
        **{name: _plain(bsdf.get(name, 0.0)) for name in ("k_i", "k_a", "k_d", "k_s")},
        n=bsdf.get("n", 1.0),
    )
    lights = [
        oracle.Light(
            kind=value["type"].removeprefix("heuristic_"),
            intensity=_plain(value.get("intensity", 1.0)),
            position=value.get("position", (0, 0, 0)),
            direction=value.get("direction", (0, 0, 1)),
            cutoff=value.get("cutoff", 30.0),
            exponent=value.get("exponent", 0.0),
            attenuation=tuple(value.get(k, d) for k, d in (("k0", 1), ("k1", 0), ("k2", 0))),
            clamped=value.get("clamped", False),
            **{name: _plain(value[name]) for name in OWN if name in value},
        )
        for value in scene.values()
        if isinstance(value, dict) and value.get("type", "").startswith("heuristic_")
    ]
    ambient = _plain(scene["integrator"].get("ambient", 0.0))
    viewer = np.array(scene["sensor"]["to_world"].matrix)[:3, 3]
    return material, lights, ambient, viewer


def check_against_direct(scene, resolution=96, spp=16, seed=3):
    """Compare the integrator ``heuristic`` with the ``phong`` plugin under Mitsuba's ``direct``.

    ``direct`` draws one emitter for each sample, so every light is rendered alone, and the sum
    taken; a light of two intensities twice, each time with one of the terms. Emission and ambient
    light join one of these renderings as a ``heuristic_glow``.
    """
    scene = with_film(scene, resolution, spp)
    kernel = render(scene, spp, seed)
    integrator = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0, "hide_emitters": False}
    names = [name for name in scene if name.startswith("light")]
    dark = {name: value for name, value in scene.items() if name not in (*names, "integrator")}
    bsdf = scene["sphere"]["bsdf"]
    glow = {"type": "heuristic_glow", "ambient": scene["integrator"].get("ambient", 0.0)}
    glow |= {name: bsdf[name] for name in ("k_i", "k_a") if name in bsdf}
    if names:
        glow["sampling_weight"] = 0.0
    total = 0.0
    passes = [(name, *each) for name in names for each in _passes(scene[name])]
    for number, (name, light, without) in enumerate(passes or [(None, None, {})]):
        lit = dict(dark) if name is None else {**dark, name: light}
        lit["sphere"] = {**dark["sphere"], "bsdf": bsdf | without}
        if number == 0:
            lit["sphere"]["glow"] = glow
        total = total + render(lit, spp, seed, integrator)
    assert kernel.max() > 0.1, "the picture should not be black"
    oracle.require_close(kernel, total, relative=1e-5, absolute=2.0**-23)


def _passes(light):
    """Return a light as each of its renderings has it, with the coefficients that are 0 there.

    A sample of Mitsuba's has one colour, which is ``L_d``.
    """
    if not light.keys() & set(OWN):
        return [(light, {})]
    specular = light.get("specular_intensity", light.get("intensity", 1.0))
    return [(light, {"k_s": 0.0}), (light | {"diffuse_intensity": specular}, {"k_d": 0.0})]


def _plain(value):
    return value["value"] if isinstance(value, dict) else value


def everything():
    """What the figures lack: spots, parallel light, attenuation, colours, emission, back light.

    Two of the lights have an intensity of their own for a term.
    """
    scene = SCENES["fig-8-11-n9"].make()
    scene["sphere"]["bsdf"] |= {
        "k_i": rgb_of(0.02, 0.0, 0.05),
        "k_d": rgb_of(0.5, 0.25, 0.75),
        "k_s": rgb_of(0.7, 0.6, 0.5),
        "n": 5.5,
    }
    scene["light 2"] |= {"k0": 0.2, "k1": 0.1, "k2": 0.05}
    scene["light 3"] |= {"k0": 0.1, "k1": 0.0, "k2": 0.05, "clamped": True}
    scene["light 4"] = {
        "type": "heuristic_spot",
        "position": (-3, 2, 2),
        "direction": (3, -2.2, -2),
        "cutoff": 12.0,
        "exponent": 20.0,
        "intensity": rgb_of(0.9, 0.9, 0.4),
        "specular_intensity": rgb_of(0.3, 0.6, 0.9),
    }
    scene["light 5"] = {
        "type": "heuristic_directional",
        "direction": (-1, 0.5, -0.5),  # from behind: a highlight at the rim, cut by the horizon
        "intensity": rgb_of(0.2, 0.4, 0.8),
        "diffuse_intensity": rgb_of(0.5, 0.1, 0.2),
    }
    return scene


def rows(vectors):
    return np.atleast_2d(np.array(vectors, float).T)
