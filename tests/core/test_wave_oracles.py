"""The travelling-wave solver against closed forms (oracles of docs/model.md)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from bare_scenes import AREA, C0, GAP, L_B, L_P, READING, SPRING, E, Z, bar, bare
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from percussion_model import EventKind, Scene, Section, Simulation


def measured_order(sizes, errors):
    """Slope of log(error) over log(size)."""
    return np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0]


# ------------------------------------------------------------ oracle 1: equal sections


@pytest.mark.parametrize("cells", [1, 7, 20, 40])
@pytest.mark.parametrize("v", [0.3, 10.0])
def test_impact_of_equal_sections(cells, v):
    """Force Z v/2 for 2 L_p/c, then the piston rests and <v_b> = v L_p/L_b."""
    # one cell in the piston needs a bit of whole cells
    bit = bar(2 * L_P if cells == 1 else 23 / 20 * L_P)
    if cells == 7:
        bit = bar(9 / 7 * L_P)
    scene = bare(
        **{
            "start.piston_velocity": v,
            "solver.cells": cells,
            "bit.sections": bit,
        }
    )
    impact, length = GAP / v, 2 * L_P / C0
    simulation = Simulation(scene)
    assert simulation.solver.wave_speed_error < 1e-12
    # a force that is read is the mean since the last grid point: not across the closure
    first = simulation.solver.time_step / length
    inside = simulation.sample(impact + length * np.linspace(first, 1 - 1e-5, 97))
    np.testing.assert_allclose(inside["contact_force"], Z * v / 2, rtol=1e-9)
    after = simulation.sample(impact + length * np.array([1 + first, 1.3 + first, 3.0]))
    np.testing.assert_allclose(after["contact_force"], 0.0, atol=1e-9 * Z * v)
    np.testing.assert_allclose(after["piston_velocity"], 0.0, atol=1e-10 * v)
    np.testing.assert_allclose(after["bit_velocity"], v * L_P / bit[0].length, rtol=1e-10)
    fields = simulation.fields()
    np.testing.assert_allclose(fields["piston_velocity"], 0.0, atol=1e-10 * v)
    np.testing.assert_allclose(fields["piston_force"], 0.0, atol=1e-10 * Z * v)
    events = simulation.events
    assert events["kind"].tolist() == [EventKind.CONTACT_CLOSED, EventKind.CONTACT_OPENED]
    np.testing.assert_allclose(events["time"], [impact, impact + length], rtol=1e-11)
    ledger = simulation.energy()
    assert abs(ledger["residual_relative"]) < 1e-12
    assert abs(ledger["numerical_relative"]) < 1e-12


def test_impact_numbers_of_the_notes():
    found = [10 * Z / 2, 2 * L_P / C0, 10 * L_P / L_B]
    assert found == pytest.approx([1116.547e3, 67.6695e-6, 8.69565], rel=1e-6)


# ------------------------------------------------------- oracle 2: first peak on a spring


@pytest.mark.parametrize("cells", [20, 40])
@pytest.mark.parametrize("v", [8.5, 3.0])
def test_first_peak_on_linear_rock(cells, v):
    K = 7.5e8
    scene = Scene().replace(**SPRING | {"start.piston_velocity": v, "solver.cells": cells})
    t = GAP / v + (L_B + 2 * L_P) / C0
    beta = 2 * K * L_P / (E * AREA)
    p = Z * v / K * -math.expm1(-beta)
    # a hair later: a force that is read is the mean since the last grid point
    seen = Simulation(scene).sample([t * (1 - 1e-4), t * (1 + 1e-9), t * (1 + 1e-4)])
    assert seen["bit_end_position"][1] == pytest.approx(p, rel=READING)
    assert seen["bit_force"][1] == pytest.approx(K * p, rel=READING)
    assert seen["bit_end_position"][1] > seen["bit_end_position"][[0, 2]].max()
    if v == 8.5:
        assert p == pytest.approx(0.514511e-3, rel=1e-6)
        assert K * p == pytest.approx(385.883e3, rel=1e-6)


# -------------------------------------------------------- oracle 3: elastic bar on a spring


def bar_on_spring(v, K, length, until):
    """p' = v - [F(t) + 2 sum F(t - kT)]/Z, interval by interval; a function p(t)."""
    T = 2 * length / C0
    pieces = []

    def p(t):
        return pieces[min(int(t / T), len(pieces) - 1)](t)[0]

    start = 0.0
    while start < until:
        k = len(pieces)

        def slope(t, y, k=k):
            # an earlier interval's own formula, also at its right end
            past = sum(pieces[k - j](min(t - j * T, (k - j + 1) * T))[0] for j in range(1, k + 1))
            return [v - K * (y[0] + 2 * past) / Z]

        begin = [0.0 if k == 0 else float(pieces[-1](start)[0])]
        pieces.append(
            solve_ivp(
                slope,
                (start, start + T),
                begin,
                method="DOP853",
                rtol=1e-12,
                atol=1e-18,
                dense_output=True,
            ).sol
        )
        start += T
    return p


