"""Building an FMU from the command line, and the comparison of the first run."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from fmpy import read_model_description

from fmu_src.compare import describe, run_both
from percussion_model import Scene, Simulation
from tests.commands import percussion

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}


def test_any_scene_is_baked_in_and_its_signals_lie_beside(tmp_path, capsys):
    scene = Scene().replace(**RIGID, **{"feed.force": 4321.0, "title": "more feed"})
    scene.to_toml(tmp_path / "scene.toml")
    path = tmp_path / "dist" / "MoreFeed.fmu"
    path.parent.mkdir()
    assert percussion("fmu", tmp_path / "scene.toml", "-o", path) == 0
    assert str(path) in capsys.readouterr().out
    model = read_model_description(str(path))
    starts = {one.name: one.start for one in model.modelVariables}
    assert float(starts["feed_force"]) == 4321.0
    assert "more feed" in model.description
    assert model.coSimulation.modelIdentifier == "MoreFeed"
    with open(path.with_name("MoreFeed_ref.csv"), newline="") as file:
        head, *rows = list(csv.reader(file))
    table = np.array(rows, dtype=float)
    assert head[0] == "time"
    assert {"rate_of_penetration", "blow_count"} < set(head)
    assert table[-1, 0] == pytest.approx(0.5)
    simulation = Simulation(scene)
    simulation.advance(0.5)
    assert table[-1, head.index("blow_count")] == len(simulation.blows) > 5
    with open(path.with_name("MoreFeed_in.csv"), newline="") as file:
        head, *rows = list(csv.reader(file))
    assert float(rows[0][head.index("feed_force")]) == 4321.0


def test_a_bad_scene_ends_in_one_line(tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text("[feed]\nforce = 'much'\n")
    assert percussion("fmu", "--scene", scene, "-o", tmp_path / "A.fmu") == 2
    said = capsys.readouterr().err
    assert said.startswith("percussion: ")
    assert said.count("\n") == 1
    assert "feed.force" in said
    assert not (tmp_path / "A.fmu").exists()


def test_the_comparison_prints_both_and_the_difference(tmp_path):
    scene = Scene().replace(**RIGID, **{"run.duration": 1.0, "run.settle": 0.3})
    both = run_both(scene, tmp_path / "Rigid.fmu")
    text = describe(both, scene.run.settle)
    lines = text.splitlines()
    assert lines[0].split() == ["FMU", "in", "fmpy", "library", "difference"]
    assert len(lines) == 9
    assert all(line.split()[-1] == "0" for line in lines[1:-1])
    both["fmu"]["impact_velocity"][3] += 0.5  # and a difference would show
    (line,) = [line for line in describe(both, 0.3).splitlines() if "impact" in line]
    assert line.split()[-1] == "0.5"
