"""``fotismos study``: files, messages and exit codes; a Dask cluster of others."""

import builtins
import os
import re
import signal
import subprocess
import sys
import time
import tomllib

import pytest

from comparisons.processes import cluster
from comparisons.study import dataset
from tests import dask_cluster
from tests.programs import ROOT

STUDY = """title = "A small study"
[[part]]
name = "lobe"
scene = "lobe"
[part.parameters]
alpha = [0.2, 0.4]
light_angle = [0, 60]
"""
TEMPLATE = '{{ study.title }}: {{ "%.3f" | format(value("lobe", "albedo_reference")) }}\n'


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(STUDY, encoding="utf-8")
    return path


def test_study_writes_dataset_figures_and_findings(run, file, tmp_path):
    (tmp_path / "small.md.j2").write_text(TEMPLATE, encoding="utf-8")
    out, page = tmp_path / "out", tmp_path / "page.md"
    code, printed, messages = run("study", file, "-o", out, "--findings", page)
    assert (code, messages) == (0, "")
    place = out / "study/small"
    table = dataset.read(place / "small.parquet")
    assert table.num_rows == 4
    assert dataset.read(tmp_path / "small.parquet").equals(table)
    assert "<svg" in (place / "figures/lobe.svg").read_text(encoding="utf-8")
    mean = sum(table["albedo_reference"].to_pylist()) / 4
    assert page.read_text(encoding="utf-8") == f"A small study: {mean:.3f}\n"
    assert str(page) in printed
    code, printed, _ = run("study", file, "-o", out)
    assert code == 0
    assert "4 points were cached" in printed


@pytest.mark.parametrize(
    ("words", "text", "expected"),
    [
        ((), STUDY.replace("alpha", "alfa"), r"small\.toml: part 'lobe': 'alfa' is not known"),
        (("--findings", "p.md"), STUDY, r"small\.md\.j2: there is no such file"),
        (("--workers", 2, "--processes", 2), STUDY, "exclude each other"),
        (("--scheduler", "tcp://127.0.0.1:9"), STUDY, "no Dask scheduler answers"),
        ((), STUDY + "[[figure]]\nname='f'\nkind='pie'", r"small\.toml: figure 'f'"),
    ],
)
def test_a_mistake_gets_one_message(words, text, expected, run, file, tmp_path, monkeypatch):
    monkeypatch.setattr("comparisons.processes.cluster.TIMEOUT", 0.5)
    file.write_text(text, encoding="utf-8")
    code, printed, messages = run("study", file, "-o", tmp_path / "out", *words)
    assert (code, printed) == (2, "")
    assert re.search(expected, messages)
    assert "Traceback" not in messages


def test_without_the_extra_it_says_how_to_install_it(run, file, tmp_path, monkeypatch):
    import_module = builtins.__import__

    def without(name, *rest):
        if name == "distributed":
            raise ImportError(name)
        return import_module(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    code, _, messages = run("study", file, "-o", tmp_path / "out", "--workers", 2)
    assert code == 2
    assert messages.endswith("-m pip install dask distributed\n")
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert list(cluster.NEEDED) == extras["optional-dependencies"]["cluster"]


def test_a_restarted_scheduler_loses_nothing_and_repeats_nothing(run, file, tmp_path):
    file.write_text(STUDY.replace("[0, 60]", "{from = 0, to = 80, steps = 8}"), encoding="utf-8")
    kept, processes = tmp_path / "out/study/small/points", []

    def study(address):
        words = ("-m", "reports", "study", file, "-o", tmp_path / "out", "--scheduler", address)
        return subprocess.Popen(
            [sys.executable, *map(str, words)],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    try:
        first = study(dask_cluster.start(processes))
        while len(list(kept.glob("*.json"))) < 3:
            assert first.poll() is None, first.communicate()
            time.sleep(0.02)
        processes[0].send_signal(signal.SIGKILL)
        _, messages = first.communicate(timeout=120)
        assert first.returncode == 1
        assert "run the same command again" in messages
        assert "Traceback" not in messages
        done = {path: path.stat().st_mtime_ns for path in kept.glob("*.json")}
        assert 3 <= len(done) < 16
        code, printed, messages = run(
            "study", file, "-o", tmp_path / "out", "--scheduler", dask_cluster.start(processes)
        )
        assert code == 0, messages
        assert f"{len(done)} points were cached" in printed
        assert all(path.stat().st_mtime_ns == when for path, when in done.items())
        assert dataset.read(tmp_path / "out/study/small/small.parquet").num_rows == 16
    finally:
        for process in processes:
            process.kill()
            process.wait()
