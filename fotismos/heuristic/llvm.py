"""Find LLVM, with which Dr.Jit compiles every kernel, and check it and Mitsuba before use.

Dr.Jit reads ``DRJIT_LIBLLVM_PATH`` once, when first imported, and searches the system if the
variable is not set. So `configure` runs before that import and points the variable at the installed
LLVM wheel. `check` examines the library before anything is compiled: with LLVM 15 and 16 the first
kernel aborts the whole process.
"""

import ctypes
import importlib.metadata
import os
import re
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

from fotismos.heuristic.errors import InputError, InstallationError, unknown
from fotismos.heuristic.program import installation

VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono")
"""The supported variants of Mitsuba."""

MITSUBA_TESTED = (3, 9, 1)
"""The version that the documentation's figures and this project's baselines were made with."""

MITSUBA_VERSION = ".".join(map(str, MITSUBA_TESTED))
MITSUBA_REQUIREMENT = f"mitsuba~={MITSUBA_VERSION}"
"""What pip installs: this version, or a later one with the same first two numbers."""

VARIABLE = "DRJIT_LIBLLVM_PATH"
WHEEL = "karellen-llvm-core"
ATOMIC = "libatomic.so.1"
OLDEST_USABLE = 17

LARGEST_FILMS = 2**26
"""Numbers in the films of all threads, at most. With Dr.Jit's own bound, 2**20 in one film, a
sample took up to 1.4 times as long at 1280 x 720 as at 128 x 72."""

FEWEST_THREADS = 2
"""Threads of Dr.Jit in a process: with only one, Mitsuba waits forever when it reads or writes
images, for another thread to do its task."""

_HOW_TO_GET_IT = f"""\
Needed: LLVM {OLDEST_USABLE} or newer (15 and 16 abort at the first kernel; Dr.Jit rejects \
older ones).
How to get it:
  On Linux x86-64:  pip install {WHEEL}
  On Debian 13, Ubuntu 24.04 or newer:  apt-get install libllvm19
  On macOS:  brew install llvm
  Any other:  {VARIABLE}=/path/to/libLLVM.so (.dylib on macOS, .dll on Windows)
  ./run installs the first of these by itself."""

_TOO_EARLY = (
    f"Dr.Jit was imported before fotismos, so the LLVM of the {WHEEL} wheel is not used: "
    f"import fotismos first, or set {VARIABLE} before Python starts."
)


@dataclass(frozen=True)
class LLVM:
    """The LLVM that Dr.Jit uses.

    ``version`` is such as ``(22, 1, 8)``, None if Dr.Jit found none; ``path`` is None if unknown.
    ``source`` is its origin: the user's variable, ``wheel``, or ``system``, Dr.Jit's own search.
    """

    version: tuple[int, int, int] | None
    path: Path | None
    source: str


def unknown_variant(what: str, given: object) -> InputError:
    """Return the error for a variant of Mitsuba that fotismos does not support."""
    error = unknown(what, given, VARIANTS)
    if str(given).startswith(("cuda", "scalar")):
        return InputError(f"{error} Only LLVM renders here, on the processor.")
    return error


def configure() -> None:
    """Point Dr.Jit at the LLVM wheel, unless the user chose another or none is installed.

    Call it before anything imports Dr.Jit or Mitsuba. If Dr.Jit is already imported it is too late;
    it warns if that leaves no usable LLVM.
    """
    library = None if os.environ.get(VARIABLE) else find_wheel()
    if library is None:
        return
    if sys.modules.get("drjit") is None:
        os.environ[VARIABLE] = str(library)
    elif not _is_usable(_version()):
        warnings.warn(f"The first kernel will fail. {_TOO_EARLY}", RuntimeWarning, stacklevel=2)


def find_wheel() -> Path | None:
    """Find the libLLVM of the installed LLVM wheel; None if there is none.

    It is the library with the shortest name: libLLVM.so, or libLLVM.so.22.1 without that link.
    """
    try:
        wheel = importlib.metadata.distribution(WHEEL)
    except importlib.metadata.PackageNotFoundError:
        return None
    paths = (Path(str(file.locate())) for file in wheel.files or ())
    libraries = (path for path in paths if path.match("libLLVM*.so*") and path.is_file())
    best = min(libraries, key=lambda path: (len(path.name), path.name), default=None)
    return best and best.parent.resolve() / best.name


def require_libraries() -> None:
    """Raise `InstallationError` if Dr.Jit cannot be loaded for want of a system library.

    Its own handler of that error fails with a NameError, wherever it is imported first.
    """
    if sys.platform == "linux":
        try:
            ctypes.CDLL(ATOMIC)
        except OSError as error:
            raise _not_imported(error) from error


