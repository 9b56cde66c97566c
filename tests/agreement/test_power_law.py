"""The power law of the rock by every solver: closed form, its limit, each other, the ledger."""

from __future__ import annotations

import pytest

from percussion_model import Scene, simulate
from percussion_model.physics.records import Mode

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}
SOLVERS = [{"solver.name": one} for one in ("modal", "wave", "fem")] + [RIGID]
SHORT = {"run.duration": 0.6, "run.settle": 0.3}


def drill(**changes):
    return simulate(Scene().replace(**{**SHORT, **changes}), error_estimate=False)


@pytest.mark.parametrize("exponent", [1.3, 1.5, 2.0])
def test_the_peak_of_a_drop_is_that_of_its_energy(exponent):
    scene = Scene().replace(
        **{
            "piston.model": "absent", "bit.model": "rigid", "effects.drive": "none",
            "effects.feed": False, "effects.gravity": False, "effects.barrier": False,
            "effects.rock": "power", "rock.loading_exponent": exponent,
            "start.bit_velocity": 8.0, "run.duration": 1e-3, "run.settle": 0.0,
        }
    )  # fmt: skip
    # M v^2 / 2 = K P^2 (p/P)^(n+1) / (n+1)
    stiffness, reference = scene.rock.loading_stiffness, scene.rock.reference_penetration
    share = (exponent + 1.0) * 0.5 * scene.bit.mass * 64.0 / (stiffness * reference**2)
    peak = stiffness * reference * share ** (exponent / (exponent + 1.0))
    events = simulate(scene, error_estimate=False).events
    turn = events["value"][events["kind"] == Mode.BC][0]
    assert turn == pytest.approx(peak, rel=5e-7)


@pytest.mark.parametrize("solver", SOLVERS)
def test_plain_exponents_are_the_bilinear_law_to_the_last_bit(solver):
    bilinear = drill(**solver)
    power = drill(**solver, **{"effects.rock": "power", "rock.loading_exponent": 1.0})
    assert bilinear.blows.tobytes() == power.blows.tobytes()


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_law_goes_over_into_the_bilinear_one(solver):
    # modes are stepped on a curve, and leap on the bilinear law
    close = 1e-4 if solver.get("solver.name") == "modal" else 1e-5
    bilinear = drill(**solver)
    power = drill(**solver, **{"effects.rock": "power", "rock.loading_exponent": 1.0 + 1e-7})
    assert power.rate_of_penetration == pytest.approx(bilinear.rate_of_penetration, rel=close)


# by the second law no blow is like the one before: means of 21 scatter by half a per cent
@pytest.mark.parametrize(("exponent", "unloading", "close"), [(1.5, 0.0, 1e-3), (2.0, 0.3, 0.015)])
def test_solvers_agree(exponent, unloading, close):
    law = {
        "effects.rock": "power", "rock.loading_exponent": exponent,
        "rock.unloading_exponent": unloading,
    }  # fmt: skip
    # blows by the second law repeat to 0.3 % alone
    law |= {"run.duration": 1.6, "run.settle": 0.6}
    waves = drill(**law, **{"solver.name": "wave", "solver.cells": 60})
    modes = drill(**law, **{"solver.name": "modal"})
    elements = drill(**law, **{"solver.name": "fem", "fem.elements": 120})
    rigid = drill(**law, **RIGID)
    assert modes.rate_of_penetration == pytest.approx(waves.rate_of_penetration, rel=close)
    # as the same elements and bodies do with the bilinear law
    assert elements.rate_of_penetration == pytest.approx(waves.rate_of_penetration, rel=0.01)
    assert rigid.rate_of_penetration == pytest.approx(waves.rate_of_penetration, rel=0.1)


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_ledger_closes_with_and_without_leaps(solver):
    law = {"effects.rock": "power", "rock.unloading_exponent": 0.5}
    for leaps in (True, False):
        energy = drill(**law, **solver, **{"solver.leaps": leaps}).energy
        put_in = energy["drive"] + energy["feed"] + energy["gravity"]
        assert abs(energy["residual"]) < 1e-9 * put_in
