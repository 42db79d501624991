"""Records: frozen types from which JSON files and their published schemas are made.

A record is a :class:`Record` whose fields are the keys of a JSON object. What a field means stands
in its annotation, ``Annotated[float, msgspec.Meta(description="...", ge=0)]``, and the schema says
it too.
"""

import json
from typing import Any, TypeVar

import msgspec
import numpy as np

from heuristic.errors import InputError

VERSION = 2
"""Of all records: 2 since their types make them. Records of fotismos 0.1 have none."""

Kind = TypeVar("Kind")


class Record(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Something that is written as a JSON object."""


def plain(record: Any) -> Any:
    """Return a record as dictionaries, lists, text, numbers, booleans and None."""
    return msgspec.to_builtins(record, enc_hook=_numpy)


def to_json(record: Any) -> str:
    """Return the text of a record's file; ``ValueError`` for a NaN or an infinity."""
    return json.dumps(plain(record), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def schema(kind: type) -> dict[str, Any]:
    """Return the JSON Schema of a type of record."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **msgspec.json.schema(kind),
    }


def read(kind: type[Kind], text: str, where: str) -> Kind:
    """Read a record.

    Parameters
    ----------
    kind
        The type of record.
    text
        JSON.
    where
        Name of the file, for messages.

    Raises
    ------
    InputError
        When the text is not such a record, or one of another version.
    """
    try:
        content = json.loads(text)
        version = content.get("record_version") if isinstance(content, dict) else None
        if isinstance(content, dict) and version != VERSION:
            found = "of fotismos 0.1" if version is None else f"version {version}"
            raise InputError(
                f"{where}: this record is {found}, and version {VERSION} is read. Make it again."
            )
        return msgspec.convert(content, kind)
    except json.JSONDecodeError as error:
        raise InputError(f"{where}: this is not JSON: {error}. Make it again.") from error
    except (ValueError, msgspec.ValidationError) as error:
        raise InputError(f"{where}: {error}. Make it again.") from error


def _numpy(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise NotImplementedError(f"{type(value).__name__} has no place in a record")
