"""The predicted cost of a run, on clocks that are invented: no test depends on a time."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from percussion_model import Scene
from percussion_model.analysis.cost import (
    LONGEST_PROBE,
    PROBE_BLOWS,
    PROBE_WALL,
    Mark,
    explained,
    forecast,
    predict,
    probe,
)
from percussion_model.interface.cli import app
from percussion_model.solvers.base import make_solver

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
SOLVER = make_solver(Scene().replace(**RIGID))


class Clock:
    """A simulation whose cost is known: blows have a dear beginning, the first costs more.

    `wall_at` is its exact wall time at any simulated time.
    """

    row_bytes = 0

    def __init__(self, period, cost, first=3.0, share=0.9, start=0.0):
        self.period, self.cost, self.first = period, cost, first
        self.share, self.start = share, start
        self.time = 0.0

    @property
    def wall_time(self):
        return self.wall_at(self.time)

    def wall_at(self, t):
        blow, rest = divmod(t, self.period)
        # nine tenths of a blow's cost in the first tenth of its time
        within = min(rest / (0.1 * self.period), 1.0) * self.share
        within += rest / self.period * (1.0 - self.share)
        whole = blow + (self.first - 1.0 if blow >= 1 else 0.0)
        return self.start + self.cost * (whole + within * (self.first if blow < 1 else 1.0))

    def advance(self, t):
        assert t > self.time
        self.time = t

    def statistics(self):
        blows = int(self.time / self.period)
        return {"blows": blows, "steps": 100 * blows, "events": 50 * blows}


@pytest.mark.parametrize("cost", [1e-6, 1e-3, 0.05, 0.4, 1.5])
@pytest.mark.parametrize("period", [0.0123, 0.0456, 0.2])
def test_prediction_of_a_known_cost(cost, period):
    clock = Clock(period, cost)
    marks = probe(clock, 4.0)
    found = predict(SOLVER, 0.1, marks, 4.0)
    assert found.wall_time == pytest.approx(clock.wall_at(4.0), rel=0.25)
    assert found.probed == clock.time
    if found.per_blow is not None:
        assert found.per_blow == pytest.approx(cost, rel=0.25)
        assert found.counts == {"steps": 100.0, "events": 50.0}


def test_a_probe_of_a_dear_scene_ends():
    clock = Clock(0.05, 100.0)
    probe(clock, 4.0)
    assert clock.wall_time < 2.5 * LONGEST_PROBE  # one piece beyond
    quick = Clock(0.05, 0.5)
    probe(quick, 4.0)
    assert PROBE_WALL < quick.wall_time < LONGEST_PROBE
    assert quick.statistics()["blows"] == PROBE_BLOWS


def test_a_cheap_run_is_measured_to_its_end():
    """What happens late in it need not show in its beginning."""
    clock = Clock(0.05, 1e-3)
    probe(clock, 4.0)
    assert clock.time == 4.0


def test_a_whole_run_that_was_probed_is_not_extrapolated():
    marks = [Mark(0.0, 0.0, {}), Mark(0.5, 2.0, {}), Mark(1.0, 2.5, {})]
    assert predict(SOLVER, 0.0, marks, 1.0).wall_time == 2.5
    assert predict(SOLVER, 0.0, marks, 2.0).wall_time == 5.0


def test_where_blows_have_ceased_the_rest_counts():
    """Three quick blows, a cheap flight, then a dear rest."""
    blows = [Mark(0.01 * k, 0.001 * k, {"blows": k}) for k in range(4)]
    flight = [Mark(0.1 * k, 0.003, {"blows": 3}) for k in range(1, 11)]
    rest = [Mark(1.0 + 0.01 * k, 0.003 + 0.1 * k, {"blows": 3}) for k in range(1, 11)]
    found = predict(SOLVER, 0.0, [*blows, *flight, *rest], 3.0)
    assert found.per_second == pytest.approx(10.0)
    assert found.wall_time == pytest.approx(1.003 + 1.9 * 10.0)
    assert found.per_blow is None


def test_a_scene_is_forecast_and_explained():
    scene = Scene().replace(
        **RIGID, **{"effects.barrier": False, "run.duration": 1.0, "run.settle": 0.1}
    )
    found = forecast(scene)
    assert found.runs == 1
    assert found.probed == 1.0  # it takes no second
    assert found.counts["events"] > 10
    told = json.loads(json.dumps(explained(scene, found), allow_nan=False))
    assert told["solver"] == "rigid"
    assert "barrier" in told["effects_off"]
    assert set(told["effects_on"]) == {"gravity", "feed", "drive", "rock"}
    assert told["predicted_wall_time"] > 0.0


def test_command_gives_json_alone(tmp_path):
    file = tmp_path / "scene.toml"
    Scene().replace(**RIGID, **{"run.duration": 0.5, "run.settle": 0.1}).to_toml(file)
    plain = json.loads(CliRunner().invoke(app, ["explain", str(file), "--json", "-"]).stdout)
    assert plain["duration"] == 0.5
    assert plain["wall_time_per_blow"] > 0.0
