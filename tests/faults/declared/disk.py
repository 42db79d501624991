"""Places that cannot be written to, things in the way, and names that are hard to bear."""

import os
from collections.abc import Iterator
from pathlib import Path

from tests.faults.declared.baselines import WHOLE
from tests.faults.declared.words import STUDY
from tests.faults.fault import RESULTS, SMALL, UNPRIVILEGED, Fault, compare, then, written
from tests.small_scene import SCENE

MADE = "was not made by fotismos"

IN_THE_WAY = {
    "a file in place of the folder": ("out", "file", "out: "),
    "a pipe in place of the folder": ("out", "pipe", "out: "),
    "a link to itself in place of the folder": ("out", "out", "out"),
    "a link to a file in place of the folder": ("out", "mine.txt", "out"),
    "a file in place of the scene's folder": ("out/a", "file", MADE),
    "a pipe in place of the scene's folder": ("out/a", "pipe", MADE),
    "a link in place of the scene's folder": ("out/a", "../elsewhere", MADE),
    "a link to nothing in place of the scene's folder": ("out/a", "nowhere", MADE),
    "another's folder in place of the scene's": ("out/a/mine", "file", MADE),
    "another's page": ("out/index.html", "file", MADE),
    "a folder in place of the page": ("out/index.html/x", "file", MADE),
    "a link in place of the page": ("out/index.html", "../mine.txt", MADE),
    "a pipe in place of the page": ("out/index.html", "pipe", MADE),
    "another's run.json": ("out/run.json", "file", MADE),
    "a link in place of run.json": ("out/run.json", "../mine.txt", MADE),
    "a file in place of the tables": ("out/tables", "file", MADE),
    "another's table": ("out/tables/metrics.csv", "file", MADE),
    "a link in place of the tables": ("out/tables", "../elsewhere", MADE),
}
"""What is where results go: the place, what stands there (or where a link leads), what is said."""

OUTPUTS = {
    "/dev/null": "null", "/dev/full": "full", "/proc/self": "/proc/self/x",
    "a folder of /sys": "/sys/x", "a name of 300": "x" * 300, "a path of 6000": "x/" * 3000,
    "a folder below a file": "mine.txt/x",
}  # fmt: skip
RENDERED_TO = {
    "folders that are not there": "p/q/r", "a newline": "p\nq", "bytes that are no UTF-8": b"p\xff",
    "blanks": " p q ", "a dash": "./-p", "a link to a folder": "link",
}  # fmt: skip

NAMES = {
    "a newline": b"a\nb.xml", "no UTF-8": b"a\xff.xml", "a dash": b"-a.xml", "250 bytes":
    b"x" * 246 + b".xml", "dots": b"..a...xml", "markup": b"<b>&.xml", "quotes": b"'\"`$(x).xml",
    "a colon": b"a:b.xml", "the page's": b"index.html.xml", "the tables'": b"tables.xml",
    "a list's": b".fotismos.xml", "no letters": b"...xml", "emoji": "\U0001f600.xml".encode(),
    "a percent": b"%s%n.xml", "a backslash": b"a\\b.xml", "a terminal's escapes": b"a\x1b[31m.xml",
}  # fmt: skip

CLASHES = {
    "names that differ by case": ("A.xml", "a.xml"),
    "names that differ by composition": ("\u00e9.xml", "e\u0301.xml"),
    "names that are the same in two folders": ("p/a.xml", "q/a.xml"),
    "names that become the same": ("a b.xml", "a-b.xml"),
    "a file of a built-in scene's name": ("fig-8-9.xml", "fig-8-9"),
}

LIMITED = {
    "compare": compare(),
    "plan": ("plan", "a.xml"),
    "cost": ("cost", "a.xml", "-o", "out", "--rounds", "2", *SMALL),
    "fit": ("fit", "a.xml", "-o", "out", "--form", "phong", *SMALL),
    "check": ("check", "b.json", "--update", "--scene", "a.xml", "--spp", "8"),
    "study": ("study", "s.toml", "-o", "out", "--processes", "1"),
}

SPECIAL = {
    "full": "full: No space",
    "folder": "folder.*irectory",
    "pipe": "pipe: No such device",
    "mine.txt/x": "mine.txt",
    "x" * 300: "xxx.*too long",
    "/proc/x": "/proc/x",
}
"""Places for single files, and what is said."""

STREAMS = {
    "standard output full": '"$@" >/dev/full',
    "standard output closed": 'exec "$@" >&-',
    "standard error closed": 'exec "$@" 2>&-',
    "standard input closed": 'exec "$@" <&-',
    "standard error full": 'exec "$@" 2>/dev/full',
    "all of them closed": 'exec "$@" <&- >&- 2>&-',
}


def _stand(folder: Path, place: str, what: str) -> None:
    path = folder / place
    (folder / "elsewhere").mkdir()
    (folder / "elsewhere/mine.txt").write_text("mine")
    path.parent.mkdir(parents=True, exist_ok=True)
    if what == "file":
        path.write_text("mine")
    elif what == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to(what)


