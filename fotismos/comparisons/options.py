"""The options of a comparison, from which all that takes, keeps or repeats options derives.

The command line, the notebook, baselines and studies name them alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeAlias

import msgspec
from msgspec import Meta, inspect, structs

from fotismos.heuristic import llvm, program
from fotismos.heuristic.errors import InputError, unknown

if TYPE_CHECKING:  # the command line reads options without loading Dr.Jit
    from fotismos.comparisons.records.departure import Viewing
    from fotismos.heuristic.heuristics import Interpolation  # loaded late: help needs no Mitsuba

    # Options take more than they keep: functions, mappings, arrays, a single name.
    Shader: TypeAlias = Any
    Definitions: TypeAlias = Any
    Pictures: TypeAlias = Any
else:
    Shader = str
    Definitions = dict[str, str]
    Pictures = tuple[str, ...]

LARGEST_SPP = 2**20
"""Samples per pixel: the noise is a thousandth of one sample's, and an image takes days."""

Variant = Literal["llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono"]
Seed = Annotated[int, Meta(ge=0, le=2**63 - 1)]
Samples = Annotated[int, Meta(ge=2, le=LARGEST_SPP)]  # the noise needs at least 2
Error = Annotated[float, Meta(gt=0, le=1000)]  # ΔE2000
Side = Annotated[int, Meta(ge=1, le=2**31 - 1)]
Fineness = Annotated[int, Meta(ge=1, le=512)]  # fotismos.heuristic.tessellation.FINEST
VertexWeights = Literal["mean", "area", "angle"]  # fotismos.heuristic.normals.WEIGHTINGS
Sensor = Annotated[int, Meta(ge=0, le=2**31 - 1)]
Density = Annotated[float, Meta(ge=1, le=1000)]  # records.departure.MOST_PIXELS
ToneMapName = Literal["reinhard", "aces", "agx", "neutral"]  # departure.tone_maps.TONE_MAPS


def option(description: str, **more: Any) -> Meta:
    """Describe a field of a declaration, from which an option of a command derives.

    ``default`` says what None stands for. On the command line the option has the ``names``, by
    default the field's own; its value is a ``metavar``, of click's ``type``.
    """
    return Meta(description=description, extra=more)


class Declaration(msgspec.Struct, frozen=True, kw_only=True):
    """A type whose fields carry their help and bounds.

    Options of commands, arguments of functions and tables of files derive from it. A value that is
    not allowed raises :class:`InputError`.
    """

    def __post_init__(self) -> None:
        for field in structs.fields(self):
            if field.type is Any:
                continue
            value = _plain(field.name, getattr(self, field.name))
            try:
                value = msgspec.convert(value, field.type, dec_hook=_built)
            except msgspec.ValidationError:
                raise _refusal(field.name, value, field.type) from None
            structs.force_setattr(self, field.name, value)

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Self:
        """Return the declaration with the values of a mapping, in which None means the default.

        An unknown name, or a value that is not allowed, raises :class:`InputError`.
        """
        if others := sorted(set(given) - set(cls.__struct_fields__)):
            raise unknown("option", others[0], sorted(cls.__struct_fields__))
        return cls(**{name: value for name, value in given.items() if value is not None})


