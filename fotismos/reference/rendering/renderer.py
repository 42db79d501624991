"""Renderers: sources of passes that Mitsuba renders, with their times.

Samples within a pass are stratified; passes are independent.
"""

import gc
import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from copy import copy
from pathlib import Path
from time import perf_counter, process_time
from types import CodeType, FunctionType
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic.convention import Scene
from fotismos.heuristic.errors import FotismosError, InputError
from fotismos.reference.records import Times
from fotismos.reference.rendering.gbuffer import image_size, resize
from fotismos.reference.rendering.passes import (
    LARGEST_VALUE,
    Size,
    Stream,
    pass_seed,
    require_finite,
    wrong_pixels,
)
from fotismos.reference.scene.messages import plain_message

try:
    import resource
except ImportError:  # Windows, which limits no process
    HAS_LIMITS = False
else:
    HAS_LIMITS = True

LOGGER = logging.getLogger(__name__)
"""Receives why passes cannot be replayed."""

LARGEST_PASS = 2**26
"""Samples of one pass, and pixels of an image; memory may allow fewer."""

BYTES_A_PIXEL = 550
"""At the peak of a comparison: 525 measured between 512 x 512 and 1400 x 1400 pixels."""

BASE = 200 * 2**20
"""Memory that a comparison of any size takes, in addition to the process before it."""


WARM = 2
"""Images before those that are timed: the first traces and compiles, the second warms caches."""

ROUNDING = 1e-5
"""A value below 0 by less than this is a rounding error, in units of display white."""


class Renderer:
    """One half of a pair, ready to render passes in the variant that it was made in.

    ``integrator`` None takes the scene's own; ``pass_spp`` are samples per pixel and pass; ``size``
    is that of its passes unless they are given another of the same shape, and the film's if
    omitted. A film has the size of the last pass of any renderer. Passes replay the kernels of the
    first of their size, unless the integrator's code ``is_traced`` at each. ``warnings`` of its
    pair explain pixels that are not finite.
    """

    def __init__(
        self,
        scene: Scene,
        integrator: Any,
        pass_spp: int,
        label: str,
        size: Size | None = None,
        is_traced: bool = False,
        warnings: Sequence[str] = (),
    ):
        self.scene = scene
        self.integrator = integrator or scene.integrator()
        self.pass_spp = pass_spp
        shading = getattr(self.integrator, "model", None)  # only the integrator `heuristic` has it
        self._is_users = shading is not None and not shading.is_builtin
        self.label = f"{label} ({shading.name})" if shading and self._is_users else label
        self.size = size or image_size(scene)
        self.variant = mi.variant()
        self.times: list[float] = []
        self.processor_times: list[float] = []
        self.kernel_times: list[float] = []
        self.compilation = 0.0
        self.warnings = warnings
        # A user's code may be impossible to record: NumPy ends the process. Mitsuba's tables of the
        # eye's sensitivity always are: they are no inputs that Python could name.
        is_traced = is_traced or self._is_users or mi.is_spectral
        self._replayed = None if is_traced else dr.freeze(_rendered, warn_after=100)

    def active(self) -> AbstractContextManager[None]:
        """Return a context in its variant, for several passes."""
        return variant(self.variant)

    def passes(
        self, count: int, size: Size | None = None, stream: Stream = Stream.COMPARED, seed: int = 0
    ) -> Iterator[Any]:
        """Yield ``count`` passes of a size, which is its own if omitted; see :meth:`render`."""
        for number in range(count):
            yield self.render(pass_seed(seed, number, stream), size)

    def render(self, seed: int, size: Size | None = None) -> Any:
        """Render one pass and return it as a tensor (H, W, 3), noting the time."""
        size = size or self.size
        width, height = size
        if width * height * self.pass_spp > LARGEST_PASS:
            raise InputError(
                f"{self.label}: {self.pass_spp} samples per pixel of {width}x{height} pixels at"
                f" once are too many: at most {LARGEST_PASS} samples per pass are allowed."
                " Give a smaller `spp` or `resolution`."
            )
        # The pass, timed with its evaluation.
        with variant(self.variant), dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            resize(self.scene, size)
            _reset(self.scene)
            dr.kernel_history_clear()
            begin = perf_counter()
            used = process_time()
            try:
                image = self._image(dr.opaque(mi.UInt32, seed), size)
                dr.eval(image)
                dr.sync_thread()
            except RuntimeError as error:
                chain = list(_chain(error))
                for cause in chain:
                    if isinstance(cause, FotismosError):
                        raise cause from None
                reason = plain_message(chain[-1])
                raise InputError(f"{self.label}: Mitsuba cannot render it: {reason}") from error
            self.times.append(perf_counter() - begin)
            self.processor_times.append(process_time() - used)
            kernels = dr.kernel_history([dr.KernelType.JIT])
        # Dr.Jit counts milliseconds.
        self.compilation += sum(kernel["backend_time"] for kernel in kernels) / 1000
        self.kernel_times.append(sum(kernel["execution_time"] for kernel in kernels) / 1000)
        # A variant of one channel.
        if image.shape[2] == 1:
            image = dr.repeat(image, 3, axis=2)
        layer = f"{self.label}, pass with seed {seed}"
        # Written so that a NaN fails it too.
        if not dr.all(dr.abs(image.array) <= LARGEST_VALUE):
            pixels = np.array(image)
            require_finite(pixels, layer, self.warnings)
            wrong = wrong_pixels(pixels, np.abs(pixels) <= LARGEST_VALUE, "too bright")
            raise InputError(
                f"{layer}: {wrong}. At most {LARGEST_VALUE:g} is allowed: divide all lights by the"
                " same number."
            )
        if self._is_users and dr.any(image.array < -ROUNDING):
            plugin = self.scene.sensors()[0].film().rfilter().class_name()
            if any(kind in plugin for kind in ("Box", "Tent", "Gaussian")):  # no negative lobes
                pixels = np.array(image)
                wrong = wrong_pixels(pixels, pixels >= -ROUNDING, "negative")
                raise InputError(
                    f"{layer}: {wrong}. Light must be 0 or more: clamp what can be negative, such"
                    " as drjit.maximum(cosine, 0)."
                )
        return image

    def sampled(self, pass_spp: int) -> "Renderer":
        """Return the same renderer with another number of samples."""
        other = copy(self)
        other.pass_spp = pass_spp
        other.times = []
        other.processor_times = []
        other.kernel_times = []
        other.compilation = 0.0
        return other

    def _image(self, seed: int, size: Size) -> Any:
        """Render; later passes replay the kernels of the first if Dr.Jit knows all their arrays."""
        spp = self.pass_spp
        if self._replayed is not None:
            try:
                if hasattr(self.integrator, "collect"):  # what cannot be recorded
                    self.integrator.collect(self.scene)
                with _no_collection():
                    return self._replayed(self.scene, self.integrator, spp, size, seed)
            except InputError:  # the scene cannot be prepared
                raise
            except Exception as error:  # a plugin's message is better when it is traced
                *_, cause = _chain(error)
                LOGGER.info("%s: passes are traced, not replayed: %s", self.label, cause)
                self._replayed = None
        return _rendered(self.scene, self.integrator, spp, size, seed)

    @property
    def preparation(self) -> float:
        """The seconds in which its heuristic prepared the scene; the first pass has them, too."""
        seconds: float = getattr(self.integrator, "preparation", 0.0)
        return seconds

    def pass_times(self) -> Times:
        """Return the :class:`Times` of the passes so far, without the preparation."""
        first = max(self.times[0] - self.preparation, 0.0)
        return Times.of([first, *self.times[1:]], self.compilation, self.kernel_times)


