"""Turns of processes: one that measures is alone, and waits for no newcomer."""

import threading
from time import monotonic, sleep

import pytest

from fotismos.comparisons.processes.pool import Turn


@pytest.mark.guarantee("runs", "While one process of a command measures, its others wait.")
def test_one_that_measures_is_alone_and_no_newcomer_comes_first(tmp_path):
    gate = tmp_path / "tables"
    gate.mkdir()
    working, order = 0, []
    lock, begun, over = threading.Lock(), threading.Event(), threading.Event()

    def measure():
        with Turn(tmp_path, gate) as turn:
            begun.wait(10)
            with turn.alone():
                order.append("measure")
                assert working == 0
                sleep(0.05)
                assert working == 0
        over.set()

    def work(name):
        nonlocal working
        with Turn(tmp_path, gate):
            with lock:
                working += 1
            order.append(name)
            begun.set()
            sleep(0.05)
            with lock:
                working -= 1

    first = [threading.Thread(target=measure), threading.Thread(target=work, args=("first",))]
    for thread in first:
        thread.start()
    assert begun.wait(10)
    deadline = monotonic() + 10
    while not over.is_set() and monotonic() < deadline:  # newcomers, one after another
        work("late")
    for thread in first:
        thread.join(10)
    assert over.is_set()
    assert order[0] == "first"
    assert "measure" in order


@pytest.mark.guarantee("runs", "A comparison takes its times while its command does nothing else.")
def test_one_that_works_gives_way_between_its_steps(tmp_path):
    """One that measures does not wait for all that another has to do."""
    gate = tmp_path / "tables"
    gate.mkdir()
    busy, measured = [0], []
    lock, both = threading.Lock(), threading.Barrier(2, timeout=10)

    def work(name):
        with Turn(tmp_path, gate) as turn:
            both.wait()
            for step in range(40):
                turn.give_way()
                with lock:
                    busy[0] += 1
                sleep(0.005)
                with lock:
                    busy[0] -= 1
                if (name, step) == ("a", 5):
                    with turn.alone():
                        assert busy[0] == 0
                        sleep(0.02)
                        assert busy[0] == 0
                        measured.append(name)
            measured.append(f"end of {name}")

    threads = [threading.Thread(target=work, args=(name,)) for name in "ab"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(10)
    assert measured[0] == "a"
    assert set(measured[1:]) == {"end of a", "end of b"}
