"""The schemes and layouts of both chapters, drawn from their equations: ``SHEETS`` of panels.

A panel is 3 wide and 1.65 high, with a surface at height 0 and mostly its point at the origin.
Directions are angles in degrees from the normal, to the right. Sources are circles, viewers
squares, as in chapter 8.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from drjit.auto import Array3f
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Polygon
from numpy.typing import ArrayLike, NDArray

import fotismos
from docs.figures.documents import draw
from docs.figures.model_figures import (
    COLOURS,
    FAINT,
    GROUND,
    HALO,
    INCIDENCE,
    OTHER,
    STYLE,
    arrow,
    at,
    lobe,
    seen,
    vector,
)
from fotismos.comparisons.departure.colour import to_srgb
from fotismos.comparisons.gallery.builtin import THREE_LIGHTS, VIEWER_A, VIEWER_C, WHITE_LIGHT

INK, LIGHT, GREY = "#1c1e21", COLOURS["L"], "#e3e5e8"
N, L, R, V = (rf"\mathbf{{{letter}}}" for letter in "nlrv")
"""Unit vectors of chapter 6."""

WIDE, TALL = 3.0, 2.0
"""Inches of a panel, with its title."""


def write() -> None:
    """Draw all sheets."""
    for name, panels in SHEETS.items():
        draw(f"models-{name}.svg", sheet(panels))


def sheet(panels: Mapping[str, Callable[[Axes], None]]) -> Figure:
    """Draw panels in two columns, each below its number and title."""
    rows = -(-len(panels) // 2)
    with rc_context(STYLE):
        figure = Figure(figsize=(2 * WIDE, TALL * rows), facecolor=GROUND)
        for place, (title, panel) in enumerate(panels.items()):
            row, column = divmod(place, 2)
            box = column / 2, 1 - (row + 1) / rows, 1 / 2, 1.65 / TALL / rows
            axes = figure.add_axes(box, xlim=(-1.5, 1.5), ylim=(-0.35, 1.3))
            axes.axis("off")
            axes.text(0.03, 1.05, title, size=12, transform=axes.transAxes)
            panel(axes)
    return figure


# --- Chapter 8 -------------------------------------------------------------------------------


def point_source(axes: Axes) -> None:
    """Draw rays of a near source, and the angle α at one point."""
    source = at(-45, 1.6)
    _bulge(axes)
    for x in (-1.2, -0.8, -0.4, 0.9):
        _ray(axes, source, (x, -0.09 * x**2))
    _line(axes, source, (0, 0))
    _mark(axes, "S", source, shift=(-0.15, 0))
    _incidence(axes, -45)


def parallel_beam(axes: Axes) -> None:
    """Draw the rays of a source at infinity."""
    _bulge(axes)
    for x in (-0.6, -0.3, 0.4, 0.8):
        x0, y0 = at(-45, 1.2)
        _ray(axes, (x + x0, y0), (x, -0.09 * x**2))
    _incidence(axes, -45)


def view_angle(axes: Axes) -> None:
    """Draw the element dE of a surface, and the cross-section dA of what a viewer sees of it."""
    beta, half = 50.0, 0.3
    across = np.array(at(beta + 90, half * np.cos(np.radians(beta))))
    _ground(axes)
    axes.plot((-half, half), (0, 0), color=OTHER, linewidth=4, solid_capstyle="butt")
    axes.text(-0.05, -0.2, "$dE$", color=OTHER, ha="center", size=14)
    for side in (-1, 1):
        start = side * half, 0.0
        _line(axes, start, start + 1.25 * np.array(at(beta)))
    middle = np.array(at(beta, 0.75))
    axes.plot(*np.transpose((middle - across, middle + across)), color=LIGHT, linewidth=3)
    axes.text(*(middle + 1.9 * across), "$dA$", color=LIGHT, ha="center", va="center", size=14)
    arrow(axes, "N", 0)
    arrow(axes, "V", beta)
    _angle(axes, "β", 0, beta, 0.45)
    _note(axes, "dE = dA / cos β")


def phong(axes: Axes) -> None:
    """Draw the vectors of chapter 8 with their angles, H, and Phong's lobe about R."""
    beta = 78.0
    _bulge(axes)
    lobe(axes, seen(INCIDENCE, k_s=1.0, n=81), COLOURS["R"], "")
    half = (beta - INCIDENCE) / 2
    for letter, angle in {"L": -INCIDENCE, "H": half, "N": 0, "V": beta, "R": INCIDENCE}.items():
        arrow(axes, letter, angle)
    _angle(axes, "α", -INCIDENCE, 0, 0.4)
    _angle(axes, "α", 0, INCIDENCE, 0.4, 0.62)
    _angle(axes, "β", 0, beta, 0.7, 0.36)
    _angle(axes, "β − α", INCIDENCE, beta, 0.88, size=12, beyond=0.25)