def warm(renderer: Renderer, size: Size | None = None) -> None:
    """Render the images that are not timed, of a size if given."""
    for seed in range(WARM):
        renderer.render(seed, size)


@contextmanager
def variant(name: str) -> Iterator[None]:
    """Switch to a Mitsuba variant for the block, unless it is the current one."""
    if name == mi.variant():
        yield
        return
    before = mi.variant()
    _switch(name)
    try:
        yield
    finally:
        _switch(before)


@contextmanager
def _no_collection() -> Iterator[None]:
    """Postpone garbage collection: during a recording it would end the process."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


_transformed: dict[tuple[str, CodeType], CodeType] = {}


def _switch(name: str) -> None:
    """Make a variant the current one, for less than Mitsuba takes.

    With each switch Mitsuba loads its Python integrators again, and Dr.Jit would transform the same
    functions again. Ten scenes of two variants each then take twice the processor time.
    So each function's code is transformed once, by what ``drjit.syntax`` is during the switch only.
    """
    transform = dr.syntax

    def syntax(f: FunctionType | None = None, **options: Any) -> Callable[..., Any]:
        if f is None or options:
            decorated: Callable[..., Any] = transform(f, **options)
            return decorated
        key = f.__code__.co_filename, f.__code__
        if key not in _transformed:
            _transformed[key] = transform(f).__code__
        # Only the code is shared: globals and defaults are those of the module just loaded.
        copy = FunctionType(_transformed[key], f.__globals__)
        copy.__defaults__ = f.__defaults__
        return copy

    dr.syntax = syntax  # Mitsuba's modules look it up when they are loaded
    try:
        mi.set_variant(name)
    finally:
        dr.syntax = transform


def _rendered(scene: Any, integrator: Any, spp: int, size: Size, seed: int) -> Any:
    """Render an image on a film of a size; a recording holds it, so each size has its own."""
    image = mi.render(scene, integrator=integrator, spp=spp, seed=seed)
    _reset(scene)
    return image


def _reset(scene: Any) -> None:
    """Release what film and sampler keep: if they begin with another state, a pass is traced."""
    sensor = scene.sensors()[0]
    sensor.film().prepare([])
    if hasattr(sensor.sampler(), "forget"):
        sensor.sampler().forget()


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    """Yield an error, and those that led to it: Dr.Jit wraps errors of Python code."""
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


def require_memory(name: str, width: int, height: int) -> None:
    """Reject an image that does not fit into memory."""
    free = available_memory()
    need = BASE + BYTES_A_PIXEL * width * height
    if free is not None and need > free:
        raise InputError(
            f"{name}: an image of {width}x{height} pixels needs {need / 1e9:.2g} GB of memory, and"
            f" {free / 1e9:.2g} GB are free. Give a smaller `resolution`, free some memory, or"
            " raise the limits of the process (ulimit -d, ulimit -v)."
        )


def available_memory() -> int | None:
    """Return the bytes free on the machine and to this process; None if it does not say."""
    if not HAS_LIMITS:
        return None
    with suppress(OSError, ValueError, KeyError):
        files = (Path("/proc/meminfo"), Path("/proc/self/status"))
        lines = [line.split() for file in files for line in file.read_text("utf-8").splitlines()]
        sizes = {fields[0]: 1024 * int(fields[1]) for fields in lines if fields[-1] == "kB"}
        limits = {"VmData:": resource.RLIMIT_DATA, "VmSize:": resource.RLIMIT_AS}
        # What each limit of the process still allows.
        left = [
            resource.getrlimit(limit)[0] - sizes[name]
            for name, limit in limits.items()
            if resource.getrlimit(limit)[0] != resource.RLIM_INFINITY
        ]
        return max(min([sizes["MemAvailable:"], *left]), 0)
    return None
