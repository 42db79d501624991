# VTK's smooth normal at a box's corner leans 19.5 degrees towards the face cut into two triangles
#
# A vertex normal is expected to depend on the surface, not on how its faces are cut. trimesh and
# Mitsuba weight each triangle by its angle at the vertex and give a box's corner its diagonal.
# VTK's `vtkPolyDataNormals` counts every triangle once, so a face cut through the corner counts
# twice: (-0.41, -0.41, -0.82) for three times -0.58. One mesh is shaded in two ways by two
# viewers, with smooth shading alone.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    mitsuba==3.9.1 \
    drjit==1.5.0 \
    numpy==2.4.6 \
    trimesh==5.2.0 \
    scipy==1.17.1 \
    vtk==9.7.2
"$folder/venv/bin/python" - <<'PYTHON'
import os
import tempfile

import mitsuba as mi
import numpy as np
import trimesh
import vtk

mi.set_variant("scalar_rgb")
print("mitsuba", mi.__version__, "trimesh", trimesh.__version__, "vtk", vtk.VTK_VERSION)
# Three faces of a box around the origin; the one in the plane z = 0 is two triangles.
CORNER = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 0\nf 1 5 2\nf 1 3 5\nf 1 2 4\nf 1 4 3\n"
normals = {}
with tempfile.TemporaryDirectory() as folder:
    path = os.path.join(folder, "corner.obj")
    with open(path, "w") as file:
        file.write(CORNER)
    mesh = mi.load_dict({"type": "obj", "filename": path})
    mesh.recompute_vertex_normals()
    normals["mitsuba"] = np.array(mi.traverse(mesh)["vertex_normals"])[:3]
    normals["trimesh"] = trimesh.load(path, process=False).vertex_normals[0]
    reader = vtk.vtkOBJReader()
    reader.SetFileName(path)
    smooth = vtk.vtkPolyDataNormals()
    smooth.SetInputConnection(reader.GetOutputPort())
    smooth.SplittingOff()
    smooth.ConsistencyOff()
    smooth.Update()
    normals["vtk"] = np.array(smooth.GetOutput().GetPointData().GetNormals().GetTuple(0))
diagonal = -np.ones(3) / np.sqrt(3)
leaning = {name: np.degrees(np.arccos(min(1, n @ diagonal))) for name, n in normals.items()}
for name, degrees in leaning.items():
    print(f"{name}: {normals[name].round(3)}, {degrees:.1f} degrees from the diagonal")
assert leaning["mitsuba"] < 0.1
assert leaning["trimesh"] < 0.1
assert abs(leaning["vtk"] - 19.5) < 0.1
PYTHON