def test_elastic_bar_dropped_on_a_spring():
    """The error falls with the square of the cell."""
    v, K, T = 5.25, 7.5e8, 2 * L_B / C0
    p = bar_on_spring(v, K, L_B, 0.25e-3)
    peak = minimize_scalar(lambda t: -p(t), (0.16e-3, 0.17e-3, 0.18e-3), tol=1e-10)
    assert p(T) == pytest.approx(0.359527e-3, rel=2e-6)
    assert -peak.fun == pytest.approx(0.554510e-3, rel=2e-6)
    assert peak.x == pytest.approx(0.1722e-3, rel=3e-4)
    cells = np.array([10, 20, 40, 80])
    # grid points of all these grids; and the peak, looked for between them
    times = T * np.array([1.0, 1.6, 2.2, 2.7])
    around = np.linspace(0.95, 1.05, 2001) * peak.x
    errors = []
    for n in cells:
        changes = {"piston.model": "absent", "start.bit_velocity": v, "solver.cells": int(n)}
        scene = Scene().replace(**SPRING | changes)
        seen = Simulation(scene).sample(times)["bit_end_position"]
        largest = Simulation(scene).sample(around)["bit_end_position"].max()
        errors.append([*(seen - [p(t) for t in times]), largest + peak.fun])
    errors = np.array(errors) / -peak.fun
    # up to T the end sees nothing but its own first wave: exact
    np.testing.assert_allclose(errors[:, 0], 0.0, atol=READING)
    for column in errors.T[1:]:
        assert measured_order(1 / cells, column) == pytest.approx(2.0, abs=0.1)
    assert np.all(np.abs(errors[-1]) < 1e-5)


# ------------------------------------------------------ oracle 6: rectangular wave on rock


@pytest.mark.parametrize("beta", [0.3, 1.256431, 4.0])
def test_efficiency_of_a_rectangular_wave(beta):
    v, tau = 10.0, 2 * L_P / C0
    K = beta * Z / tau
    scene = Scene().replace(
        **SPRING
        | {
            "bit.sections": bar(4 * L_P),
            "rock.loading_stiffness": K,
            "start.piston_velocity": v,
        }
    )
    simulation = Simulation(scene)
    peak = GAP / v + 4 * L_P / C0 + tau
    end = simulation.sample([peak])["bit_end_position"][0]
    incident = tau * (Z * v / 2) ** 2 / Z
    efficiency = 2 * (1 - math.exp(-beta)) ** 2 / beta
    assert 0.5 * K * end**2 / incident == pytest.approx(efficiency, rel=3 * READING)
    if beta == 1.256431:
        assert efficiency == pytest.approx(0.814529, rel=1e-6)


# ----------------------------------------------------------------- oracle 10: section step


@pytest.mark.parametrize("areas", [(5.5e-3, 2.5e-3), (2.5e-3, 5.5e-3)])
def test_section_step(areas):
    v = 10.0
    first, second = (Section(length=4 * L_P, area=area) for area in areas)
    scene = bare(
        **{
            "piston.sections": bar(L_P, areas[0]),
            "bit.sections": (first, second),
            "start.piston_velocity": v,
            "solver.cells": 20,
        }
    )
    simulation = Simulation(scene)
    dt = simulation.solver.time_step
    simulation.advance(GAP / v + 7 * L_P / C0)  # transmitted and reflected, both free
    fields = simulation.fields()
    split = 80
    force, velocity = fields["bit_force"], fields["bit_velocity"]
    z_1, z_2 = first.impedance, second.impedance
    incident = z_1 * v / 2
    share = 2 * z_2 / (z_1 + z_2)
    transmitted = force[split:][np.abs(force[split:]) > 1.0]
    reflected = force[:split][np.abs(force[:split]) > 1.0]
    np.testing.assert_allclose(transmitted, share * incident, rtol=1e-10)
    np.testing.assert_allclose(reflected, (share - 1) * incident, rtol=1e-10)
    impedance = np.where(np.arange(len(force)) < split, z_1, z_2)
    energy = 0.5 * dt * (force**2 / impedance + impedance * velocity**2)
    whole = 2 * L_P / C0 * incident**2 / z_1
    ratio = 4 * z_1 * z_2 / (z_1 + z_2) ** 2
    assert energy[split:].sum() / whole == pytest.approx(ratio, rel=1e-10)
    assert energy[:split].sum() / whole == pytest.approx(1 - ratio, rel=1e-10)
    assert ratio == pytest.approx(0.859375, rel=1e-12)
    if areas[0] > areas[1]:
        assert share == pytest.approx(0.625, rel=1e-12)
