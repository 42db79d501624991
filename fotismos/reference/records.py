"""Records: frozen types that define JSON files and their published schemas.

A record is a :class:`Record` whose fields are the keys of a JSON object. The meaning of a field is
in its annotation, ``Annotated[float, msgspec.Meta(description="...", ge=0)]``, or in the section
*Attributes* of the docstring, and both go into the schema.
"""

import json
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Annotated, Any, TypeVar, dataclass_transform

import msgspec
import numpy as np
from msgspec import Meta

from fotismos.heuristic.errors import InputError
from fotismos.heuristic.program import cores

VERSION = 4
"""Version of all records. Records of fotismos 0.1 have none."""

OLDER = (2, 3)
CHANGES = (
    "version 3 calls rungs `methods` and prices `attribution`, and `visible` holds shares of pixels"
    " with their intervals; version 4 holds the ratio of times in `price`, and calls the `mean` of"
    " an interval `value`"
)
"""Older versions, and what changed since; records in which nothing changed are still read."""

CHANGED = ("rung", "method", "price", "attribution", "visible", "ratio", "`mean`")
"""Parts of the names of fields that changed: an error about one of them means an older record."""

PATHS = ("path", "volpath", "volpathmis")
"""Integrators with the same light as the reference: all paths up to a length."""

STOCK_RR_DEPTH = 5
"""Where Mitsuba's integrators begin to end paths at random."""

RR_DEPTH = 3
"""The same for ``direct_all``. Ending paths two reflections sooner saves a sixth of the time and
adds a tenth of the variance, on the Cornell box and on glossy spheres alike; the mean stays."""

SAMPLER = "rotated_multijitter"
STOCK_SAMPLER = "independent"
"""The sampler of Mitsuba's examples."""

Kind = TypeVar("Kind")


Amount = Annotated[float, Meta(ge=0)]
Positive = Annotated[float, Meta(gt=0)]
Share = Annotated[float, Meta(ge=0, le=1)]
Count = Annotated[int, Meta(ge=0)]
Size = Annotated[int, Meta(ge=1)]
Resolution = Annotated[tuple[Size, Size], Meta(description="Width and height in pixels.")]
Versions = Annotated[dict[str, str], Meta(description="Versions that a result depends on.")]


class RecordType(msgspec.StructMeta):
    """The type of records: all their fields are keywords, which msgspec does not inherit."""

    def __new__(
        cls, name: str, bases: tuple[type, ...], namespace: dict[str, Any], **config: Any
    ) -> "RecordType":
        made: RecordType = super().__new__(cls, name, bases, namespace, kw_only=True, **config)
        return made


# mypy does not know that `frozen` and `kw_only` are inherited.
@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(msgspec.field,))
class Record(msgspec.Struct, metaclass=RecordType, frozen=True, forbid_unknown_fields=True):
    """A type that is written as a JSON object."""


class Pixels(Record):
    """The number of pixels whose centre sees a surface, and of all."""

    counted: Count
    total: Size


class Machine(Record):
    """What times depend on: model of the processor, number of usable cores, system."""

    processor: str
    cores: Size
    system: str

    @classmethod
    def here(cls) -> "Machine":
        """Return the machine that this process runs on."""
        try:
            lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        except OSError:
            lines = []
        names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
        processor = names[0] if names else platform.processor() or platform.machine()
        return cls(
            processor=processor,
            cores=cores(),
            system=f"{platform.system()} {platform.machine()}",
        )


class Times(Record):
    """Wall times of one rendering in seconds, evaluated and synchronised.

    Attributes
    ----------
    median_s
        Median time of a pass's kernels, once compiled. Not of whole passes: the half that comes
        first after a pause pays for it.
    first_s
        The first pass, with compilation.
    compile_s
        Code generation and back end: almost nothing for kernels in Dr.Jit's cache on disk.
    """

    median_s: Amount
    passes: Size
    first_s: Amount
    total_s: Amount
    compile_s: Amount | None

    @classmethod
    def of(
        cls, passes: Sequence[float], compilation: float, kernels: Sequence[float] = ()
    ) -> "Times":
        """Return the times of some passes, and of their kernels if they have any.

        The median is of those after the first, if there are more.
        """
        timed = kernels or passes
        return cls(
            median_s=median(timed[1:] or timed),
            passes=len(passes),
            first_s=passes[0],
            total_s=sum(passes),
            compile_s=compilation,
        )


@dataclass(frozen=True)
class Missing:
    """In place of a value that does not exist; ``reason`` is a sentence."""

    reason: str


class Interval(Record):
    """A number with its 95 % interval: of Student's t over replicates, unless another is stated."""

    value: float
    low: float
    high: float


def plain(record: Any) -> Any:
    """Return a record as dictionaries, lists, text, numbers, booleans and None."""
    return msgspec.to_builtins(record, enc_hook=_numpy)


def to_json(record: Any) -> str:
    """Return the text of a record's file; ``ValueError`` for a NaN or an infinity."""
    return json.dumps(plain(record), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def read(kind: type[Kind], text: str, where: str) -> Kind:
    """Read a record from JSON; InputError names the file ``where`` if it holds none."""
    version: Any = None
    try:
        content = json.loads(text)
        if isinstance(content, dict):
            version = content.get("record_version")
            if version not in (*OLDER, VERSION):
                fault = f"its `record_version` is {json.dumps(version)}, not the number {VERSION}"
                if version is None:
                    fault = f"this record is of fotismos 0.1, not version {VERSION}"
                raise InputError(f"{where}: {fault}. Make it again.")
            content["record_version"] = VERSION
        return msgspec.convert(content, kind)
    except json.JSONDecodeError as error:
        raise InputError(f"{where}: this is not JSON: {error}. Make it again.") from error
    except RecursionError as error:
        raise InputError(f"{where}: it is nested too deep. Make it again.") from error
    except (ValueError, msgspec.ValidationError) as error:
        is_old = version in OLDER and any(name in str(error) for name in CHANGED)
        reason = f"this record is version {version}; {CHANGES} ({error})" if is_old else error
        raise InputError(f"{where}: {reason}. Make it again.") from error


def _numpy(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise NotImplementedError(f"{type(value).__name__} cannot be in a record")


WIDTH = 110
"""Columns: enough for the colours of a block of pixels with their errors."""


def laid_out(value: Any, depth: int = 0, before: str = "") -> str:
    """Return JSON with one line per entry of the outer two levels, and of others if too long.

    ``before`` is the text already on the line; ``ValueError`` for a NaN or an infinity.
    """
    line = json.dumps(value, ensure_ascii=False, allow_nan=False)
    is_empty = not isinstance(value, (dict, list, tuple)) or not value
    if is_empty or (depth > 1 and len(before) + len(line) <= WIDTH):
        return line
    indent = "  " * (depth + 1)
    if isinstance(value, dict):
        keys = [f"{json.dumps(key)}: " for key in value]
        items = list(value.values())
    else:
        keys = [""] * len(value)
        items = list(value)
    lines = [
        indent + key + laid_out(item, depth + 1, indent + key)
        for key, item in zip(keys, items, strict=True)
    ]
    return line[0] + "\n" + ",\n".join(lines) + f"\n{indent[2:]}{line[-1]}"
