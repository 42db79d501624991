"""POV-Ray as a witness of the heuristic: the same figure by a program that shares no code with it.

POV-Ray's ``ambient``, ``diffuse`` and ``phong`` are the terms of equation 8.10. The translation
reads numbers from a scene dictionary, and leaves vectors, camera and sums to POV-Ray:

- It is left-handed; a negative ``right`` turns it into the right-handed frame of the figures.
- One ray per pixel, through the centre: no antialiasing, no jitter.
- ``assumed_gamma`` and ``File_Gamma`` of 1 keep values linear. EXR holds them in half precision.
- Lights shine as far as they like, as ``f_att = 1`` has it. A ``spotlight`` of equal ``radius`` and
  ``falloff`` is an even cone, and its ``tightness`` the exponent of equation 6.4.
- Lights cast shadows there, none here: the shapes are convex and nothing stands between. (Lights
  that are ``shadowless`` make no highlights.)
"""

import shutil
import subprocess
from pathlib import Path

import mitsuba as mi
import numpy as np

PROGRAM = shutil.which("povray")
OPTIONS = ("+FE", "-A", "-D", "-GA", "+WT1", "File_Gamma=1.0", "Output_Alpha=off", "Jitter=off")


def render(scene: dict, size: int, folder: Path) -> np.ndarray:
    """Return the picture (size, size, 3) that POV-Ray makes of a figure.

    Raises
    ------
    RuntimeError
        With what POV-Ray says, where it cannot.
    """
    return drawn(translated(scene), size, folder)


def drawn(text: str, size: int, folder: Path) -> np.ndarray:
    """Return the picture (size, size, 3) of a text in POV-Ray's language; see :func:`render`."""
    source, picture = folder / "figure.pov", folder / "figure.exr"
    source.write_text(text, encoding="ascii")
    command = [PROGRAM, f"+I{source}", f"+O{picture}", f"+W{size}", f"+H{size}", *OPTIONS]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=120)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return np.array(mi.Bitmap(str(picture)), float)[..., :3]


def translated(scene: dict) -> str:
    """Return a figure in POV-Ray's language."""
    lines = [_camera(scene["sensor"])]
    for part in scene.values():
        kind = part["type"] if isinstance(part, dict) else ""
        if kind in ("sphere", "rectangle"):
            lines.append(_shape(part))
        elif kind.startswith("heuristic_"):
            lines.append(_light(part))
    return document(scene["integrator"].get("ambient", 0.0), lines)


def document(ambient, lines):
    """Return a text in POV-Ray's language whose values are linear, of its own lines."""
    head = f"global_settings {{ assumed_gamma 1.0 ambient_light rgb {triple(ambient)} }}"
    return "\n".join(["#version 3.7;", head, "background { rgb 0 }", *lines, ""])


def _camera(sensor):
    """Of the transform, the place and the way it looks: up is z in all figures."""
    matrix = np.array(sensor["to_world"].matrix, float)
    place = matrix[:3, 3]
    ahead = place + matrix[:3, 2] * np.linalg.norm(place)
    return (
        f"camera {{ perspective location {triple(place)} sky z right -x up y"
        f" angle {sensor['fov']} look_at {triple(ahead)} }}"
    )


def _light(light):
    if any(light.get(key, value) != value for key, value in (("k0", 1), ("k1", 0), ("k2", 0))):
        raise ValueError("the figures' lights do not fall off with distance")
    place = np.array(light["position"], float)
    cone = ""
    if light["type"] == "heuristic_spot":
        cutoff, target = light["cutoff"], place + np.array(light["direction"], float)
        cone = f"spotlight radius {cutoff} falloff {cutoff} tightness {light['exponent']}"
        cone += f" point_at {triple(target)} "
    colour = triple(light.get("intensity", 1.0))
    return f"light_source {{ {triple(place)} rgb {colour} {cone}}}"


def _shape(shape):
    """A unit sphere at the origin, or the square from -1 to 1 moved by a transform."""
    bsdf = shape["bsdf"]
    finish = (
        f"ambient {bsdf.get('k_a', 0.0)} diffuse {bsdf.get('k_d', 0.0)} brilliance 1"
        f" phong {bsdf.get('k_s', 0.0)} phong_size {bsdf.get('n', 1.0)}"
    )
    texture = f"texture {{ pigment {{ rgb 1 }} finish {{ {finish} }} }}"
    if shape["type"] == "sphere":
        return f"sphere {{ 0, 1 {texture} }}"
    to_world = np.eye(4) if "to_world" not in shape else np.array(shape["to_world"].matrix, float)
    corners = [to_world @ (x, y, 0, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    points = ", ".join(triple(corner[:3]) for corner in corners)
    return f"polygon {{ 5, {points} {texture} }}"


def triple(value):
    """Return a number, colour or vector as POV-Ray writes it."""
    value = value["value"] if isinstance(value, dict) else value
    return "<" + ", ".join(repr(float(part)) for part in np.broadcast_to(value, 3)) + ">"
