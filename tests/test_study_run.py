"""Running a study: kernels shared, work kept, processes killed, failures told."""

import gc
import json
import multiprocessing
import os
import signal
import socket
from contextlib import suppress

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from comparisons.processes import cluster
from comparisons.study import dataset, design, editing, point, rendered, running
from comparisons.study.scenes import SCENES, bsdf
from heuristic.errors import InputError, LostProcessError
from reference.effects import EFFECTS
from reference.pairing import factors, halves
from reference.pairing.albedo import RoughPlastic
from reference.rendering.guard import Guard, Verdict
from reference.scene.source import Source

SMALL = "spp = 16\nresolution = [12, 12]"


def study(parameters, scene="sphere", more=SMALL):
    text = f"[[part]]\nscene = '{scene}'\n{more}\n[part.parameters]\n{parameters}"
    return design.parse(text)


def blocks(wanted):
    return [block for part in wanted.parts for block in point.blocks(part)]


SWEEP = "alpha = [0.2, 0.4]\nlight_angle = [20, 70]\nlight_size = [2, 40]"


@pytest.mark.parametrize(
    ("scene", "parameters"),
    [("sphere", SWEEP), ("enclosure", "alpha = [0.2, 0.4]\nwall_albedo = [0.1, 0.8]")],
)
def test_a_point_after_the_first_compiles_nothing_and_makes_no_scene(
    scene, parameters, rgb, monkeypatch
):
    launched = []
    history = dr.kernel_history

    def noted(kinds):  # a renderer's own look at the history empties it
        kernels = history(kinds)
        launched[-1] += kernels
        return kernels

    monkeypatch.setattr(dr, "kernel_history", noted)
    rendered._kept.cache_clear()
    gc.collect()  # the kernels would have the BSDFs of earlier scenes
    wanted = blocks(study(parameters, scene))
    for block in wanted:
        launched.append([])
        point.rows(block)
    first, *others = launched
    assert len(first) >= 2 * rendered.PASSES
    for kernels in others:
        # By their hashes, since a cache on disk would hide what is compiled elsewhere.
        assert [kernel["hash"] for kernel in kernels] == [kernel["hash"] for kernel in first]
        assert all(kernel["cache_hit"] for kernel in kernels)
    assert [kept.made for kept in rendered._kept(scene, block.identity)] == [1, 1]


@pytest.mark.parametrize("scene", ["sphere", "enclosure"])
def test_an_edited_scene_renders_as_one_made_anew(scene, rgb):
    points = blocks(
        study("alpha = [0.2, 0.4]\nint_ior = [1.3, 1.7]\nreflectance = [0.2, 0.6]", scene)
    )
    points += blocks(study("light_size = [2, 60]", scene)) + blocks(study("n = [2, 40]", scene))
    kept = editing.Kept(), editing.Kept()
    for block in points:
        (values,) = block.points
        source = Source(scene, SCENES[scene].make(values, bsdf(values)))
        pair = halves.pair(source, resolution=(16, 16))
        for keeper, graph in zip(kept, (pair.heuristic, pair.physical), strict=True):
            edited, new = keeper.scene(graph), graph.instantiate()
            integrator = mi.load_dict({"type": "direct_all", "hide_emitters": True})
            images = [
                np.array(
                    mi.render(
                        made,
                        integrator=made.integrator() if graph is pair.heuristic else integrator,
                        spp=4,
                    )
                )
                for made in (edited, new)
            ]
            assert images[0].max() > 0.05
            np.testing.assert_allclose(images[0], images[1], rtol=1e-5, atol=1e-6)
    # One scene of each half serves all roughplastic points; the phong ones are another structure.
    assert [keeper.made for keeper in kept] == [2, 2]


def first_row(parameters, scene="sphere"):
    (block,) = blocks(study(parameters, scene))
    (found,) = point.rows(block)
    return found


def test_a_row_names_the_material_that_pairing_derived(rgb):
    """Of either side: by the factors for the values of the row."""
    found = first_row("alpha = 0.3\nint_ior = 1.5\nreflectance = 0.4")
    plastic = RoughPlastic((0.4,) * 3, 0.3, 1.5, 1.0)
    phong, _ = factors.to_phong(plastic, factors.Convention.MATCHED)
    derived = {"n": phong.n, "k_d": phong.k_d[0], "k_s": phong.k_s[0]}
    assert {name: found[name] for name in derived} == pytest.approx(derived, rel=1e-3)
    found = first_row("n = 20\nk_d = 0.3\nk_s = 0.4")
    phong = factors.Phong((0.3,) * 3, (0.4,) * 3, 20.0)
    plastic, _ = factors.to_roughplastic(phong, factors.Convention.MATCHED)
    derived = {"alpha": plastic.alpha, "int_ior": plastic.int_ior}
    derived["reflectance"] = plastic.diffuse_reflectance[0]
    assert {name: found[name] for name in derived} == pytest.approx(derived, rel=1e-3)
    found = first_row("n = 20\nk_d = 0.3\nk_s = 0")  # diffuse, which has no roughness
    assert not any(found.get(name) for name in ("alpha", "int_ior", "reflectance"))


