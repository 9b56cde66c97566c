"""Files of measurements as loggers write them: read, or refused in one line."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from percussion_model.analysis.fitting import FitError
from percussion_model.interface.measured_files import read_curve, read_drop, read_reading

CASES = tomllib.loads((Path(__file__).parent / "cases.toml").read_text(encoding="utf-8"))["case"]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_files_of_loggers_are_read_or_refused_in_one_line(case, tmp_path):
    file = tmp_path / "logged.csv"
    file.write_bytes(case["input"].encode(case.get("encoding", "utf-8")))
    is_drop = case.get("kind") == "drop"

    def read():
        return read_drop(f"{file}@5.25") if is_drop else read_curve(file)

    if "right" in case:
        with pytest.raises(FitError) as refused:
            read()
        said = str(refused.value)
        assert said.startswith(f"{file}: ")
        assert "\n" not in said
        assert all(part in said for part in case["right"]), said
        return
    found = read()
    if is_drop:
        assert found.signal == "bit_position"
        assert found.time == pytest.approx([0.0, 1e-3, 2e-3], abs=1e-12)
        assert found.values == pytest.approx([0.0, 1e-3, 1.5e-3], abs=1e-12)
    else:
        assert found.penetration == pytest.approx([0.0, 1e-4, 2e-4], abs=1e-12)
        assert found.force == pytest.approx([0.0, 5e4, 1e5], abs=1e-6)


def test_what_is_left_out_is_said(tmp_path, capsys):
    file = tmp_path / "logged.csv"
    file.write_text("index,time [ms],bit position [mm]\n1,-1,0\n2,0,0\n3,1,1\n", encoding="utf-8")
    read_drop(f"{file}@5.25")
    said = " ".join(capsys.readouterr().err.split())
    assert "not read: column 1, 'index'" in said
    assert "1 of 3 rows are before time 0: omitted" in said


def test_a_decimal_comma_of_a_number_is_told():
    with pytest.raises(FitError, match=r"write 2\.1, with a decimal point"):
        read_reading("rebound_velocity=2,1+-0,05 m/s @5.25")