def layout(lights: Sequence, viewer: Sequence[float], names: str) -> Callable[[Axes], None]:
    """Return a panel of the unit sphere, its lights and the viewer, in a parallel projection."""

    def panel(axes: Axes) -> None:
        axes.set(xlim=(-4.75, 4.75), ylim=(-3.4, 1.825))
        turn = np.linspace(0, 2 * np.pi, 61)
        axes.add_patch(Circle((0, 0), 1, facecolor=GREY, edgecolor=FAINT))
        equator = _projected(np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1))
        axes.plot(*equator.T, color=FAINT, linewidth=0.8)
        for letter, end in {"x": (1.8, 0, 0), "y": (0, 1.8, 0), "z": (0, 0, 1.5)}.items():
            tip = _projected(end)
            axes.annotate("", tip, (0, 0), arrowprops={"arrowstyle": "->", "color": FAINT})
            axes.text(*(1.1 * tip), f"${letter}$", color=FAINT, ha="center", va="center")
        for name, (place, colour) in zip(names, lights, strict=True):
            _line(axes, (0, 0), _projected(place))
            fill = LIGHT if min(colour) else colour
            _placed(axes, f"{name} " * (len(lights) > 1), place, "o", fill)
        below = _projected((*viewer[:2], 0))
        _line(axes, (0, 0), below, _projected(viewer))
        _placed(axes, "", viewer, "s", "white")

    return panel


# --- Chapter 6: light and reflection ---------------------------------------------------------


def from_light_to_viewer(axes: Axes) -> None:
    """Draw a light, a point of a surface, and a viewer."""
    light, viewer = at(-40, 1.3), at(60, 1.3)
    _ground(axes)
    _line(axes, (0, 0), (0, 1.2))
    _ray(axes, light, (0, 0))
    _ray(axes, (0, 0), viewer)
    _mark(axes, "L", light)
    _mark(axes, "V", viewer, "s", (0.15, 0.1))
    axes.text(0, -0.22, "$S$", ha="center", size=14)
    _angle(axes, "θ_L", -40, 0, 0.5)
    _angle(axes, "θ_V", 0, 60, 0.5)


def point_light(axes: Axes) -> None:
    """Draw the diverging rays of a point light, and the distance of one point."""
    light = np.array((-0.5, 0.5))
    for angle in range(0, 360, 30):
        if angle != 90:
            _ray(axes, light + at(angle, 0.12), light + at(angle, 0.72))
    _line(axes, light, (1, 0.5))
    _mark(axes, "L", light, shift=(-0.2, 0.1))
    axes.plot(1, 0.5, ".", color=INK)
    axes.text(1.1, 0.5, "$P$", va="center", size=14)
    axes.text(0.55, 0.56, "$d$", size=14)


def directional_light(axes: Axes) -> None:
    """Draw parallel rays, which give all points one vector l."""
    _ground(axes)
    for x in np.arange(-0.6, 1.4, 0.4):
        x0, y0 = at(-35, 1.35)
        _ray(axes, (x + x0, y0), (x, 0))
    for x in (-0.2, 0.6):
        x0, y0 = at(-35, 0.75)
        vector(axes, L, (x + x0, y0), (x, 0))


