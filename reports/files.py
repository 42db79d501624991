"""Files that appear whole or not at all."""

import os


def write(path, content):
    """Write bytes, or text as UTF-8, beside ``path`` and then move them there.

    Raises ``OSError`` where the place cannot be written to.
    """
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    partial.write_bytes(content.encode() if isinstance(content, str) else content)
    partial.replace(path)
