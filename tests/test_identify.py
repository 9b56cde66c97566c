"""Rock from drilling data: the table, the filter, layers, intervals, the plan, the command."""

from __future__ import annotations

import csv
import json
import math
import os
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import identify as campaign
from benchmarks.hardness_index import hardness_index
from percussion_model.analysis.identify.cleaning import clean
from percussion_model.analysis.identify.drill import drill_of
from percussion_model.analysis.identify.filter import EDGE, Noise, RockFilter
from percussion_model.analysis.identify.observation import (
    GAMMA,
    RATE,
    RENEWAL,
    STIFFNESS,
    UNKNOWNS,
    Q,
)
from percussion_model.analysis.identify.part import from_numbers, to_numbers
from percussion_model.analysis.identify.plan import ROOM, plan
from percussion_model.analysis.identify.prior import KEYS, prior_of
from percussion_model.analysis.identify.profile import (
    SURE,
    identify,
    noise_of,
    strength_by_energy,
)
from percussion_model.analysis.identify.synthetic import LAG, make_hole, steps_of
from percussion_model.analysis.identify.tabulate import (
    IdentifyError,
    spread_points,
    tabulate,
)
from percussion_model.analysis.stationary import settled
from percussion_model.interface.identify_text import unknown_rows
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks.breaking import energy_by_strength
from percussion_model.scene.text import read_toml
from tests.commands import percussion

ROCK = "kuru-granite"


@pytest.fixture(scope="module")
def rigid():
    """Drill of rigid bodies, which are quick, its prior, and a table of few points."""
    drill = drill_of(hammer("dth5").computed_by("rigid"), "dth5")
    prior = prior_of(drill.scene, ROCK)
    return drill, prior, small_table(drill, prior)


def small_table(drill, prior):
    ends = {
        name: tuple(np.exp(prior.mean[k] + np.array([-2.1, 2.1]) * prior.spread[k]).tolist())
        for k, name in ((GAMMA, "unloading_ratio"), (STIFFNESS, "loading_stiffness"))
    }
    feed = drill.scene["feed.force"]
    ranges = {"pressure": (0.86 * drill.pressure, 1.02 * drill.pressure),
              "feed": (1.07 * feed, 1.29 * feed), **ends}  # fmt: skip
    return tabulate(drill.scene, drill.changes, ranges, points=60, with_splines=False)


def test_the_table_and_its_equations_are_the_settled_response(rigid):
    """Rates, frequencies and torques of scenes that were not in it, by the errors it states."""
    drill, prior, table = rigid
    random = np.random.default_rng(5)
    off = []
    for _ in range(30):
        unknowns = prior.mean + 0.8 * prior.spread * random.standard_normal(6).clip(-2.0, 2.0)
        low, high = table.middle[:2] - table.half[:2], table.middle[:2] + table.half[:2]
        setting = np.array([*np.exp(random.uniform(low, high)), random.uniform(1.5, 7.0)])
        values = dict(zip(KEYS, np.exp(unknowns).tolist(), strict=True))
        values[KEYS[0]] *= drill.scene["breaking.efficiency"]
        scene = drill.scene.replace(
            **drill.changes(setting[0]),
            **{"feed.force": setting[1], "rotation.speed": setting[2], **values},
        )
        found = settled(scene, 1e-3, 200, scatter=0.01)
        torque = float(found.counted["rotation_torque"].mean())
        measured = np.log([found.rate_of_penetration, 1.0 / found.blow_period, torque])
        off.append(table.predict(unknowns[np.newaxis], setting)[0] - measured)
    assert np.all(np.sqrt(np.mean(np.square(off), axis=0)) < 1.5 * table.errors)
    assert np.all(table.errors < [0.03, 0.015, 0.05])


def test_a_rate_tells_the_apparent_energy_alone(rigid):
    """Its sensitivity is -1, to the stiffness hardly any: docs/breaking.md."""
    drill, prior, table = rigid
    usual = steps_of(drill)[0]
    setting = np.array([usual[name] for name in ("pressure", "feed", "speed")])
    steps = 0.01 * np.eye(6)
    up, down = (table.predict(prior.mean + sign * steps, setting) for sign in (1.0, -1.0))
    slopes = (up - down)[:, RATE] / 0.02
    assert slopes[Q] == pytest.approx(-1.0, abs=1e-9)
    assert abs(slopes[STIFFNESS]) < 0.1
    assert slopes[RENEWAL] == 0.0  # at makers' speed the old craters are below the threshold


class Linear(SimpleNamespace):
    """In place of a table: signals that are linear in the unknowns."""

    def about(self, points):
        return np.zeros((len(points), 5)), np.zeros((len(points), 4, 5))

    def signals(self, rows, unknowns, speed):
        return unknowns @ self.slopes.T + math.log(speed) * (unknowns @ self.turning.T)


