"""Values in a scene that cannot be meant, and a few that look so and can."""

from collections.abc import Iterator

from tests.faults.fault import RESULTS, SMALL, Fault, compare, written
from tests.small_scene import SCENE

ALPHA = '<float name="alpha" value="0.2"/>'
COLOUR = 'value="0.2, 0.3, 0.5"'
LAMP = '<point name="position" x="2" y="-3" z="4"/>'
POWER = '<rgb name="intensity" value="60"/>'
SPHERE = '<shape type="sphere">'
FLOOR = '<scale x="5" y="5"/>'
VIEW = '<lookat origin="0, -5, 2" target="0, 0, 0" up="0, 0, 1"/>'
CAMERA = '<sensor type="perspective">'
WIDTH = '<integer name="width" value="24"/>'
HEIGHT = '<integer name="height" value="16"/>'
DEPTH = '<integer name="max_depth" value="3"/>'
LAST = "</scene>"


def _child(kind: str, name: str) -> str:
    return f'<{kind} name="{name}" value="{{}}"/>'


CROP = (
    '<integer name="crop_width" value="4"/><integer name="crop_height" value="4"/>'
    '<integer name="crop_offset_y" value="0"/>'
)
ZEROS, NANS = " ".join("0" * 16), " ".join(["nan"] * 16)

REFUSED = {
    "radius": (SPHERE, SPHERE + _child("float", "radius"), ("nan", "inf", "0", "1e39", "x", "")),
    "centre": (SPHERE, SPHERE + '<point name="center" x="{}" y="0" z="0"/>', ("nan", "-inf", "x")),
    "fov": (CAMERA, CAMERA + _child("float", "fov"), ("nan", "0", "-10", "180", "inf", "x")),
    "near_clip": (CAMERA, CAMERA + _child("float", "near_clip"), ("nan", "0", "-1", "1e30")),
    "alpha": (ALPHA, _child("float", "alpha"), ("nan", "inf", "1e308", "x")),
    "int_ior": (ALPHA, ALPHA + _child("float", "int_ior"), ("nan", "inf", "0", "-1.5")),
    "material": (ALPHA, ALPHA + _child("string", "int_ior"), ("watr",)),
    "distribution": (ALPHA, ALPHA + _child("string", "distribution"), ("gxg",)),
    "colour": (COLOUR, 'value="{}"', ("nan, 0, 0", "-1, 0, 0", "0.2, 0.3", "a, b, c", "", "#12")),
    "position": (LAMP, '<point name="position" x="{}" y="-3" z="4"/>', ("nan", "inf", "x")),
    "intensity": (POWER, _child("rgb", "intensity"), ("nan", "inf", "1e39")),
    "scale": (FLOOR, '<scale x="{}" y="5"/>', ("nan", "0", "inf", "1e-60")),
    "rotation": (FLOOR, FLOOR + '<rotate x="1" angle="{}"/>', ("nan", "inf", "x")),
    "matrix": (FLOOR, '<matrix value="{}"/>', ("1 2 3", ZEROS, NANS)),
    "width": (WIDTH, _child("integer", "width"), ("0", "-5", "1000000000", "x", "1.5", "9" * 30)),
    "crop_width": (WIDTH, WIDTH + _child("integer", "crop_width"), ("0", "-1", "25")),
    "crop_offset_x": (WIDTH, WIDTH + CROP + _child("integer", "crop_offset_x"), ("-1", "23")),
    "filter": (HEIGHT, HEIGHT + '<rfilter type="{}"/>', ("boxy",)),
    "pixel_format": (HEIGHT, HEIGHT + _child("string", "pixel_format"), ("rgbx",)),
    "depth": (DEPTH, _child("integer", "max_depth"), ("-5", "x")),
}
"""By name: what stands in the small scene, what comes in its place, and values for that."""

