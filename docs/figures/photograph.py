"""The picture of a comparison's page, in README and docs/page.md: a browser opens it."""

import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

from PIL import Image

from docs.figures import commands, hero
from fotismos.reports.files.images import webp

WIDTH, HEIGHT = 1080, 880
"""Pixels of the browser's window."""

CHROMIUM = ("chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars")

WAIT = 8000
"""Milliseconds for which the page may load its pictures."""


def of_page() -> bytes:
    """Compare the README's scene, open its page in light colours, and return what is seen."""
    with TemporaryDirectory() as folder:
        commands.run("compare", hero.SCENE, "-o", folder)
        seen = Path(folder, "seen.png")
        options = (
            f"--window-size={WIDTH},{HEIGHT}",
            f"--virtual-time-budget={WAIT}",
            f"--screenshot={seen}",
            Path(folder, "index.html").as_uri(),
        )
        subprocess.run([*CHROMIUM, *options], check=True, capture_output=True)
        return webp(Image.open(seen).convert("RGB"))
