"""Rendering in independent passes, with mean, standard error and times.

Both halves of a pair are rendered pass by pass with the same sampler and seed. So the camera rays
of a pass are the same in both, and pixel filter and edges cancel in the difference. Passes differ
only in seed and are independent; samples within a pass are stratified and are not. So every
standard error here comes from the spread of passes.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass
from statistics import median
from time import perf_counter
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.arrays import Scene
from heuristic.errors import FotismosError, InputError, NonFiniteError
from reference.planning.plan import Plan
from reference.rendering import direct
from reference.rendering.albedo_table import AlbedoTable
from reference.rendering.gbuffer import image_size, resize
from reference.scene.preparation import PATHS

LARGEST_PASS = 2**26
"""Samples of one pass, and pixels of an image; `reference.rendering.memory` may allow fewer."""


ROUNDING = 1e-5
"""A value below 0 by less than this is a rounding error, in units of display white."""


@dataclass(frozen=True)
class PassTimes:
    """Times of the passes of one half, in seconds.

    ``first`` is the time of the first pass, which traces and compiles; ``compilation`` the part
    that LLVM took, almost nothing for kernels in Dr.Jit's cache on disk. ``median`` is of the
    passes after the first (or of the first if it is alone).
    """

    median: float
    first: float
    total: float
    compilation: float
    passes: int


class Renderer:
    """One half of a pair, ready to render passes in the variant that it was made in.

    Parameters
    ----------
    scene
        The Mitsuba scene.
    integrator
        A Mitsuba integrator; None takes the scene's own.
    spp
        Samples per pixel and pass.
    label
        Name in error messages.
    size
        Width and height to render in place of the film's, of the same shape; None keeps the film's.

    Attributes
    ----------
    replays
        Whether passes after the first replay its kernels, without tracing again.

    Raises
    ------
    InputError
        When rendering, for more samples in a pass than :data:`LARGEST_PASS`.
    """

    def __init__(
        self,
        scene: Scene,
        integrator: Any,
        spp: int,
        label: str,
        size: tuple[int, int] | None = None,
    ):
        self.scene = scene
        self.integrator = integrator or scene.integrator()
        self.spp = spp
        shading = getattr(self.integrator, "model", None)  # only the integrator `heuristic` has it
        self._is_users = shading is not None and not shading.is_own
        self.label = f"{label} ({shading.name})" if shading and self._is_users else label
        self.size = size
        self.variant = mi.variant()
        self.times: list[float] = []
        self.compilation = 0.0
        # A user's code may be impossible to record: NumPy ends the process.
        self._replayed = None if self._is_users else dr.freeze(_rendered)

    def render(self, seed: int) -> Any:
        """Render one pass and return it as a tensor (H, W, 3), noting the time.

        Raises
        ------
        InputError
            With Mitsuba's own reason if it cannot render the scene.
        NonFiniteError
            With the first pixel that is NaN or infinite, and their number.
        InputError
            Likewise if a user's heuristic gives negative light.
        """
        if self.size:
            resize(self.scene, self.size)
        self._require_room()
        with variant(self.variant), dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            begin = perf_counter()
            try:
                image = self._image(dr.opaque(mi.UInt32, seed))
                dr.eval(image)
                dr.sync_thread()
            except RuntimeError as error:
                chain = list(_chain(error))
                for own in chain:
                    if isinstance(own, FotismosError):
                        raise own from None
                reason = str(chain[-1]).strip()
                raise InputError(f"{self.label}: Mitsuba cannot render it: {reason}") from error
            self.times.append(perf_counter() - begin)
            kernels = dr.kernel_history([dr.KernelType.JIT])
        # The film keeps its developed image.
        self.scene.sensors()[0].film().clear()
        self.compilation += sum(kernel["backend_time"] for kernel in kernels) / 1000
        if image.shape[2] == 1:
            image = dr.repeat(image, 3, axis=2)
        if not dr.all(dr.isfinite(image.array)):
            require_finite(np.array(image), f"{self.label}, pass with seed {seed}")
        if self._is_users and dr.any(image.array < -ROUNDING) and not self._may_overshoot():
            require_light(np.array(image), f"{self.label}, pass with seed {seed}")
        return image

    @property
    def replays(self) -> bool:
        """See the class."""
        return self._replayed is not None

    def sampled(self, spp: int) -> "Renderer":
        """Return the same renderer with another number of samples."""
        other = copy(self)
        other.spp, other.times, other.compilation = spp, [], 0.0
        return other

    def _image(self, seed):
        """Render; later passes replay the kernels of the first if Dr.Jit can.

        It cannot if a plugin has arrays that it does not know of, such as Mitsuba's spectral
        tables.
        """
        given = self.scene, self.integrator, self.spp, seed
        if self._replayed is not None:
            try:
                if hasattr(self.integrator, "prepare"):
                    self.integrator.prepare(self.scene)
                with _no_collection():
                    return self._replayed(*given)
            except InputError:  # the scene cannot be prepared
                raise
            except Exception:  # a plugin's message is better when it is traced
                self._replayed = None
        return _rendered(*given)

    def _may_overshoot(self):
        """Return whether the film's filter has negative lobes."""
        found = self.scene.sensors()[0].film().rfilter().class_name()
        return not any(kind in found for kind in ("Box", "Tent", "Gaussian"))

    def _require_room(self):
        width, height = image_size(self.scene)
        if width * height * self.spp > LARGEST_PASS:
            raise InputError(
                f"{self.label}: {self.spp} samples per pixel of {width}x{height} pixels at once"
                f" are too many: at most {LARGEST_PASS} samples per pass are allowed."
                " Give fewer with --spp, or a smaller image with --resolution."
            )

    def pass_times(self) -> PassTimes:
        """Return the :class:`PassTimes` of the passes so far."""
        steady = self.times[1:] or self.times
        return PassTimes(
            median=median(steady),
            first=self.times[0],
            total=sum(self.times),
            compilation=self.compilation,
            passes=len(self.times),
        )


