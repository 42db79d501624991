"""Builds the documentation as a site, offline, from the pages and the docstrings."""

from pathlib import Path
from tempfile import TemporaryDirectory

from sphinx.cmd.build import build_main

from docs.website import sources


def build(folder: Path, *options: str) -> int:
    """Write the site into a folder; return 0 only if no link or docstring has a fault."""
    with TemporaryDirectory() as temporary:
        sources.gather(Path(temporary, "sources"))
        words = ["-b", "html", "-W", "--keep-going", "-q", "-c", str(Path(__file__).parent)]
        trees = ["-d", f"{temporary}/trees"]
        return build_main([*words, *trees, *options, f"{temporary}/sources", str(folder)])
