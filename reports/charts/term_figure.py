"""Equation 8.10 at a pixel for notebooks and docs: the vectors and lobes as SVG, the terms as HTML.

The page's own version of the figure is ``reports/page/templates/viewer/vectors.js``.
"""

from collections.abc import Iterator, Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from comparisons.departure.spaces import luminance
from comparisons.terms import polar
from comparisons.terms.term_grid import LightTerms, PixelTerms, TermMaterial
from reports.terminal.printing import number

VECTOR, LOBE = 150, 165
"""Lengths of a vector and of the longest radius."""

COLOURS = {"N": "#1c1e21", "L": "#b97b00", "R": "#0067a8", "V": "#00795a", "physical": "#b0426f"}

VIEWS = np.arange(-90, 91, 1.5)
"""Degrees from the normal at which the textbook lobe is drawn."""


def strongest(point: PixelTerms) -> LightTerms | None:
    """Return the light that contributes most at a point; None if none reaches its side."""
    lit = [light for light in point.lights if light.cos_incidence > 0]
    return max(lit, key=lambda one: luminance(np.add(one.diffuse, one.specular)), default=None)


def textbook_lobe(material: TermMaterial, incidence: float) -> NDArray[np.float64]:
    """Return the luminance of ``k_d (N·L) + k_s (R·V)^n`` at `VIEWS`, for intensity 1."""
    share = 0.5 if material.form == "blinn" else 1.0
    cosine = np.maximum(np.cos(np.radians(share * (VIEWS - incidence))), 0)
    k_d, k_s = luminance(material.k_d), luminance(material.k_s)
    return k_d * np.cos(np.radians(incidence)) + k_s * cosine**material.n


def physical_lobe(table: NDArray[np.float64], incidence: float) -> NDArray[np.float64]:
    """Interpolate a table of :mod:`comparisons.terms.polar` at an incidence in degrees."""
    columns = [np.interp(incidence, polar.INCIDENCES, column) for column in table.T]
    return np.array(columns)


def svg(point: PixelTerms) -> str:
    """Return N, L, R and V in the plane of incidence, and both lobes on one scale."""
    light = strongest(point)
    parts = ['<rect x="-240" y="-205" width="480" height="255" fill="#fcfcfb"/>']
    parts += ['<path d="M-180 32Q0 -32 180 32Z" fill="#f3f4f5" stroke="#585f67"/>']
    vectors = {"N": (0.0, 1.0)}
    if light is None:
        vectors["V"] = (_sine(point.cos_view), point.cos_view)
    else:
        cosine, sine = light.cos_incidence, _sine(light.cos_incidence)
        along = (cosine * point.cos_view - light.cos_view) / sine if sine > 1e-4 else 0.0
        vectors |= {"L": (-sine, cosine), "R": (sine, cosine), "V": (along, point.cos_view)}
        parts += _lobes(point.material, float(np.degrees(np.arccos(min(cosine, 1.0)))))
    parts += [_vector(letter, *place) for letter, place in vectors.items()]
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="-240 -205 480 255" width="480"'
        ' role="img" aria-label="Vectors and lobes">' + "".join(parts) + "</svg>"
    )


def html(point: PixelTerms, reference: Sequence[float], error: float) -> str:
    """Return the figure, and the terms in a table with the reference and its standard error."""
    rows = [*_rows(point), (f"physical reference, ± {number(error)}", tuple(reference))]
    body = "".join(
        f"<tr><th>{escape(name)}</th>" + "".join(f"<td>{number(v)}</td>" for v in values) + "</tr>"
        for name, values in rows
    )
    head = "<tr><th>Term</th><th>R</th><th>G</th><th>B</th></tr>"
    place = f"Pixel {point.pixel[0]}, {point.pixel[1]}: {escape(point.material.name)}"
    return f"<div><p>{place}</p>{svg(point)}<table>{head}{body}</table></div>"


def _rows(point: PixelTerms) -> Iterator[tuple[str, tuple[float, ...]]]:
    yield "emission k_i", point.emission
    yield "ambient I_a k_a", point.ambient
    for light in point.lights:
        factors = f"{light.name}, f_att = {number(light.attenuation)}"
        yield f"diffuse, {factors}, N·L = {number(light.cos_incidence)}", light.diffuse
        yield f"specular, {factors}, R·V = {number(light.cos_reflection)}", light.specular
    if any(point.others):
        yield "other lights", point.others
    yield "textbook, the sum", point.total


def _lobes(material: TermMaterial, incidence: float) -> list[str]:
    lobes = {"R": (VIEWS, textbook_lobe(material, incidence))}
    if material.physical is not None:
        views = polar.view_angles(incidence)
        lobes["physical"] = (views, physical_lobe(material.physical, incidence))
    top = max(values.max() for _, values in lobes.values()) or 1.0
    return [_lobe(kind, views, LOBE * values / top) for kind, (views, values) in lobes.items()]


def _lobe(kind: str, degrees: NDArray, radius: NDArray) -> str:
    angle = np.radians(degrees)
    points = np.column_stack((radius * np.sin(angle), -radius * np.cos(angle)))
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    colour, dashes = COLOURS[kind], ' stroke-dasharray="5 4"' if kind == "physical" else ""
    return (
        f'<polygon points="0,0 {path}" fill="{colour}" fill-opacity=".15"'
        f' stroke="{colour}"{dashes}/>'
    )


def _vector(letter: str, x: float, y: float) -> str:
    size = np.hypot(x, y) or 1.0
    to = VECTOR * x, -VECTOR * y
    away = 31 if letter == "V" else 16  # V often lies next to R or N
    at = to[0] + away * x / size, to[1] - away * y / size + 5
    colour = COLOURS[letter]
    return (
        f'<line x2="{to[0]:.1f}" y2="{to[1]:.1f}" stroke="{colour}" stroke-width="2.5"/>'
        f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" fill="{colour}" text-anchor="middle"'
        f' font-family="Georgia, serif" font-style="italic" font-size="17">{letter}</text>'
    )


def _sine(cosine: float) -> float:
    return float(np.sqrt(max(0.0, 1 - cosine**2)))
