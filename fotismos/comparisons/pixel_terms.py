"""Equation 8.10 term by term, as the kernel has it: at a grid of pixels, and as images.

Those of the grid are at the centres of pixels, one in the middle of each cell; a column and a row
may be moved to a pixel of interest.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fotismos.comparisons.departure.blocks import shrunk
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.images import (
    GridLight,
    LivePoints,
    TermGrid,
    TermMaterial,
    Whole,
    colour,
)
from fotismos.heuristic import kernel, materials, terms, vectors
from fotismos.heuristic.convention import Floats, Scene
from fotismos.heuristic.heuristics import Interpolation
from fotismos.heuristic.kernel import LightContribution
from fotismos.heuristic.lights import lamps
from fotismos.heuristic.materials import COEFFICIENTS, FORMS, Material
from fotismos.reference.records import Missing
from fotismos.reference.rendering.gbuffer import centre_rays, pixel_rays
from fotismos.reference.rendering.passes import pass_seed
from fotismos.reference.rendering.renderer import Renderer, variant

SIDE = 64
"""Points along the longer side of the grid, at most."""

VALUES = 8192
"""Points times lights, at most: more lights leave a coarser grid."""

LIGHTS = 4
"""Lights with separate terms: the strongest ones. The others are summed."""

MOST_LIGHTS = 64
"""With more lights there are no terms: each of them takes as long as a pass."""

MATERIALS = 256
"""Different sets of coefficients, at most: textures have more."""

TOO_MANY_MATERIALS = Missing(f"Its textures make more than {MATERIALS} different materials.")

LIVE_SIDE = 128
"""Points along the longer side of the film on which a page shades again, at most."""

LIVE_LIGHTS = 16
"""Lights that a page shades with, at most."""

SAME = 1e-3
"""Largest difference of normals that are the same for the page."""

MODELS = "phong", "blinn"
"""The heuristics that are the sum of 8.10."""


# --- Reading the kernel ------------------------------------------------------------------------


def trace(
    half: Renderer, options: Options, pixel: tuple[int, int] | None = None
) -> TermGrid | Missing:
    """Return the terms of a heuristic half, or why there are none.

    The grid's column and row nearest to a ``pixel`` are moved to it.
    """
    with variant(half.variant):
        if reason := _without(half, options, Interpolation.PHONG):
            return Missing(reason)
        return _traced(half, pixel)


def live(half: Renderer, options: Options) -> LivePoints | Missing:
    """Return what a page needs to shade a textbook half again, or why it cannot.

    Flat shading has the face's normal, at each point in place of the face's centre.
    """
    with variant(half.variant):
        if reason := _without(half, options, Interpolation.PHONG, Interpolation.FLAT):
            return Missing(reason)
        return _live(half, options)


def _without(half: Renderer, options: Options, *allowed: Interpolation) -> str:
    """Return why equation 8.10 does not describe a half's shading; empty if it does."""
    if reason := _without_sum(half, options):
        return reason
    if options.polygon_shading not in allowed:
        shading = options.polygon_shading.value.capitalize()
        return f"{shading} shading does not evaluate 8.10 at pixels."
    if half.integrator.occlusion:
        return "Shadow rays hide lights, and equation 8.10 has no shadows."
    if mi.is_spectral:
        return "The textbook half is rendered by wavelength, so its terms are not RGB."
    if any(bsdf.is_clear for bsdf in half.integrator.known(half.scene).materials.bsdfs):
        return "Some surfaces are transparent, so a pixel shows several of them at once."
    return ""


def _without_sum(half: Renderer, options: Options) -> str:
    """Return why a half has no terms in any form; empty if it has."""
    if options.heuristic not in MODELS:
        return f"The heuristic {options.heuristic} is not the sum of equation 8.10."
    if len(half.scene.emitters()) > MOST_LIGHTS:
        return f"There are more than {MOST_LIGHTS} lights."
    return ""


