"""Supply and hammer coupled by pressure and mass of air, in a hole with water."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fmu_src.system.archive import SYSTEMS, build_fmus, read_plan, write_system
from percussion_model import Scene, simulate
from percussion_model.coupling import Coupling
from percussion_model.scene.presets import scene_file

SIGNALS = (
    "supply.air_given", "supply.air_lost", "supply.air_stored", "supply.hose_pressure",
    "supply.back_pressure", "hammer.pneumatic.consumed", "hammer.pneumatic.supply",
    "hammer.blow_count", "hammer.impact_velocity",
)  # fmt: skip
AMBIENT = 101_325.0


@pytest.fixture(scope="module")
def archive(built_library, tmp_path_factory):
    folder = tmp_path_factory.mktemp("air")
    plan = read_plan(SYSTEMS / "air_drilling.toml")
    return write_system(plan, build_fmus(plan, folder), folder / "AirDrilling.ssp")


@pytest.fixture(scope="module")
def drilled(archive):
    """Two and a half seconds, every step kept."""
    return Coupling(archive).run(2.5, 1e-3, SIGNALS)


def test_all_air_is_somewhere(drilled):
    """The supply takes in a step what the hammer has used in the one before."""
    given, lost, stored, used = (drilled[name] for name in (*SIGNALS[:3], SIGNALS[5]))
    missing = (given - given[0]) - lost - (stored - stored[0]) - np.r_[0.0, used[:-1]]
    assert np.abs(missing).max() < 1e-12
    assert used[-1] > 0.9


def test_the_hammer_has_the_pressure_of_the_hose_and_the_hole_its_water(drilled):
    here = drilled["hammer.pneumatic.supply"][2:] - AMBIENT
    np.testing.assert_allclose(here, drilled["supply.supply_pressure"][1:-1], atol=1e-3)
    lost = drilled["supply.hose_pressure"] - drilled["supply.supply_pressure"]
    assert 1e3 < lost[100:].mean() < 5e4
    depth = np.r_[0.0, drilled["hammer.bit.position"][:-1]]
    np.testing.assert_allclose(drilled["supply.back_pressure"], 9810.0 * (20.0 + depth))


def test_it_beats_as_a_hammer_alone_under_the_same_pressures(drilled):
    late = drilled["time"] > 1.5
    pressures = {
        "supply_pressure": drilled["supply.supply_pressure"][late].mean(),
        "back_pressure": drilled["supply.back_pressure"][late].mean(),
    }
    given = {f"pneumatic.{name}": float(value) for name, value in pressures.items()}
    scene = Scene.from_toml(scene_file(Path("dth5_st_anne")))
    law = {"drive.force": None, "drive.reversal_distance": None}
    alone = simulate(
        scene.replace(**law, **given, **{"effects.drive": "pneumatic", "feed.force": 8000.0}), 2.5
    ).counted
    for name, wanted in (
        ("hammer.blow_frequency", 1.0 / alone["period"].mean()),
        ("hammer.impact_velocity", alone["impact_velocity"].mean()),
    ):
        assert drilled[name][late].mean() == pytest.approx(wanted, rel=0.01)


def test_a_compressor_that_is_too_small_starves_the_hammer(archive, drilled):
    """Pressure falls by what is missing: p' = R T (q_c - q_d) / (V_1 + V_2)."""
    found = Coupling(archive, {"supply.compressor.flow_limit": 0.1}).run(1.5, 1e-3, SIGNALS)
    assert found.verdict.word == "balanced"
    used = np.ptp(found["hammer.pneumatic.consumed"][500:1400])
    fall = 287.05 * 300.0 * (0.1 * 0.9 - used) / 0.32
    pressure = found["supply.hose_pressure"]
    assert pressure[1400] - pressure[500] == pytest.approx(fall, rel=0.03)
    ratio = found["hammer.blow_frequency"][-1] / drilled["hammer.blow_frequency"][-1]
    assert ratio < 0.98
