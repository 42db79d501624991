"""Find LLVM, with which Dr.Jit compiles every kernel, and check it before use.

Dr.Jit reads ``DRJIT_LIBLLVM_PATH`` once, when first imported, and searches the system if the
variable is not set. So `configure` runs before that import and points the variable at the installed
LLVM wheel. `check` examines the library found before anything is compiled: with LLVM 15 and 16 the
first kernel aborts the whole process.
"""

import ctypes
import glob
import importlib.metadata
import os
import sys
import sysconfig
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from heuristic.errors import InstallationError

VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono")
"""The supported variants of Mitsuba."""

VARIABLE = "DRJIT_LIBLLVM_PATH"
WHEEL = "karellen-llvm-core"
ATOMIC = "libatomic.so.1"
OLDEST_USABLE = 17

FEWEST_THREADS = 2
"""Threads of Dr.Jit in a process: with only one, Mitsuba waits forever when it reads or writes
images, for another thread to do its task."""

_HOW_TO_GET_IT = f"""\
  On Linux x86-64:  pip install {WHEEL}
  On Debian 13, Ubuntu 24.04 or newer:  apt-get install libllvm19
  On macOS:  brew install llvm
  Any other:  {VARIABLE}=/path/to/libLLVM.so (.dylib on macOS, .dll on Windows)
  ./run installs the first of these by itself."""

# Named in messages as found if Dr.Jit reports nothing; Dr.Jit does its own search.
_USUAL_PLACES = (
    "/usr/lib/*/libLLVM*.so*",
    "/usr/lib/libLLVM*.so*",
    "/usr/lib64/libLLVM*.so*",
    "/usr/lib/llvm-*/lib/libLLVM*.so*",
    "/opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",
    "/usr/local/opt/llvm*/lib/libLLVM*.dylib",
)

_TOO_EARLY = (
    f"Dr.Jit was imported before fotismos, so the LLVM of the {WHEEL} wheel is not used: "
    f"import heuristic first, or set {VARIABLE} before Python starts."
)

_imported_too_early = False


@dataclass(frozen=True)
class LLVMInfo:
    """The LLVM that Dr.Jit uses.

    Attributes
    ----------
    version
        Such as ``(22, 1, 8)``; None if Dr.Jit found none.
    path
        The library; None if unknown.
    source
        Its origin: the user's variable, the wheel, or Dr.Jit's search of the system.
    note
        What a person should know about it; may be empty.
    """

    version: tuple[int, int, int] | None
    path: Path | None
    source: Literal["DRJIT_LIBLLVM_PATH", "wheel", "system"]
    note: str = ""


def configure() -> None:
    """Point Dr.Jit at the LLVM wheel, unless the user chose another or none is installed.

    Call it before anything imports Dr.Jit or Mitsuba. It starts no process and imports neither. If
    Dr.Jit is already imported it is too late; it warns if that leaves no usable LLVM.
    """
    global _imported_too_early
    if os.environ.get(VARIABLE):
        return
    library = find_wheel()
    if library is None:
        return
    if "drjit" in sys.modules:
        # Setting the variable now would change nothing, and the report would be wrong.
        _imported_too_early = True
        if not _is_usable(_version()):
            warnings.warn(f"The first kernel will fail. {_TOO_EARLY}", RuntimeWarning, stacklevel=2)
        return
    os.environ[VARIABLE] = str(library)


def require_libraries() -> None:
    """Raise `InstallationError` if Dr.Jit cannot be loaded for want of a system library.

    Its own handler of that error fails with a NameError, wherever it is imported first.
    """
    if sys.platform == "linux":
        try:
            ctypes.CDLL(ATOMIC)
        except OSError as error:
            raise InstallationError(_not_imported(error)) from error


def check() -> LLVMInfo:
    """Return the LLVM that Dr.Jit uses; raise `InstallationError` unless it works.

    Call it before the first kernel. It compiles nothing itself.
    """
    found = inspect()
    if not _is_usable(found.version):
        raise InstallationError(_message(found))
    return found


