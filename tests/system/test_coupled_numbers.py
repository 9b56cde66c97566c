"""Numbers of coupled runs have their errors, and say what these are of."""

from __future__ import annotations

import math

import numpy as np
import pytest

from percussion_model.coupling.coupled_run import STRING_ENERGIES, CoupledRun, summary
from percussion_model.interface.commands.couple import _lines


def test_a_coupled_rate_has_its_error():
    time = np.linspace(0.0, 4.0, 4001)
    blow = np.floor(time / 0.045)
    noise = np.random.default_rng(5).normal(1.0, 0.3, len(blow))
    advance = np.where(np.diff(blow, prepend=0.0) > 0, 7e-4 * noise, 0.0)
    columns = {
        "time": time,
        "hammer.blow_count": blow,
        "hammer.hole_depth": np.cumsum(advance),
        "hammer.bit.position": np.cumsum(advance) + 1e-2 * np.sin(time * 40.0),
    }
    found = summary(CoupledRun(columns, 1e-3, 4000))
    rate, error = found["rate_second_half"], found["rate_second_half_error"]
    assert 0.0 < error < 0.2 * rate
    # the mean of a blow by its period, and its standard error by the 44 blows of the half
    assert abs(rate - 7e-4 / 0.045) < 3.0 * error
    assert error == pytest.approx(0.3 * 7e-4 / 0.045 / math.sqrt(44.0), rel=0.5)
    assert found["rate_second_half_undecided"] is False
    (line,) = [text for text in _lines(found) if text.startswith("Rate in the second half ")]
    assert "±" in line
    assert line.endswith("mm/s (scatter alone)")
    # what the error is of, and of what it is not
    assert found["rate_second_half_error_of"] == "scatter"
    assert found["not_in_errors"] == ["communication step", "cells"]
    last = " ".join(list(_lines(found))[-1].split())
    assert last.endswith("communication step and cells is not in it.")
    # names are words, and what has no error has three digits
    assert found["without_error"] == ["depth"]
    more = {"shoulder_by_blows": -0.000718548, "shoulder_energy": -4.0144}
    shown = list(_lines(found | more | {"without_error": ["depth", *more]}))
    assert not any("_" in text for text in shown)
    assert any("-0.0719 % of blow energy (error not estimated)" in text for text in shown)
    assert any("-4.01 J (error not estimated)" in text for text in shown)
    least = summary(CoupledRun({name: column[:99] for name, column in columns.items()}, 1e-3, 98))
    assert "rate_second_half" not in least  # it has no whole blow
    short = {name: column[:200] for name, column in columns.items()}
    short = summary(CoupledRun(short, 1e-3, 199))
    assert short["rate_second_half_error"] is None
    assert short["rate_second_half_error_of"] is None
    assert not any("±" in text for text in _lines(short))
    assert short["without_error"] == ["depth", "rate_second_half"]
    assert any("error not estimated" in text for text in _lines(short))
    held = columns | {"hammer.blow_count": np.minimum(blow, 60.0)}  # from 2.7 s on
    assert "rate_second_half" not in summary(CoupledRun(held, 1e-3, 4000))


@pytest.mark.parametrize("struck", [False, True])
def test_what_the_shoulder_takes_in_a_part_of_a_blow_is_undecided(struck):
    time = np.linspace(0.0, 5e-3, 6)
    columns = {f"string.energy.{name}": 0.0 * time for name in STRING_ENERGIES}
    columns |= {
        "time": time,
        "string.energy.shoulder": 300.0 * time,
        "string.energy.head": 300.0 * time,
        "hammer.blow_count": 0.0 * time,
        "hammer.blow_energy": 0.0 * time,
        "hammer.contact.impulse": 10.0 * struck * time,
    }
    assert summary(CoupledRun(columns, 1e-3, 5))["shoulder_energy_undecided"] is struck


@pytest.mark.parametrize(
    ("lost", "step", "residual", "hidden"),
    [
        (-27.7, 1e-3, 0.0, True),  # a damper gives nothing
        (-500.0, 1e-5, 0.0, True),
        (43.7, 1e-4, 0.0, True),  # the step may make 1.2 % of the blows' 32 kJ
        (400.0, 1e-3, 0.0, False),
        (43.7, 1e-5, 0.0, False),  # and a tenth of it less
        (43.7, 1e-5, 60.0, True),
    ],
)
def test_a_loss_that_step_or_residual_may_make_is_undecided(lost, step, residual, hidden):
    """That of the shoulder, and its share of the blows' energy."""
    time = np.linspace(0.0, 4.0, 4001)
    share = time / 4.0
    columns = {f"string.energy.{name}": 0.0 * time for name in STRING_ENERGIES}
    columns |= {
        "time": time,
        "string.energy.shoulder": lost * share,
        "string.energy.bit": 600.0 * share,
        "string.energy.head": (600.0 + lost + residual) * share,
        "hammer.blow_count": np.floor(100.0 * share),
        "hammer.blow_energy": 0.0 * time + 320.0,
    }
    found = summary(CoupledRun(columns, step, 4000))
    names = ("shoulder_energy", "shoulder_by_blows")
    assert [found[f"{name}_undecided"] for name in names] == [hidden, hidden]
    assert found["shoulder_energy"] == pytest.approx(lost)  # for scripts
    shown = [text for text in _lines(found) if "lost at the bit's shoulder" in text]
    assert len(shown) == 2
    for text in shown:
        assert text.endswith(
            "undecided (its error may be as large)" if hidden else "(error not estimated)"
        )
        assert any(digit in text for digit in "0123456789") != hidden
