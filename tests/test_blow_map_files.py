"""Tables of blow maps on disk, their nodes, the ladder of fidelities, the command."""

from __future__ import annotations

import io
import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from blow_map_scenes import RANGES, mapped

from fmu_src.hammer.blow_map import read_blow_map
from percussion_model import Scene, SceneError, simulate
from percussion_model.analysis import blow_maps
from percussion_model.analysis.blow_maps import (
    kept_map,
    make_map,
    map_file,
    node_count,
    outside_map,
    refused_run,
)
from percussion_model.analysis.effect_study import study_effects
from percussion_model.interface.cli import INTERRUPTED, _guarded, app
from percussion_model.physics import user_cache
from percussion_model.solvers.blow_map import builder
from percussion_model.solvers.blow_map.builder import build_table, get_table
from percussion_model.solvers.blow_map.records import Axis
from percussion_model.solvers.blow_map.table import BlowTable, Nodes, TableError, _sum

# Nodes so few that a table is made in seconds.
TINY = {"blow_map__density": 0.1}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("PERCUSSION_CACHE", str(tmp_path))
    return tmp_path


def test_without_a_home_tables_are_kept_with_temporary_files(monkeypatch, tmp_path, caplog):
    def no_home():
        raise RuntimeError("Could not determine home directory.")

    for name in ("PERCUSSION_CACHE", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", no_home)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    user_cache._temporary.cache_clear()
    scene = mapped(**TINY)
    made = make_map(scene, workers=1)
    assert map_file(scene).is_file()
    assert map_file(scene).parent.parent.stat().st_mode & 0o077 == 0
    assert kept_map(scene).to_bytes() == made.to_bytes()
    assert "home directory" in caplog.text
    user_cache._temporary.cache_clear()


def test_a_damaged_file_is_made_again(cache):
    scene = mapped(**TINY)
    made = make_map(scene, workers=1)
    path = map_file(scene)
    whole = path.read_bytes()
    for damaged in (b"", b"nonsense", whole[: len(whole) // 2], _flipped(whole)):
        path.write_bytes(damaged)
        assert kept_map(scene) is None
    again = make_map(scene, workers=1)
    assert path.read_bytes() == whole
    np.testing.assert_array_equal(again.values.astype(np.float32), made.values.astype(np.float32))
    assert {one.name for one in cache.iterdir()} == {path.name}


def _flipped(data):
    at = len(data) // 2
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


def test_an_interrupted_build_goes_on_where_it_was(cache):
    scene = mapped(**TINY)
    seen = []

    def stop(done, total):
        seen.append((done, total))
        if done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        get_table(scene, stop)
    assert kept_map(scene) is None
    get_table(scene, lambda done, total: seen.append((done, total)))
    total = seen[0][1]
    assert [done for done, _ in seen] == [0, 1, *range(1, total + 1)]


def test_an_interrupted_command_says_what_is_kept(cache, tmp_path, monkeypatch, capsys):
    path = tmp_path / "scene.toml"
    mapped(**TINY).to_toml(path)
    make, made = builder.make_slab, []

    def stop(*task):
        if made:
            raise KeyboardInterrupt
        made.append(task)
        return make(*task)

    monkeypatch.setattr(builder, "make_slab", stop)
    words = ["blow-map", str(path), "--workers", "1"]
    assert _guarded(lambda: app(words, standalone_mode=False)) == INTERRUPTED
    told = " ".join(capsys.readouterr().err.split())
    assert told.endswith("interrupted; 1 part of the blow map is kept, the same command continues")
    drafts = map_file(mapped(**TINY)).with_suffix(".part")
    assert [one.name for one in drafts.iterdir()] == ["0.npy"]


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no SIGINT to a child")
def test_ctrl_c_does_not_wait_for_what_workers_have_begun(tmp_path):
    """Each part of this table takes a minute or more."""
    path = tmp_path / "scene.toml"
    mapped(solver__cells=200, blow_map__density=3.0).to_toml(path)
    code = "from percussion_model.interface.cli import main; main()"
    child = subprocess.Popen(
        [sys.executable, "-c", code, "blow-map", str(path), "--workers", "2"],
        stderr=subprocess.PIPE, text=True, start_new_session=True,
        env={**os.environ, "PERCUSSION_CACHE": str(tmp_path / "cache")},
        # a shell may have started the tests with the signal ignored
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    try:
        while "parts of the blow map" not in (line := child.stderr.readline()):
            assert line, "it ended by itself"
        began = time.monotonic()
        child.send_signal(signal.SIGINT)
        _, told = child.communicate(timeout=30)
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
    assert child.returncode == INTERRUPTED
    assert time.monotonic() - began < 5.0, "a second or two on a machine with nothing else to do"
    assert told.splitlines()[-1] == "percussion: interrupted before there was a result"
    assert "Traceback" not in told
    assert [one for one in (tmp_path / "cache").rglob("*") if one.is_file()] == []


def test_builders_side_by_side_do_no_harm(cache):
    """A second builder that takes the same drafts away while the first is at it."""
    scene = mapped(**TINY)
    drafts = map_file(scene).with_suffix(".part")
    others = []

    def meddle(done, total):
        if done == 1 and not others:
            others.append(build_table(scene, drafts))

    table = build_table(scene, drafts, meddle)
    np.testing.assert_array_equal(table.values, others[0].values)


def test_the_file_depends_on_what_the_table_depends_on(cache):
    base = map_file(mapped())
    same = {"feed__force": 2200.0, "rock__loading_stiffness": 7e8, "drive__force": 2600.0}
    same |= {"drive__reversal_distance": 0.05, "start__piston_velocity": 8.0, "title": "other"}
    for key, value in same.items():
        assert map_file(mapped(**{key: value})) == base, key
    for change in (
        {"rock__unloading_ratio": 6.0},
        {"loss__time": 1e-7},
        {"solver__cells": 10},
        {"bit__sections": [{"length": 0.2, "area": 0.0055}]},
        {"blow_map__density": 2.0},
        {"blow_map__feed_to": 4000.0},
    ):
        assert map_file(mapped(**change)) != base, change


def test_an_fmu_unpacked_over_another_brings_its_own_table(cache, tmp_path):
    folder = tmp_path / "resources"
    folder.mkdir()
    found = []
    for feed_to in (3000.0, 3500.0):
        scene = mapped(**TINY, blow_map__feed_to=feed_to)
        (folder / "blow_map.npz").write_bytes(make_map(scene, workers=1).to_bytes())
        found.append(read_blow_map(str(folder)))
        assert read_blow_map(str(folder)) is found[-1]
    assert [table.highest[Axis.LOAD] for table in found] == [3000.0, 3500.0]


def test_bytes_that_are_no_table_are_refused():
    with pytest.raises(TableError):
        BlowTable.from_bytes(b"PK\x03\x04 no archive")


def _with(data, change):
    """A table's file after a change of what it says, with a checksum that fits."""
    with np.load(io.BytesIO(data)) as parts:
        about, values = json.loads(str(parts["about"])), parts["values"]
    values = change(about, values)
    text, out = json.dumps(about), io.BytesIO()
    np.savez_compressed(out, about=np.array(text), values=values, sum=_sum(text, values))
    return out.getvalue()


def _fewer_values(about, values):
    return values[:-1]


def _other_counts(about, values):
    about["counts"][0] += 1000
    return values


def _no_step(about, values):
    about["nodes"][3][0] = 0.0
    return values


def _words(about, values):
    about["nodes"] = "words"
    return values


@pytest.mark.parametrize("change", [_fewer_values, _other_counts, _no_step, _words])
def test_a_table_whose_nodes_are_not_those_of_its_values_is_refused(cache, change):
    """With a sum that fits: kernels would read beside the values."""
    data = get_table(mapped(**TINY)).to_bytes()
    assert BlowTable.from_bytes(_with(data, lambda about, values: values))
    with pytest.raises(TableError, match="damaged"):
        BlowTable.from_bytes(_with(data, change))


def test_nodes_cover_the_ranges():
    nodes = Nodes.of(Scene().replace(**{"solver.fidelity": "blow-map"}))
    assert node_count(Scene()) == len(nodes.wanted()) * nodes.counts[0]
    wanted = set(nodes.wanted())
    rng = np.random.default_rng(2)
    for _ in range(2000):
        v, feed, force = (
            rng.uniform(nodes.lowest[axis], nodes.highest[axis])
            for axis in (Axis.VELOCITY, Axis.LOAD, Axis.DRIVE)
        )
        place = (v, (feed + nodes.weight) / v, force / v)
        cell = [
            int((math.log(value) - nodes.origin[axis]) / nodes.step[axis])
            for value, axis in zip(place, (Axis.VELOCITY, Axis.LOAD, Axis.DRIVE), strict=True)
        ]
        for corner in np.ndindex(2, 2, 2):
            assert tuple(int(c + d) for c, d in zip(cell, corner, strict=True)) in wanted


# ------------------------------------------------------------------- ladder, command


def test_the_rigid_rung_is_the_rigid_scene():
    """An elastic scene on the rigid rung gives the bits of one whose bodies are rigid."""
    rung = simulate(Scene().replace(**{"solver.fidelity": "rigid"}), 1.0, settle=0.2)
    rigid = simulate(Scene().computed_by("rigid"), 1.0, settle=0.2)
    assert rung.solver == rigid.solver == "rigid"
    assert rung.blows.tobytes() == rigid.blows.tobytes()
    assert not rung.warnings


def test_a_name_says_how_waves_are_computed_and_nothing_else():
    with pytest.raises(SceneError, match=r"solver\.fidelity = \"rigid\" and solver\.name"):
        Scene().replace(**{"solver.fidelity": "rigid", "solver.name": "fem"})
    assert Scene().computed_by("blow-map").solver_name == "blow-map"
    assert Scene().computed_by("blow-map").computed_by("fem").solver_name == "fem"


def said(folder, capsys, command):
    """What calls a command on a scene with a tiny table; what it says on stdout."""
    path = folder / "scene.toml"
    mapped(**TINY).to_toml(path)

    def call(*words):
        assert not _guarded(lambda: app([command, str(path), *words], standalone_mode=False))
        return capsys.readouterr().out

    return call


def test_the_command_makes_shows_and_finds_a_table(cache, tmp_path, capsys):
    call = said(tmp_path, capsys, "blow-map")
    file = Path(call("where").strip())
    assert file.parent == cache
    assert "not made yet" in call("show")
    assert not file.exists()
    assert "kept" in call("--workers", "1")
    assert file.exists()
    told = json.loads(call("show", "--json", "-"))
    assert told["made"]
    assert told["restless_nodes"] == 0
    assert told["range"]["feed_force"] == list(RANGES["feed"])
    assert told["outside"] == []


def test_explain_says_what_a_table_would_cost_and_makes_none(cache, tmp_path, capsys):
    call = said(tmp_path, capsys, "explain")
    before = json.loads(call("--json", "-"))
    assert list(cache.glob("*.npz")) == []
    assert before["solver"] == "blow-map"
    assert before["predicted_wall_time"] is None
    assert before["blow_map_to_make"]["blows"] == node_count(mapped(**TINY))
    assert before["setup_time"] > 0.0
    assert "not made yet" in call()
    assert refused_run(mapped(**TINY), 1.0) == ""
    assert list(cache.glob("*.npz")) == []
    make_map(mapped(**TINY), workers=1)
    after = json.loads(call("--json", "-"))
    assert set(after) == set(before)
    assert after["blow_map_to_make"] is None
    assert after["predicted_wall_time"] > 0.0
    text = " ".join(call().replace("│", " ").split())
    assert "not made yet" not in text
    # no coarser table is known: nothing is promised
    assert "its error is not estimated" in text
    assert "short runs" not in text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rock__unloading_ratio": 40.0}, "the piston falls back on the bit before"),
        ({"drive__force": 9000.0}, "covers 2500 to 3500 N; blow_map.force_to widens it"),
        ({"feed__force": 0.0}, "covers 2000 to 3500 N; blow_map.feed_from widens it"),
    ],
)
def test_a_run_that_its_table_would_refuse_is_refused_before(
    change, words, cache, tmp_path, capsys
):
    """What to change is said, and no minutes are spent."""
    path = tmp_path / "scene.toml"
    mapped(**change).to_toml(path)
    out = ["--out", str(tmp_path / "out")]
    for command in (["run"], ["settled"], ["plot", *out], ["compare", "--solvers=blow-map", *out]):
        code = _guarded(lambda words=command: app([*words, str(path)], standalone_mode=False))
        told = capsys.readouterr().err
        assert code != 0
        assert "the blow map was not made" in told
        assert words in told
        assert list(cache.glob("*.npz")) == []


def test_no_blow_maps_are_made_for_a_study_of_effects(cache):
    with pytest.raises(SceneError, match="would make a blow map for each effect"):
        study_effects(mapped())
    assert list(cache.glob("*.npz")) == []


def test_the_cost_of_a_table_is_that_of_its_rocks_and_of_its_blows(monkeypatch):
    """On an invented clock: a rock takes 0.5 s to make ready, a blow 2 ms, the first a minute."""
    now = [0.0]

    class Slow:
        def __init__(self, scene, stiffness):
            now[0] += 0.5

        def entries(self, *blow):
            now[0] += 2e-3 if now[0] > 60.0 else 60.0

    monkeypatch.setattr(blow_maps, "SingleBlow", Slow)
    monkeypatch.setattr(blow_maps, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    scene = mapped()
    cost, rocks = blow_maps.map_cost(scene), Nodes.of(scene).counts[Axis.STIFFNESS]
    assert cost.blows == node_count(scene)
    assert cost.processor_time == pytest.approx(0.5 * rocks + 2e-3 * cost.blows)
    assert now[0] < 70.0


def test_a_scene_outside_its_own_table_is_told_before_the_table_is_made(cache, tmp_path, capsys):
    low, high = RANGES["stiffness"]
    rocks = {0.99 * low: "stiffness_from", low: "", high: "", 1.01 * high: "stiffness_to"}
    for stiffness, key in rocks.items():
        told = outside_map(mapped(rock__loading_stiffness=stiffness))
        assert len(told) == bool(key)
        for text in told:
            assert f"{stiffness:.6g} N/m" in text
            assert f"blow_map.{key} widens it" in text
    words = outside_map(mapped(feed__force=100.0, drive__force=9000.0))
    assert [text.split(" = ")[0] for text in words] == ["feed.force", "drive.force"]

    path = tmp_path / "scene.toml"
    mapped(**TINY, feed__force=100.0).to_toml(path)
    arguments = ["blow-map", str(path), "--workers", "1"]
    assert not _guarded(lambda: app(arguments, standalone_mode=False))
    hint, warning = capsys.readouterr().err.split("percussion: ")[1:3]
    assert hint.startswith("hint: feed.force = 100 N: 2500 to")  # it is far from what is usual
    assert warning.startswith("warning: feed.force = 100 N: the blow")
