# CAM16 gives D65 white a chroma of 2.2 under sRGB's own viewing conditions (colour-science)
#
# White is expected to be neutral in its own viewing conditions. CAM16's degree of adaptation
# follows from the dim room of sRGB's standard (64 lx, 4 cd/m2): the eye is taken as adapted by 83
# % only, and D65 keeps a tint of C = 2.2, M = 2.2. A chroma of a white pixel above 0 is not a
# fault of a picture; `discount_illuminant=True` gives 0.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    colour-science==0.4.7 \
    numpy==2.4.6 \
    scipy==1.17.1 \
    matplotlib==3.11.2
"$folder/venv/bin/python" - <<'PYTHON'
import warnings

import numpy as np

warnings.simplefilter("ignore")
import colour

print("colour-science", colour.__version__)
xy = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"]
white = colour.xy_to_XYZ(xy) * 100
adapting = 64 / np.pi / 5
average = colour.VIEWING_CONDITIONS_CAM16["Average"]
colourfulness = {}
for discount in (False, True):
    seen = colour.XYZ_to_CAM16(
        white, white, adapting, 20, average, discount_illuminant=discount
    )
    colourfulness[discount] = float(seen.M)
    print(f"discount_illuminant={discount}: J = {seen.J:.2f}, C = {seen.C:.3f}, M = {seen.M:.3f}")
assert abs(colourfulness[False] - 2.237) < 0.01
assert colourfulness[True] < 1e-6
PYTHON
