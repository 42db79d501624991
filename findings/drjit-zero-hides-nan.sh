# In Dr.Jit NaN times a 0 of the program's text is 0, and NaN times a 0 that was computed is NaN
#
# IEEE 754 has one answer, NaN, and arrays of other libraries give it. Dr.Jit removes a product
# with a literal 0 while it traces, before anything is computed, so a switched-off term (weight 0)
# hides that its factor is NaN. The NaN appears when the same weight is read from a scene, or was
# made opaque to save compilations.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    drjit==1.5.0 \
    karellen-llvm-core==22.1.8
export DRJIT_LIBLLVM_PATH="$folder/venv/lib/libLLVM.so"
"$folder/venv/bin/python" - <<'PYTHON'
import math

import drjit as dr
from drjit.llvm import Float

print("drjit", dr.__version__)
nan = dr.opaque(Float, math.nan)
literal = (nan * 0)[0]
computed = (nan * dr.opaque(Float, 0))[0]
print(f"NaN * 0 (literal) = {literal}, NaN * 0 (computed) = {computed}")
assert literal == 0
assert math.isnan(computed)
PYTHON
