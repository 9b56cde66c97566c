"""A wave that comes down a string from outside, at the default step, on rock that yields.

A rectangle of the force F and the duration T on rock of the stiffness K at the end of a bar of
the impedance Z gives the peak 2 F (1 - exp(-K T/Z)) and 2 (1 - exp(-K T/Z))^2 Z/(K T) of its
energy, of which the rock keeps 1 - 1/gamma.
"""

from __future__ import annotations

import math

import pytest

from percussion_model import Scene, simulate
from percussion_model.simulation.result import Result
from tests.core.chain_scenes import AREA, BARE, C0, F0, Z

GAMMA = 5.0


def pulse(lengths, duration, s, ratio=1.0, joint=(), loss=0.0, wait=0.0, **solver) -> Result:
    """A rectangle through a rod and a longer or shorter bit of another area, with K T/Z = s."""
    areas, odd = (AREA, ratio * AREA), {"top": "open", "bottom": "rock"}
    bars = [
        {"sections": [{"length": length, "area": area}]}
        for length, area in zip(lengths, areas, strict=True)
    ]
    return simulate(
        Scene(
            bars=[bars[0] | dict(joint), bars[1]], piston={"model": "absent"},
            string={**odd, "pulse_force": F0, "pulse_duration": duration},
            effects=BARE | {"rock": "bilinear", "loss": loss > 0.0, "barrier": False},
            rock={"loading_stiffness": s * ratio * Z / duration, "unloading_ratio": GAMMA},
            start={"rock_gap": 0.0}, solver=solver, loss={"time": loss or 1e-8},
            run={"settle": 0.0, "duration": sum(lengths) / C0 + (1.1 + wait) * duration},
        )
    )  # fmt: skip


def wanted(s, passed=1.0, ratio=1.0):
    """Peak [N] and the share of energy that the rock keeps."""
    fade = -math.expm1(-s)
    share = 2.0 * fade * fade / s * passed * passed / ratio
    return 2.0 * F0 * passed * fade, share * (1.0 - 1.0 / GAMMA)


@pytest.mark.parametrize("s", [0.4, 1.2564, 3.5])
@pytest.mark.parametrize("duration", [3.3e-5, 1e-4, 4.1e-4])
def test_pulse_on_rock_at_the_default_step(s, duration):
    """No length fits any other, nor the duration a step."""
    found = pulse((2.9, 0.2137), duration, s, wait=2.0 / s)  # until the rock has sent it back
    peak, share = wanted(s)
    assert found.fall["peak_bit_force"] == pytest.approx(peak, rel=5e-3)
    assert found.fall["transfer_efficiency"] == pytest.approx(share, rel=5e-3)
    assert 0.0 <= found.energy["numerical"] < 1e-2 * F0 * F0 * duration / Z


@pytest.mark.parametrize("ratio", [0.4, 2.5])
def test_pulse_through_a_step_of_impedance(ratio):
    """2 Z2/(Z1 + Z2) of its force passes; what the rock sends back returns when it has ended."""
    found = pulse((1.1, 0.3137), 1e-4, 1.2, ratio)
    peak, share = wanted(1.2, 2.0 * ratio / (1.0 + ratio), ratio)
    assert found.fall["peak_bit_force"] == pytest.approx(peak, rel=5e-3)
    assert found.fall["crushed"] == pytest.approx(share * F0 * F0 * 1e-4 / Z, rel=5e-3)


def test_pulse_through_a_lossy_joint():
    """1 - (1 - S) exp(-t/tau) of its force passes: the spring's equation, solved for that."""
    transmission, tau, duration, s = 0.7, 3e-5, 1e-4, 1.2
    joint = {"joint": "lossy", "transmission": transmission, "relaxation": tau}
    rate, fast = s / duration, 1.0 / tau
    grown = -math.expm1(-rate * duration)
    missing = (1.0 - transmission) * rate / (rate - fast)
    missing *= math.exp(-fast * duration) - math.exp(-rate * duration)
    found = pulse((1.1, 0.3137), duration, s, joint=joint)
    # what still comes when the pulse has ended is weaker than what the rock pushes back with
    assert found.fall["peak_bit_force"] == pytest.approx(2.0 * F0 * (grown - missing), rel=5e-3)


@pytest.mark.parametrize("cells", [None, 40, 120, 300])
def test_error_of_a_pulse_covers(cells):
    """At the default step and at longer ones; next to no loss, for which numbers have errors."""
    found = pulse((2.9, 0.2137), 1e-4, 1.2564, loss=1e-10, wait=2.0, cells=cells)
    for name, right in zip(("peak_bit_force", "transfer_efficiency"), wanted(1.2564), strict=True):
        off = abs(found.fall[name] - right)
        assert off <= found.errors[name]
        assert found.errors[name] < right * 2.0 * found.time_step / 1e-4
