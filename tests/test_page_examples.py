"""What pages show runs: a scene from a data sheet, Python, a component of one's own."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from percussion_model import Scene, settled

DOCS = Path(__file__).resolve().parent.parent / "docs"


def examples(page):
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


def test_a_data_sheet_becomes_a_scene_with_its_blows(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (script,) = examples("how_to/from_a_data_sheet")
    exec(compile(script, "data_sheet.py", "exec"), {})
    *_, blows, rate = capsys.readouterr().out.splitlines()
    assert blows == "1600 blows per minute of 400 J"
    found = settled(Scene.from_toml(tmp_path / "my_hammer.toml"))
    assert 3600 * found.rate_of_penetration == pytest.approx(float(rate.split()[0]), rel=0.01)
    assert found.counted["blow_energy"].mean() == pytest.approx(400.0, rel=5e-3)


def test_the_examples_of_python_run(capsys):
    place = {}
    for script in examples("reference/api"):
        exec(compile(script, "api.md", "exec"), place)
    said = capsys.readouterr().out
    assert "±" in said
    assert "J each" in said


def test_the_components_of_the_page_are_such():
    found = []
    for script in examples("how_to/your_own"):
        if "COMPONENT" in script:
            place = {}
            exec(compile(script, "own.py", "exec"), place)
            found.append(place["COMPONENT"])
    made, hertz = found
    assert made.fault == hertz.fault == ""
    par, moving = SimpleNamespace(drag_coefficient=5.0), SimpleNamespace(v_p=2.0)
    push = getattr(made.on_piston, "py_func", made.on_piston)
    assert push(par, moving, 1e-6) == -10.0
    # f(1) = 1, f' and the integral of f at 2 by differences
    loading = getattr(hertz.loading, "py_func", hertz.loading)
    (low, _, before), (_, slope, _), (high, _, behind) = (
        loading(None, x) for x in (1.999, 2, 2.001)
    )
    assert loading(None, 1.0)[0] == 1.0
    assert slope == pytest.approx((high - low) / 2e-3, rel=1e-6)
    assert loading(None, 2.0)[0] == pytest.approx((behind - before) / 2e-3, rel=1e-6)
