"""What the intervals of rock and bit leave of a rate of penetration."""

from __future__ import annotations

import json

import pytest

from percussion_model.analysis import rock_interval
from percussion_model.scene.hammers import hammer
from percussion_model.scene.rocks import Number, read_rock, rock
from percussion_model.scene.rocks.breaking import ENERGY, parameters_under, rock_of
from tests.commands import percussion


def scene(text="kuru-granite"):
    """A hammer of rigid bodies, which are quick, on a rock."""
    found = hammer("dth5")
    return found.replace(**parameters_under(read_rock(text), found)).computed_by("rigid")


@pytest.mark.parametrize("text", ["kuru-granite", "kuru-granite:10", "st-anne-limestone"])
def test_a_rock_under_a_bit_is_known_again_whatever_its_buttons(text):
    assert rock_of(scene(text)) == text.partition(":")[0]


def test_a_rate_follows_the_one_number_that_is_uncertain(monkeypatch):
    """It is proportional to 1 / e_c, so its quantiles are those of what was sampled."""
    price = scene()[ENERGY]
    one = Number(ENERGY, price, price / 2.0, price * 3.0, "assumed", "of a test")
    monkeypatch.setattr(rock_interval, "uncertain_numbers", lambda scene: ("granite", [one]))
    found = rock_interval.rate_interval(scene())
    # a twentieth of all lies above 3^0.9 times its value, a twentieth below 2^-0.9 times it
    assert found.low == pytest.approx(3.0**-0.9, rel=0.04)
    assert found.high == pytest.approx(2.0**0.9, rel=0.04)
    assert found.samples == rock_interval.SAMPLES


def test_more_uncertain_numbers_leave_more_of_the_rate():
    name, numbers = rock_interval.uncertain_numbers(scene())
    assert name == "kuru-granite"
    assert {ENERGY, "breaking.efficiency", "rotation.renewal_length"} <= {
        one.key for one in numbers
    }
    found = rock_interval.rate_interval(scene())
    assert found.low < 0.75
    assert found.high > 1.25
    assert found == rock_interval.rate_interval(scene())


def test_there_is_no_interval_without_a_rock_of_a_name_or_without_breaking():
    other = scene().replace(**{"rock.unloading_ratio": 6.1})
    assert rock_interval.uncertain_numbers(other) == ("", [])
    assert rock_interval.rate_interval(other) is None
    off = hammer("dth5").replace(
        **{"effects.breaking": False, "effects.rotation": False, **rock("kuru-granite").parameters}
    )
    assert rock_interval.rate_interval(off) is None


def test_table_report_and_json_tell_the_interval(capsys, tmp_path):
    file = tmp_path / "one.toml"
    percussion("new", file, "--hammer", "dth5")
    words = ("run", file, "--solver", "rigid", "--rock", "kuru-granite:10")
    percussion(*words, "--out", tmp_path / "out", "--json", tmp_path / "one.json")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "by the intervals of kuru-granite and bit" in page
    found = json.loads((tmp_path / "one.json").read_text())["rate_by_rock"]
    assert found["low"] < 1.0 < found["high"]
    assert "m/h numerical" in capsys.readouterr().out
    percussion(*words, "--set", "rock.unloading_ratio=6.1")
    out, err = capsys.readouterr()
    assert "m/h numerical" not in out
    assert "by how much is not known" in " ".join(err.split())
    percussion(*words, "--no-rock-interval")
    assert "m/h numerical" not in capsys.readouterr().out