def spot(axes: Axes) -> None:
    """Draw the cone of a spot, and a point in it."""
    omega, inside, light = 19.0, 10.0, np.array((-1.15, 0.45))
    edges = [light + at(90 + side * omega, 2.3) for side in (-1, 1)]
    axes.add_patch(Polygon([light, *edges], facecolor=LIGHT + "22"))
    for edge in edges:
        _line(axes, light, edge)
    point = light + at(90 - inside, 1.95)
    _line(axes, light, light + np.array((2.3, 0)))
    _line(axes, light, point)
    vector(axes, "v_L", light + np.array((0.8, 0)), light)
    vector(axes, "v_P", light + at(90 - inside, 1.25), light)
    _mark(axes, "L", light, shift=(-0.12, 0.12))
    axes.plot(*point, ".", color=INK)
    axes.text(*np.add(point, (0.1, 0.02)), "$P$", va="center", size=14)
    _angle(axes, "ω_L", 90, 90 + omega, 1.4, centre=light, beyond=0.18)
    _angle(axes, "ω_P", 90 - inside, 90, 1.6, centre=light, beyond=0.18)


def sun(theta: float) -> Callable[[Axes], None]:
    """Return a panel of equal beams on a floor, as bright as n·l."""

    def panel(axes: Axes) -> None:
        cosine = np.cos(np.radians(theta))
        axes.fill_between((-1.4, 1.4), -0.12, 0, color=str(round(cosine, 3)), edgecolor=FAINT)
        for step in range(-6, 7):
            x = 0.2 * step / cosine
            x0, y0 = at(-theta, 5)
            if abs(x) < 1.4:
                axes.plot((x, x + x0), (0, y0), color=LIGHT, linewidth=0.9)
        vector(axes, N, (0, 0.95))
        vector(axes, L, at(-theta, 0.95))
        _angle(axes, "θ", -theta, 0, 0.45)
        _note(axes, f"cos θ = {cosine:.2f}")

    return panel


def ball(**material: Any) -> Callable[[Axes], None]:
    """Return a panel of a ball, as the kernel shades it."""

    def panel(axes: Axes) -> None:
        x, y = np.meshgrid(np.linspace(-1, 1, 121), np.linspace(1, -1, 121))
        z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
        normal = Array3f(*(np.float32(part.ravel()) for part in (x, y, z)))
        light = fotismos.DirectionalLight(direction=(1, -1, -1.2), intensity=1.0)
        made = fotismos.Material(k_a=0.1, k_d=0.6, **material)
        value = fotismos.shade(normal, normal, Array3f(0, 0, 1), made, [light], 1.0)
        shown = to_srgb(np.clip(np.array(value, float), 0, 1)).reshape(x.shape)
        box = -0.78, 0.78, -0.3, 1.26
        drawn = axes.imshow(shown, "gray", vmin=0, vmax=1, extent=box, interpolation="none",
                            aspect="auto")  # fmt: skip
        drawn.set_clip_path(axes.add_patch(Circle((0, 0.48), 0.77, facecolor="none")))

    return panel


def lobe_angle(axes: Axes) -> None:
    """Draw the angle φ between the viewer and the mirrored ray."""
    _ground(axes)
    lobe(axes, seen(INCIDENCE, k_s=1.0, n=9), COLOURS["R"], "")
    for label, angle in {L: -INCIDENCE, N: 0, V: 20, R: INCIDENCE}.items():
        vector(axes, label, at(angle))
    _angle(axes, "φ", 20, INCIDENCE, 0.6)


def mirror(axes: Axes) -> None:
    """Draw r as n (l·n) and its distance to l, added once more (6.30, 6.31)."""
    foot = np.array((0, np.cos(np.radians(INCIDENCE))))
    _ground(axes)
    for label, angle in {L: -INCIDENCE, N: 0, R: INCIDENCE}.items():
        vector(axes, label, at(angle))
    _line(axes, at(-INCIDENCE), foot, at(INCIDENCE))
    for side in (-1, 0):
        _angle(axes, "θ", side * INCIDENCE, (side + 1) * INCIDENCE, 0.3)


# --- Chapter 6: triangles --------------------------------------------------------------------


