"""JSON that people read and compare: what fits on a line stands on one."""

import json
from typing import Any

WIDTH = 110
"""Columns: enough for the colours of a block of pixels, with their errors."""


def laid_out(value: Any, depth: int = 0, before: str = "") -> str:
    """Return JSON: entries of the outer two levels on lines of their own, others where they fit.

    ``before`` is what stands on the line already; ``ValueError`` for a NaN or an infinity.
    """
    line = json.dumps(value, ensure_ascii=False, allow_nan=False)
    is_empty = not isinstance(value, (dict, list, tuple)) or not value
    if is_empty or (depth > 1 and len(before) + len(line) <= WIDTH):
        return line
    indent = "  " * (depth + 1)
    if isinstance(value, dict):
        keys, items = [f"{json.dumps(key)}: " for key in value], list(value.values())
    else:
        keys, items = [""] * len(value), list(value)
    lines = [
        indent + key + laid_out(item, depth + 1, indent + key)
        for key, item in zip(keys, items, strict=True)
    ]
    return line[0] + "\n" + ",\n".join(lines) + f"\n{indent[2:]}{line[-1]}"
