# colour-science converts ACEScg to sRGB by CAT02, where ACES and ICC prescribe Bradford
#
# ACES' own transforms, ICC profiles and most image tools adapt between the white of ACES and D65
# by Bradford's matrix, so a conversion that names both spaces is taken for theirs. `RGB_to_RGB`
# uses CAT02 unless told otherwise: blue of a brown differs by 0.5 %, that of ProPhoto's blue
# primary by 0.016. Whites agree, so a test with grey does not show it.
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
pairs = {}
cases = {(0.5, 0.2, 0.1): "ACEScg", (0, 0, 1): "ProPhoto RGB", (1, 1, 1): "ACEScg"}
for value, space in cases.items():
    default = colour.RGB_to_RGB(value, space, "sRGB")
    bradford = colour.RGB_to_RGB(
        value, space, "sRGB", chromatic_adaptation_transform="Bradford"
    )
    pairs[value] = default, bradford
    print(f"{space} {value}: {default.round(5)}, by Bradford {bradford.round(5)}")
default, bradford = pairs[0.5, 0.2, 0.1]
assert abs(default[2] / bradford[2] - 1.0048) < 0.0005
default, bradford = pairs[0, 0, 1]
assert abs(bradford[2] - default[2] - 0.0164) < 0.0005
default, bradford = pairs[1, 1, 1]
assert np.abs(default - bradford).max() < 5e-4
PYTHON