def use_threads(count: int | None = None) -> None:
    """Set the number of Dr.Jit's threads, at least :data:`FEWEST_THREADS`.

    If omitted, Dr.Jit keeps its own number, which is too few on a machine with one core.
    """
    import drjit as dr

    enough = max(count or dr.thread_count(), FEWEST_THREADS)
    if dr.thread_count() != enough:
        dr.set_thread_count(enough)


def inspect() -> LLVMInfo:
    """Return the LLVM that Dr.Jit uses, usable or not."""
    source, path = _chosen()
    note = _TOO_EARLY if _imported_too_early else ""
    # Dr.Jit would print its own lines about a path that does not exist.
    if path is not None and len(path.parts) > 1 and not path.is_file():
        return LLVMInfo(None, path, source, note)
    version = _version()
    return LLVMInfo(version, path or (_loaded_library() if version else None), source, note)


def find_wheel() -> Path | None:
    """Find the libLLVM of the installed LLVM wheel; None if there is none."""
    try:
        files = importlib.metadata.files(WHEEL)
    except importlib.metadata.PackageNotFoundError:
        return None
    if files is None:  # an installer that keeps no list of files
        directory = Path(sysconfig.get_path("data"), "lib")
        return _best(directory.glob("libLLVM*"))
    return _best(Path(file.locate()) for file in files if file.name.startswith("libLLVM"))


def _best(libraries: Iterable[Path]) -> Path | None:
    """Choose the library with the shortest name: libLLVM.so before libLLVM.so.22.1.

    The link without a version is made after the installation, and may not be there.
    """
    is_library = (".so", ".dylib", ".dll")
    present = [p for p in libraries if any(s in p.name for s in is_library) and p.is_file()]
    if not present:
        return None
    best = min(present, key=lambda path: (len(path.name), path.name))
    return best.parent.resolve() / best.name


def _chosen() -> tuple[Literal["DRJIT_LIBLLVM_PATH", "wheel", "system"], Path | None]:
    """Return who told Dr.Jit where to look; a child process inherits what `configure` set."""
    value = os.environ.get(VARIABLE)
    if not value:
        return "system", None
    return ("wheel" if Path(value) == find_wheel() else "DRJIT_LIBLLVM_PATH"), Path(value)


def _is_usable(version: tuple[int, int, int] | None) -> bool:
    return version is not None and version[0] >= OLDEST_USABLE


def _version() -> tuple[int, int, int] | None:
    try:
        import drjit
    except ImportError as error:
        raise InstallationError(_not_imported(error)) from error
    major, minor, patch = drjit.detail.llvm_version()
    # Dr.Jit returns -1 for no library, one that it cannot load, and one older than 15.
    return None if major < 0 else (major, minor, patch)


def _not_imported(error: Exception) -> str:
    return (
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


def _message(found: LLVMInfo) -> str:
    lines = [
        "Dr.Jit cannot find an LLVM to compile kernels with.",
        f"Found: {_what_was_found(found)}.",
        f"Needed: LLVM {OLDEST_USABLE} or newer (15 and 16 abort at the first kernel; "
        "Dr.Jit rejects older ones).",
        "How to get it:",
        _HOW_TO_GET_IT,
    ]
    if found.source == "DRJIT_LIBLLVM_PATH":
        lines.append(f"Or unset {VARIABLE}, and fotismos searches by itself.")
    if found.note:
        lines.append(found.note)
    return "\n".join(lines)


def _what_was_found(found: LLVMInfo) -> str:
    set_by = f"{VARIABLE}={found.path}" if found.source == "DRJIT_LIBLLVM_PATH" else found.path
    if found.version is not None:
        version = ".".join(map(str, found.version))
        return f"LLVM {version}" + (f" ({set_by})" if found.path else "")
    if found.path is None:
        others = sorted({p for pattern in _USUAL_PLACES for p in glob.glob(pattern)})
        return f"none that Dr.Jit accepts among {', '.join(others)}" if others else "none"
    if len(found.path.parts) > 1 and not found.path.is_file():
        return f"{set_by}, which is not a file"
    return f"{set_by}, which is not an LLVM library, or one older than 15"
