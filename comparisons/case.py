"""A scene as the user gave it: every command, test and notebook opens scenes here."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from comparisons import atomic
from comparisons.departure.spaces import DEFAULT_VIEWING, Viewing
from comparisons.gallery.builtin import builtin
from comparisons.options import Options
from comparisons.processes.worker import end_after_task
from heuristic import program
from heuristic.backend import VARIANTS
from heuristic.errors import InputError, unknown
from heuristic.heuristics import PHONG, known_as
from heuristic.interpolation import Interpolation
from reference.pairing.factors import Convention
from reference.planning.plan import wants_spectra
from reference.scene.graph import set_variant
from reference.scene.source import Source

RGB, SPECTRAL = "llvm_ad_rgb", "llvm_ad_spectral"

SUFFIXES = (".xml", ".py")
"""Suffixes of scene files: Mitsuba's, and Python's."""

Scene = str | Path | Mapping[str, Any] | Callable[[], Mapping[str, Any]]


@dataclass(frozen=True)
class Request:
    """The options for rendering a scene, named as on the command line.

    None means the scene's own value, or else the default of :class:`comparisons.options.Options`.

    Parameters
    ----------
    heuristic
        A name, ``FILE.py:function``, ``FILE.glsl``, a function of a point, or a
        :class:`heuristic.Heuristic`; the latter two are declared in this process, and stored by
        name.
    define
        Values of a scene file's placeholders.
    """

    variant: str | None = None
    heuristic_variant: str | None = None
    seed: int = 0
    spp: int | None = None
    noise: float | None = None
    resolution: tuple[int, int] | None = None
    heuristic: str | None = None
    interpolation: str | None = None
    tessellation: int | None = None
    everything: bool = False
    pairing: str = "matched"
    define: Mapping[str, str] = field(default_factory=dict)
    sensor: int | None = None
    allow_empty: bool = False
    image: tuple[str, ...] = ()
    transfer: str | None = None
    pixels_per_degree: float | None = None

    def __post_init__(self) -> None:
        values = {key: str(value) for key, value in dict(self.define or ()).items()}
        object.__setattr__(self, "define", values)
        if self.heuristic is not None:
            object.__setattr__(self, "heuristic", known_as(self.heuristic))
        images = (self.image,) if isinstance(self.image, str) else tuple(self.image)
        object.__setattr__(self, "image", images)
        if isinstance(self.resolution, Iterable):
            object.__setattr__(self, "resolution", tuple(self.resolution))
        for word, kinds in (("pairing", Convention), ("interpolation", Interpolation)):
            allowed = [kind.value for kind in kinds]
            if getattr(self, word) not in (None, *allowed):
                raise unknown(word, getattr(self, word), allowed)
        for name in (self.variant, self.heuristic_variant):
            if name not in (None, *VARIANTS):
                raise InputError(
                    f"variant {name!r} is not supported: choose one of {', '.join(VARIANTS)}."
                )

    @classmethod
    def of(cls, words: Mapping[str, Any]) -> "Request":
        """Return the request that a mapping of options describes.

        Raises
        ------
        InputError
            For an unknown name, or a value that is not allowed.
        """
        known = {each.name for each in fields(cls)}
        if unknown := sorted(set(words) - known):
            raise InputError(
                f"unknown options {', '.join(unknown)}: choose from {', '.join(sorted(known))}."
            )
        return cls(**words)

    @property
    def viewing(self) -> Viewing:
        """The viewing conditions.

        Raises
        ------
        InputError
            If they are not allowed.
        """
        given = self.pixels_per_degree
        return DEFAULT_VIEWING if given is None else Viewing(pixels_per_degree=given)

    def stated(self) -> dict[str, Any]:
        """Return the options as plain data, without those that are None, False or empty."""
        plain = {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(self).items()}
        return {k: v for k, v in plain.items() if v not in (None, {}, []) and v is not False}


@dataclass(frozen=True)
class Case:
    """An opened scene, with its options.

    Attributes
    ----------
    source
        The scene, read once.
    request
        The options, completed from the scene itself.
    word
        The scene's name in a command.
    """

    source: Source
    request: Request
    word: str

    @property
    def name(self) -> str:
        """The scene's name."""
        return self.source.name

    @property
    def variant(self) -> str:
        """Mitsuba's variant for the scene."""
        return self.request.variant or RGB

    @cached_property
    def options(self) -> Options:
        """The options of a comparison."""
        asked = self.request
        return Options(
            seed=asked.seed,
            spp=asked.spp,
            noise=asked.noise,
            resolution=asked.resolution,
            convention=Convention(asked.pairing),
            heuristic_variant=asked.heuristic_variant,
            heuristic=asked.heuristic or PHONG.name,
            interpolation=Interpolation(asked.interpolation or "phong"),
            tessellation=asked.tessellation,
            everything=asked.everything,
            sensor=asked.sensor or 0,
            allow_empty=asked.allow_empty,
            image=asked.image,
            transfer=asked.transfer,
            viewing=asked.viewing,
        )

    def asking(self, **changes: Any) -> "Case":
        """Return the same scene, not opened again, with other options."""
        return replace(self, request=replace(self.request, **changes))

    def command(self, verb: str = "compare", **more: Any) -> str:
        """Return the command that does the same with the scene again."""
        words = [verb, self.word]
        for name, value in self.request.define.items():
            words += ["-D", f"{name}={value}"]
        for image in self.request.image:
            words += ["--image", image]
        several = ("define", "image")
        stated = {key: value for key, value in asdict(self.request).items() if key not in several}
        for key, value in (stated | more).items():
            option = f"--{key.replace('_', '-')}"
            if value is True:
                words.append(option)
            elif value not in (None, False):
                text = "x".join(map(str, value)) if key == "resolution" else str(value)
                words += [option, text]
        return program.command(*words)


