# Mitsuba's blackbody loads in rgb variants and raises only at the render
#
# A plugin that a variant cannot use is normally refused when the scene is loaded, as `sunsky` is
# in mono variants. A lamp of a `blackbody` passes the parser, the list of unused parameters and
# `mi.traverse`, so a tool that checks scenes by loading them reports it as sound. The first
# evaluation raises, after all other files have been read.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    mitsuba==3.9.1 \
    drjit==1.5.0 \
    numpy==2.4.6 \
    karellen-llvm-core==22.1.8
export DRJIT_LIBLLVM_PATH="$folder/venv/lib/libLLVM.so"
"$folder/venv/bin/python" - <<'PYTHON'
import mitsuba as mi

scene = {
    "type": "scene",
    "integrator": {"type": "path"},
    "lamp": {"type": "constant", "radiance": {"type": "blackbody", "temperature": 5000.0}},
    "camera": {"type": "perspective", "film": {"type": "hdrfilm", "width": 4, "height": 4}},
}
print("mitsuba", mi.__version__)
outcome = {}
for variant in ("llvm_ad_rgb", "llvm_ad_spectral"):
    mi.set_variant(variant)
    loaded = mi.load_dict(scene)
    try:
        mi.render(loaded, spp=4)
        outcome[variant] = "renders"
    except RuntimeError:
        outcome[variant] = "raises"
    print(variant, "loads, then", outcome[variant])
assert outcome == {"llvm_ad_rgb": "raises", "llvm_ad_spectral": "renders"}
PYTHON