def vertex_normal(axes: Axes) -> None:
    """Draw the normals of the faces around a vertex, and their mean (6.32)."""
    turn = np.radians(np.arange(5) * 72 - 130)
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn - 0.35], axis=1)
    shift = np.array((0, 0.43))
    faces = [(one, other) for one, other in zip(ring, np.roll(ring, -1, axis=0), strict=True)]
    normals = [_unit(np.cross(one, other)) for one, other in faces]
    for (one, other), normal in zip(faces, normals, strict=True):
        corners = _projected([(0, 0, 0), one, other]) + shift
        axes.add_patch(Polygon(corners, facecolor=GREY, edgecolor=FAINT))
        middle = (one + other) / 3
        start, end = _projected([middle, middle + 0.45 * normal]) + shift
        axes.annotate("", end, start, arrowprops={"arrowstyle": "->", "color": COLOURS["R"]})
    vector(axes, "n_v", _projected(0.75 * _unit(sum(normals))) + shift, shift)
    (one, other), normal = faces[-1], normals[-1]
    _labelled(axes, "n_1", _projected((one + other) / 3 + 0.45 * normal) + shift + (-0.3, 0))
    arc = [0.35 * _unit(one + part * (other - one)) for part in np.linspace(0, 1, 9)]
    axes.plot(*(_projected(arc) + shift).T, color=INK, linewidth=1)
    _labelled(axes, "θ_1", _projected(0.52 * _unit(one + other)) + shift)


CORNERS = {"A": (-0.2, 0.8), "B": (-0.85, -0.25), "C": (0.85, -0.15)}
TILTS = {"A": -5.0, "B": -50.0, "C": 45.0}
"""Degrees of the normals at the corners."""

SCAN = 0.35
"""Height of the scan line."""


def gouraud(axes: Axes) -> None:
    """Draw the points at which 6.35 and 6.36 interpolate."""
    for name, (place, _) in _interpolated(axes).items():
        x, y = {"A": (0.1, 0.08), "B": (-0.18, 0.05), "C": (0.1, 0.08), "D": (-0.18, 0.1),
                "E": (0.1, 0.08), "P": (-0.06, -0.22)}[name]  # fmt: skip
        side = "right" if x < -0.1 else "left"
        axes.text(place[0] + x, place[1] + y, f"${name}$: $I_{name}$", ha=side, size=13)


def phong_shading(axes: Axes) -> None:
    """Draw the normals that 6.37 and 6.38 interpolate."""
    for name, (place, normal) in _interpolated(axes).items():
        vector(axes, f"n_{name}", place + 0.32 * normal, place, 13)


def lost_highlight(axes: Axes) -> None:
    """Draw the kernel's value along a scan line, and Gouraud's between its ends (figure 6.14)."""
    place = np.linspace(-1.25, 1.25, 101)
    high = 1.2
    light = fotismos.PointLight(position=(-1.2, high, 0), intensity=1.0)
    view = Array3f(np.float32(1.2 - place), high, 0)
    made = fotismos.Material(k_d=0.2, k_s=0.6, n=40)
    value = fotismos.shade(Array3f(np.float32(place), 0, 0), Array3f(0, 1, 0), view, made, [light])
    shown = np.array(value, float)
    _ground(axes)
    axes.plot(place, shown, color=COLOURS["V"], linewidth=1.8)
    axes.plot(place[[0, -1]], shown[[0, -1]], color=COLOURS["R"], linewidth=1.8)
    axes.text(0.3, 0.55, "Phong", color=COLOURS["V"])
    axes.text(0.5, 0.2, "Gouraud", color=COLOURS["R"])
    _mark(axes, "", (-1.2, high))
    _mark(axes, "", (1.2, high), "s")


SHEETS: dict[str, dict[str, Callable[[Axes], None]]] = {
    "vectors": {
        "8.1 a  point source": point_source,
        "8.1 b  parallel beam": parallel_beam,
        "8.2  the view angle": view_angle,
        "8.3  Phong's model": phong,
        "8.4  layout of 8.5 to 8.8 a": layout(WHITE_LIGHT, VIEWER_A, "S"),
        "8.10  layout of 8.11": layout(THREE_LIGHTS, VIEWER_C, "RGB"),
    },
    "incidence": {"6.6  noon": sun(15), "6.6  evening": sun(75)},
    "gloss": {
        "6.7  matt": ball(),
        "6.7  glossy": ball(k_s=0.5, n=20),
        "6.8  the lobe": lobe_angle,
        "6.9  the mirror image": mirror,
    },
    "lights": {
        "6.1  light and viewer": from_light_to_viewer,
        "6.2  point light": point_light,
        "6.3  directional light": directional_light,
        "6.4  spot": spot,
    },
    "triangles": {
        "6.11  vertex normal": vertex_normal,
        "6.12  Gouraud shading": gouraud,
        "6.13  Phong shading": phong_shading,
        "6.14  on a scan line": lost_highlight,
    },
}
"""The figures of each sheet, with their numbers and titles."""


