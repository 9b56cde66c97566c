"""The default solver against peers, on studies whose answer is known."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from percussion_model import Scene
from percussion_model.interface.commands.accuracy_tables import (
    bounds_text,
    ratio_text,
    show_bars,
    show_contests,
    show_study,
    why_text,
)
from percussion_model.verification.accuracy import Point, Reference, Study
from percussion_model.verification.accuracy.advantage import (
    MET,
    MISSED,
    PEER_MISSES,
    UNDECIDED,
    contest,
    summary,
)
from percussion_model.verification.accuracy.problems import APERIODIC, DROP, PERIODIC, quantities
from percussion_model.verification.accuracy.references import (
    Bar,
    fingerprint,
    load_references,
)


def made(ladders, bar=0.0, agreed=True, title="", kind=PERIODIC, sizes=None, threshold=False):
    """A study of ladders: pairs of time and error, by name; each rung half the size of the last."""
    key = quantities(kind)[0]
    points = [
        Point(name, f"rung {k}", sizes[k] if sizes else 0.5**k, 0.0, time, time, 3, 0.0, {},
              {key: error})
        for name, rungs in ladders.items()
        for k, (time, error) in enumerate(rungs)
    ]  # fmt: skip
    bars = {key: Bar(1.0, bar, {"wave": (1.0, bar), "explicit": (1.0, bar)}, agreed, threshold)}
    here = {"processor": "one", "cores": 1, "load": None, "python": "3"}
    return Study(title, kind, 1.0, 1.0, Reference(title, kind, bars, {}), points, {}, here)


MISS = 5e-2
WAVE = [(1.0, MISS), (2.0, 1e-3)]


def peer(time, error=1e-3):
    """A ladder whose last rung meets the error."""
    return [(0.5 * time, MISS), (time, error)]


def test_the_cheapest_peer_counts():
    found = made({"wave": WAVE, "explicit": peer(10.0), "fem": peer(50.0), "rigid": WAVE})
    one = contest(found, 1e-3)
    assert one.outcome == MET
    assert one.peer is not None
    assert one.peer.ladder == "explicit"
    assert one.ratio == pytest.approx(5.0)
    assert one.low <= one.ratio <= one.high
    assert (one.least, one.most) == (one.ratio, one.ratio)


def test_what_one_side_misses_gives_a_bound():
    lost = contest(made({"wave": WAVE, "explicit": [(10.0, MISS)], "fem": [(8.0, MISS)]}), 1e-3)
    assert lost.outcome == PEER_MISSES
    assert lost.ratio == pytest.approx(4.0)  # from the peer that was given least
    assert (lost.least, lost.most) == (lost.ratio, math.inf)
    bad = contest(made({"wave": [(2.0, MISS)], "explicit": peer(10.0)}), 1e-3)
    assert bad.outcome == MISSED
    assert bad.ratio == pytest.approx(5.0)
    assert (bad.least, bad.most) == (0.0, bad.ratio)


def test_a_coarsest_rung_that_meets_the_error_gives_a_bound():
    """What a coarser one would cost nobody knows: at most that."""
    waves = contest(made({"wave": [(2.0, 5e-4)], "explicit": peer(10.0)}), 1e-3)
    assert waves.own.is_bound
    assert (waves.least, waves.most) == (pytest.approx(5.0), math.inf)
    assert ratio_text(waves) == "≥ 5.0"
    peers = contest(made({"wave": WAVE, "explicit": [(10.0, 5e-4)]}), 1e-3)
    assert (peers.least, peers.most) == (0.0, pytest.approx(5.0))
    assert ratio_text(peers).startswith("≤ 5.0")
    both = contest(made({"wave": [(2.0, 5e-4)], "explicit": [(10.0, 5e-4)]}), 1e-3)
    assert both.outcome == UNDECIDED


def test_a_place_among_bounds_is_as_wide_as_they_leave_it():
    studies = [
        made({"wave": [(2.0, 5e-4)], "explicit": peer(8.0)}),  # at least 4
        made({"wave": WAVE, "explicit": peer(12.0)}),  # 6
        made({"wave": WAVE, "explicit": peer(2.0)}),  # 1
    ]
    told = summary([contest(one, 1e-3) for one in studies])
    assert told.luckiest == (pytest.approx(6.0), math.inf)
    assert told.median == (pytest.approx(4.0), pytest.approx(6.0))
    assert told.worst == (pytest.approx(1.0), pytest.approx(1.0))
    assert [bounds_text(one) for one in told[3:6]] == ["≥ 6.0", "4.0 to 6.0", "1.0"]


def test_what_the_reference_does_not_resolve_is_undecided():
    ladders = {"wave": [(1.0, MISS), (2.0, 5e-4)], "explicit": peer(10.0, 1e-4)}
    assert contest(made(ladders, bar=6e-4), 1e-3).outcome == UNDECIDED
    assert contest(made(ladders, agreed=False), 1e-3).outcome == UNDECIDED
    assert contest(made(ladders), 1e-3).outcome == MET


def test_the_default_solver_counts_and_another_own_one_where_it_was_not_run():
    ladders = {"modal": peer(1.0), "wave": peer(2.0), "explicit": peer(10.0)}
    found = made(ladders)
    assert found.own == "modal"
    assert contest(found, 1e-3).ratio == pytest.approx(10.0)
    assert contest(found, 1e-3, ladder="wave").ratio == pytest.approx(5.0)
    assert replace(found, solver="wave").own == "wave"  # as of a power law
    del ladders["modal"]
    assert replace(made(ladders), solver="modal").own == "wave"


def test_set_up_counts_where_it_is_asked_for():
    found = made({"modal": peer(1.0), "explicit": peer(10.0)})
    setups = {"modal": 3.0, "explicit": 1.0}
    points = [replace(point, setup=setups[point.ladder]) for point in found.points]
    found = replace(found, points=points)
    assert contest(found, 1e-3).ratio == pytest.approx(10.0)
    assert contest(found, 1e-3, duration=2.0).ratio == pytest.approx(10.5 / 2.5)
    assert found.setup(contest(found, 1e-3).own) == 3.0
    slow = replace(found, points=[replace(p, setup=9.0) if p.ladder == "fem" else p
                                  for p in made({"modal": peer(1.0), "fem": peer(8.0),
                                                 "explicit": peer(10.0)}).points])  # fmt: skip
    winners = [contest(slow, 1e-3, duration=time).peer for time in (math.inf, 2.0)]
    assert [one.ladder for one in winners] == ["fem", "explicit"]


def test_a_row_says_why_a_peer_wins_or_nobody_does():
    lost = contest(made({"wave": WAVE, "explicit": peer(1.0)}), 1e-3)
    assert why_text(lost) == (
        "explicit elements win, rung 1 meet the error for good, of the solver rung 1"
    )
    near = contest(made({"wave": WAVE, "explicit": peer(9.0)}, bar=6e-3, threshold=True), 1e-3)
    assert why_text(near) == "undecided, the motion is near a threshold"
    blurred = contest(made({"wave": WAVE, "explicit": peer(9.0)}, bar=6e-3), 1e-3)
    assert why_text(blurred) == "undecided, by the bar of the reference"
    missed = contest(made({"wave": [(2.0, MISS)], "explicit": peer(10.0)}), 1e-3)
    assert why_text(missed) == "explicit elements win, the solver misses it"
    assert contest(made({"wave": WAVE, "explicit": peer(9.0)}), 1e-3).why == ""


def test_the_summary_has_the_worst_scene_and_not_the_luckiest_alone():
    studies = [
        made({"wave": WAVE, "explicit": peer(2.0 * ratio)}, title=str(ratio))
        for ratio in (3.0, 0.5, 7.0, 11.0)
    ]
    told = summary([contest(one, 1e-3) for one in [*studies, made({"wave": WAVE}, bar=1.0)]])
    for found, ratio in zip(
        (told.luckiest, told.median, told.worst), (11.0, 5.0, 0.5), strict=True
    ):
        assert found == (pytest.approx(ratio), pytest.approx(ratio))
    assert told.where == ("11.0", "0.5")
    assert (told.scenes, told.undecided) == (5, 1)
    assert not summary([contest(studies[0], 1e-9)]).median.decided


# ------------------------------------------------------------------------------ advice


def test_advice_takes_a_finer_setting_that_is_cheaper():
    """As in the drop test, where five cells take less time than three."""
    found = made({"wave": [(1.3, 1.5e-3), (0.99, 4e-4), (1.8, 1e-4)], "explicit": peer(1.1)})
    assert "take wave, rung 1, " in found.advice(1e-2)
    assert "990 ms" in found.advice(1e-2)
    assert "luck" not in found.advice(1e-2)


def test_advice_tells_a_setting_that_is_good_by_luck_apart():
    found = made({"wave": [(1.0, 1e-4), (2.0, 2e-2), (4.0, 1e-3)]})
    first, second = found.advice(5e-3).split(". Wave")
    assert "take wave, rung 2, " in first
    assert second.startswith(", rung 0, at 1000 ms")
    assert "by luck" in second


def test_advice_does_not_name_what_the_reference_cannot_tell():
    found = made({"wave": [(1.0, 1e-2), (2.0, 1e-4)]}, bar=2e-3)
    assert "the reference does not show it: its bar is 0.20 %" in found.advice(1e-3)
    assert "take wave, rung 1" in found.advice(3e-3)
    assert "no method" in made({"wave": [(1.0, 1e-2)]}).advice(1e-3)


def test_a_longer_run_of_aperiodic_motion_is_the_finer_and_the_dearer_one():
    rungs = [(0.04, 6e-2), (0.05, 5e-3), (0.04, 1e-3)]
    found = made({"wave": rungs, "rigid": rungs}, bar=5e-3, kind=APERIODIC, sizes=[2.0, 8.0, 32.0])
    # rigid bodies have another error than that of statistics
    assert found.advice(1e-2).startswith("For 1 % take wave, rung 1, ")
    assert "400 ms (± 0 %) for the run" in found.advice(1e-2)
    cost = found.cost("wave", found.main, 5e-3)
    assert cost.value == pytest.approx(0.4)
    assert cost.decided  # a standard error does not hang on the bar of the reference


# ------------------------------------------------------------------------ what is printed


def test_a_cost_that_is_a_bound_is_shown_as_one(capsys):
    found = made({"wave": [(1e-3, 1e-3), (2e-3, 1e-5)], "explicit": peer(1e-2, 1e-5)})
    show_study(found)
    rows = [line for line in capsys.readouterr().out.splitlines() if " % " in f"{line} "]
    percents = {row.split()[0]: row for row in rows if row.split()[1:2] == ["%"]}
    assert "≤ 1.0" in percents["1"]
    assert "≤" not in percents["0.05"]
    costs = found.to_dict()["costs"]
    shown = {(one["ladder"], one["wanted"]): one["is_bound"] for one in costs}
    assert shown["wave", 1e-2]
    assert not shown["wave", 5e-4]
    assert not shown["explicit", 1e-2]


def test_tables_say_what_is_compared(capsys):
    fall = made({"wave": WAVE, "explicit": peer(10.0)}, kind=DROP)
    show_study(fall)
    assert "at an error in the resting place" in " ".join(capsys.readouterr().out.split())
    show_contests({"fall": fall})
    text = capsys.readouterr().out
    assert "fall: error in the resting place of the bit's end" in " ".join(text.split())
    assert "rate" not in text.replace("ratio", "")
    show_contests({"fall": fall, "blows": made({"wave": WAVE})})
    assert "blows: error in the rate of penetration" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("name", ["aperiodic", "reference"])
def test_a_bar_that_is_a_standard_error_promises_nothing(name, capsys):
    scene = Scene.from_toml(Path(__file__).parents[2] / "scenarios" / f"{name}.toml")
    show_bars(load_references()[fingerprint(scene)])
    said = " ".join(capsys.readouterr().out.split())
    assert ("true value lies within the bar" in said) == (name == "reference")
    assert ("The bar is the standard error of the reference" in said) == (name == "aperiodic")