def _live(half: Renderer, options: Options) -> LivePoints | Missing:
    scene = half.scene
    emitters = lamps(scene)
    sensor = scene.sensors()[0]
    if len(emitters) > LIVE_LIGHTS:
        return Missing(f"There are more than {LIVE_LIGHTS} lights.")
    if not isinstance(sensor, mi.ProjectiveCamera):
        return Missing(f"The camera, {sensor.class_name()}, has no plane film.")
    size = shrunk(half.size, LIVE_SIDE)
    ray = centre_rays(scene, size, film=half.size)
    ahead = sensor.world_transform() @ mi.Vector3f(0, 0, 1)
    # Directions that end on a plane are linear over the film: three corners give all others.
    film = (ray.o, ray.d / dr.dot(ray.d, ahead))
    corners = [0, size[0] - 1, -size[0]]
    points = _Points(scene, half.integrator, ray)
    if not points.hit.any():
        return Missing("No pixel’s centre sees a shaded surface.")
    materials, places = points.materials()
    vectors = dict[str, Floats]()
    # Many materials may be one with a texture: diffuse colours get planes of their own.
    if len(materials) > MATERIALS:
        vectors["k_d"] = points.select(lambda material: points.colours(material.k_d))
        has_ambient = points.colours(points.ambient).any()  # else k_a, too, does not matter
        materials, places = points.materials(("k_d",) if has_ambient else ("k_a", "k_d"))
        if len(materials) > MATERIALS:
            return TOO_MANY_MATERIALS
    si = points.si
    vectors["normal"] = points.colours(points.normal)
    face = points.colours(dr.mulsign(si.n, dr.dot(si.n, points.view)))
    if abs(face - vectors["normal"])[points.hit].max() > SAME:
        vectors["face_normal"] = face
    planes = {"material": places + 1, "depth": np.log(points.floats(si.t))}
    for name, vector in vectors.items():
        planes |= {f"{name}.{axis}": vector[:, i] for i, axis in enumerate("xyz")}

    def numbers(emitter: Any) -> dict[str, Any]:
        light = emitter.light(dr.zeros(mi.SurfaceInteraction3f), True)
        fields = light.given()
        for name, end in (("diffuse_intensity", 0), ("specular_intensity", -1)):
            fields[name] = points.colours(light.intensities[end])[0]
        return {name: np.ravel(v).tolist() for name, v in fields.items()} | {"name": emitter.id()}

    return LivePoints(
        planes={name: plane.reshape(size[::-1]) for name, plane in planes.items()},
        materials=materials,
        lights=tuple(map(numbers, emitters)),
        rays=[points.colours(vectors_of_rays)[corners].tolist() for vectors_of_rays in film],
        is_flat=options.polygon_shading is Interpolation.FLAT,
    )


