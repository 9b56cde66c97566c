"""Pages on the drilling system: tables are current, commands exist, examples run."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

from typer.main import get_command

from docs import make_system
from fmu_src.system.archive import read_plan
from percussion_model.interface.cli import app

PAGE = Path(make_system.__file__).with_name("system.md")
HOW_TO = PAGE.parent / "how_to"
CONTROLLER, SYSTEM = HOW_TO / "couple_a_controller.md", HOW_TO / "write_a_system.md"
PAGES = (PAGE, CONTROLLER, SYSTEM, HOW_TO / "run_the_scenarios.md")


def test_the_tables_are_current():
    told = "run: " + make_system.__doc__
    assert make_system.page() == PAGE.read_text(encoding="utf-8"), told
    written = make_system.VARIABLES.read_text(encoding="utf-8")
    assert make_system.variables_page() == written, told


def test_commands_are_those_of_the_venv_and_exist():
    """As README has them: they run from a clone, as they are printed."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    assert not re.findall(r"(?m)(?:^    |`)(?:python|percussion) .*(?:-m|dist|--out)", text)
    modules = re.findall(r"\.venv/bin/python -m ([\w.]+)", text)
    assert len(modules) > 8
    assert [name for name in modules if importlib.util.find_spec(name) is None] == []
    words = re.findall(r"\.venv/bin/percussion ([\w-]+)", text)
    known = get_command(app).commands
    assert set(words) == {"couple", "bench-controller"} <= set(known)


def test_the_example_runs(feed_control, brief, capsys):
    text = CONTROLLER.read_text(encoding="utf-8")
    examples = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    archive = "dist/FeedControlRigid.ssp"
    said = []
    for example in examples:
        assert archive in example
        exec(compile(example.replace(archive, str(feed_control)), CONTROLLER.name, "exec"), {})
        said.append(capsys.readouterr().out.split())
    (depth,), (first, good, second, slow) = said
    assert float(depth) > 5e-3
    assert first == second == "soft"
    assert float(slow) + 1.0 < float(good) < 100.0


def test_the_system_file_of_the_page_is_one(tmp_path):
    (text,) = re.findall(r"```toml\n(.*?)```", SYSTEM.read_text(encoding="utf-8"), re.DOTALL)
    base = PAGE.parents[1] / "scenarios" / "systems" / "feed_control.toml"
    assert f'base = "{base.name}"' in text
    path = tmp_path / "hard_rock.toml"
    path.write_text(text.replace(base.name, base.as_posix()), encoding="utf-8")
    plan, before = read_plan(path), read_plan(base)
    assert plan.name == "HardRock"
    assert plan.hammer.is_file()
    assert plan.connections == before.connections
    assert plan.parameters["controller"]["feed_setpoint"] == 3500.0
    assert plan.parameters["string"] == before.parameters["string"]