# --- Parts -----------------------------------------------------------------------------------


def _incidence(axes: Axes, angle: float) -> None:
    axes.text(0.05, -0.22, "$P$", size=14)
    arrow(axes, "N", 0)
    arrow(axes, "L", angle)
    _angle(axes, "α", angle, 0, 0.4)


def _bulge(axes: Axes) -> None:
    across = np.linspace(-1.35, 1.35, 40)
    axes.fill_between(across, -0.09 * across**2, -0.3, color=GREY)


def _ground(axes: Axes) -> None:
    axes.fill_between((-1.35, 1.35), -0.08, 0, color=GREY)


def _ray(axes: Axes, start: Any, end: Any) -> None:
    style = {"arrowstyle": "->", "color": LIGHT, "linewidth": 1, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=style)


def _line(axes: Axes, *places: Any) -> None:
    axes.plot(*np.transpose(places), color=FAINT, linewidth=1, linestyle="--", zorder=1)


def _mark(axes: Axes, label: str, place: Any, shape: str = "o", shift: Any = (-0.15, 0.1)) -> None:
    axes.plot(*place, shape, color=INK, markerfacecolor="white", markersize=7)
    _labelled(axes, label, np.add(place, shift))


def _labelled(axes: Axes, label: str, place: Any, size: float = 14) -> None:
    words = f"${label}$" if label else ""
    axes.text(*place, words, ha="center", va="center", size=size, path_effects=HALO)


def _note(axes: Axes, words: str) -> None:
    axes.text(1.42, -0.28, words, ha="right", size=11)


def _angle(
    axes: Axes,
    label: str,
    low: float,
    high: float,
    radius: float,
    part: float = 0.5,
    centre: ArrayLike = (0, 0),
    size: float = 14,
    beyond: float = 0.13,
) -> None:
    """Draw an arc between two directions, and its letter at a part of it."""
    arc = Arc(centre, 2 * radius, 2 * radius, theta1=90 - high, theta2=90 - low, color=INK)
    axes.add_patch(arc)
    x, y = np.add(centre, at(low + part * (high - low), radius + beyond))
    _labelled(axes, label, (x, y), size)


def _interpolated(axes: Axes) -> dict[str, tuple[NDArray, NDArray]]:
    """Draw a triangle with a scan line; return A to E and P with their normals."""
    known = {name: (np.array(CORNERS[name]), np.array(at(TILTS[name]))) for name in CORNERS}

    def between(one: str, other: str, part: float) -> tuple[NDArray, NDArray]:
        (p, n), (q, m) = known[one], known[other]
        return p + part * (q - p), _unit(n + part * (m - n))

    for name, corner in (("D", "B"), ("E", "C")):
        top, bottom = CORNERS["A"][1], CORNERS[corner][1]
        known[name] = between("A", corner, (top - SCAN) / (top - bottom))
    known["P"] = between("D", "E", 0.6)
    axes.add_patch(Polygon([*CORNERS.values()], facecolor=GREY, edgecolor=FAINT))
    _line(axes, (-1.35, SCAN), (1.35, SCAN))
    axes.plot(*np.transpose([place for place, _ in known.values()]), ".", color=INK)
    return known


def _placed(axes: Axes, name: str, place: Any, shape: str, fill: str) -> None:
    x, y = _projected(place)
    axes.plot(x, y, shape, color=INK, markerfacecolor=fill, markersize=7)
    words = name + "(" + ", ".join(f"{part:g}" for part in place).replace("-", "−") + ")"
    shift = (-0.35, 0.45) if y > -1 else (0, -0.45)
    axes.text(*np.add((x, y), shift), words, ha="center", va="center", size=10)


def _projected(places: Any) -> NDArray:
    """Return places (..., 3) in the plane of a picture, seen from the front, left and above."""
    azimuth, height = np.radians((-130, 27))
    right = -np.sin(azimuth), np.cos(azimuth), 0
    sine = -np.sin(height)
    up = sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(height)
    return np.asarray(places, float) @ np.transpose([right, up])


def _unit(vector: Any) -> Any:
    return vector / np.linalg.norm(vector)