def _traced(half: Renderer, pixel: tuple[int, int] | None) -> TermGrid | Missing:
    emitters = lamps(half.scene)
    resolution = half.size
    columns, rows = _pixels(resolution, min(max(len(emitters), 1), LIGHTS))
    if pixel:
        columns[pixel[0] * len(columns) // resolution[0]] = pixel[0]
        rows[pixel[1] * len(rows) // resolution[1]] = pixel[1]
    x, y = np.meshgrid(columns, rows)
    points = _Points(
        half.scene, half.integrator, pixel_rays(half.scene, resolution, x=x, y=y, film=resolution)
    )
    materials, places = points.materials()
    if len(materials) > MATERIALS:
        return TOO_MANY_MATERIALS
    shape = len(rows), len(columns)
    lights = [points.light(emitter, shape) for emitter in emitters]
    cos_view = points.floats(dr.dot(points.normal, points.view)).reshape(shape)
    places = places.reshape(shape)
    grid = TermGrid(
        resolution=resolution,
        columns=columns,
        rows=rows,
        materials=materials,
        material=places,
        cos_view=cos_view,
        lights=tuple(lights),
    )
    if len(lights) <= LIGHTS:
        return grid
    # The strongest over the whole grid, in the scene's order; the others become one sum.
    images = [grid.light_image(light) for light in lights]
    order = np.argsort([-image.sum() for image in images], kind="stable")
    strongest = sorted(order[:LIGHTS])
    others = sum(images[number] for number in order[LIGHTS:])
    return replace(grid, lights=tuple(lights[number] for number in strongest), others=others)


def _pixels(resolution: tuple[int, int], lights: int) -> tuple[Whole, Whole]:
    """Return the columns and rows of the pixels in the middles of the cells."""
    longest = min(SIDE, int((VALUES / 2 / lights) ** 0.5) if lights > 2 else SIDE)
    across, down = shrunk(resolution, longest)
    width, height = resolution
    columns = (2 * np.arange(across) + 1) * width // (2 * across)
    rows = (2 * np.arange(down) + 1) * height // (2 * down)
    return columns, rows


ROW = {
    "number": slice(0, 1), "k_i": slice(1, 4), "k_a": slice(4, 7), "k_d": slice(7, 10),
    "k_s": slice(10, 13), "n": slice(13, 14), "form": slice(14, 15), "ambient": slice(15, 18),
}  # fmt: skip
"""The columns of a point's numbers: its material, of which ``number`` is the index, and light."""


class _Points:
    """The kernel's arguments at the points that rays see."""

    def __init__(self, scene: Scene, integrator: Any, ray: Any) -> None:
        self.si = scene.ray_intersect(ray)
        normal, is_shaded = integrator.seen_side(scene, self.si, self.si.is_valid())
        self.hit = np.array(self.si.is_valid() & is_shaded)
        self.position, normal, view = kernel.checked_vectors(self.si.p, normal, mi.Vector3f(-ray.d))
        self.normal, self.view = vectors.normalise(normal), vectors.normalise(view)
        dr.eval(self.si, self.position, self.normal, self.view)  # else each value intersects again
        self.known = integrator.known(scene).materials
        self.present = self.known.at(self.si, self.si.is_valid())
        self.ambient = integrator.ambient_at(self.si, self.si.is_valid())

    def floats(self, value: Any) -> NDArray[np.float64]:
        """Return a value of each point, (N,)."""
        return np.array(mi.Float(value) + dr.zeros(mi.Float, len(self.hit)), np.float64)

    def colours(self, value: Any) -> NDArray[np.float64]:
        """Return a colour of each point, (N, 3)."""
        value = materials.as_array(value, mi.Vector3f)
        value = value[0] if dr.depth_v(value) > 1 and len(value) == 1 else value
        return np.array(mi.Color3f(value) + dr.zeros(mi.Color3f, len(self.hit)), np.float64).T

    def select(self, read: Callable[[Material], Floats]) -> NDArray[np.float64]:
        """Return numbers read from the material at each point, (N, C)."""
        total = np.zeros(())
        for material, mask in self.present:
            here = np.array(mi.Bool(mask) & dr.full(mi.Bool, True, len(self.hit)))[:, None]
            total = total + np.where(here, read(material), 0.0)
        return total

    def materials(self, ones: Sequence[str] = ()) -> tuple[tuple[TermMaterial, ...], Whole]:
        """Return the different materials, with 1 for some of `ROW`, and each point's index."""
        # A row of numbers for each point (`ROW`): points with equal rows share a material.
        number = self.floats(self.known.index(self.si, self.si.is_valid()))
        rows = np.column_stack((number, self.select(self._row), self.colours(self.ambient)))
        for name in ones:
            rows[:, ROW[name]] = 1
        different, places = np.unique(rows[self.hit], axis=0, return_inverse=True)
        numbers = np.full(len(self.hit), -1)
        numbers[self.hit] = places.ravel()
        return tuple(map(self._material, different.tolist())), numbers

    def _row(self, material: Material) -> NDArray[np.float64]:
        colours = [self.colours(getattr(material, name)) for name in COEFFICIENTS]
        form = np.full(len(self.hit), FORMS.index(material.form))
        return np.column_stack((*colours, self.floats(material.n), form))

    def _material(self, row: list[float]) -> TermMaterial:
        parts = {name: row[columns] for name, columns in ROW.items()}
        (number,) = parts["number"]
        (n,) = parts["n"]
        (form,) = parts["form"]
        return TermMaterial(
            name=self.known.bsdfs[int(number)].id(),
            k_i=colour(parts["k_i"]),
            k_a=colour(parts["k_a"]),
            k_d=colour(parts["k_d"]),
            k_s=colour(parts["k_s"]),
            n=n,
            form=FORMS[int(form)],
            ambient=colour(parts["ambient"]),
        )

    def light(self, emitter: Any, shape: tuple[int, int]) -> GridLight:
        """Return a light at all points."""
        light = emitter.light(self.si, self.si.is_valid())

        def contribution(material: Material) -> LightContribution:
            # The kernel leaves out what has a coefficient of 0, and its cosine with it.
            material = replace(material, k_d=1, k_s=1)
            one = kernel.contributions(
                self.position, self.normal, self.view, material=material, lights=[light]
            )
            return next(one)

        def lobe(material: Material) -> Floats:
            cosine = contribution(material).cos_lobe
            if cosine is None:  # a mirror shows no light
                return np.zeros((len(self.hit), 1))
            return self.floats(terms.specular(1, 1, cosine, material.n))[:, None]

        # Where and how light arrives is one for all materials.
        shared = contribution(Material())
        arrival = shared.arrival
        # Both intensities in a row; the largest number tells what they have in common.
        intensity = np.hstack([self.colours(light.intensities[end])[0] for end in (0, -1)])
        brightest = int(np.argmax(intensity))
        arriving = np.hstack([self.colours(arrival.diffuse), self.colours(arrival.specular)])
        scale = arriving[:, brightest]
        scale /= intensity[brightest] or 1.0
        cos_view = self.floats(dr.dot(arrival.toward, self.view))
        return GridLight(
            name=emitter.id(),
            intensity=colour(intensity[:3]),
            specular_intensity=colour(intensity[3:]),
            attenuation=scale.reshape(shape),
            cos_incidence=self.floats(shared.cos_incidence).reshape(shape),
            cos_view=cos_view.reshape(shape),
            lobe=self.select(lobe).reshape(shape),
        )


# --- As images ---------------------------------------------------------------------------------


TERMS = dict(zip(("emission", "ambient", "diffuse", "specular"), COEFFICIENTS, strict=True))
"""The coefficient of each term."""


def layers(half: Renderer, options: Options, whole: Floats) -> dict[str, Floats]:
    """Return the terms of a textbook half as layers that add up to its image ``whole``, (H, W, 3).

    Each has its share of the half's first pass, rendered once more: all passes would add a quarter
    to some runs, and AOVs lengthen the passes, whose times are compared. Backgrounds are emission.
    Other heuristics have no such terms, and more than :data:`MOST_LIGHTS` lights get none.
    """
    if _without_sum(half, options):
        return {}
    integrator = half.integrator
    scene = half.scene
    hidden = integrator.hide_emitters
    images = dict.fromkeys(TERMS, 0 * whole)
    with variant(half.variant):
        bsdfs = integrator.known(scene).materials.bsdfs
        there = {k for bsdf in bsdfs for k in bsdf.present}
        if scene.environment():
            there.add("k_i")
        names = [name for name, k in TERMS.items() if k in there]
        renderers: dict[bool, Renderer] = {}
        try:
            for name in names:
                kept = TERMS[name]
                # Opaque, so all terms have one kernel.
                integrator.shares = {k: dr.opaque(mi.Float, k == kept) for k in COEFFICIENTS}
                integrator.hide_emitters = hides = hidden or name != "emission"
                renderer = renderers.setdefault(
                    hides,
                    Renderer(
                        scene, integrator, pass_spp=half.pass_spp, label="terms", size=half.size
                    ),
                )
                images[name] = np.array(renderer.render(pass_seed(options.seed, 0)))
        finally:
            integrator.shares = None
            integrator.hide_emitters = hidden
    # Shares of the image; the last term is what the others leave, so that the sum is exact.
    together = sum(images.values())
    rest = whole
    for name in names[:-1]:
        share = np.divide(images[name], together, out=0 * whole, where=together != 0)
        images[name] = whole * share.clip(0, 1)
        rest = rest - images[name]
    images[names[-1] if names else "emission"] = rest
    return {f"term.{name}": image for name, image in images.items()}
