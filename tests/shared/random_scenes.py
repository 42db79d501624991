"""Random small scenes, and plans of them against stock Mitsuba's own integrator.

A scene follows from its seed alone. A scene is rendered by the plan's reference and by the
integrator that the scene asks for, with Mitsuba's independent sampler. Where both are the same
integrator, to the same depth, there is nothing to compare. A plan is wrong if a mean of
the image is off by more than a percent and by more than four standard errors, with 16 times the
samples if a first look finds 2.5 of them.

    python -m tests.shared.random_scenes FIRST COUNT [VARIANT]

examines the seeds from FIRST on, a line each, in processes of :data:`BATCH` scenes.
"""

import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import mitsuba as mi
import numpy as np

from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.heuristic.errors import FotismosError
from fotismos.reference.rendering.passes import pass_seed
from fotismos.reference.scene.source import Source
from tests.shared.misplanned import octahedron

SIZE, PASSES, SPP = 16, 8, 64
TOLERANCE, ERRORS, MORE = 0.01, 4.0, 16
DOUBT = 2.5
"""Standard errors from which on a scene is rendered again with more samples."""

BOTH = 4
"""Of so many scenes the heuristic half is rendered too: it has to be finite and not negative."""

BATCH = 40
"""Scenes to a process: Mitsuba keeps some megabytes of each."""


class Draw:
    """Random choices of one seed."""

    def __init__(self, seed, folder):
        self.rng, self.folder = np.random.default_rng(seed), Path(folder)

    def chance(self, share):
        return self.rng.random() < share

    def uniform(self, low, high, size=None):
        found = self.rng.uniform(low, high, size)
        return float(found) if size is None else [float(x) for x in found]

    def one(self, **weights):
        shares = np.array(list(weights.values()), float)
        return str(self.rng.choice(list(weights), p=shares / shares.sum()))

    def colour(self, low=0.1, high=0.9):
        return {"type": "rgb", "value": self.uniform(low, high, 3)}

    def toward(self):
        vector = self.rng.normal(size=3)
        return vector / np.linalg.norm(vector)


def random_scene(seed, folder):
    """Return the scene of a seed, as ``mitsuba.load_dict`` takes it; its files go to a folder."""
    draw = Draw(seed, folder)
    found = {"type": "scene", "integrator": _integrator(draw)}
    count = int(draw.one(**{"1": 5, "2": 3, "3": 1.5, "4": 0.5}))
    shapes = {f"shape{i}": _shape(draw, alone=count == 1) for i in range(count)}
    found |= shapes | _lights(draw, shapes)
    found["sensor"] = _camera(draw, shapes)
    if found["integrator"]["hide_emitters"] and draw.chance(0.4):
        found["screen"] = _screen(draw, found["sensor"])
    return found


def _integrator(draw):
    plugin = draw.one(path=5, direct=3, volpath=1)
    found = {"type": plugin, "hide_emitters": draw.chance(0.25)}
    if plugin != "direct":
        found["max_depth"] = int(draw.one(**{"-1": 4, "2": 3, "3": 1, "5": 1, "1": 0.3}))
        if draw.chance(0.2):
            found["rr_depth"] = int(draw.rng.integers(2, 9))
    elif draw.chance(0.3):
        found |= {name: int(draw.rng.integers(3)) for name in WAYS}
        if not any(found[name] for name in WAYS):  # which Mitsuba refuses
            found["bsdf_samples"] = 1
    return found


WAYS = ("emitter_samples", "bsdf_samples")


def _shape(draw, alone):
    plugin = draw.one(sphere=4, rectangle=3, disk=1, cube=1.5, cylinder=0.5, ply=1)
    place = draw.uniform(-0.3, 0.3, 3) if alone else draw.uniform(-1.6, 1.6, 3)
    to_world = mi.ScalarTransform4f().translate(place)
    to_world = to_world.rotate(draw.toward(), draw.uniform(0, 360) if draw.chance(0.7) else 0.0)
    to_world = to_world.scale(draw.uniform(0.4, 1.3))
    if draw.chance(0.12):
        to_world = to_world.scale((-1, 1, 1))
    found = {"type": plugin, "to_world": to_world, "flip_normals": draw.chance(0.25)}
    if plugin in ("cube", "ply"):
        found["face_normals"] = draw.chance(0.6)
    if plugin == "ply":
        found["filename"] = str(_hull(draw))
    found["bsdf"] = _bsdf(draw)
    return found


def _hull(draw):
    """Write an octahedron, whole or with faces missing, and with or without a dent."""
    height = -0.5 if draw.chance(0.2) else 1.0
    faces = int(draw.one(**{"8": 3, "7": 1, "4": 1, "1": 1}))
    return octahedron(draw.folder / f"hull-{draw.rng.integers(2**31)}.ply", faces, height)