def check() -> LLVM:
    """Return the LLVM that Dr.Jit uses; raise `InstallationError` unless it and Mitsuba work."""
    require_mitsuba()
    value = os.environ.get(VARIABLE)
    path = Path(value) if value else None
    # A child process inherits what `configure` set.
    source = "system" if path is None else "wheel" if path == find_wheel() else VARIABLE
    # Dr.Jit would print its own lines about a path that does not exist.
    version = None if _is_missing(path) else _version()
    llvm = LLVM(version, path or (_loaded_library() if version else None), source)
    if _is_usable(version):
        return llvm
    lines = [
        "Dr.Jit cannot find an LLVM to compile kernels with.",
        f"Found: {_description(llvm)}.",
        _HOW_TO_GET_IT,
    ]
    if source == VARIABLE:
        lines.append(f"Or unset {VARIABLE}, and fotismos searches by itself.")
    raise InstallationError("\n".join(lines))


def use_threads(count: int | None = None) -> None:
    """Set the number of Dr.Jit's threads, at least :data:`FEWEST_THREADS`.

    If omitted, Dr.Jit keeps its own number, which is too few on a machine with one core. Each
    thread has its own film, up to :data:`LARGEST_FILMS`: a shared one is slower.
    """
    import drjit as dr  # after `configure`

    enough = max(count or dr.thread_count(), FEWEST_THREADS)
    if dr.thread_count() != enough:
        dr.set_thread_count(enough)
    dr.set_expand_threshold(LARGEST_FILMS // enough)


def _is_missing(path: Path | None) -> bool:
    """Return whether a path is not a file; a bare name is searched for by the system."""
    return path is not None and len(path.parts) > 1 and not path.is_file()


def _is_usable(version: tuple[int, int, int] | None) -> bool:
    return version is not None and version[0] >= OLDEST_USABLE


def _version() -> tuple[int, int, int] | None:
    try:
        import drjit  # after `configure`
    except ImportError as error:
        raise _not_imported(error) from error
    major, minor, patch = drjit.detail.llvm_version()
    # Dr.Jit returns -1 for no library, one that it cannot load, and one older than 15.
    return None if major < 0 else (major, minor, patch)


def _not_imported(error: Exception) -> InstallationError:
    return InstallationError(
        f"Dr.Jit cannot be imported: {error}.\n"
        f"Needed: the packages of requirements.txt and, on Linux, {ATOMIC}.\n"
        "How to get them: ./run installs the packages; "
        "apt-get install libatomic1 (Debian, Ubuntu) or dnf install libatomic (Fedora)."
    )


def _loaded_library() -> Path | None:
    """Find the libLLVM in this process's memory map (Linux only)."""
    try:
        lines = Path("/proc/self/maps").read_text().splitlines()
    except OSError:
        return None
    paths = (Path(line.split(maxsplit=5)[-1]) for line in lines if "libLLVM" in line)
    return next(paths, None)


def _description(llvm: LLVM) -> str:
    path = f"{VARIABLE}={llvm.path}" if llvm.source == VARIABLE else llvm.path
    if llvm.version is not None:
        return f"LLVM {'.'.join(map(str, llvm.version))}" + (f" ({path})" if llvm.path else "")
    if llvm.path is None:
        return "none that Dr.Jit accepts"
    if _is_missing(llvm.path):
        return f"{path}, which is not a file"
    return f"{path}, which is not an LLVM library, or one older than 15"


def require_mitsuba() -> None:
    """Raise `InstallationError` unless the installed Mitsuba is one that fotismos works with."""
    version = importlib.metadata.version("mitsuba")
    numbers = _numbers(version)
    if numbers < MITSUBA_TESTED or numbers[:2] != MITSUBA_TESTED[:2]:
        major, minor, _ = MITSUBA_TESTED
        raise InstallationError(
            f"Mitsuba {version} is installed, and fotismos needs {MITSUBA_VERSION} or a later"
            f" {major}.{minor}. Install it: {installation(MITSUBA_REQUIREMENT)}"
        )


def other_version() -> str:
    """Return what to know of a Mitsuba that is not the tested one; empty if it is."""
    version = importlib.metadata.version("mitsuba")
    if version == MITSUBA_VERSION:
        return ""
    return (
        f"The documentation's numbers are of Mitsuba {MITSUBA_VERSION}. With {version} the noise"
        " may be another, and `check` may find that old baselines moved."
    )


def _numbers(version: str) -> tuple[int, ...]:
    """Return the numbers at the start of a version, such as (3, 9, 1) of ``3.9.1.post2``."""
    start = re.match(r"\d+(\.\d+)*", version)
    return tuple(map(int, start[0].split("."))) if start else ()
