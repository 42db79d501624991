"""A scene as the user gave it: every command, test and notebook opens scenes here."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fotismos.comparisons.gallery.builtin import builtin
from fotismos.comparisons.names import file_of
from fotismos.comparisons.options import Options
from fotismos.heuristic.errors import InputError
from fotismos.reference.planning.plan import wants_spectra
from fotismos.reference.scene.graph import set_variant
from fotismos.reference.scene.source import Script, Source

RGB = "llvm_ad_rgb"
SPECTRAL = "llvm_ad_spectral"

Scene = str | Path | Mapping[str, Any] | Callable[[], Mapping[str, Any]]


@dataclass(frozen=True)
class Case:
    """A scene as the user gave it, read once, with its options, completed from the scene.

    ``word`` is the scene's name in a command.
    """

    source: Source
    options: Options
    word: str

    @property
    def name(self) -> str:
        """The scene's name."""
        return self.source.name

    @property
    def variant(self) -> str:
        """Mitsuba's variant for the scene."""
        return self.options.variant or RGB

    def changed(self, **changes: Any) -> "Case":
        """Return the same scene, not opened again, with other options."""
        return replace(self, options=self.options.changed(**changes))

    def command(self, verb: str = "compare", **more: Any) -> str:
        """Return the command that does the same with the scene again."""
        return self.options.command(verb, self.word, **more)


def open_case(scene: Scene, options: Options | None = None, name: str | None = None) -> Case:
    """Open a scene: read it, run its script, choose its variant, and switch Mitsuba to it.

    ``scene`` is a built-in name, the path of a Mitsuba file (.xml) or of a Python file (.py) in
    which ``scene`` is a dictionary or returns one, a dictionary as ``mitsuba.load_dict`` takes it,
    or a function that returns one. ``name`` replaces the file's or function's. A scene that cannot
    be found or read raises :class:`InputError`.
    """
    options = options or Options()
    path = file_of(scene) if isinstance(scene, (str, Path)) else None
    if options.define and path is None:
        raise InputError(
            f"-D {', '.join(options.define)}: only files take values: Mitsuba's for placeholders"
            " (.xml), and Python's for arguments of `scene` (.py). Omit the option, or give a file."
        )
    if path is not None:
        content: Any = path
        if path.suffix == ".py":
            content = Script(path, options.define)
        return _complete(Source(name or path.stem, content, options.define), options, str(path))
    if isinstance(scene, (str, Path)):
        entry = builtin(str(scene))
        both = entry.heuristic_variant if options.variant is None else None
        settings = {
            # A requested variant is meant for both halves.
            "variant": entry.variant,
            "heuristic_variant": both,
            "interpolation": entry.interpolation,
            "tessellation": entry.tessellation,
            "vertex_weights": entry.vertex_weights,
        }
        changes = {key: value for key, value in settings.items() if getattr(options, key) is None}
        return _complete(entry.source(), options.changed(**changes), entry.name)
    if not isinstance(scene, Mapping) and not callable(scene):
        raise InputError(
            f"a scene of type {type(scene).__name__} is not allowed. Give two pictures, `image` and"
            " `reference`, or the name of a built-in"
            " scene, the path of one (.xml or .py), a dictionary for mitsuba.load_dict, or a"
            " function that returns one."
        )
    own_name = name or str(getattr(scene, "__name__", "scene"))
    return _complete(Source(own_name, scene), options, own_name)


def _complete(source: Source, options: Options, word: str) -> Case:
    """Choose a scene's variant, and complete the options from it."""
    # A scene can be read in a variant only, and tells which it wants once it is read.
    set_variant(options.variant or RGB)
    variant = options.variant or (SPECTRAL if wants_spectra(source.parse()) else RGB)
    set_variant(variant)
    interpolation = options.interpolation or "phong"
    return Case(source, options.changed(variant=variant, interpolation=interpolation), word)