CLEAR = ("dielectric", "mask", "null", "clear principled")


def _bsdf(draw):
    plugin = draw.one(
        diffuse=6, roughplastic=2, roughconductor=2, anisotropic=1.5, conductor=0.7, plastic=0.7,
        textured=1.2, blendbsdf=0.5, bumpmap=0.4, principled=0.4, black=0.5, mask=0.6,
        dielectric=0.4, null=0.1, **{"clear principled": 0.1},
    )  # fmt: skip
    if plugin in CLEAR or not draw.chance(0.5):
        return _plain(draw, plugin)
    found = {"type": "twosided", "front": _plain(draw, plugin)}
    if draw.chance(0.15):
        found["back"] = _plain(draw, draw.one(diffuse=2, black=1, roughplastic=1))
    return found


def _plain(draw, plugin):
    alpha = draw.uniform(0.08, 0.6)
    if plugin == "diffuse":
        return {"type": plugin, "reflectance": draw.colour()}
    if plugin == "black":
        return {"type": "diffuse", "reflectance": 0.0}
    if plugin == "roughplastic":
        return {"type": plugin, "diffuse_reflectance": draw.colour(), "alpha": alpha}
    if plugin == "roughconductor":
        return {"type": plugin, "material": "Au", "alpha": alpha}
    if plugin == "anisotropic":
        return {"type": "roughconductor", "alpha_u": alpha, "alpha_v": draw.uniform(0.08, 0.6)}
    if plugin == "textured":
        checks = {"type": "checkerboard", "color0": draw.colour(), "color1": draw.colour()}
        checks["to_uv"] = mi.ScalarTransform3f().scale((4, 4))
        return {"type": "diffuse", "reflectance": checks}
    if plugin == "blendbsdf":
        inner = {"one": _plain(draw, "diffuse"), "two": _plain(draw, "roughconductor")}
        return {"type": plugin, "weight": draw.uniform(0, 1), **inner}
    if plugin == "bumpmap":
        waves = {"type": "bitmap", "filename": str(_picture(draw)), "raw": True}
        return {"type": plugin, "arbitrary": waves, "scale": 0.1, "bsdf": _plain(draw, "diffuse")}
    if plugin in ("principled", "clear principled"):
        found = {"type": "principled", "base_color": draw.colour(), "roughness": alpha}
        names = ("metallic", "specular", "clearcoat", "sheen", "spec_tint", "anisotropic")
        found |= {name: draw.uniform(0, 1) for name in names if draw.chance(0.3)}
        clear = 0.4 if plugin.startswith("clear") else 0.0
        return found | ({"spec_trans": clear} if clear or draw.chance(0.2) else {})
    if plugin == "mask":
        return {"type": plugin, "opacity": draw.uniform(0, 1), "bsdf": _plain(draw, "diffuse")}
    return {"type": plugin}


def _picture(draw):
    path = draw.folder / f"picture-{draw.rng.integers(2**31)}.exr"
    mi.Bitmap(draw.rng.random((4, 8, 3)).astype(np.float32)).write(str(path))
    return path


def _lights(draw, shapes):
    found, count = {}, int(draw.one(**{"1": 6, "2": 3, "3": 1}))
    around = False
    for number in range(count):
        plugin = draw.one(point=4, constant=3, area=2, directional=1.5, spot=1, envmap=1)
        if plugin in ("constant", "envmap"):
            if around:
                continue
            around = True
        if plugin == "area":
            _shine(draw, shapes, found, number)
        else:
            found[f"light{number}"] = _light(draw, plugin)
    return found


def _light(draw, plugin):
    place = np.array(draw.uniform(-3, 3, 3)) if draw.chance(0.7) else 0.3 * draw.toward()
    if plugin == "point":
        return {"type": plugin, "position": place.tolist(), "intensity": draw.colour(2, 9)}
    if plugin == "spot":
        to_world = mi.ScalarTransform4f().look_at(place.tolist(), draw.uniform(-1, 1, 3), (0, 0, 1))
        return {"type": plugin, "to_world": to_world, "intensity": 20.0, "cutoff_angle": 30.0}
    if plugin == "directional":
        return {
            "type": plugin,
            "direction": draw.toward().tolist(),
            "irradiance": draw.colour(1, 3),
        }
    if plugin == "constant":
        return {"type": plugin, "radiance": draw.colour()}
    return {"type": plugin, "filename": str(_picture(draw))}


def _screen(draw, sensor):
    """A lamp before the camera, which looks through it."""
    shape = {"type": draw.one(rectangle=3, disk=1, cube=1)}
    to_world = sensor["to_world"].translate((0, 0, draw.uniform(0.3, 1.5))).scale(0.4)
    return _lamp(draw, shape | {"to_world": to_world, "flip_normals": draw.chance(0.5)})


