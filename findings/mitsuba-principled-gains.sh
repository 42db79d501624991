# Mitsuba's principled of a white base reflects 105 % head on and 142 % at grazing angles
#
# A model made of physical lobes is expected to keep energy. Disney's diffuse lobe, which it has,
# does not: with a specular lobe on top of a base colour of 1, more light leaves than arrives, and
# light between such surfaces grows from reflection to reflection. A base of 0.8 stays below 1 at a
# cosine of 0.5 (0.867).
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


def principled(base, cosine):
    colour = {"type": "rgb", "value": base}
    return albedo({"type": "principled", "base_color": colour, "roughness": 1.0}, cosine)


head_on, grazing = principled(1.0, 1.0), principled(1.0, 0.1)
print(f"base 1: {head_on:.3f} head on, {grazing:.3f} at a cosine of 0.1")
print(f"base 0.8: {principled(0.8, 0.5):.3f} at a cosine of 0.5")
assert abs(head_on - 1.048) < 0.01
assert abs(grazing - 1.42) < 0.02
assert principled(0.8, 0.5) < 1
PYTHON
