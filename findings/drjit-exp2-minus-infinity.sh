# Dr.Jit's exp2 of doubles from -1024 to -1023.5 is -infinity, between zeros on both sides
#
# 2^x falls to 0, so a guess is a small number, or 0 where small numbers are flushed. Dr.Jit 1.5.0
# gives 0 at -1023, -infinity at -1023.6 and 0 again at -1030. A power c^n is exp2(n log2 c): a
# narrow highlight in double precision meets the gap at one ring of pixels, and one pixel of
# -infinity is the mean of the picture.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    drjit==1.5.0 \
    karellen-llvm-core==22.1.8 \
    numpy==2.4.6
export DRJIT_LIBLLVM_PATH="$folder/venv/lib/libLLVM.so"
"$folder/venv/bin/python" - <<'PYTHON'
import drjit as dr
import numpy as np
from drjit.llvm import Float64

print("drjit", dr.__version__)
values = {x: dr.exp2(dr.opaque(Float64, x))[0] for x in (-1022, -1023, -1023.6, -1024, -1030)}
for x, value in values.items():
    print(f"exp2({x:g}) = {value:g}, NumPy: {np.exp2(x):g}")
assert values[-1022] == 2.0**-1022
assert values[-1023] == values[-1030] == 0
assert values[-1023.6] == values[-1024] == -np.inf
PYTHON
