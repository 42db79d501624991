# In Mitsuba a two-sided sphere that shines outwards lights its own inside, if the lamp is sampled
#
# Lamps shine on the side of their normals only, so the inside of a shining sphere is dark, however
# light is sampled. Seen from its centre a two-sided `sphere` of radiance 1 and reflectance 0.5 is
# 0 by samples of the surface, 0.14 in the mean by samples of the lamp and 0.06 by `path`: samples
# taken from a point on the sphere itself find light that no ray meets. A `cube` is 0 by all.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    mitsuba==3.9.1 \
    drjit==1.5.0 \
    numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
print("mitsuba", mi.__version__)
film = {"type": "hdrfilm", "width": 32, "height": 32, "rfilter": {"type": "box"}}
diffuse = {"type": "diffuse", "reflectance": 0.5}
integrators = {
    "surface": {"type": "direct", "bsdf_samples": 1, "emitter_samples": 0},
    "lamp": {"type": "direct", "bsdf_samples": 0, "emitter_samples": 1},
    "path": {"type": "path"},
}
values = {}
for shape in ("sphere", "cube"):
    scene = {
        "type": "scene",
        "lamp": {
            "type": shape,
            "bsdf": {"type": "twosided", "inner": diffuse},
            "light": {"type": "area", "radiance": 1.0},
        },
        "camera": {"type": "perspective", "fov": 90.0, "film": film},
    }
    loaded = mi.load_dict(scene)
    for name, integrator in integrators.items():
        image = mi.render(loaded, integrator=mi.load_dict(integrator), spp=1024)
        values[shape, name] = float(np.array(image).mean())
        print(f"{shape} by {name}: {values[shape, name]:.4f}")
assert values["cube", "surface"] == values["cube", "lamp"] == values["cube", "path"] == 0
assert values["sphere", "surface"] == 0
assert values["sphere", "lamp"] > 0.1
assert values["sphere", "path"] > 0.03
PYTHON
