# In VTK and PyVista a colour set by SetColor or color= tints the highlight too
#
# Phong's highlight of a plastic is the lamp's colour, and VTK has a specular colour of its own,
# white by default. `SetColor` sets that one with the others, and PyVista's `color=` calls it: a
# blue ball gets a blue highlight, like a metal, unless the specular colour is set afterwards. The
# same numbers in a textbook's formula or in another viewer give a white one.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    vtk==9.7.2 \
    pyvista==0.49.1 \
    numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import pyvista
import vtk

print("vtk", vtk.VTK_VERSION, "pyvista", pyvista.__version__)
look = vtk.vtkProperty()
before = look.GetSpecularColor()
look.SetColor(0.1, 0.2, 0.8)
after = look.GetSpecularColor()
print(f"specular colour: {before}, after SetColor(0.1, 0.2, 0.8): {after}")
of_pyvista = pyvista.Property(color=(0.1, 0.2, 0.8), specular=0.5).GetSpecularColor()
print(f"pyvista.Property(color=(0.1, 0.2, 0.8), specular=0.5): {of_pyvista}")
assert before == (1, 1, 1)
assert after == (0.1, 0.2, 0.8)
assert max(of_pyvista) < 0.81
PYTHON