class Options(
    Declaration, frozen=True, kw_only=True, omit_defaults=True, forbid_unknown_fields=True
):
    """The options of a comparison, as the command line names them; None leaves one to the scene.

    A ``heuristic`` may also be a function of a point or a :class:`fotismos.heuristic.Heuristic`: it
    is declared in this process, and its name is stored. A value that is not allowed raises
    :class:`InputError`.
    """

    variant: Annotated[
        Variant | None,
        option(
            "Mitsuba variant.",
            default="llvm_ad_rgb, or llvm_ad_spectral for a scene with tabulated spectra",
            names=("-m", "--variant"),
        ),
    ] = None
    heuristic_variant: Annotated[
        Variant | None,
        option(
            "Variant of the textbook half, such as RGB shading of a spectral scene.",
            default="the scene's own, else `variant`",
        ),
    ] = None
    seed: Annotated[
        Seed, option("Seed of the run, from which each pass derives its own.", metavar="N")
    ] = 0
    spp: Annotated[
        Samples | None,
        option("Samples per pixel, over all passes.", default="the plan's", metavar="N"),
    ] = None
    noise: Annotated[
        Error | None,
        option(
            "Continue until 95 % of pixels have noise under this ΔE2000, up to `spp` samples per"
            " pixel, or 4096.",
            metavar="DE",
        ),
    ] = None
    resolution: Annotated[
        tuple[Side, Side] | None, option("Width and height.", default="the film's", metavar="WxH")
    ] = None
    heuristic: Annotated[
        Shader,
        option(
            "The textbook shading: phong, blinn, one that engines use (such as shadow-map), one"
            " that a package declares, or FILE.glsl or FILE.py[:FUNCTION] with shade(point).",
            metavar="NAME|FILE",
        ),
    ] = "phong"
    interpolation: Annotated[
        Literal["flat", "gouraud", "phong"] | None,
        option("Shading of polygons in the textbook half.", default="the scene's own, else phong"),
    ] = None
    tessellation: Annotated[
        Fineness | None,
        option(
            "Mesh the shapes of the textbook half: N edges per quarter turn or straight side.",
            default="the scene's own, else 16 for flat and gouraud",
            metavar="N",
        ),
    ] = None
    vertex_weights: Annotated[
        VertexWeights | None,
        option(
            "How much a face counts in its vertices' normals (6.32 to 6.34); the shapes of the"
            " textbook half become meshes with such normals.",
            default="the scene's own, else a mesh's normals, or angle if it has none",
        ),
    ] = None
    everything: Annotated[bool, option("Simulate every effect, and leave out nothing.")] = False
    pairing: Annotated[
        Literal["literal", "matched"], option("How roughplastic and phong are paired.")
    ] = "matched"
    define: Annotated[
        Definitions,
        option(
            "Values of a scene file's placeholders $NAME, or of the arguments of a script's scene.",
            metavar="NAME=VALUE",
            names=("-D",),
        ),
    ] = {}
    sensor: Annotated[Sensor, option("Which sensor of the scene, from 0.", metavar="N")] = 0
    allow_empty: Annotated[
        bool, option("Accept pictures in which no pixel sees a surface, or none sees light.")
    ] = False
    image: Annotated[
        Pictures,
        option(
            "A picture of the scene (.exr, FILE.exr:LAYER, .png, .jpg, .hdr, .pfm, .npy) that"
            " replaces the textbook half, or a pattern of several in quotes: repeats, which show"
            " its noise.",
            metavar="FILE",
            names=("-t", "--image"),
        ),
    ] = ()
    reference: Annotated[
        Pictures,
        option(
            "A picture in place of the physical half, such as of another path tracer, or a"
            " pattern of repeats.",
            metavar="FILE",
            names=("-r", "--reference"),
        ),
    ] = ()
    mask: Annotated[
        str | None,
        option(
            "A picture that says which pixels count: those that are not black in it.",
            metavar="FILE",
        ),
    ] = None
    transfer: Annotated[
        Literal["linear", "srgb"] | None,
        option(
            "Transfer function of the pictures.", default="the file's own: sRGB for .png and .jpg"
        ),
    ] = None
    over: Annotated[
        str | None,
        option("What lies behind a picture with alpha: black, white, or R,G,B in linear numbers."),
    ] = None
    tone_map: Annotated[
        ToneMapName | None,
        option(
            "The curve by which the picture was tone-mapped; the reference is shown by it, too.",
            default="none: the picture is linear light",
        ),
    ] = None
    pixels_per_degree: Annotated[
        Density | None, option("FLIP: pixels per degree of vision.", default="67", metavar="N")
    ] = None
    colour_science: Annotated[
        bool, option("Compute all colour differences with colour-science, which takes longer.")
    ] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.image and self.heuristic != "phong":
            raise InputError(
                f"heuristic {self.heuristic} and image {self.image[0]}: give one of them."
            )

    def changed(self, **changes: Any) -> Options:
        """Return the options with some of them changed."""
        return structs.replace(self, **changes)

    def stated(self) -> dict[str, Any]:
        """Return what differs from the defaults, the seed and the pairing, as plain data."""
        plain = msgspec.to_builtins(self) | {"seed": self.seed, "pairing": self.pairing}
        return {k: list(v) if isinstance(v, tuple) else v for k, v in plain.items()}

    def command(self, verb: str, scene: str, **more: Any) -> str:
        """Return the command that does the same again, with a scene unless its name is empty."""
        arguments = [verb, scene] if scene else [verb]
        for name, value in (msgspec.to_builtins(self) | more).items():
            option = f"--{name.replace('_', '-')}"
            if name == "define":
                arguments += [word for entry in value.items() for word in ("-D", "=".join(entry))]
            elif name in ("image", "reference", "picture"):
                files = (value,) if isinstance(value, str) else value
                arguments += [word for file in files for word in (option, file)]
            elif value is True:
                arguments.append(option)
            elif value not in (None, False):
                arguments += [
                    option,
                    "x".join(map(str, value)) if name == "resolution" else str(value),
                ]
        return program.command(*arguments)

    @property
    def picture_files(self) -> tuple[str, ...]:
        """The files of pictures and of the mask."""
        return (*self.image, *self.reference, *((self.mask,) if self.mask else ()))

    @property
    def first_half(self) -> str:
        """What stands for the textbook half, as records name it."""
        return f"picture {', '.join(self.image)}" if self.image else self.heuristic

    @property
    def polygon_shading(self) -> Interpolation:
        """How the textbook half shades polygons."""
        # Loaded late: help needs no Mitsuba.
        from fotismos.heuristic.heuristics import Interpolation

        return Interpolation(self.interpolation or "phong")

    @property
    def viewing(self) -> Viewing:
        """The viewing conditions."""
        # Loaded late: help needs no Mitsuba.
        from fotismos.comparisons.records.departure import DEFAULT_VIEWING, Viewing

        density = self.pixels_per_degree
        return DEFAULT_VIEWING if density is None else Viewing(pixels_per_degree=density)

    def require_model(self, what: str, halves: Sequence[str] = ("image", "reference")) -> None:
        """Raise InputError if a picture replaces one of the halves, which ``what`` renders."""
        for name in halves:
            if files := getattr(self, name):
                raise InputError(f"{what} renders what {files[0]} would replace. Omit `{name}`.")


