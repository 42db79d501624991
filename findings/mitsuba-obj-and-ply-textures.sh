# Mitsuba turns the texture coordinates of an OBJ upside down and leaves those of a PLY as they are
#
# One mesh with one set of coordinates, saved by a modelling tool as OBJ and as PLY, is expected to
# wear its texture alike. The `obj` plugin flips v by default and `ply` does not, so the same point
# is at v = 0.9 and at v = 0.1, and pictures stand on their heads in one of the two. Symmetric test
# textures hide it. `flip_tex_coords` exists on both.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    mitsuba==3.9.1 \
    drjit==1.5.0 \
    numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import os
import tempfile

import mitsuba as mi

mi.set_variant("scalar_rgb")
print("mitsuba", mi.__version__)
square = ((-1, -1, 0, 0), (1, -1, 1, 0), (1, 1, 1, 1), (-1, 1, 0, 1))
OBJ = "".join(f"v {x} {y} 0\n" for x, y, _, _ in square)
OBJ += "".join(f"vt {u} {v}\n" for _, _, u, v in square) + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
PLY = "ply\nformat ascii 1.0\nelement vertex 4\n"
PLY += "".join(f"property float {name}\n" for name in "xyzuv")
PLY += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
PLY += "".join(f"{x} {y} 0 {u} {v}\n" for x, y, u, v in square) + "3 0 1 2\n3 0 2 3\n"
height = {}
with tempfile.TemporaryDirectory() as folder:
    for kind, text in (("obj", OBJ), ("ply", PLY)):
        path = os.path.join(folder, f"square.{kind}")
        with open(path, "w") as file:
            file.write(text)
        scene = mi.load_dict({"type": "scene", "square": {"type": kind, "filename": path}})
        ray = mi.Ray3f(mi.Point3f(-0.8, -0.8, 5), mi.Vector3f(0, 0, -1))
        height[kind] = scene.ray_intersect(ray).uv.y
        print(f"{kind}: the point with v = 0.1 in the file has v = {height[kind]:.2f}")
assert abs(height["obj"] - 0.9) < 1e-5
assert abs(height["ply"] - 0.1) < 1e-5
PYTHON
