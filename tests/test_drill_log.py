"""Logs of drill rigs as they come: read, cleaned with a count, or refused with row and column."""

from __future__ import annotations

import re

import numpy as np
import pytest

from percussion_model.analysis.fitting import FitError
from percussion_model.analysis.identify.cleaning import OVER, clean
from percussion_model.analysis.identify.tabulate import IdentifyError
from percussion_model.interface.drill_log import read_log
from percussion_model.scene.rows import SceneError
from tests.commands import percussion

OWN = {"pressure": 2.4e6, "feed": 11e3, "speed": 5.7}
HEAD = ["Time [s]", "Hole depth [m]", "Penetration rate [m/min]", "Percussion pressure [bar]",
        "Feed force [kN]", "RPM", "Torque [kN m]"]  # fmt: skip


def rows(count=120, rate=0.6):
    """Cells of a good log at 1 Hz."""
    return [
        [f"{k}", f"{k * rate / 60.0:.4f}", f"{rate}", "24.0", "11.5", "54", "0.25"]
        for k in range(count)
    ]


def text_of(table, head=HEAD, mark=","):
    return "\n".join(mark.join(row) for row in [head, *table]) + "\n"


def changed(row, column, word):
    """A good log with one cell replaced; rows count from 0, in the file from 2."""
    table = rows()
    table[row][column] = word
    return text_of(table)


def with_row(at, line):
    lines = text_of(rows()).splitlines()
    lines.insert(at, line)
    return "\n".join(lines) + "\n"


def without(*columns, count=120):
    kept = [k for k in range(len(HEAD)) if k not in columns]
    return text_of([[row[k] for k in kept] for row in rows(count)], [HEAD[k] for k in kept])


def headed(column, title):
    head = list(HEAD)
    head[column] = title
    return text_of(rows(), head)


def stepped(first, values, column):
    """A good log in which one column goes on with other values from a row on."""
    table = rows()
    for k, value in enumerate(values, first):
        table[k][column] = value
    return text_of(table)