REPLACED = {
    "a camera at what it looks at": (VIEW, VIEW.replace("0, -5, 2", "0, 0, 0")),
    "a camera that looks along its up": (VIEW, VIEW.replace("0, 0, 1", "0, -5, 2")),
    "a camera that looks away": (VIEW, VIEW.replace('target="0, 0, 0"', 'target="0, -9, 9"')),
    "a clip beyond all shapes": (CAMERA, CAMERA + '<float name="near_clip" value="500"/>'),
    "no camera": (CAMERA, '<texture type="bitmap" id="x">'),
    "a cylinder of no length": (
        LAST, '<shape type="cylinder"><point name="p0" value="1"/><point name="p1" value="1"/>'
        "</shape></scene>",
    ),
    "an integrator that is none": ('type="path"', 'type="pth"'),
    "a camera that is none": ('type="perspective"', 'type="perspectiv"'),
    "a shape that is none": (SPHERE, '<shape type="spere">'),
    "a material that is none": ('type="roughplastic"', 'type="ruffplastic"'),
    "a light that is none": ('type="point"', 'type="pointy"'),
    "a parameter that is none": (ALPHA, ALPHA + '<float name="alhpa" value="1"/>'),
    "a parameter twice": (ALPHA, ALPHA + ALPHA),
    "a parameter of another type": (ALPHA, '<boolean name="alpha" value="true"/>'),
    "a material in a light": (LAMP, LAMP + '<bsdf type="diffuse"/>'),
    "two materials of one shape": (SPHERE, SPHERE + '<bsdf type="diffuse"/>'),
    "a boolean that is none": (SPHERE, SPHERE + '<boolean name="flip_normals" value="ja"/>'),
    "an emitter with the direction 0": (
        LAST, '<emitter type="directional"><vector name="direction" value="0"/></emitter></scene>',
    ),
    "a spot of no angle": (
        LAST, '<emitter type="spot"><float name="cutoff_angle" value="0"/></emitter></scene>',
    ),
    "a spectrum that goes backwards": (
        LAST, '<emitter type="constant"><spectrum name="radiance" value="700:1, 400:1"/></emitter>'
        "</scene>",
    ),
    "a black body of NaN": (
        LAST, '<emitter type="constant"><blackbody name="radiance" temperature="nan"/></emitter>'
        "</scene>",
    ),
}  # fmt: skip

RENDERED = {
    "a roughness of 0": (ALPHA, '<float name="alpha" value="0"/>'),
    "a roughness of 1e-30": (ALPHA, '<float name="alpha" value="1e-30"/>'),
    "a negative radius": (SPHERE, SPHERE + '<float name="radius" value="-1"/>'),
    "a film of one pixel": (WIDTH + HEIGHT, WIDTH.replace("24", "1") + HEIGHT.replace("16", "1")),
    "an endless depth": (DEPTH, '<integer name="max_depth" value="-1"/>'),
    "no light by the lamp": (POWER, '<rgb name="intensity" value="0"/>'),
}
"""Stock Mitsuba renders these, and so does a comparison."""

MAY_BE = {
    "a negative roughness": (ALPHA, '<float name="alpha" value="-0.2"/>'),
    "a negative light": (POWER, '<rgb name="intensity" value="-5"/>'),
    "a depth of 0": (DEPTH, '<integer name="max_depth" value="0"/>'),
    "a colour above 1": (COLOUR, 'value="2, 2, 2"'),
    "a light as strong as can be": (POWER, '<rgb name="intensity" value="3e38"/>'),
    "a lamp as far as can be": (LAMP, '<point name="position" x="3e38" y="-3" z="4"/>'),
    "a lamp inside the ball": (LAMP, '<point name="position" x="0" y="0" z="0"/>'),
    "a lamp on the floor": (LAMP, '<point name="position" x="2" y="-3" z="-1"/>'),
    "a ball as small as can be": (SPHERE, SPHERE + '<float name="radius" value="1e-38"/>'),
    "a ball as large as can be": (SPHERE, SPHERE + '<float name="radius" value="3e38"/>'),
}
"""Refused with the reason, or rendered."""


def faults() -> Iterator[Fault]:
    """Yield faults of values."""
    for name, (old, new, values) in REFUSED.items():
        for value in values:
            short = value if len(value) < 20 else value[:17] + "..."
            yield _of(f"{name} = {short!r}", old, new.format(value))
    for name, (old, new) in REPLACED.items():
        yield _of(name, old, new)
    for name, (old, new) in RENDERED.items():
        yield _of(name, old, new, codes=(0,))
    for name, (old, new) in MAY_BE.items():
        yield _of(name, old, new, codes=(0, 1, 2))
    empty = written({"a.xml": SCENE.replace(VIEW, VIEW.replace('"0, 0, 0"', '"0, -9, 9"'))})
    asked = (*compare(), "--allow-empty")
    yield Fault("nothing in view, as asked for", asked, None, (0,), empty, RESULTS)


def _of(name: str, old: str, new: str, codes: tuple[int, ...] = (2,)) -> Fault:
    assert old in SCENE, old
    # One film is too small for a camera of two words.
    scene = SCENE.replace(old, new, 1)
    if new.startswith("<texture"):
        scene = SCENE[: SCENE.index(CAMERA)] + SCENE[SCENE.index(SPHERE) :]
    is_of_film = "width" in new or "height" in new
    words = (*compare(small=False), *(SMALL[:2] if is_of_film else SMALL))
    message = r"^fotismos: error: .*a\b"
    return Fault(name, words, message, codes, written({"a.xml": scene}), RESULTS)
