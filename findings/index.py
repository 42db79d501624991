"""Writes README.md, the list of the scripts beside it: ``python findings/index.py``."""

from pathlib import Path

FOLDER = Path(__file__).resolve().parent
INTRODUCTION = """\
# What surprises in libraries and formats

Each script installs pinned public packages into a temporary folder, shows one behaviour of theirs
without fotismos, says why a good guess misses it, and fails if the behaviour changes:
`bash findings/NAME.sh`. They are not part of CI.
[Surprises](../docs/surprises.md) says what fotismos does about them.

| Script | What happens |
|---|---|
"""


def summary(script: Path) -> str:
    """Return what a script shows: its first line, without the mark of a comment."""
    return script.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ")


def page() -> str:
    """Return the content of README.md."""
    scripts = sorted(FOLDER.glob("*.sh"))
    rows = [f"| [{script.stem}]({script.name}) | {summary(script)} |\n" for script in scripts]
    return INTRODUCTION + "".join(rows)


if __name__ == "__main__":
    (FOLDER / "README.md").write_text(page(), encoding="utf-8")