def test_of_linear_signals_the_filter_is_bayes(rigid):
    """Closed form: precisions add."""
    random = np.random.default_rng(2)
    table = Linear(
        slopes=random.normal(size=(3, 6)), turning=random.normal(size=(3, 6)),
        errors=np.array([0.02, 0.01, 0.05]), stretch=np.ones(2), half=np.ones(4),
        nodes=(),
    )  # fmt: skip
    mean, spread = random.normal(size=6), np.full(6, 0.6)
    truth, noise = mean + 0.3 * random.normal(size=6), Noise(0.05, 0.01, 0.1)
    found = RockFilter(table, mean, spread, noise, cells=(1, 1))
    settings = [np.array([1.0, 1.0, math.e**turn]) for turn in (1.0, 2.0, 1.0)]
    count = 40
    for k in range(3 * count):
        one = settings[k // count]
        found.sample(0.0, one, np.exp(table.signals(None, truth, one[2])))
    matrix = np.concatenate([table.slopes + turn * table.turning for turn in (1.0, 2.0)])
    counts = np.array([[2.0 * count], [count]])
    own = noise.values() ** 2 * (1.0 + EDGE**2 / counts) / counts
    own[:, RATE] += noise.varies**2
    # the table's error at one pressure and feed is the same at all rotations
    total = np.diag(own.ravel()) + np.kron(np.ones((2, 2)), np.diag(table.errors**2))
    precision = np.diag(spread**-2.0) + matrix.T @ np.linalg.solve(total, matrix)
    expected = mean + np.linalg.solve(
        precision, matrix.T @ np.linalg.solve(total, matrix @ (truth - mean))
    )
    assert found.layers == 0
    assert found.x == pytest.approx(expected, abs=1e-8)
    assert found.p == pytest.approx(np.linalg.inv(precision), abs=1e-8)


def samples_of(drill, prior, table, count, jump=0.0, speed=1.0, seed=0):
    """Signals of the table itself with noise; the apparent energy leaps in their middle."""
    random = np.random.default_rng(seed)
    usual = steps_of(drill)[0]
    setting = np.array([usual["pressure"], usual["feed"], speed * usual["speed"]])
    for k in range(count):
        unknowns = prior.mean.copy()
        unknowns[Q] += jump * (k >= count // 2)
        signals = np.exp(table.predict(unknowns[np.newaxis], setting)[0])
        yield setting, signals * np.exp(Noise().values() * random.standard_normal(3))


@pytest.mark.parametrize("jump", [-0.5, 0.4])
def test_a_layer_is_found_where_it_begins(rigid, jump):
    drill, prior, table = rigid
    found, at = RockFilter(table, prior.mean, prior.spread), []
    for k, (setting, signals) in enumerate(samples_of(drill, prior, table, 400, jump)):
        ago = found.sample(0.01, setting, signals)
        at += [k - ago + 1] * bool(ago)
    assert len(at) == 1
    assert abs(at[0] - 200) <= 3
    assert found.x[Q] == pytest.approx(prior.mean[Q] + jump, abs=SURE * found.sigma[Q])


def test_without_layers_and_with_outliers_none_is_found(rigid):
    drill, prior, table = rigid
    found = RockFilter(table, prior.mean, prior.spread)
    for k, (setting, signals) in enumerate(samples_of(drill, prior, table, 1000, seed=4)):
        signals[RATE] *= 5.0 if k % 97 == 50 else 1.0
        if k % 41 == 0:
            signals[:] = math.nan
        found.sample(0.01, setting, signals)
    assert found.layers == 0
    assert found.x[Q] == pytest.approx(prior.mean[Q], abs=SURE * found.sigma[Q])


def test_a_saved_filter_goes_on_to_the_same_bits(rigid):
    drill, prior, table = rigid
    one = RockFilter(table, prior.mean, prior.spread)
    steps = list(samples_of(drill, prior, table, 60, 0.5))
    steps[3][1][2] = math.nan
    for setting, signals in steps[:31]:
        one.sample(0.01, setting, signals)
    other = RockFilter(table, prior.mean, prior.spread)
    other.restore(json.loads(json.dumps(one.save())))
    for setting, signals in steps[31:]:
        assert one.sample(0.01, setting, signals) == other.sample(0.01, setting, signals)
    assert one.layers == 1
    assert np.array_equal(one.x, other.x)
    assert np.array_equal(one.p, other.p)


def test_numbers_of_a_part_make_the_same_filter(rigid):
    drill, prior, table = rigid
    one = RockFilter(table, prior.mean, prior.spread)
    other = from_numbers(to_numbers(one))
    for setting, signals in samples_of(drill, prior, table, 5):
        one.sample(0.01, setting, signals)
        other.sample(0.01, setting, signals)
    assert np.array_equal(one.x, other.x)


@pytest.fixture(scope="module")
def holes(rigid):
    """A hole with steps and one at a slow rotation, drilled by modes, told by rigid bodies."""
    drill, prior, table = rigid
    truth = replace(drill, scene=hammer("dth5").computed_by("modal"))
    found = {}
    for name, schedule in (("steps", steps_of(truth)), ("slow", steps_of(truth)[1:2])):
        hole = make_hole(truth, prior, schedule, 4, depth=11.0, tops=(0.0, 4.0, 8.0))
        found[name] = hole, identify(hole.log, drill, ROCK, table=table)
    return found


def test_the_lag_of_the_rate_is_found_and_told(holes):
    told = holes["steps"][1].samples.notes
    assert any(note.startswith(f"rate: {LAG} rows (") for note in told)


def test_a_rate_in_a_wrong_unit_is_told(rigid, holes):
    drill, _, table = rigid
    hole, found = holes["slow"]
    assert not any("is its unit right" in note for note in found.samples.notes)
    columns = hole.log.columns | {"rate": 15.0 * hole.log.columns["rate"]}
    other = identify(replace(hole.log, columns=columns), drill, ROCK, table=table)
    assert any("what this hammer drills in usual rock" in note for note in other.samples.notes)


def test_at_one_rotation_the_interval_says_what_it_cannot_know(holes):
    """The share of fresh rock is held with its prior, and its doubt is in the interval."""
    (_, steps), (hole, slow) = holes["steps"], holes["slow"]
    assert steps.determined()["renewal_length"]
    assert not slow.determined()["renewal_length"]
    assert unknown_rows(slow)[RENEWAL][-1] == "not determined: its prior"
    assert slow.spread[-1, RENEWAL] > 0.7 * slow.prior.spread[RENEWAL]
    assert np.median(slow.spread[:, Q]) > 1.5 * np.median(steps.spread[:, Q])
    off = np.abs(slow.mean[:, Q] - hole.truth(slow.depth))
    assert np.mean(off < SURE * slow.spread[:, Q]) > 0.9


def test_a_plan_asks_for_rotation_where_that_tells_most(holes):
    best, *others = plan(holes["slow"][1])
    assert best.setting == "speed"
    now = next(one for one in others if not one.setting)
    assert best.spread < 0.8 * now.spread
    assert "renewal_length" in best.narrowed


def test_noise_is_that_of_the_log(holes):
    _, found = holes["steps"]
    noise = noise_of(found.samples, found.table, found.prior)
    assert noise.rate == pytest.approx(0.05, rel=0.25)
    assert noise.torque == pytest.approx(0.1, rel=0.25)


def test_noise_that_goes_on_counts_for_more(holes):
    """Of noise that fades by r from sample to sample, a mean has (1 + r) / (1 - r) the variance."""
    _, found = holes["slow"]
    random, kept, count = np.random.default_rng(1), 0.6, len(found.depth)
    values = np.zeros(count)
    for k in range(1, count):
        values[k] = kept * values[k - 1] + 0.03 * random.standard_normal()
    signals = found.samples.signals.copy()
    signals[:, RATE] = 0.01 * np.exp(values)
    noise = noise_of(replace(found.samples, signals=signals), found.table, found.prior)
    spread = 0.03 / math.sqrt(1.0 - kept**2)
    assert noise.rate == pytest.approx(spread * math.sqrt((1 + kept) / (1 - kept)), rel=0.3)


@pytest.mark.skipif("PERCUSSION_LONG" not in os.environ, reason="minutes; set PERCUSSION_LONG=1")
def test_of_two_hundred_holes_the_intervals_hold_as_they_say():
    found = campaign.campaign(range(200), steps=True)
    for name in ("covered", "covered_late"):
        assert 0.90 < np.mean([getattr(one, name) for one in found]) < 0.98
    errors = np.concatenate([one.errors for one in found])
    near = np.mean(np.abs(errors) < campaign.WITHIN)
    assert near > campaign.allowed(found) - 0.02
    slow = campaign.campaign(range(50), steps=False)
    assert not any(one.told for one in slow)
    layers, told = (sum(getattr(one, name) for one in slow) for name in ("layers", "found"))
    assert 0.9 * layers < told < 1.1 * layers


def test_of_a_few_holes_the_intervals_hold(rigid):
    """Drilled by travelling waves, told by a table of modes; errors in a hole go together."""
    drill, prior, _ = rigid
    own, truth = (
        replace(drill, scene=hammer("dth5").computed_by(solver)) for solver in ("modal", "wave")
    )
    table = small_table(own, prior)
    found = []
    for seed in range(5):
        hole = make_hole(truth, prior, steps_of(truth), seed, depth=7.0, tops=(0.0, 3.5))
        found.append(campaign.score(hole, identify(hole.log, own, ROCK, table=table)))
    assert np.mean([one.covered for one in found]) > 0.75
    assert np.median(np.abs([one.errors for one in found])) < campaign.WITHIN
    assert all(abs(one.found - one.layers) <= 2 for one in found)


def test_the_strength_is_the_relation_turned_round():
    strengths = np.array([0.0, 50e6, 236e6])
    energies = np.array([energy_by_strength(one) for one in strengths])
    assert strength_by_energy(energies) == pytest.approx(strengths, abs=1.0)
    assert strength_by_energy(np.array([1e6]))[0] == 0.0


def test_the_usual_index_does_not_see_the_settings(holes):
    """Of a rate that goes with powers of them, it is the rock alone."""
    _, found = holes["steps"]
    signals = found.samples.signals.copy()
    by = found.samples.settings / np.median(found.samples.settings, axis=0)
    signals[:, RATE] = 0.01 * by[:, 0] ** 1.6 * by[:, 1] ** -0.2 * by[:, 2] ** 0.3
    index = hardness_index(replace(found.samples, signals=signals))
    assert index == pytest.approx(-math.log(0.01), abs=1e-9)


def test_points_fill_their_cube():
    points = spread_points(64, 2)
    counts, *_ = np.histogram2d(*points.T, bins=4, range=[[-1, 1], [-1, 1]])
    assert counts.min() >= 2
    assert np.abs(points).max() <= 1.0


def test_scenes_for_which_the_equations_do_not_hold_are_refused():
    scene = hammer("dth5")
    for key, value in (("rotation.old_line", True), ("breaking.flushed_volume", 1e-5)):
        with pytest.raises(IdentifyError, match=key):
            drill_of(scene.replace(**{key: value}), "dth5")
    with pytest.raises(IdentifyError, match="--bit"):
        drill_of(scene.replace(**{"effects.rotation": False, "effects.breaking": False}))


def test_a_log_without_a_scale_of_pressure_says_what_it_takes(holes):
    hole, _ = holes["slow"]
    drill, said = replace(drill_of(hammer("dth5"), "dth5"), pressure=None).at_pressure_of(hole.log)
    usual = float(np.median(hole.log.columns["pressure"]))
    assert drill.pressure == usual
    assert "--pressure" in said
    assert drill.changes(usual)["drive.force"] == drill.scene["drive.force"]


def test_a_profile_is_represented_in_a_line(holes):
    assert len(repr(holes["slow"][1])) < 80


def test_collaring_is_left_out_as_asked(holes):
    hole, _ = holes["slow"]
    own = {"pressure": 2.4e6, "feed": 11e3, "speed": 5.7}
    assert clean(hole.log, own, 1.5).depth[0] > 1.5
    assert UNKNOWNS[Q] == "apparent_energy"


def test_the_command_tells_the_rock_of_a_hole(tmp_path, capsys):
    log, out, found = tmp_path / "hole.csv", tmp_path / "rock", tmp_path / "rock.json"
    words = ("--hammer", "dth5", "--bit", "dth-140", "--solver", "rigid", "--rock", ROCK)
    assert percussion("identify", log, *words, "--example", "--plan", "--out", out,
                      "--json", found, "--part", tmp_path / "part.toml") == 0  # fmt: skip
    numbers = read_toml(tmp_path / "part.toml")["parameters"]["filter"]
    assert from_numbers(numbers).table.contains(np.array([[2.4e6, 12.1e3, 5.0]]))[0]
    said = capsys.readouterr()
    assert re.search(r"(?<!not )determined", said.out)
    assert "next metre" in said.out
    told = json.loads(found.read_text())
    assert told["samples"] + sum(told["dropped"].values()) == told["rows"]
    assert len(told["layers"]) >= 4
    assert {one["setting"] for one in told["plan"]} == {"", "pressure", "feed", "speed"}
    with (out / "rock.csv").open() as file:
        rows = list(csv.DictReader(file))
    depths = [float(row["depth"]) for row in rows]
    assert depths == sorted(depths)
    assert 0.09 < np.median(np.diff(depths)) < 0.11
    for row in rows:
        low, value, high = (float(row[f"apparent_energy{end}"]) for end in ("_low", "", "_high"))
        assert low < value < high
    assert "The next metre" in (out / "report.html").read_text(encoding="utf-8")
    assert (out / "rock.png").stat().st_size > 20_000
    assert ROOM["feed"][1] > 1.0
