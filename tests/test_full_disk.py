"""A place that cannot be written to: one message, nothing half written, earlier results whole."""

import errno
import io
import os
from pathlib import Path

import pytest

from comparisons import atomic
from heuristic.errors import OutputError
from reports.files import listing, ownership
from reports.run import output
from tests.programs import python

CALLS = ("mkdir", "rename", "replace", "unlink", "rmdir", "open", "write")
"""What changes a disk, by its name in `os`."""


class Disk:
    """Fails one call, and all that write more from then on if it stays full."""

    def __init__(self, monkeypatch, fails_at, stays_full):
        self.count, self.fails_at, self.stays_full, self.on = 0, fails_at, stays_full, False
        for name in CALLS:
            monkeypatch.setattr(os, name, self._counted(getattr(os, name), name))
        monkeypatch.setattr(io, "open", self._opening(io.open))

    def is_full(self, frees=False):
        """Count a call, and say whether it fails; what frees space works on a full disk."""
        if not self.on:
            return False
        self.count += 1
        if self.count == self.fails_at:
            return True
        return self.stays_full and not frees and 0 < self.fails_at < self.count

    def check(self, frees=False):
        if self.is_full(frees):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def _counted(self, call, name):
        def instead(*words, **more):
            writes = name != "open" or words[1] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
            if writes:
                self.check(frees=name in ("unlink", "rmdir"))
            return call(*words, **more)

        return instead

    def _opening(self, call):
        def instead(file, mode="r", *words, **more):
            opened = call(file, mode, *words, **more)
            if self.on and set(mode) & set("wax+"):
                write = opened.write

                def torn(content):
                    if self.is_full():
                        write(content[: len(content) // 2])
                        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                    return write(content)

                return _Torn(opened, torn)
            return opened

        return instead


class _Torn:
    """A file of which one writing is cut short."""

    def __init__(self, file, write):
        self._file, self.write = file, write

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._file.close()

    def __getattr__(self, name):
        return getattr(self._file, name)


def produce(folder, text):
    """Write what commands write: files, a folder as a whole, a folder of single files."""
    with output.held(folder, "produce"):
        below = output.below(folder, "cost")
        ownership.write(below / "cost.json", text)
        with ownership.replacing_folder(folder / "scene") as place:
            (place / "a.png").write_bytes(text.encode())
            atomic.write(place / "b.json", text)
        output.as_far_as_possible(
            lambda: ownership.write(folder / "index.html", text),
            lambda: ownership.write(folder / "run.json", text),
        )


FILES = ("cost/cost.json", "scene/a.png", "scene/b.json", "index.html", "run.json")


def states(folder):
    """Return the texts of what was produced, None where it is not there.

    A scene's earlier folder may have stepped aside, from where the next run fetches it.
    """
    found = {}
    aside = atomic.beside(folder / "scene", "old")
    for name in FILES:
        path = folder / name
        if name.startswith("scene") and not path.parent.exists():
            path = aside / path.name
        found[name] = path.read_text(encoding="utf-8") if path.is_file() else None
    return found


@pytest.mark.guarantee(
    "runs",
    "If any write fails, earlier results stay intact, and no partial file is left after the "
    "next run.",
)
@pytest.mark.parametrize("stays_full", [False, True])
@pytest.mark.parametrize("earlier", [False, True])
def test_whichever_call_fails_nothing_is_torn_or_lost(tmp_path, earlier, stays_full):
    fails_at, failed = 0, 0
    while True:
        fails_at += 1
        folder = tmp_path / f"{fails_at}"
        if earlier:
            produce(folder, "old")
            (folder / "scene/mine.txt").write_text("mine", encoding="utf-8")
        with pytest.MonkeyPatch.context() as patch:
            disk = Disk(patch, fails_at, stays_full)
            disk.on = True
            message = None
            try:
                produce(folder, "new" * 10)
            except OutputError as error:
                message = str(error)
            disk.on = False
        if disk.count < fails_at:
            break
        failed += message is not None
        old = "old" if earlier else None
        found = states(folder)
        assert set(found.values()) <= {old, "new" * 10}, (fails_at, message, found)
        assert found["scene/a.png"] == found["scene/b.json"]
        if message is None:
            assert set(found.values()) == {"new" * 10}
        else:
            assert "No space left on device. Free some space" in message
            assert "Errno" not in message
        partials = [path for path in folder.rglob("*") if atomic.LEFT.fullmatch(path.name)]
        assert len(partials) <= 1, (fails_at, partials)  # one, where its removal is what failed
        produce(folder, "last")
        assert set(states(folder).values()) == {"last"}, fails_at
        assert not earlier or (folder / "scene/mine.txt").read_text(encoding="utf-8") == "mine"
        assert listing.read(folder).made == {"cost", "scene", "index.html", "run.json"}
        assert not listing.read(folder).coming
        left = {path for path in folder.rglob("*") if "fotismos-" in path.name}
        assert left == {folder / ".fotismos-lock"}, fails_at
    assert failed > 15


LIMITED = """
import resource, sys
import heuristic
from reports import cli
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv.pop(1)),) * 2)
cli.main()
"""


def limited(size, *words):
    """Run the command line with a limit on the size of files, in bytes."""
    return python("-c", LIMITED, size, *words)


def test_a_limit_on_the_size_of_files_is_told_and_tears_nothing(run, scene_file, tmp_path):
    """The page is the largest file: the scene is whole, and `run.json` is written."""
    out = tmp_path / "out"
    words = ("compare", scene_file, "-o", out, "--spp", 2, "--no-why")
    refused = limited(100, *words)
    assert (refused.returncode, refused.stdout) == (2, "")
    assert not any("fotismos-partial" in path.name for path in out.rglob("*"))
    refused = limited(300_000, *words)
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert f"{out / 'index.html'}: File too large. Raise the limit" in refused.stderr
    names = {path.name for path in out.iterdir()}
    assert names == {".fotismos", ".fotismos-lock", "my-scene", "run.json", "tables"}
    assert finished_again(run, words, out)


def finished_again(run, words, out):
    """Whether the same command goes on from a finished scene to the page."""
    before = (out / "my-scene/comparison.exr").stat().st_mtime_ns
    assert run(*words)[0] == 0
    assert (out / "index.html").is_file()
    return (out / "my-scene/comparison.exr").stat().st_mtime_ns == before


@pytest.mark.parametrize("kind", ["arrays", "JSON", "EXR", "Parquet"])
def test_every_kind_of_file_is_written_whole_or_not_at_all(kind, tmp_path):
    """Cut anywhere, at each size up to its own, also where a library writes it."""
    done = python("-c", EVERY_SIZE, kind, tmp_path)
    assert done.stdout.startswith("cut at"), done.stderr
    assert [path.suffix for path in tmp_path.iterdir()] == [".whole"]


EVERY_SIZE = """
import resource, sys
from pathlib import Path
import heuristic
import numpy as np
import pyarrow
from comparisons import store
from comparisons.study import dataset
from heuristic.errors import OutputError
from reports.files import exr

kind, folder = sys.argv[1], Path(sys.argv[2])
image = np.random.default_rng(1).random((9, 9, 3))
path = folder / {"arrays": "x.npz", "JSON": "x.json", "EXR": "x.exr", "Parquet": "x.parquet"}[kind]
write = {
    "arrays": lambda: store.Entry(path, "key").save({"a": image}),
    "JSON": lambda: store.Entry(path, "key").save({"a": image.tolist()}),
    "EXR": lambda: exr.write(path, {"reference": image}, {}),
    "Parquet": lambda: dataset.write(path, pyarrow.table({"a": image.ravel()})),
}[kind]
write()
size = path.stat().st_size
whole = path.rename(path.with_suffix(".whole")).read_bytes()
for limit in range(0, size, 7):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    try:
        write()
    except OutputError as error:
        assert "File too large" in str(error), error
    else:
        raise AssertionError(f"nothing was said at {limit} of {size}")
    assert [each.suffix for each in folder.iterdir()] == [".whole"], limit
print("cut at", size)
"""


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo])
@pytest.mark.parametrize(
    "name", ["index.html", "run.json", "tables", "my-scene", ".fotismos-lock", ".fotismos"]
)
def test_a_folder_or_a_pipe_in_place_of_a_result_is_one_message(
    run, scene_file, tmp_path, name, make
):
    place = tmp_path / "out" / name
    place.parent.mkdir()
    make(place)
    if make is Path.mkdir:
        (place / "mine").touch()
    code, printed, messages = run("compare", scene_file, "-o", place.parent, "--spp", 2)
    assert (code, printed) == (2, "")
    assert messages.startswith(f"fotismos: error: {place}: ")
    assert messages.count("\n") == 1
    assert [path.name for path in place.parent.iterdir()] == [name]


def test_what_a_user_names_is_written_in_place_of_a_file_or_into_a_device(tmp_path):
    """Never in place of a device or a link, which `/dev/stdout` is."""
    (tmp_path / "file").write_text("old")
    (tmp_path / "link").symlink_to("file")
    atomic.put(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "file").read_text() == "new"
    (tmp_path / "null").symlink_to("/dev/null")
    atomic.put(tmp_path / "null", "gone")
    (tmp_path / "full").symlink_to("/dev/full")
    with pytest.raises(OutputError, match="No space left"):
        atomic.put(tmp_path / "full", "too much")
    assert os.readlink(tmp_path / "null") == "/dev/null"
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OutputError, match="pipe: No such device"):
        atomic.put(tmp_path / "pipe", "nobody reads it")
    with pytest.raises(OutputError, match="too long"):
        atomic.put(tmp_path / ("x" * 300), "no file")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    atomic.put(tmp_path / "pipe", "read")
    assert os.read(reader, 100) == b"read"
    os.close(reader)
    assert (tmp_path / "pipe").is_fifo()