@contextmanager
def variant(name: str) -> Iterator[None]:
    """Switch to a Mitsuba variant for the block, unless it is the current one."""
    if name == mi.variant():
        yield
        return
    with mi.scoped_set_variant(name):
        yield


def physical_integrator(plan: Plan, scene: Scene, hide_emitters: bool) -> Any:
    """Make the integrator that a plan names, for the physical half's scene."""
    direct.register()
    description = {"type": plan.integrator, "hide_emitters": hide_emitters}
    if plan.integrator == "direct":
        return mi.load_dict(description)
    description["max_depth"] = plan.max_depth
    if plan.integrator in PATHS:
        return mi.load_dict(description | {"rr_depth": plan.rr_depth})
    names = ("shadows", "bsdf_samples", "light_samples")
    own = {name: getattr(plan, name) for name in names}
    integrator = mi.load_dict(description | own)
    # The effect left out may be the environment itself.
    if plan.tabulate_environment and scene.environment() is not None:
        integrator.environment_albedo = AlbedoTable(scene.shapes()[0].bsdf())
    return integrator


@contextmanager
def _no_collection():
    """Postpone garbage collection: during a recording it would end the process."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _rendered(scene, integrator, spp, seed):
    return mi.render(scene, integrator=integrator, spp=spp, seed=seed)


def _chain(error):
    """Yield an error, and those that led to it: Dr.Jit wraps errors of Python code."""
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


def require_finite(image: np.ndarray, layer: str) -> None:
    """Raise `NonFiniteError` if an image (H, W) or (H, W, C) holds a NaN or an infinity.

    The message gives the layer, the number of pixels and the first one as (x, y), counted from the
    top left in reading order.
    """
    finite = np.isfinite(image)
    if not finite.all():
        raise NonFiniteError(
            f"{layer}: {_wrong(image, finite, 'NaN or infinite')}. Look at the surface and the"
            " lights seen there: an infinite light or a degenerate mesh is the usual cause."
        )


def require_light(image: np.ndarray, layer: str) -> None:
    """Raise `InputError` if an image holds a value that is negative by more than rounding."""
    right = image >= -ROUNDING
    if not right.all():
        raise InputError(
            f"{layer}: {_wrong(image, right, 'negative')}. Light must be 0 or more: clamp what"
            " can be negative, such as drjit.maximum(cosine, 0)."
        )


def _wrong(image, right, what):
    """Return how many pixels are wrong, and the first."""
    wrong = ~right if right.ndim == 2 else ~right.all(axis=-1)
    place = np.unravel_index(np.argmax(wrong), wrong.shape)
    return (
        f"{np.count_nonzero(wrong)} of {wrong.size} pixels are {what}, the first at (x, y) ="
        f" ({', '.join(str(index) for index in reversed(place))}): {np.asarray(image)[place]}"
    )