def test_a_plan_that_a_probe_contradicts_simulates_everything(rgb, monkeypatch):
    probed = []

    def examined(chosen, *_):
        probed.append(chosen)
        return Guard(Verdict.DISAGREED, rays=9, departure=0.1, error=0.01)

    monkeypatch.setattr(rendered, "examine_plan", examined)
    monkeypatch.setattr(rendered, "_guards", {})
    plans = []
    stages = rendered._plans
    monkeypatch.setattr(rendered, "_plans", lambda chosen: plans.append(chosen) or stages(chosen))
    for alpha in (0.2, 0.3):
        first_row(f"alpha = {alpha}")
    (pruned,) = probed  # once for both points, which are planned alike
    assert not all(pruned.calls_for(effect) for effect in EFFECTS)
    assert len(plans) == 2
    for chosen in plans:
        assert all(chosen.calls_for(effect) for effect in EFFECTS)
        assert (chosen.integrator, chosen.max_depth) == ("path", -1)
        assert chosen.sampler == pruned.sampler


def test_a_study_that_ended_early_goes_on_and_repeats_nothing(rgb, tmp_path, monkeypatch):
    wanted = study("alpha = [0.1, 0.2, 0.3, 0.4]\nlight_angle = [0, 60]", "lobe", "")
    whole = running.run(wanted, tmp_path / "whole")

    def interrupted(given):
        for number, block in enumerate(given):
            if number == 3:
                raise KeyboardInterrupt
            yield block, point.rows(block)

    with pytest.raises(KeyboardInterrupt):
        running.run(wanted, tmp_path / "cut", interrupted)
    half = next((tmp_path / "cut/points").glob("*.json"))
    half.write_text(half.read_text(encoding="utf-8")[:40], encoding="utf-8")
    done = []

    def noted(given):
        for block in given:
            done.append(block.first)
            yield block, point.rows(block)

    outcome = running.run(wanted, tmp_path / "cut", noted)
    assert len(done) == 8 - 3 + 1  # the one whose file is damaged is done again
    assert (outcome.done, outcome.cached, outcome.failed) == (6, 2, 0)
    assert outcome.table.equals(whole.table)
    assert running.run(wanted, tmp_path / "cut").done == 0


def test_points_that_two_parts_share_are_done_once(rgb, tmp_path):
    text = study("light_angle = [0, 30]", "lobe", "").text
    twice = f"{text}\n" + text.replace("scene", "name = 'again'\nscene")
    given = []

    def noted(left):
        for block in left:
            given.append(block)
            yield block, point.rows(block)

    table = running.run(design.parse(twice), tmp_path, noted).table
    assert len(given) == 2
    assert table["part"].to_pylist() == ["lobe", "lobe", "again", "again"]
    assert table["dE2000"].to_pylist()[:2] == table["dE2000"].to_pylist()[2:]


def ending_processes(number):
    """Return what spreads blocks over processes, which all get a signal after the third block."""

    def spread(given):
        for count, done in enumerate(running.processes(2)(given)):
            yield done
            if count == 2:
                for child in multiprocessing.active_children():
                    os.kill(child.pid, number)

    return spread


def test_processes_give_the_same_and_a_dead_one_ends_the_run(rgb, tmp_path, monkeypatch):
    monkeypatch.setattr(running, "WORTH_A_PROCESS", 1)
    wanted = study("alpha = [0.1, 0.3]\nlight_angle = {from=0, to=85, steps=7}", "lobe", "")
    alone = running.run(wanted, tmp_path / "a")
    with pytest.raises(LostProcessError, match="run the same command again"):
        running.run(wanted, tmp_path / "b", ending_processes(signal.SIGABRT))
    outcome = running.run(wanted, tmp_path / "b")
    assert outcome.cached >= 3
    assert 0 < outcome.done <= 11
    assert outcome.table.equals(alone.table)
    killed = running.run(wanted, tmp_path / "c", ending_processes(signal.SIGKILL))
    assert killed.table.equals(alone.table)


def test_other_values_and_options_are_other_points(tmp_path):
    keys = [
        blocks(study("alpha = 0.1", "sphere", more))[0].key
        for more in ("", "seed = 1", "spp = 16", "resolution = [8, 8]", "pairing = 'literal'")
    ]
    keys += [blocks(study("alpha = 0.2", "sphere", ""))[0].key]
    keys += [blocks(study("alpha = 0.1", "enclosure", ""))[0].key]
    assert len(set(keys)) == len(keys)
    renamed = design.parse("[[part]]\nname='other'\nscene='sphere'\n[part.parameters]\nalpha=0.1")
    assert blocks(renamed)[0].key == keys[0]


