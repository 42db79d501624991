"""Batches and checks on a Dask cluster give what they give here."""

from pathlib import Path

import pytest

from comparisons.processes import cluster
from comparisons.processes.worker import Task
from heuristic.errors import InputError
from reports import jobs
from tests import dask_cluster
from tests.interruptions import results
from tests.small_baselines import change
from tests.small_scene import SCENE


@pytest.fixture(scope="module")
def address():
    with dask_cluster.running() as found:
        yield found


def test_a_batch_is_the_same_on_a_cluster(run, apart, address, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    boxed = SCENE.replace("</film>", '<rfilter type="box"/></film>')
    for name, scene in (("a", boxed), ("b", boxed), ("c", "<scene/>")):
        (tmp_path / f"{name}.xml").write_text(scene, encoding="utf-8")
    told = []
    for out, words in (("here", ()), ("there", ("--scheduler", address))):
        names = ("a.xml", "b.xml", "c.xml")
        code, printed, messages = run("compare", *names, "-o", out, "--spp", 4, "-q", *words)
        told.append((code, printed.replace(out, ""), messages))
    assert told[0] == told[1]
    assert told[0][0] == 2
    assert "c.xml" in told[0][2]
    assert results(tmp_path / "here") == results(tmp_path / "there")


def test_tasks_of_one_name_are_apart_whoever_asks(address):
    with cluster.connected(address) as one, cluster.connected(address) as other:
        first = one.each([Task("sum", divmod, (7, 2)), Task("sum", divmod, (9, 2))])
        assert next(first)[1].result() in ((3, 1), (4, 1))
        assert other.do(Task("sum", divmod, (50, 7))) == (7, 1)
        assert next(first)[1].result() in ((3, 1), (4, 1))


def test_baselines_are_checked_on_a_cluster(run, apart, address, baselines_folder, tmp_path):
    change(baselines_folder / "fig-8-6b.json")
    words = ("check", baselines_folder, "-o", tmp_path / "out", "--scheduler", address)
    code, printed, messages = run(*words)
    assert (code, messages) == (1, "")
    assert "1 of 2 moved" in printed


def test_workers_of_two_kinds_exclude_each_other(run, scene_file, tmp_path):
    words = ("compare", scene_file, "-o", tmp_path / "out", "--scheduler", "tcp://x:1")
    code, _, messages = run(*words, "--workers", 2)
    assert code == 2
    assert "exclude each other" in messages


def test_a_worker_without_the_folder_says_so(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here").mkdir()
    jobs._enter(str(tmp_path / "here"))
    assert Path.cwd() == tmp_path / "here"
    with pytest.raises(InputError, match=r"gone: No such file or directory, on a worker"):
        jobs._enter(str(tmp_path / "gone"))
    assert Path.cwd() == tmp_path / "here"
