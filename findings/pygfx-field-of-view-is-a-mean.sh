# pygfx's field of view is neither horizontal nor vertical but the mean of both, as lengths
#
# Other viewers measure the angle along one side of the picture: three.js, VTK, glTF and MuJoCo
# along its height, Mitsuba along its width. pygfx takes the mean of width and height for the side
# of the angle, so that 40 degrees in a picture of 4:3 are 34.7 along the height. A ball looks 17 %
# larger than in another engine's picture from the same place.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    pygfx==0.17.0 \
    numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import numpy as np
import pygfx

print("pygfx", pygfx.__version__)
vertical = {}
for aspect in (1, 4 / 3, 16 / 9):
    camera = pygfx.PerspectiveCamera(40, aspect)
    camera.set_view_size(1000 * aspect, 1000)
    vertical[aspect] = 2 * np.degrees(np.arctan(1 / camera.projection_matrix[1, 1]))
    print(f"40 degrees at {aspect:.2f}:1 are {vertical[aspect]:.2f} along the height")
for aspect, degrees in vertical.items():
    expected = 2 * np.arctan(np.tan(np.radians(20)) * 2 / (1 + aspect))
    assert abs(degrees - np.degrees(expected)) < 0.01
assert abs(vertical[1] - 40) < 0.01
assert abs(vertical[4 / 3] - 34.65) < 0.1
PYTHON