def faults() -> Iterator[Fault]:
    """Yield faults of the disk and of names."""
    scene = written({"a.xml": SCENE, "s.toml": STUDY})
    for name, (place, what, message) in IN_THE_WAY.items():
        stands = lambda folder, place=place, what=what: _stand(folder, place, what)  # noqa: E731
        yield Fault(name, compare(), message, (2,), then(scene, stands))
    for name, place in OUTPUTS.items():
        yield Fault(f"-o {name}", ("compare", "a.xml", "-o", place, *SMALL), "-o|another place",
                    (2,), then(scene, _special))  # fmt: skip
    for name, place in RENDERED_TO.items():
        prepare = then(
            scene, lambda f: (f / "out").mkdir(), lambda f: (f / "link").symlink_to("out")
        )
        yield Fault(f"-o with {name}", ("compare", "a.xml", "-o", place, *SMALL), "", (0,), prepare,
                    ("**/comparison.json", "**/index.html"))  # fmt: skip
    for name, file in NAMES.items():
        prepare = lambda folder, file=file: (  # noqa: E731
            Path(os.fsdecode(os.fsencode(folder) + b"/" + file)).write_text(SCENE)
        )
        words = ("compare", b"./" + file, "-o", "out", *SMALL)
        codes = (2,) if name == "no UTF-8" else (0,)  # Mitsuba has no such names
        yield Fault(f"a scene's name with {name}", words, "in UTF-8", codes, prepare, RESULTS)
    for name, files in CLASHES.items():
        prepare = written({file: SCENE for file in files if file.endswith(".xml")})
        both = ("out/*/comparison.json", "out/*-2/comparison.json")
        yield Fault(name, compare(*files), "", (0,), prepare, both)
    yield from _limits(scene)
    yield from _rights(scene)
    for name, shell in STREAMS.items():
        codes = (0, 2) if "output" in name or name == "all of them closed" else (0,)
        yield Fault(name, compare(), None if "all" in name else "output", codes, scene, RESULTS,
                    shell=shell)  # fmt: skip
        if "output" in name:
            codes = (2,) if "full" in name else (0, 2)
            yield Fault(f"{name}, for a list", ("scenes",), "output", codes, shell=shell)


def _limits(scene) -> Iterator[Fault]:
    for command, words in LIMITED.items():
        for blocks in (0, 4):
            codes = (
                (0,) if command == "plan" else (0, 2) if (command, blocks) == ("check", 4) else (2,)
            )
            yield Fault(f"{command} with files of {blocks} blocks at most", words,
                        "ulimit -f|File too large", codes, scene,
                        shell=f'ulimit -f {blocks}; exec "$@"')  # fmt: skip
    yield Fault("compare with files of 100 blocks at most", compare(), "ulimit -f", (2,), scene,
                leaves=("out/a/comparison.json", "out/run.json"),
                shell='ulimit -f 100; exec "$@"')  # fmt: skip
    yield Fault("compare with 12 open files", compare(), "open files|Too many", (0, 1, 2), scene,
                RESULTS, shell='ulimit -n 12; exec "$@"')  # fmt: skip
    check = ("check", "b", "-o", "out", "--junit")
    known = then(scene, written({"b/b.json": WHOLE.read_bytes(), "folder": None}), _special)
    for place, message in SPECIAL.items():
        yield Fault(f"--junit {place[:20]}", (*check, place), message, (2,), known)
        words = (*LIMITED["fit"], "--markdown", place)
        yield Fault(f"--markdown {place[:20]}", words, message, (2,), known)
    for place in ("link", "stdout"):
        yield Fault(f"--junit {place}", (*check, place), "", (0,), known, ours=("other.txt",))


def _special(folder: Path) -> None:
    """Make what is no file; never name a device itself, which root could replace."""
    os.mkfifo(folder / "pipe")
    for name in ("full", "stdout", "null"):
        (folder / name).symlink_to(f"/dev/{name}")
    (folder / "other.txt").write_text("replaced by way of the link")
    (folder / "link").symlink_to("other.txt")


def _rights(scene) -> Iterator[Fault]:
    drop = UNPRIVILEGED + '"$@"'
    for name, place in (("the folder", "out"), ("its parent", ".")):
        words = ("compare", "a.xml", "-o", "out" if place == "out" else "new", *SMALL)
        prepare = then(scene, lambda folder: (folder / "out").mkdir(),
                       lambda folder, place=place: (folder / place).chmod(0o555))  # fmt: skip
        yield Fault(f"no rights to write to {name}", words, "denied", (2,), prepare, shell=drop)
    for name, shell in (
        ("a umask of 777", f"umask 777; {drop}"),
        ("no HOME", 'unset HOME; exec "$@"'),
        ("a HOME that is not there", 'HOME=/nowhere/at/all exec "$@"'),
        ("a HOME that is a file", 'HOME=/etc/passwd exec "$@"'),
        ("a TMPDIR that is not there", 'TMPDIR=/nowhere exec "$@"'),
        ("a cache that is a file", 'XDG_CACHE_HOME=/etc/passwd exec "$@"'),
        ("no PATH", 'PATH= exec "$@"'),
        ("a locale that is not there", 'LC_ALL=xx_XX LANG=xx PYTHONUTF8=0 exec "$@"'),
        ("ASCII alone", 'LC_ALL=C PYTHONCOERCECLOCALE=0 PYTHONUTF8=0 exec "$@"'),
        ("a width of 0", 'COLUMNS=0 LINES=0 exec "$@"'),
        ("no terminal that is known", 'TERM=unknown exec "$@"'),
        ("a current folder that is gone", 'mkdir x; cd x; rmdir ../x; exec "$@"'),
    ):
        codes = (1, 2) if "umask" in name or "gone" in name else (0,)
        yield Fault(name, compare(), "denied|folder|file", codes, scene, RESULTS, shell=shell)
