# A cylinder that shines, mirrored in Mitsuba, lights by one way of sampling and not by the other
#
# Where a renderer samples lamps and surfaces, both ways must find the same light, so a mirrored
# lamp is either right or wrong altogether. A mirrored `cylinder` keeps its outward normal where a
# ray hits it and turns it inwards where points of it are sampled: a wall outside gets 0.094 by
# sampling the surface, 0 by sampling the lamp, and 0.009 by `path`, which weights both. Rectangles
# and disks, mirrored, are right.
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
place = mi.ScalarTransform4f()
film = {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}}
light = {"type": "area", "radiance": 1.0}
facing = place.translate([2, 0, 0.5]).rotate([0, 1, 0], -90)
white = {"type": "diffuse", "reflectance": 1.0}
integrators = {
    "surface": {"type": "direct", "bsdf_samples": 1, "emitter_samples": 0},
    "lamp": {"type": "direct", "bsdf_samples": 0, "emitter_samples": 1},
    "path": {"type": "path"},
}
values = {}
for sign in (1, -1):
    lamp = {"type": "cylinder", "radius": 0.5, "to_world": place.scale([sign, 1, 1]), "e": light}
    scene = {
        "type": "scene",
        "lamp": lamp,
        "wall": {"type": "rectangle", "to_world": facing, "bsdf": white},
        "meter": {
            "type": "radiancemeter", "origin": [1, 0, 0.5], "direction": [1, 0, 0], "film": film,
        },
    }
    loaded = mi.load_dict(scene)
    for name, integrator in integrators.items():
        image = mi.render(loaded, integrator=mi.load_dict(integrator), spp=100_000)
        values[sign, name] = float(np.array(image).ravel()[0])
        print(f"x scaled by {sign}, by {name}: {values[sign, name]:.4f}")
assert all(abs(values[1, name] - 0.094) < 0.002 for name in integrators)
assert abs(values[-1, "surface"] - 0.094) < 0.002
assert values[-1, "lamp"] < 1e-4
assert abs(values[-1, "path"] - 0.0086) < 0.001
PYTHON
