"""Pictures of what commands make: a comparison's page, and a study's contact sheet."""

import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from docs.figures import hero
from docs.figures.documents import DOCS, run
from fotismos.comparisons import atomic
from fotismos.reports.files.images import webp

WIDTH, HEIGHT = 1080, 880
"""Pixels of the browser's window."""

CHROMIUM = ("chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars")

WAIT = 8000
"""Milliseconds for which the page may load its pictures."""


def write_page() -> None:
    """Compare the README's scene, and write what a browser shows of its page in light colours."""
    with TemporaryDirectory() as folder:
        run("compare", hero.SCENE, "-o", folder)
        seen = Path(folder, "seen.png")
        options = (
            f"--window-size={WIDTH},{HEIGHT}",
            f"--virtual-time-budget={WAIT}",
            f"--screenshot={seen}",
            Path(folder, "index.html").as_uri(),
        )
        subprocess.run([*CHROMIUM, *options], check=True, capture_output=True)
        atomic.write(DOCS / "page.webp", webp(Image.open(seen)))


def write_study() -> None:
    """Keep the contact sheet that the example study makes."""
    with TemporaryDirectory() as folder:
        run("study", "studies/lamp-and-roughness.toml", "-o", folder)
        (sheet,) = Path(folder).glob("study/*/figures/sheet-*.webp")
        atomic.write(DOCS / "study.webp", sheet.read_bytes())