# Text of a log, and what its one line says.
REFUSED = {
    "empty": ("", "is empty"),
    "blank": ("\n\n  \n", "is empty"),
    "binary": ("a\0b", "not a text file"),
    "prose": ("Drilled well today.\nNo numbers.\n", "row 1, column 1: 'Drilled well today.'"),
    "heading alone": (text_of([]), "row 1, column 1: no row of numbers"),
    "words": (stepped(4, ["fast"] * 70, 2), "row 6, column 3 .rate.: 'fast' is no number"),
    "units in cells": (stepped(0, ["11 kN"] * 120, 4), "row 2, column 5 .feed.: '11 kN'"),
    "decimal commas between commas": (stepped(5, ["0,6"] * 90, 2), "row 7, column 8: 8 cells"),
    "no unit": (headed(2, "Penetration rate"), "row 1, column 3, 'Penetration rate': has no unit"),
    "no unit of pressure": (headed(3, "Hammer pressure"), "column 4, 'Hammer pressure': has no"),
    "another quantity": (headed(3, "Percussion pressure [kN]"), "row 1, column 4.*'kN' must be"),
    "an unknown unit": (headed(2, "ROP [furlong/day]"), "row 1, column 3.*'furlong/day'"),
    "case of a unit": (headed(3, "Percussion pressure [BAR]"), "did you mean bar"),
    "two rates": (headed(4, "ROP [m/h]"), "row 1, column 5: 'ROP .m/h.' is rate, as column 3"),
    "no rate, no time": (without(0, 2), "row 1, column 1: found depth"),
    "no rate, no depth": (without(1, 2), "row 1, column 1: found time"),
    "never drills": (text_of(rows(120, 0.0)), "0 of 120 rows are left"),
    "rows in reverse": (text_of(rows()[::-1]), "are the rows in reverse order"),
    "few rows": (text_of(rows(12)), "of 12 rows are left"),
    "all in a collar": (text_of(rows(40)), "at the collar 40"),
    "thousands": (text_of(rows(), mark=";").replace("24.0", "1.024,0"), "column 4 .pressure."),
}
# Text of a log, and what was left out or decided, with its count.
CLEANED = {
    "a word": (changed(4, 2, "fast"), "the first in row 6, column 3 (rate): 'fast'"),
    "two points": (changed(7, 3, "24.0.1"), "the first in row 9, column 4 (pressure): '24.0.1'"),
    "a unit in a cell": (
        changed(0, 4, "11 kN"),
        "feed: 1 cells are no numbers, the first in row 2",
    ),
    "a formula": (changed(9, 5, "=A1"), "row 11, column 6 (speed): '=A1'"),
    "underlines": (changed(9, 3, "2_4"), "row 11, column 4 (pressure): '2_4'"),
    "an error of a sheet": (changed(2, 6, "#REF!"), "row 4, column 7 (torque): '#REF!'"),
    "a bad time": (changed(3, 0, "25 past"), "row 5, column 1 (time): '25 past'"),
    "a date of no calendar": (changed(3, 0, "2024-13-45 10:00:00"), "row 5, column 1 (time)"),
    "a cell too many": (with_row(4, "1,2,3,4,5,6,7,8"), "too many cells, the first row 5"),
    "empty cells": (changed(90, 2, ""), "rate: 1 of 120 cells"),
    "not a number": (changed(90, 6, "NaN"), "torque: 1 of 120 cells"),
    "a dash": (changed(90, 3, "--"), "pressure: 1 of 120 cells"),
    "a sentinel": (changed(90, 2, "-9999"), "rate: 1 of 120 cells"),
    "a word of loggers": (changed(90, 2, "Error"), "rate: 1 of 120 cells"),
    "an overflow": (changed(90, 2, "****"), "rate: 1 of 120 cells"),
    "a row cut off": (with_row(100, "99,0.9,0.6"), "1 rows are cut off"),
    "a repeated heading": (with_row(100, ",".join(HEAD)), "1 rows repeat the heading"),
    "a repeated row": (with_row(100, ",".join(rows()[98])), "repeated: 1"),
    "a wild rate": (changed(90, 2, "9000"), "rate: 1 values no drill has, the first in row 92"),
    "a negative torque": (changed(90, 6, "-1"), "torque: 1 values no drill has"),
    "retraction": (stepped(80, ["0.1"] * 5, 1), "bit back for a rod or in retraction: 5"),
    "percussion off": (stepped(80, ["1.0"] * 6, 3), "with percussion or feed off: 6"),
    "no advance": (stepped(80, ["0"] * 4, 2), "without advance: 4"),
    "a clock set back": (stepped(80, [f"{k}" for k in range(40)], 0), "time: set back 1 times"),
    "a gap in time": (stepped(80, [f"{k}" for k in range(500, 540)], 0), "behind a stop"),
    "a leap of the depth": (
        stepped(80, ["9.9"] * 5, 1),
        "depth leaps away and comes back: 5",
    ),
    "depth negative downwards": (stepped(0, [f"-{row[1]}" for row in rows()], 1), "downwards"),
    "no rate": (without(2, count=400), "rate: none in the log; depth over time"),
    "no depth": (without(1), "depth: none in the log"),
    "no rotation": (without(5), "speed: none in the log; the hammer's, 5.7 rad/s"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_bad_log_ends_in_one_line_with_row_and_column(name, tmp_path):
    text, said = REFUSED[name]
    path = tmp_path / "log.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises((IdentifyError, FitError)) as caught:
        clean(read_log(path), OWN)
    assert "\n" not in str(caught.value)
    assert re.search(said, str(caught.value)), caught.value


@pytest.mark.parametrize("name", CLEANED)
def test_what_is_cleaned_is_counted(name, tmp_path):
    text, said = CLEANED[name]
    path = tmp_path / "log.csv"
    path.write_text(text, encoding="utf-8")
    found = clean(read_log(path), OWN)
    told = [*found.notes, *(f"{rule}: {count}" for rule, count in found.dropped.items())]
    assert any(said in one for one in told), told
    assert len(found.depth) + sum(found.dropped.values()) == found.total
    assert np.all(np.isfinite(found.signals[:, 0]))


def test_rates_by_the_depth_share_no_rows(tmp_path):
    """A mean over rows that overlap would tell less than so many samples do."""
    path = tmp_path / "log.csv"
    path.write_text(without(2, count=400), encoding="utf-8")
    found = clean(read_log(path), OWN)
    assert np.diff(found.rows).min() == OVER
    assert found.signals[:, 0] == pytest.approx(0.01, rel=1e-2)  # m/s


def test_columns_units_and_marks_do_not_matter(tmp_path):
    """The same numbers in another order, with a row of units, decimal commas and dates."""
    plain, other = tmp_path / "plain.csv", tmp_path / "other.csv"
    plain.write_text(text_of(rows()), encoding="utf-8")
    head = ["Hammer pressure", "Timestamp", "rotation torque", "Depth", "Rotation speed", "ROP",
            "Thrust"]  # fmt: skip
    table = [["MPa", "", "N m", "cm", "rpm", "m/h", "kN"]]
    for k, row in enumerate(rows()):
        clock = f"2026-05-01 23:{58 + k // 60:02d}:{k % 60:02d}"
        cells = ["2.40", clock, "250", f"{100 * float(row[1]):.2f}", row[5], "36.0", row[4]]
        table.append([cell.replace(".", ",") for cell in cells])
    lines = ["sep=;", "# rig 7", ";".join(head), *(";".join(row) for row in table)]
    other.write_text("\n".join(lines), encoding="cp1252")
    one, two = read_log(plain), read_log(other)
    assert len(one.columns) == len(two.columns) == len(HEAD)
    for name in one.columns:
        shift = two.columns[name][0] - one.columns[name][0] if name == "time" else 0.0
        assert two.columns[name] - shift == pytest.approx(one.columns[name], rel=1e-12, abs=1e-12)
    assert two.rows[0] == 5


def test_a_clock_goes_on_behind_midnight(tmp_path):
    path = tmp_path / "log.csv"
    table = rows()
    for k, row in enumerate(table):
        second = 86400 - 60 + k
        row[0] = f"{second // 3600 % 24:02d}:{second // 60 % 60:02d}:{second % 60:02d}"
    path.write_text(text_of(table), encoding="utf-8")
    assert np.diff(read_log(path).columns["time"]) == pytest.approx(1.0)


def test_headings_of_rigs_are_known(tmp_path):
    """Words run together, what says that it is a mean, lines of a header, and units below."""
    path = tmp_path / "log.txt"
    head = ["Datum", "Depth", "RateOfPenetration", "avePercPressure", "PressurePulldown"]
    lines = ["[HEADER]", "ID=7", "", ";".join(head), "0;m;cm/min;bar;bar", "[DATA]",
             *(f"03.11.2023 12:30:{k:02d};-{k / 100};60;24;90" for k in range(60))]  # fmt: skip
    path.write_text("\n".join(lines), encoding="utf-8")
    found = read_log(path)
    assert set(found.columns) == {"time", "depth", "rate", "pressure", "feed_pressure"}
    assert found.columns["rate"] == pytest.approx(0.01)
    assert found.columns["pressure"] == pytest.approx(24e5)
    assert np.diff(found.columns["time"]) == pytest.approx(1.0)
    head[3] = "MWD Sample Percussion Pressure (Avg)"
    lines[3:5] = [";".join(head), "0;m;cm/min;;bar"]
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(IdentifyError, match=r"row 4, column 4, .*has no unit"):
        read_log(path)


def test_a_mapping_names_columns_and_gives_areas(tmp_path):
    path, mapping = tmp_path / "log.csv", tmp_path / "columns.toml"
    head = list(HEAD)
    head[2], head[4] = "Vortrieb", "Vorschubdruck"
    path.write_text(text_of(rows(), head), encoding="utf-8")
    mapping.write_text(
        '[columns]\nrate = {heading = "Vortrieb", unit = "m/min"}\n'
        'feed = {heading = "Vorschubdruck", unit = "bar", factor = 5e-3, offset = 1000.0}\n',
        encoding="utf-8",
    )
    found = read_log(path, mapping).columns
    assert found["rate"] == pytest.approx(0.01)
    assert found["feed"] == pytest.approx(11.5e5 * 5e-3 + 1000.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[columns]\nspeedy = "RPM"\n', "columns.speedy"),
        ('[columns]\nspeed = "Drehzahl"\n', "no column of .*log.csv, row 1, is headed 'Drehzahl'"),
        ("[columns]\nspeed = 3\n", "columns.speed: must be a heading"),
        ('[columns]\nspeed = {heading = "RPM", scale = 2}\n', "columns.speed.scale"),
        ('[columns]\nspeed = {heading = "RPM", factor = "2"}\n', "must be a number"),
        ("[other]\na = 1\n", "one table"),
        ("columns = [", "columns.toml"),
    ],
)
def test_a_bad_mapping_names_its_key(text, said, tmp_path):
    path, mapping = tmp_path / "log.csv", tmp_path / "columns.toml"
    path.write_text(text_of(rows()), encoding="utf-8")
    mapping.write_text(text, encoding="utf-8")
    with pytest.raises((IdentifyError, SceneError), match=said):
        read_log(path, mapping)


def test_the_command_ends_in_that_line(tmp_path, capsys):
    path = tmp_path / "log.csv"
    path.write_text(REFUSED["words"][0], encoding="utf-8")
    words = ("--hammer", "dth5", "--out", tmp_path / "out")
    assert percussion("identify", path, *words) == 2
    assert "row 6, column 3 (rate): 'fast' is no number" in capsys.readouterr().err.replace(
        "\n", " "
    )
    assert not (tmp_path / "out").exists()
