"""Small scenes that rules of pruning without premises get wrong, by 1 % to everything."""

from fotismos.reference.pairing.probe import AlbedoTable
from fotismos.reference.planning.decisions import RuleResult
from fotismos.reference.planning.rules import PruningRule
from tests.shared.parts import camera, moved

DIFFUSE = {"type": "diffuse", "reflectance": 0.7}
TWO_SIDED = {"type": "twosided", "bsdf": DIFFUSE}
BLACK = {"type": "diffuse", "reflectance": 0.0}
SKY = {"type": "constant", "radiance": 1.0}


def _blind(rule, facts):
    return RuleResult(name=rule.name, applies=True, premise="", evidence=rule.absent)


def prune_blindly(monkeypatch):
    """Take every premise for true, and know of front sides alone in the table of albedos."""
    at = AlbedoTable.at

    def at_the_front(self, mu):
        self.has_back = False
        return at(self, mu)

    monkeypatch.setattr(PruningRule, "check", _blind)
    monkeypatch.setattr(AlbedoTable, "at", at_the_front)


def scene(viewer=(0, -4, 0), target=(0, 0, 0), integrator="path", lens=None, size=32, **parts):
    """A scene seen from a point; ``lens`` has parameters of the sensor."""
    lens = lens or {}
    up = (0, 1, 0) if viewer[:2] == target[:2] else (0, 0, 1)
    size = 1 if lens.get("type") == "radiancemeter" else size
    sensor = camera(viewer, target, up, size, **lens)
    if sensor["type"] == "orthographic":
        sensor["to_world"] = sensor["to_world"].scale((3.0, 3.0, 1.0))
    integrator = integrator if isinstance(integrator, dict) else {"type": integrator}
    return {"type": "scene", "integrator": integrator, "sensor": sensor, **parts}


def sphere(bsdf=DIFFUSE, **more):
    """A unit sphere."""
    return {"type": "sphere", "bsdf": bsdf, **more}


def octahedron(path, faces=8, height=1.0):
    """Write an octahedron to a PLY file without normals, whole or with faces missing.

    Below 0 the height of its tip makes a dent.
    """
    points = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, height), (0, 0, -1)]
    corners = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5)]
    corners = [*corners, (0, 3, 5)][:faces]
    lines = ["ply", "format ascii 1.0", "element vertex 6"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += [f"element face {faces}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(str, row)) for row in points] + [f"3 {a} {b} {c}" for a, b, c in corners]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


def lamp(position, intensity=1.0):
    """A point light."""
    return {"type": "point", "position": position, "intensity": intensity}


def _behind():
    plate = {"type": "rectangle", "bsdf": TWO_SIDED}
    return scene(viewer=(0, 0, -4), plate=plate, sky=SKY)


def _cut_open():
    inside = lamp((0, 0, 0.3))
    return scene(lens={"near_clip": 4.0}, ball=sphere(TWO_SIDED), light=inside)


def _wide():
    """The camera stands beside the sphere; its ray plane goes through it."""
    inside = lamp((0, 0, 0.3))
    lens, ball = {"type": "orthographic"}, sphere(TWO_SIDED)
    return scene((2.5, 0, 0), (2.5, 1, 0), lens=lens, ball=ball, light=inside)


def _leaking():
    outside = lamp((0, -4, 0.3), 10.0)
    return scene((0, 0, 0), (0, 1, 0), "direct", ball=sphere(TWO_SIDED), light=outside)


def _dark_room():
    return scene((0, 0, 0), (0, 1, 0), "direct", ball=sphere(flip_normals=True), sky=SKY)


def _brushed():
    brushed = {"type": "roughconductor", "material": "Au", "alpha_u": 0.05, "alpha_v": 0.6}
    return scene(ball=sphere(brushed), sky=SKY)


def tube(scale, **ends):
    """A floor under a cylinder that shines, seen from above."""
    around = moved((0, 0, 1.2)).rotate((1, 0, 0), 40)
    lamp = {"type": "cylinder", "to_world": around.scale(scale), "bsdf": BLACK, **ends}
    lamp["emitter"] = {"type": "area", "radiance": 3.0}
    floor = {"type": "rectangle", "bsdf": TWO_SIDED, "to_world": moved(0, 3)}
    return scene((0, -3, 6), integrator="direct", floor=floor, tube=lamp)


SCENES = {
    "a two-sided rectangle seen from behind": _behind,
    "a two-sided sphere cut open by the near clip plane": _cut_open,
    "a two-sided sphere in the ray plane of an orthographic camera": _wide,
    "a camera inside a two-sided sphere, a point outside": _leaking,
    "a camera inside a sphere with flipped normals, light outside": _dark_room,
    "an anisotropic sphere": _brushed,
    "a mirrored cylinder that shines": lambda: tube((0.5, 0.5, -0.5)),
}
"""By what is wrong in them; a function each, since transforms belong to a variant."""
