"""Breaking and rotation from a site's rates and torques, and from craters."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from percussion_model import simulate
from percussion_model.analysis.fitting import FitError
from percussion_model.analysis.fitting.site import fit_craters, fit_site
from percussion_model.analysis.stationary import settled
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks import rock
from percussion_model.scene.rocks.breaking import parameters_under
from tests.commands import percussion

RPM = 2.0 * math.pi / 60.0
TRUTH = {
    "breaking.crushing_energy": 7.5e7,
    "rotation.renewal_length": 3.5e-3,
    "rotation.friction": 0.6,
}


def scene():
    """Rigid bodies, which are quick."""
    found = hammer("dth5")
    return found.replace(**parameters_under(rock("kuru-granite"), found)).computed_by("rigid")


def measured(settings):
    """What a site with other rock gives at settings."""
    truth = scene().replace(**TRUTH)
    found = {"rate_of_penetration": [], "rotation_torque": []}
    for k in range(len(next(iter(settings.values()), [0]))):
        run = truth.replace(**{key: values[k] for key, values in settings.items()})
        summary = simulate(run, 6.0, 1.0, error_estimate=False).summary()
        for name, values in found.items():
            values.append(summary[name])
    return settings | found


def test_rates_at_two_speeds_and_torques_find_the_rock_of_a_site():
    settings = {"rotation.speed": [54 * RPM, 20 * RPM, 10 * RPM, 54 * RPM],
                "drive.force": [11800.0, 11800.0, 11800.0, 8000.0]}  # fmt: skip
    found = fit_site(scene(), measured(settings))
    assert set(TRUTH) <= set(found.changes())
    for one in found.estimates:
        if one.key in TRUTH:  # within two standard errors, none of which is wide
            assert abs(math.log(one.value / TRUTH[one.key])) < 2.0 * math.log(one.factor)
            assert one.factor < 1.3
    low, high = found.rate_interval()
    assert low < measured({})["rate_of_penetration"][0] < high < 1.1 * low


def test_a_fitted_scene_drills_as_the_fit_says():
    """Also where the data leave some of its parameters open."""
    data = measured({"rotation.speed": [54 * RPM]})
    found = fit_site(scene(), data)
    fitted = scene().replace(**found.changes())
    rate = simulate(fitted, 6.0, 1.0, error_estimate=False).rate_of_penetration
    assert found.rate == pytest.approx(rate, rel=1e-9)
    # one rate known to 3 % leaves as much of the rate at the same setting
    assert math.log(found.rate_factor) == pytest.approx(0.03, rel=0.1)


def test_one_rate_tells_the_crushing_energy_and_no_renewal_length():
    data = measured({"rotation.speed": [54 * RPM]})
    del data["rotation_torque"]
    found = {one.key: one for one in fit_site(scene(), data).estimates}
    length, energy = found["rotation.renewal_length"], found["breaking.crushing_energy"]
    assert not length.is_told
    assert length.value == pytest.approx(scene()["rotation.renewal_length"], rel=0.05)
    assert energy.factor < energy.prior_factor
    assert energy.value > 6e7


def test_craters_lie_on_a_line_above_a_threshold():
    volume = np.array([1e-7, 3e-7, 4e-7, 8e-7])
    energy, error, threshold, other = fit_craters(4.0 + 6e7 * volume, volume)
    assert (energy, threshold) == pytest.approx((6e7, 4.0), rel=1e-9)
    assert error / energy < 1e-9 > other / threshold
    with pytest.raises(FitError, match="at least three"):
        fit_craters([1.0, 2.0], [1e-7, 2e-7])
    with pytest.raises(FitError, match="do not grow"):
        fit_craters([30.0, 20.0, 10.0], [1e-7, 2e-7, 3e-7])


def test_the_command_fits_craters_and_writes_the_scene(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "craters.csv").write_text(
        "energy [J],volume [cm^3]\n10,0.1\n22,0.3\n28,0.4\n52,0.8\n", encoding="utf-8"
    )
    scene().to_toml(tmp_path / "drill.toml")
    words = ["calibrate", "drill.toml", "--crater", "craters.csv", "--json", "-"]
    assert percussion(*words, "--out", "fitted.toml") == 0
    changes = json.loads(capsys.readouterr().out)["changes"]
    assert changes["breaking.crushing_energy"] == pytest.approx(6e7, rel=1e-6)
    assert "crushing_energy = 6" in (tmp_path / "fitted.toml").read_text(encoding="utf-8")


def test_the_command_tells_what_a_site_leaves_of_the_rate(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "site.csv").write_text(
        "rate_of_penetration [m/h],rotation.speed [rpm]\n33,54\n25,10\n", encoding="utf-8"
    )
    scene().to_toml(tmp_path / "drill.toml")
    assert percussion("calibrate", "drill.toml", "--site", "site.csv", "--out", "one.toml") == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "m/h by what the site leaves of its parameters" in told
    written = (tmp_path / "one.toml").read_text(encoding="utf-8")
    assert "# breaking.crushing_energy, J/m^3: " in written
    assert "# rate_of_penetration 2, m/h: measured 25, model " in written


def test_what_cannot_be_fitted_is_said(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "site.csv").write_text("rate_of_penetration [m/h]\n20\n", encoding="utf-8")
    assert percussion("calibrate", "reference", "--site", "site.csv") == 2
    assert "give --bit" in capsys.readouterr().err
    assert percussion("calibrate", "reference") == 2
    assert "nothing to fit" in capsys.readouterr().err


def test_a_motor_has_followed_its_torque_where_blows_repeat():
    """Blows look alike long before the rotation is as slow as its torque makes it."""
    slow = {"feed.force": 12e3, "rotation.stall_torque": 350.0, "rotation.full_torque": 100.0}
    weak = scene().replace(**slow)
    run = simulate(weak, 6.0, 3.0, error_estimate=False).rate_of_penetration
    assert settled(weak).rate_of_penetration == pytest.approx(run, rel=0.02)
    free = simulate(scene(), 6.0, 3.0, error_estimate=False).rate_of_penetration
    assert run < 0.95 * free


def test_impossible_numbers_of_a_site_are_refused():
    for name, value in (("rate_of_penetration", -0.01), ("rate_of_penetration", 30.0)):
        with pytest.raises(FitError, match=rf"{name} = .* must be above 0"):
            fit_site(scene(), {name: [value]})
    with pytest.raises(FitError, match=r"volume \[cm\^3\]"):
        fit_craters([10.0, 20.0, 30.0], [0.1, 0.2, 0.3])
