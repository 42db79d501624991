# Mitsuba's roughplastic of reflectance 1 reflects 74 % at a roughness of 0.5
#
# A coat that absorbs nothing over a base that absorbs nothing should return all light, as smooth
# `plastic` nearly does (100.1 %). `roughplastic` counts one reflection by its microfacets, and
# what passes to the base and back by a table of mean transmittance: 97 % return at a roughness of
# 0.1 and 74 % at 0.5. A wall that is made rough by this one number gets darker, and a room of such
# walls much darker.
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
import math

import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
print("mitsuba", mi.__version__)


def albedo(bsdf, cosine, samples=1_000_000):
    """Return the share of light that leaves a surface, for light of one direction."""
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, samples)
    si = dr.zeros(mi.SurfaceInteraction3f, samples)
    si.wi = mi.Vector3f(math.sqrt(1 - cosine * cosine), 0, cosine)
    context = mi.BSDFContext()
    _, weight = mi.load_dict(bsdf).sample(context, si, sampler.next_1d(), sampler.next_2d())
    return dr.mean(weight[0])[0]


white = {"type": "rgb", "value": 1.0}
smooth = albedo({"type": "plastic", "diffuse_reflectance": white}, 1.0)
rough = {
    alpha: albedo({"type": "roughplastic", "diffuse_reflectance": white, "alpha": alpha}, 1.0)
    for alpha in (0.1, 0.2, 0.5)
}
print(f"plastic {smooth:.4f}, roughplastic {rough}")
assert abs(smooth - 1) < 0.005
assert abs(rough[0.1] - 0.968) < 0.005
assert abs(rough[0.5] - 0.745) < 0.005
PYTHON
