"""Published drilling rates beside predicted ones: data, criteria, closed form, command."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from docs.blocks import DOCS
from percussion_model.scene.rocks import rock
from percussion_model.scene.rocks.breaking import breaking_numbers, energy_by_strength
from percussion_model.scene.scene import Scene
from percussion_model.verification.rates import stored_cases
from percussion_model.verification.rates.cases import DOWN, TOP
from percussion_model.verification.rates.comparison import RateRow, Rates, crater_verdicts
from percussion_model.verification.rates.criteria import (
    MET,
    MISSED,
    NOT_CLAIMED,
    after_site_factor,
    by_others,
    geometric_mean,
    judged,
    scatter,
)
from percussion_model.verification.rates.prediction import (
    RATIO,
    Prediction,
    advance,
    first_scene,
    interval,
    nearest_bit,
    predict,
    rock_parameters,
)
from percussion_model.verification.rates.table import cells

ROWS_READ = 35  # of the two tables of Kahraman 1999


def by_id(name):
    return next(one for one in stored_cases().cases if one.id == name)


def test_every_case_has_its_source_and_what_is_assumed():
    for one in stored_cases().cases:
        assert {"published", "read_in", "rate"} <= set(one.source)
        assert one.assumed
        assert one.kind in ("field", "figure", "trade page")
        assert min(one.rates) > 0.0
        told = (one.power, one.frequency) if one.type == TOP else (one.pressure, one.piston)
        assert all(value is not None and value > 0.0 for value in told)
    for row in (*stored_cases().unused, *stored_cases().wanted):
        assert all(row.values())
    assert all(row["lacks"] for row in stored_cases().unused)


def test_each_measured_number_is_there_once():
    cases = stored_cases().cases
    assert sum(len(one.rates) for one in cases) == ROWS_READ
    assert len({one.id for one in cases}) == len(cases)
    # what a prediction sees of a case; two alike would be one
    seen = [
        (c.type, c.bit, c.power, c.frequency, c.pressure, c.piston, c.rock, c.site, c.strength)
        for c in cases
    ]
    assert len(set(seen)) == len(cases)


def test_numbers_are_in_si():
    one = by_id("top_02+03")
    assert one.bit == pytest.approx(0.076)
    assert one.blow_energy == pytest.approx(280.0)
    assert one.strength == pytest.approx(123.8e6)
    assert one.rate * 3600 == pytest.approx((42.6 + 49.2) / 2)
    assert by_id("dth_1").pressure == pytest.approx(7e5)


def test_statistics_of_made_up_ratios():
    ratios = [0.5, 2.0, 1.0, 1.0]
    assert geometric_mean(ratios) == pytest.approx(1.0)
    assert scatter(ratios) == pytest.approx(math.exp(math.log(2.0) * math.sqrt(2.0 / 3.0)))
    assert geometric_mean([0.0, 1.0]) == 0.0
    assert scatter([0.0, 1.0]) == math.inf
    assert math.isnan(geometric_mean([]))
    assert math.isnan(scatter([1.0]))


def test_a_site_factor_is_that_of_its_ratios():
    ratios, sites = [0.5, 2.0, 7.0, 0.0, 3.0], ["a", "a", "b", "c", "c"]
    # one case alone is no test of a factor, and none helps where a rate is nothing
    assert after_site_factor(ratios, sites) == pytest.approx([0.5, 2.0, 0.0, 0.0])
    assert by_others(ratios, sites) == pytest.approx([0.25, 4.0, 0.0, 0.0])


def test_criteria_of_made_up_ratios():
    sites = ["a"] * 10
    assert [one.verdict for one in judged([1.0] * 9 + [2.5], sites)] == [MET] * 4
    wide = judged([0.4] * 5 + [2.5] * 5, sites)
    assert [one.verdict for one in wide] == [MET, MISSED, MISSED, MISSED]
    assert [one.found for one in wide[2:]] == [0.0, 0.0]
    shifted = judged([1.7] * 10, sites)
    assert [one.verdict for one in shifted] == [MISSED, MET, MET, MET]
    nothing = judged([1.0] * 9 + [0.0], sites)
    assert [one.verdict for one in nothing] == [MISSED, MISSED, MET, MISSED]


def test_below_ten_cases_no_share_is_claimed():
    few = judged([1.0] * 9, ["a"] * 9)
    assert [one.verdict for one in few] == [MET, MET, NOT_CLAIMED, NOT_CLAIMED]
    # nor of sites that have one case each
    assert judged([1.0] * 10, [*"abcdefghij"])[3].verdict == NOT_CLAIMED


def test_the_crater_is_that_of_the_energy_that_the_other_needs():
    first, second = stored_cases().craters
    twice = replace(second, bit_energy=second.returned + 2 * (first.crushing - 5.0) + 5.0,
                    volume=2.0 * first.volume)  # fmt: skip
    same, carried = crater_verdicts([first, twice])
    assert (same.found, same.verdict) == (pytest.approx(1.0), MET)
    softer = energy_by_strength(first.strength) / energy_by_strength(second.strength)
    assert carried.found == pytest.approx(softer)


def test_all_cases_have_one_set_of_numbers():
    """Those of a rock without own craters, so none is fitted to a rate."""
    plain = rock("red-bohus-granite")
    numbers = {one.key: one for one in breaking_numbers(plain)}
    ratio = plain.number("rock.unloading_ratio")
    assert (ratio.value, ratio.low, ratio.high) == RATIO
    for one in stored_cases().cases:
        found = rock_parameters(one)
        assert found["breaking.crushing_energy"] == energy_by_strength(one.strength)
        assert found["breaking.efficiency"] == 0.64
        for key in ("rotation.renewal_length", "rotation.friction"):
            assert found[key] == numbers[key].value
        assert found["hole_diameter"] == one.bit


def test_a_hammer_down_the_hole_goes_by_the_area_of_its_piston():
    big, small = first_scene(by_id("dth_3")), first_scene(by_id("dth_6"))
    share = (36.0 / 57.0) ** 2
    assert small.piston.mass == pytest.approx(share * big.piston.mass)
    assert small["drive.force"] == pytest.approx(share * big["drive.force"])
    assert nearest_bit(by_id("dth_6")).name == "dth-105"


SCENE = Scene().replace(
    **{
        "effects.breaking": True, "effects.rotation": True, "breaking.buttons": 10,
        "hole_diameter": 0.1, "rotation.mean_radius": 0.03, "breaking.crushing_energy": 5e7,
        "breaking.threshold": 5.0, "breaking.efficiency": 0.64,
    }
)  # fmt: skip


def test_closed_form_of_an_advance():
    area = 0.25 * math.pi * 0.01
    assert advance(SCENE, 150.0, 0.1) == pytest.approx(0.64 * 100.0 / 5e7 / area)
    # craters that are still there take what is more than the threshold
    assert advance(SCENE, 150.0, 0.5) == pytest.approx(0.64 * 75.0 / 5e7 / area)
    assert advance(SCENE, 50.0, 0.1) == 0.0
    low, high = interval(SCENE, 150.0, 0.1)
    assert low < advance(SCENE, 150.0, 0.1) < high
    assert interval(SCENE, 20.0, 0.1)[0] == 0.0


def test_a_run_has_the_energy_of_its_case_and_the_closed_form_its_rate():
    """A case that nobody measured."""
    case = replace(by_id("top_01"), power=20e3, frequency=55.0, strength=180e6)
    found = predict(case)
    assert found.blow_energy == pytest.approx(case.blow_energy, rel=0.02)
    assert found.frequency == pytest.approx(55.0, rel=0.02)
    # less what flushing and the depth pressed in cut off, and blows that differ
    assert found.rate == pytest.approx(found.closed_form, rel=0.1)
    assert found.low < found.rate < found.high
    assert found.without_threshold > found.closed_form


def test_a_hammer_below_the_threshold_drills_nothing():
    found = predict(by_id("dth_5"))
    assert found.crushed < found.threshold
    assert found.rate == found.closed_form == 0.0
    assert found.without_threshold > 0.0


def made_up(case, ratio):
    numbers = (ratio * case.rate, 0.0, 0.0, 1.0, 1.0, 300.0, 60.0, 150.0, 65.0, 0.0, 1.0)
    return RateRow(case, Prediction(*numbers, "th-76", 1, "periodic"))


def test_verdicts_are_data():
    stored = stored_cases()
    found = Rates(stored, [made_up(one, 1.0) for one in stored.cases])
    assert set(found.verdicts) == {"all cases", TOP, DOWN, "craters"}
    tree = json.loads(json.dumps(found.to_dict()))
    words = {one["verdict"] for rows in tree["verdicts"].values() for one in rows}
    assert words <= {MET, MISSED, NOT_CLAIMED}
    assert all(one["verdict"] == MET for one in tree["verdicts"]["all cases"])
    assert len(tree["rows"]) == len(stored.cases)
    assert all(row["source"]["published"] for row in tree["rows"])
    # of drills with a power alone
    assert tree["beside"][DOWN]["energy_alone"] is None
    assert np.isfinite(tree["beside"][TOP]["energy_alone"])


def test_the_page_has_these_numbers():
    page = (DOCS / "data" / "rates.md").read_text(encoding="utf-8")
    for name in ("top_25", "dth_1"):
        case = by_id(name)
        texts = cells(RateRow(case, predict(case)))
        assert f"| {' | '.join(texts)} |" in page, "run: python -m docs.make rates"
    stored = stored_cases()
    for case in stored.cases:
        assert f"| {case.id} | {case.rock}, {case.site} |" in page
        assert case.source["published"] in page
    assert all(row["lacks"] in page for row in stored.unused)
    assert all(row["what"] in page for row in stored.wanted)


def test_the_documents_count_the_rates_within_their_intervals_as_the_table_does():
    rows = re.findall(r"^\| (top|dth)_.*? \| ([\d.]+) \|[^|]*\| ([\d.]+) to ([\d.]+) \|",
                      (DOCS / "data/rates.md").read_text(encoding="utf-8"), re.M)  # fmt: skip
    inside = {
        kind: [
            float(low) <= float(rate) <= float(high) for one, rate, low, high in rows if one == kind
        ]
        for kind in ("top", "dth")
    }
    top, down = (rf"{sum(one)} of (the )?{len(one)}" for one in inside.values())
    for page in ("README.md", "docs/field.md", "docs/data/rates.md", "paper/paper.md"):
        text = " ".join((DOCS.parent / page).read_text(encoding="utf-8").split())
        assert re.search(rf"\b{top}\b", text), page
        assert page == "README.md" or re.search(rf"\b{down}\b", text), page