def _lamp(draw, shape):
    emitter = {"type": "area", "radiance": draw.uniform(1, 5)}
    if draw.chance(0.2):
        emitter["sampling_weight"] = float(draw.one(**{"0": 1, "0.3": 1}))
    black = {"type": "diffuse", "reflectance": 0.0 if draw.chance(0.5) else 0.5}
    return shape | {"emitter": emitter, "bsdf": black}


def _shine(draw, shapes, found, number):
    """Let a shape shine: one that is there, or a lamp."""
    emitter = {"type": "area", "radiance": draw.uniform(1, 5)}
    name = f"shape{draw.rng.integers(len(shapes))}"
    clear = shapes[name]["bsdf"]["type"] in CLEAR
    if draw.chance(0.4) and "emitter" not in shapes[name] and not clear:
        shapes[name]["emitter"] = emitter
        return
    place = (3 * draw.toward()).tolist()
    to_world = mi.ScalarTransform4f().look_at(place, (0, 0, 0), (0.1, 0.2, 1)).scale(0.5)
    shape = {"type": draw.one(rectangle=3, sphere=1, disk=1, ply=2), "to_world": to_world}
    if shape["type"] == "ply":
        shape["filename"], shape["face_normals"] = str(_hull(draw)), draw.chance(0.3)
    found[f"lamp{number}"] = _lamp(draw, shape | {"flip_normals": draw.chance(0.15)})


def _camera(draw, shapes):
    plugin = draw.one(perspective=5, orthographic=1.5, thinlens=1)
    film = {"type": "hdrfilm", "width": SIZE, "height": SIZE, "pixel_format": "rgb"}
    film["rfilter"] = {"type": "box"}
    if draw.chance(0.1):
        film |= {"rfilter": {"type": "gaussian"}, "sample_border": draw.chance(0.5)}
    if draw.chance(0.05):
        film |= {"crop_width": 9, "crop_height": 7, "crop_offset_x": 3, "crop_offset_y": 5}
    inside = draw.chance(0.25)
    origin = (0.3 * draw.toward() if inside else draw.uniform(2, 6) * draw.toward()).tolist()
    target = (2 * draw.toward()).tolist() if inside else draw.uniform(-0.4, 0.4, 3)
    to_world = mi.ScalarTransform4f().look_at(origin, target, (0.05, 0.1, 1))
    if plugin == "orthographic":
        to_world = to_world.scale((2.0, 2.0, 1.0))
    found = {"type": plugin, "to_world": to_world, "film": film}
    if plugin != "orthographic":
        found["fov"] = draw.uniform(25, 70)
    if plugin == "thinlens":
        found |= {"aperture_radius": draw.uniform(0.05, 1.5), "focus_distance": draw.uniform(1, 6)}
    if draw.chance(0.3):
        found["near_clip"] = draw.uniform(0.1, 6)
    return found


@dataclass(frozen=True)
class Examined:
    """What became of a seed: ``same`` is the scene's own plan; of ``unjudged`` none is right."""

    seed: int
    plan: str
    state: str
    planned: float = 0.0
    stock: float = 0.0
    departure: float = 0.0
    errors: float = 0.0

    def __str__(self):
        numbers = f"{self.planned:.6g} {self.stock:.6g} {self.departure:+.3%} {self.errors:.1f} se"
        return f"{self.seed} {self.state} [{self.plan}] {numbers}"


def examine(seed, folder):
    """Plan a scene in the current variant, render it both ways, and judge."""
    scene = random_scene(seed, folder)
    try:
        ready = prepare(Source(f"seed {seed}", scene), Options(spp=PASSES * SPP))
    except FotismosError as error:
        return Examined(seed, str(error)[:200], "refused")
    chosen, scene = ready.plan, meant(scene, {entry.what for entry in ready.pair.overridden})
    own = scene["integrator"]
    tags = (chosen.shadows, chosen.tabulated_environment, len(ready.pair.pairing.emitters))
    word = f"{chosen.integrator} {chosen.max_depth} {tags} own {own['type']}"
    if (chosen.integrator, chosen.max_depth) == (own["type"], own.get("max_depth", 2)):
        return Examined(seed, word, "same")
    stock = mi.load_dict(scene, optimize=False)
    if seed % BOTH == 0 and not is_sound(np.array(ready.heuristic.render(seed))):
        return Examined(seed, f"{word}, the heuristic half", "not finite or negative")
    found = _judged(seed, word, ready, stock, SPP)
    doubtful = abs(found.departure) > TOLERANCE and found.errors > DOUBT
    if doubtful:
        found = _judged(seed, word, ready, stock, MORE * SPP)
    misled = found.state == "wrong" and own["type"] == "volpath" and misleads(scene)
    return replace(found, state="unjudged") if misled else found


