"""Pictures in place of the heuristic half: their size, their passes, their position."""

from dataclasses import replace
from time import perf_counter

import mitsuba as mi
import numpy as np

from comparisons.options import Options
from comparisons.pictures import picture_files, registration
from comparisons.pictures.registration import Registration
from heuristic.errors import InputError
from reference.rendering.renderer import PassTimes, Renderer
from reference.scene.preparation import film_size
from reference.scene.source import Source

TEMPLATE_SPP = 16
"""Samples per pixel of the image whose edges are compared with a picture's."""


class Pictured:
    """Pictures as the passes of a heuristic half, one after another.

    Several are repeats, whose spread gives the noise; a single one serves for every pass.

    Parameters
    ----------
    images
        Linear, (H, W, 3) each.
    half
        The heuristic half that they replace.
    """

    def __init__(self, images: list[np.ndarray], half: Renderer) -> None:
        self.images, self.half = images, half
        self.variant = half.variant
        self.times: list[float] = []
        self.compilation = 0.0

    def render(self, seed: int) -> mi.TensorXf:
        """Return the next picture; the seed is ignored."""
        begin = perf_counter()
        image = mi.TensorXf(self.images[len(self.times) % len(self.images)])
        self.times.append(perf_counter() - begin)
        return image

    def pass_times(self) -> PassTimes:
        """Return the times of reading the pictures."""
        total = sum(self.times)
        return PassTimes(total / len(self.times), self.times[0], total, 0.0, len(self.times))

    def located(self, scene: mi.Scene) -> Registration:
        """Return the position of the pictures relative to a scene's camera.

        Raises
        ------
        InputError
            When they are flipped or rotated.
        """
        mean = np.mean(self.images, axis=0)
        height, width = mean.shape[:2]
        self.half.spp = TEMPLATE_SPP
        template = np.array(self.half.render(0), float)
        edges = registration.geometry_edges(scene, width, height)
        return registration.measure(mean, [edges, registration.picture_edges(template)])


def read(options: Options) -> list[np.ndarray]:
    """Return the pictures that options name, all of one size.

    Raises
    ------
    InputError
        When their sizes differ, or there are several but an odd number.
    """
    images = [picture_files.read(word, options.transfer) for word in options.image]
    sizes = {image.shape[:2] for image in images}
    if len(sizes) > 1:
        shown = ", ".join(f"{width}x{height}" for height, width in sorted(sizes))
        raise InputError(f"pictures of {shown}: give repeats of one size.")
    if len(images) > 1 and options.noise is not None:
        raise InputError(
            f"noise = {options.noise:g} and {len(images)} repeats: a noise target may need more"
            " passes than there are pictures. Give --spp instead of --noise."
        )
    if len(images) > 1 and len(images) % 2:
        raise InputError(
            f"{len(images)} repeats: give one, or an even number, whose halves give the noise."
        )
    return images


def sized(source: Source, options: Options) -> Options:
    """Return options with the resolution of their pictures.

    Raises
    ------
    InputError
        When the scene's film has another aspect ratio, or another resolution is requested.
    """
    height, width = read(options)[0].shape[:2]
    own = film_size(source.parse(), options.sensor)
    film = options.resolution or own
    if options.resolution and film != (width, height):
        raise InputError(
            f"{options.image[0]}: it has {width}x{height} pixels, and --resolution"
            f" {film[0]}x{film[1]} is requested. Omit the option."
        )
    if abs(width * film[1] - height * film[0]) > max(film):  # more than a pixel
        raise InputError(
            f"{options.image[0]}: it has {width}x{height} pixels, an aspect ratio of"
            f" {width / height:.4g}, and the scene's film {film[0]}x{film[1]},"
            f" {film[0] / film[1]:.4g}. Render the picture with the scene's camera, or ignore the"
            f" film's size with --resolution {width}x{height}."
        )
    return replace(options, resolution=(width, height))
