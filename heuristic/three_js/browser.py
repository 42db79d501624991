"""Chromium and the package of three.js: where they are, and a picture that they draw."""

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from heuristic.errors import InputError, InstallationError

HERE = Path(__file__).parent
BUILD = HERE / "node_modules/three/build"
LOCK = HERE / "package-lock.json"
PROGRAMS = ("chromium", "chromium-browser", "google-chrome")

TIMEOUT_S = 240

OPTIONS = (
    "--headless", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--allow-file-access-from-files",
    "--disable-extensions", "--disable-background-networking", "--no-first-run", "--dump-dom",
)  # fmt: skip
"""Software rendering, so a picture is the same on every machine; no network."""

PAGE = """<!doctype html><meta charset="utf-8">
<script id="scene" type="application/json">{scene}</script>
<script type="importmap">{{"imports": {{"three": "{three}"}}}}</script>
<script type="module" src="{script}"></script>
<body></body>
"""


def version() -> str:
    """Return the version of three.js in the lock file."""
    return json.loads(LOCK.read_text("utf-8"))["packages"]["node_modules/three"]["version"]


def require() -> str:
    """Return the path of Chromium.

    Raises
    ------
    InstallationError
        If it or the package is missing; the message says what to install.
    """
    if not (BUILD / "three.module.js").is_file():
        raise InstallationError(
            f"three.js {version()} is not installed, and heuristics `three:…` need it. Run npm ci"
            f" --ignore-scripts --prefix {HERE}"
        )
    for program in PROGRAMS:
        if found := shutil.which(program):
            return found
    raise InstallationError(
        f"there is no {' or '.join(PROGRAMS)}, and heuristics `three:…` need one (Debian, Ubuntu:"
        " apt-get install chromium)."
    )


def draw(scene: dict[str, Any]) -> np.ndarray:
    """Return the picture (H, W, 4) of a scene, in floats; alpha is 1 where there is a surface.

    Raises
    ------
    InstallationError
        If there is nothing to draw with.
    InputError
        With three.js' own message, if it cannot draw the scene.
    """
    program = require()
    text = json.dumps(scene).replace("<", "\\u003c")
    with TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        three, script = ((place).as_uri() for place in (BUILD / "three.module.js",
                                                        HERE / "picture.js"))  # fmt: skip
        page.write_text(PAGE.format(scene=text, three=three, script=script), encoding="utf-8")
        command = [program, *OPTIONS, f"--user-data-dir={folder}/profile", page.as_uri()]
        done = _run(command)
    if found := re.search(r'<pre id="picture">([^<]*)</pre>', done.stdout):
        floats = np.frombuffer(base64.b64decode(found[1]), np.float32)
        return floats.reshape(scene["height"], scene["width"], 4)[::-1]
    said = re.search(r'<pre id="error">([^<]*)</pre>', done.stdout)
    reason = said[1] if said else (done.stderr.strip().splitlines() or ["nothing"])[-1]
    raise InputError(f"three.js cannot draw this scene: {reason}")


def _run(command: list[str]) -> subprocess.CompletedProcess:
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired as error:
        raise InputError(
            f"three.js took longer than {TIMEOUT_S} s for this scene. Give a lower --resolution."
        ) from error
