"""Draw a scene with three.js, so that its picture can be compared with the reference.

    npm install --prefix docs/engines
    python docs/engines/three_js.py plastic-spheres three.exr
    fotismos compare plastic-spheres --resolution 256x256 --image three.exr

Headless Chromium draws in floats, without tone mapping, with four by four fragments per pixel.
three.js (MeshPhongMaterial) computes, for a light of intensity ``I`` at a distance ``d``::

    I / d^decay  N.L  (color / pi + F (n + 2) / (8 pi) (N.H)^n),
    F = specular + (1 - specular) 2^((-5.55473 V.H - 6.98316) V.H)

So a light gets ``pi I_p``, ``color`` is ``k_d``, the exponent of a lobe about the mirrored vector
becomes ``4 n``, since the half vector turns half as fast, and ``specular`` is ``8 k_s / (n + 2)``:
both lobes then have the same width and, apart from Schlick's term, the same height. Emission
includes the ambient light. Left out: textures (their middle is taken), the fall-off within a cone,
light beyond 90 degrees of a spot's axis, and the limit of 1 on attenuation.
"""

import base64
import json
import re
import subprocess
import sys
from math import pi, radians
from pathlib import Path
from tempfile import TemporaryDirectory

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import mitsuba as mi
import numpy as np

from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import Options
from fotismos.comparisons.plain_scene import PlainScene, plain_scene
from fotismos.heuristic import terms

HERE = Path(__file__).parent
SIDE, FINER, TESSELLATION = 256, 4, 96

CHROMIUM = (
    "chromium", "--headless", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--allow-file-access-from-files",
    "--disable-extensions", "--disable-background-networking", "--no-first-run", "--dump-dom",
)  # fmt: skip

PAGE = """<!doctype html><meta charset="utf-8">
<script id="scene" type="application/json">{scene}</script>
<script type="importmap">{{"imports": {{"three": "{three}"}}}}</script>
<script type="module" src="{script}"></script>
<body></body>
"""


def drawn(scene: PlainScene) -> np.ndarray:
    """Return the picture (H, W, 3) of a scene."""
    camera = scene.camera
    width, height = FINER * camera["width"], FINER * camera["height"]
    given = {
        "view": camera["view"],
        "projection": camera["projection"],
        "width": width,
        "height": height,
        "meshes": [
            {
                "positions": _packed(shape.positions, np.float32),
                "normals": None if shape.normals is None else _packed(shape.normals, np.float32),
                "faces": _packed(shape.faces, np.uint32),
                "material": _material(scene.materials[shape.material], scene.ambient)
                | {"flat": shape.normals is None},
            }
            for shape in scene.shapes
        ],
        "lights": [_light(light) for light in scene.lights],
    }
    with TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        three = HERE / "node_modules/three/build/three.module.js"
        text = PAGE.format(
            scene=json.dumps(given).replace("<", "\\u003c"),
            three=three.as_uri(),
            script=(HERE / "three_js.js").as_uri(),
        )
        page.write_text(text, encoding="utf-8")
        done = subprocess.run(
            [*CHROMIUM, f"--user-data-dir={folder}/profile", page.as_uri()],
            capture_output=True, text=True, timeout=240, check=True,
        )  # fmt: skip
    found = re.search(r'<pre id="picture">([^<]*)</pre>', done.stdout)
    if not found:
        raise SystemExit(f"three.js did not draw the scene:\n{done.stdout}\n{done.stderr}")
    floats = np.frombuffer(base64.b64decode(found[1]), np.float32).reshape(height, width, 4)
    parts = floats[::-1, :, :3].reshape(camera["height"], FINER, camera["width"], FINER, 3)
    return parts.mean(axis=(1, 3))


def _packed(array: np.ndarray, kind: type) -> str:
    return base64.b64encode(np.ascontiguousarray(array, kind).tobytes()).decode()


def _material(given: dict, ambient: tuple[float, ...]) -> dict:
    k_i, k_a, k_s = (np.array(given[name]) for name in ("k_i", "k_a", "k_s"))
    scale = terms.normalisation(given["form"], given["n"]) if given["normalised"] else 1.0
    n = given["n"] * {"phong": 4, "blinn": 1}[given["form"]]
    return {
        "type": "MeshPhongMaterial",
        "color": given["k_d"],
        "emissive": (k_i + ambient * k_a).tolist(),
        "specular": (8 * scale * k_s / (n + 2)).tolist(),
        "shininess": n,
    }


def _light(given: dict) -> dict:
    """Return a light in three.js' form, in candela and lux."""
    found = {"color": given["intensity"], "intensity": pi}
    if given["type"] == "directional":
        toward = -np.array(given["direction"]) / np.linalg.norm(given["direction"])
        far = (1e3 * toward).tolist()
        return found | {"type": "DirectionalLight", "position": far, "target": [0, 0, 0]}
    powers = [power for power, value in enumerate(given["attenuation"]) if value]
    if len(powers) > 1:
        raise SystemExit(
            f"light {given['name']!r} has the attenuation {given['attenuation']}: three.js has one"
            " power of the distance."
        )
    (power,) = powers
    found |= {
        "intensity": pi / given["attenuation"][power],
        "decay": power,
        "position": given["position"],
    }
    if given["type"] == "point":
        return found | {"type": "PointLight"}
    target = (np.array(given["position"]) + np.array(given["direction"])).tolist()
    angle = radians(min(given["cutoff"], 90.0))
    return found | {"type": "SpotLight", "angle": angle, "target": target}


if __name__ == "__main__":
    name, place = sys.argv[1:]
    case = open_case(name, Options(resolution=(SIDE, SIDE), tessellation=TESSELLATION))
    mi.Bitmap(np.float32(drawn(plain_scene(case.source, case.options)))).write(place)