def test_a_point_that_fails_is_a_row_that_says_why(rgb, tmp_path, monkeypatch):
    wanted = study("alpha = [0.1, 0.2, 0.3]", "lobe", "")
    evaluate = point._lobe

    def fails_once(part, values):
        if values["alpha"] == 0.2:
            raise ZeroDivisionError("by nothing")
        return evaluate(part, values)

    with monkeypatch.context() as patch:
        patch.setattr(point, "_lobe", fails_once)
        outcome = running.run(wanted, tmp_path)
    assert outcome.failed == 1
    assert outcome.table["error"].to_pylist() == [None, "ZeroDivisionError: by nothing", None]
    assert outcome.table["dE2000"].to_pylist()[1] is None
    assert outcome.table["alpha"].to_pylist() == [0.1, 0.2, 0.3]
    again = running.run(wanted, tmp_path)
    assert (again.done, again.cached, again.failed) == (1, 2, 0)


def test_the_dataset_says_units_meanings_and_where_it_comes_from(rgb, tmp_path):
    wanted = study("light_angle = [0, 30]", "lobe", "")
    outcome = running.run(wanted, tmp_path)
    dataset.write(tmp_path / "d.parquet", outcome.table)
    table = dataset.read(tmp_path / "d.parquet")
    assert table.equals(outcome.table, check_metadata=True)
    for field in table.schema:
        assert field.metadata[b"description"]
    assert table.schema.field("light_angle").metadata[b"unit"] == b"deg"
    assert table.schema.metadata[b"study"].decode() == wanted.text
    assert "mitsuba" in json.loads(table.schema.metadata[b"versions"])
    assert not list(tmp_path.glob("*.partial"))
    (tmp_path / "bad.parquet").write_text("nothing")
    with pytest.raises(InputError, match=r"bad\.parquet"):
        dataset.read(tmp_path / "bad.parquet")


def test_a_scene_of_ones_own_is_varied_by_paths(rgb, tmp_path):
    wanted = study("'white.reflectance' = [0.2, 0.9]", "cornell-box")
    table = running.run(wanted, tmp_path).table
    assert table["white.reflectance"].to_pylist() == [0.2, 0.9]
    dark, bright = table["reference"].to_pylist()
    assert bright > 1.3 * dark
    assert table["interreflection"].to_pylist()[1] > 2 * table["interreflection"].to_pylist()[0]
    for path, expected in (
        ("white.albedo", "white.reflectance"),
        ("floor.to_world", "is not a number"),
    ):
        with pytest.raises(InputError, match=expected):
            running.run(study(f"'{path}' = 0.5", "cornell-box"), tmp_path)
    with pytest.raises(InputError, match="neither a file nor"):
        running.run(study("'a.b' = 1", "nowhere"), tmp_path)
    with pytest.raises(InputError, match="llvm_ad_spectral"):
        running.run(study("'a.b' = 1", "metameric-pair"), tmp_path)


def test_steps_name_what_changes_the_image(rgb):
    (dark,), (bright,) = (
        point.rows(block) for block in blocks(study("wall_albedo = [0, 0.9]", "enclosure"))
    )
    assert dark["dominant"] == "form"
    assert dark["interreflection"] < 0.02 * bright["interreflection"]
    assert bright["dominant"] == "interreflection"
    # The sphere's shadow on white walls, and none where the sphere is alone.
    assert bright["occlusion"] > 0.02
    (alone,) = point.rows(blocks(study("light_size = 2"))[0])
    assert (alone["occlusion"], alone["interreflection"]) == (0, 0)
    # All steps together lead from the one half to the other.
    total = bright["form"] + bright["occlusion"] + bright["interreflection"]
    assert bright["rmse"] <= total + 1e-9


MANY = "alpha = 0.3\nlight_size = 2\nlight_angle = {from = 0, to = 90, steps = %d}"


def pids(client):
    return list(client.run(os.getpid, on_error="ignore").values())


@pytest.fixture
def taken():
    """Dask's usual port for its own page, taken by this process if not by another."""
    with socket.socket() as ours:
        with suppress(OSError):
            ours.bind(("", 8787))
            ours.listen()
        yield


@pytest.mark.parametrize(
    ("count", "workers"), [(10, 2), pytest.param(512, 4, marks=pytest.mark.slow)]
)
def test_killed_workers_change_nothing(count, workers, rgb, taken, tmp_path):
    wanted = study(MANY % count)
    undisturbed = running.run(wanted, tmp_path / "a")
    shot = []
    with cluster.local(workers) as of_ours:
        spread = running.workers_of(of_ours)

        def under_fire(given):
            from distributed import get_client

            client, rng = get_client(), np.random.default_rng(0)
            doomed = max(1, round(0.3 * workers))
            at = set(rng.choice(range(2, count - 2), max(1, count // 40), replace=False).tolist())
            for number, done in enumerate(spread(given)):
                yield done
                if number in at:
                    alive = pids(client)
                    for pid in rng.choice(alive, min(doomed, len(alive)), replace=False):
                        os.kill(int(pid), signal.SIGKILL)
                        shot.append(pid)

        outcome = running.run(wanted, tmp_path / "b", under_fire)
    assert len(shot) >= 0.3 * workers
    assert outcome.failed == 0
    assert outcome.table.equals(undisturbed.table)
