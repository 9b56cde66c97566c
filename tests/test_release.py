"""What a release says of itself: one version everywhere, forms that are valid, a paper in form."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest
import yaml

from percussion_model.interface import cli
from percussion_model.interface.commands.upgrade import CHANGES

ROOT = Path(__file__).resolve().parent.parent
ABOUT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PAPER = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
# As the format of JOSS asks for (https://joss.readthedocs.io/en/latest/paper.html).
WANTED = [
    *("Summary", "Statement of need", "State of the field", "Software design"),
    *("Research impact statement", "AI usage disclosure", "Acknowledgements", "References"),
]


def read_yaml(*names):
    return yaml.safe_load(ROOT.joinpath(*names).read_text(encoding="utf-8"))


def test_the_version_and_its_date_are_the_same_everywhere():
    cited, deposit = read_yaml("CITATION.cff"), json.loads((ROOT / ".zenodo.json").read_text())
    version, date = re.findall(r"^## (\d+\.\d+\.\d+) \((.*)\)$", CHANGELOG, re.MULTILINE)[0]
    assert cited["version"] == deposit["version"] == version == ABOUT["version"]
    assert cited["date-released"] == date
    assert cited["license"] == deposit["license"] == ABOUT["license"]
    assert cited["keywords"] == deposit["keywords"]


def test_the_workflow_tries_each_python_that_is_promised_on_each_system():
    jobs = read_yaml(".github", "workflows", "wheels.yml")["jobs"]
    told = [text.rpartition(" ")[2] for text in ABOUT["classifiers"] if re.search(r"3\.\d+$", text)]
    for job in ("try", "suite"):
        assert jobs[job]["strategy"]["matrix"]["python"] == told
    systems = {name.partition("-")[0] for name in jobs["try"]["strategy"]["matrix"]["system"]}
    assert systems == {"ubuntu", "windows", "macos"}
    for step in (step for job in jobs.values() for step in job["steps"]):
        assert re.search(r"@[0-9a-f]{40}$", step["uses"]) if "uses" in step else step["run"]


def test_every_form_asks_for_something():
    for path in (ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"):
        form = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert form["name"]
        assert form["description"]
        names = [entry["id"] for entry in form["body"]]
        assert len(names) == len(set(names))
        assert any(entry.get("validations", {}).get("required") for entry in form["body"])


def test_the_paper_has_the_form_of_its_journal():
    _, head, body = PAPER.split("---\n", 2)
    about = yaml.safe_load(head)
    assert re.findall(r"^# (.*)$", body, re.MULTILINE) == WANTED
    assert 750 <= len(body.split()) <= 1750
    assert {"title", "tags", "authors", "affiliations", "date", "bibliography"} <= about.keys()
    entries = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "paper" / "paper.bib").read_text(), re.M))
    assert set(re.findall(r"@(\w+)", body)) == entries


def test_commands_of_the_paper_and_of_the_changelog_exist():
    import fmu_src.command_line  # noqa: F401  adds commands

    known = {command.name or command.callback.__name__ for command in cli.app.registered_commands}
    known = {name.replace("_", "-") for name in known}
    named = re.findall(r"`percussion ([\w-]+)", PAPER + CHANGELOG)
    assert len(set(named)) > 10
    assert set(named) - {"blow-map"} <= known  # which it says is gone
    for module in re.findall(r"`python -m ([\w.]+)", PAPER + CHANGELOG):
        assert ROOT.joinpath(*module.split(".")).with_suffix(".py").is_file()


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: f"{change.key} {change.value}")
def test_what_upgrade_changes_is_in_the_changelog(change):
    assert (change.value or f"[{change.key}]") in CHANGELOG
    assert f"## {change.version} " in CHANGELOG


def test_figures_of_the_paper_are_those_of_the_pages():
    """Numbers that pages hold, which tests hold to stored studies."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    row = re.search(r"\*\*the default solver\*\* \| (.*?) \| (.*?) \|", readme)
    for cell, error in zip(row.groups(), ("1 %", "0.1 %"), strict=True):
        median, low, high, scenes = re.fullmatch(
            r"(.+) \((.+) to (.+); (\d+) scenes\)", cell.replace("≥", "at least")
        ).groups()
        assert f"| {error} | {median} | {low} to {high} | {scenes} |" in PAPER
    for number in ("16.3505 ± 0.0004", "16.3485 ± 0.001"):
        assert number in readme
        assert number in PAPER
