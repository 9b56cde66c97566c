"""Pages on the drilling system: tables are current, commands exist, examples run."""

from __future__ import annotations

import importlib.util
import re

from typer.main import get_command

from docs.blocks import DOCS
from docs.pages import system
from fmu_src.command_line import app
from fmu_src.commands.scenario import _scripts
from fmu_src.system.archive import read_plan
from percussion_model.scene.presets import scenario_folder

PAGE = DOCS / "system.md"
HOW_TO = PAGE.parent / "how_to"
CONTROLLER, SYSTEM = HOW_TO / "couple_a_controller.md", PAGE
SCENARIOS = PAGE.parent / "data" / "scenarios.md"
PAGES = (PAGE, CONTROLLER, SCENARIOS)


def test_the_tables_are_current():
    for path, text in system.made().files().items():
        assert text == path.read_text(encoding="utf-8"), "run: python -m docs.make system"


def test_commands_exist():
    """As users have them: `percussion`, which the clone has in its venv; modules from the clone."""
    texts = {page.name: page.read_text(encoding="utf-8") for page in PAGES}
    known = get_command(app).commands
    used = set()
    for name, text in texts.items():
        assert re.findall(r"\.venv/bin/percussion\b", text) == [".venv/bin/percussion"], name
        shown = "".join(re.findall(r"(?s)```sh\n(.*?)```", text)).replace("\\\n", " ").splitlines()
        shown += re.findall(r"`([^`\n]+)`", text)
        for line in shown:
            found = re.match(r" *percussion ([\w-]+)(.*)", line)
            if not found:
                continue
            word, rest = found.groups()
            used.add(word)
            options = {one for p in known[word].params for one in p.opts + p.secondary_opts}
            assert set(re.findall(r"(?<=\s)--?[a-z][\w-]*", rest)) <= options, (name, line)
    assert used == {"system", "couple", "bench-controller", "scenario"}
    text = "\n".join(texts.values())
    assert not re.findall(r"(?<!\.venv/bin/)python3? -m|build\.py", text)
    modules = re.findall(r"\.venv/bin/python -m ([\w.]+)", text)
    assert len(modules) > 1
    assert [name for name in modules if importlib.util.find_spec(name) is None] == []


def test_every_scenario_is_listed_and_no_other():
    text = SCENARIOS.read_text(encoding="utf-8")
    listed = re.findall(r"(?m)^\| `(\w+)` \|", text)
    assert sorted(listed) == sorted(_scripts(scenario_folder()))
    assert set(re.findall(r"percussion scenario (\w+)", text)) < set(listed)


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
    assert f'base = "{base.stem}"' in text
    path = tmp_path / "hard_rock.toml"
    path.write_text(text, encoding="utf-8")
    plan, before = read_plan(path), read_plan(base)
    assert plan.name == "HardRock"
    assert plan.hammer.is_file()
    assert plan.connections == before.connections
    assert plan.parameters["controller"]["feed_setpoint"] == 3500.0
    assert plan.parameters["string"] == before.parameters["string"]