def open_case(scene: Scene, request: Request | None = None, name: str | None = None) -> Case:
    """Open a scene: read it, run its script, choose its variant, and switch Mitsuba to it.

    Parameters
    ----------
    scene
        A built-in name, the path of a Mitsuba file (.xml) or of a Python file (.py) in which
        ``scene`` is a dictionary or returns one, a dictionary as ``mitsuba.load_dict`` takes it,
        or a function that returns one.
    request
        The options.
    name
        The scene's name, instead of the file's or function's.

    Raises
    ------
    InputError
        When there is no such scene, or it cannot be read.
    """
    asked = request or Request()
    if isinstance(scene, Mapping) or callable(scene):
        own = name or str(getattr(scene, "__name__", "scene"))
        return _opened(Source(own, scene), asked, own)
    path = file_of(scene)
    if path is not None:
        content: Any = path
        if path.suffix == ".py":
            from reference.scene.script import Script

            end_after_task()  # the script may change this process
            content = Script(path)
        return _opened(Source(name or path.stem, content, asked.define), asked, str(path))
    known = builtin(str(scene))
    # A requested variant is meant for both halves.
    variant = asked.variant or known.variant
    both = known.heuristic_variant if asked.variant is None else None
    completed = replace(
        asked,
        variant=variant,
        heuristic_variant=asked.heuristic_variant or both,
        interpolation=asked.interpolation or known.interpolation,
        tessellation=asked.tessellation or known.tessellation,
    )
    set_variant(variant)
    return Case(known.source(), completed, known.name)


def file_of(scene: str | Path) -> Path | None:
    """Return the path of a scene file, None for a built-in scene.

    Raises
    ------
    InputError
        When there is no such file, or Mitsuba cannot open a file with its name.
    """
    path = Path(scene)
    if path.suffix not in SUFFIXES and not path.exists():
        return None
    if not path.is_file():
        raise InputError(
            f"{scene}: there is no such file. Give a Mitsuba scene (.xml), a Python file"
            " that makes one (.py), a folder of them, or the name of a built-in scene"
            f" (listed by `{program.command('scenes')}`)."
        )
    try:
        str(path.resolve()).encode()
    except UnicodeEncodeError as error:
        raise InputError(
            f"{atomic.printable(path.resolve())}: Mitsuba cannot open this name, which is not in"
            " UTF-8. Rename the file, or its folder."
        ) from error
    return path


def name_of(scene: str | Path) -> str:
    """Return a scene's name, without reading the scene."""
    path = file_of(scene)
    return builtin(str(scene)).name if path is None else path.stem


def _opened(source: Source, asked: Request, word: str) -> Case:
    """Open a user's scene, and complete the request from it."""
    variant = asked.variant
    set_variant(variant or RGB)
    if variant is None:
        variant = SPECTRAL if wants_spectra(source.parse()) else RGB
        set_variant(variant)
    interpolation = asked.interpolation or Interpolation.PHONG.value
    return Case(source, replace(asked, variant=variant, interpolation=interpolation), word)