def _built(kind: type, value: Any) -> Any:
    """Return a value as a type that JSON has not, such as a path."""
    return kind(value)


def _plain(name: str, value: Any) -> Any:
    """Return a value of an option as a file would have it."""
    if name == "heuristic" and value is not None and not isinstance(value, str):
        from fotismos.heuristic.heuristics import known_as  # loaded late: help needs no Mitsuba

        return known_as(value)
    if name == "define":
        return {key: str(text) for key, text in dict(value or ()).items()}
    if name in ("image", "reference") and isinstance(value, str):
        return (value,)
    if isinstance(value, (list, tuple)):
        return tuple(_plain("", item) for item in value)
    if isinstance(value, bool) or not isinstance(value, Real):
        return value
    return int(value) if isinstance(value, Integral) else float(value)  # NumPy's too


def _refusal(name: str, value: object, kind: Any) -> InputError:
    """Return the error for a value that is not of an option's type."""
    allowed = inspect.type_info(kind)
    while isinstance(allowed, (inspect.Metadata, inspect.UnionType)):
        allowed = allowed.type if isinstance(allowed, inspect.Metadata) else allowed.types[0]
    match allowed:
        case inspect.LiteralType(values) if name.endswith("variant"):
            return llvm.unknown_variant(name, value)
        case inspect.LiteralType(values):
            return unknown(name, value, map(str, values))
        case inspect.IntType():
            give = f"a whole number from {allowed.ge} to {allowed.le}"
        case inspect.FloatType():
            low = f"above {allowed.gt}" if allowed.ge is None else f"from {allowed.ge}"
            high = f"to {allowed.le}" if allowed.lt is None else f"and below {allowed.lt}"
            give = f"a number {low} {high}"
        case inspect.TupleType():
            give = "width and height, whole numbers of at least 1"
        case inspect.BoolType():
            give = "True or False"
        case _:
            give = "text"
    return InputError(f"{name} = {value!r} is not allowed: give {give}.")
