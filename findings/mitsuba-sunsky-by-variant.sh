# Mitsuba's sunsky is 3 % less red and 3 % more blue in rgb than in spectral variants, none in mono
#
# Both variants evaluate one model of the sky, so a guess is equal colours up to noise. The rgb
# variants read the model's other set of data, fitted for three channels: a grey plane under the
# sky has other colours by 3 %, and the ratio of blue to red differs by 6 %. In mono variants,
# where a luminance would do, the plugin refuses to load.
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
import numpy as np

print("mitsuba", mi.__version__)
colours = {}
for variant in ("llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono"):
    mi.set_variant(variant)
    towards = mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}
    scene = {
        "type": "scene",
        "integrator": {"type": "path"},
        "sky": {"type": "sunsky", "sun_scale": 0.0, "turbidity": 3.0},
        "plane": {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": 0.5}},
        "camera": {"type": "perspective", "fov": 5.0, "to_world": towards, "film": film},
    }
    try:
        image = mi.render(mi.load_dict(scene), spp=8192)
        colours[variant] = np.array(image).mean(axis=(0, 1))
        print(variant, colours[variant])
    except RuntimeError as error:
        print(variant, "refuses:", str(error).splitlines()[-1][:90])
assert "llvm_ad_mono" not in colours
red, green, blue = colours["llvm_ad_rgb"] / colours["llvm_ad_spectral"]
assert 0.955 < red < 0.985
assert abs(green - 1) < 0.02
assert 1.015 < blue < 1.05
PYTHON