CURVED = ("sphere", "disk", "cylinder")


def meant(scene, overridden):
    """The scene without the settings that are named as not used, for an integrator that is right.

    Only `volpath` is right about masks, and about curved shapes behind hidden lamps.
    """
    scene = {key: dict(part) if isinstance(part, dict) else part for key, part in scene.items()}
    parts = [part for key, part in scene.items() if key not in ("type", "integrator", "sensor")]
    lamps = [part for part in parts if "emitter" in part]
    for key, part in scene.items():
        if f"sampling_weight of {key}" in overridden:
            part["emitter"] = part["emitter"] | {"sampling_weight": 1.0}
    own = {key: value for key, value in scene["integrator"].items() if key not in overridden}
    bsdfs = {part.get("bsdf", {}).get("type") for part in parts}
    curved = any(part["type"] in CURVED and "emitter" not in part for part in parts)
    is_hidden = own["hide_emitters"] and lamps and (curved or not bsdfs.intersection(CLEAR))
    if is_hidden or bsdfs.intersection(("mask", "null")):
        ways = {key: value for key, value in own.items() if key not in WAYS}
        own = {"max_depth": 2} | ways | {"type": "volpath"}
    return scene | {"integrator": own}


def misleads(scene):
    """Tell whether `volpath` may be wrong: hidden lamps in mirrors, or two of their surfaces."""
    lamps = [part["type"] for part in scene.values() if "emitter" in part]
    hidden = scene["integrator"]["hide_emitters"] and lamps
    return hidden and ("cube" in lamps or any(f"'{it}'" in str(scene) for it in SMOOTH))


SMOOTH = ("conductor", "plastic", "dielectric")


def _judged(seed, word, ready, stock, spp):
    ready.reference.pass_spp = spp
    try:
        planned = [np.array(ready.reference.render(pass_seed(seed, i))) for i in range(PASSES)]
        seeds = [pass_seed(seed, PASSES + i) for i in range(PASSES)]
        own = [_rgb(np.array(mi.render(stock, spp=spp, seed=each))) for each in seeds]
    except (FotismosError, RuntimeError) as error:
        return Examined(seed, str(error)[:200], "failed")
    if not all(is_sound(image) for image in (*planned, *own)):
        return Examined(seed, word, "not finite or negative")
    means = [np.mean(images, axis=(1, 2)) for images in (planned, own)]  # (passes, channels)
    errors = [m.std(axis=0, ddof=1) / PASSES**0.5 for m in means]
    a, b = (m.mean(axis=0) for m in means)
    error = np.hypot(*errors) + 1e-6 * np.abs(b) + 1e-12
    departure = (a - b) / np.maximum(np.maximum(np.abs(a), np.abs(b)), 1e-12)
    wrong = (np.abs(departure) > TOLERANCE) & (np.abs(a - b) > ERRORS * error)
    worst = int(np.argmax(np.where(wrong, 2, 1) * np.abs(a - b) / error))
    state = "wrong" if wrong.any() else "right"
    size = float(abs(a - b)[worst] / error[worst])
    return Examined(seed, word, state, a[worst], b[worst], departure[worst], size)


def is_sound(image):
    """Tell whether all values are finite, and none negative but for colours beyond RGB."""
    lowest = -1e-6 if not mi.is_spectral else -0.1
    return bool(np.isfinite(image).all() and image.min() >= lowest * max(image.max(), 1.0))


def _rgb(image):
    return np.repeat(image, 3, axis=2) if image.shape[2] == 1 else image[:, :, :3]


def examine_batch(first, count, variant):
    """Examine some seeds in this process, and print a line for each."""
    from fotismos.heuristic import plugins
    from fotismos.reference.rendering import direct

    mi.set_variant(variant)
    mi.set_log_level(mi.LogLevel.Error)  # of samples that are rounded up
    plugins.register()
    direct.register()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            print(examine(seed, folder), flush=True)


def run(first, count, variant="llvm_ad_rgb"):
    """Examine seeds in processes of their own; yield the lines."""
    for begin in range(first, first + count, BATCH):
        size = min(BATCH, first + count - begin)
        words = [
            sys.executable,
            "-m",
            "tests.shared.random_scenes",
            "--batch",
            str(begin),
            str(size),
        ]
        done = subprocess.run([*words, variant], capture_output=True, text=True, check=False)
        yield from done.stdout.splitlines()
        if done.returncode:
            yield f"{begin} batch ended with {done.returncode}: {done.stderr[-500:]}"


if __name__ == "__main__":
    if sys.argv[1] == "--batch":
        examine_batch(int(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
    else:
        for line in run(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:]):
            print(line, flush=True)
