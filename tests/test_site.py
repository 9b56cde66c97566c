"""The documentation site: it builds without a warning, and its reference is complete."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from docs.pages import reference
from percussion_model import Scene, simulate
from percussion_model.simulation.columns import ENERGY_COLUMNS, SUMMARY_COLUMNS

ROOT = Path(__file__).resolve().parent.parent
API = (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
MODULES = re.findall(r"automodule:: (\S+)", API)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    words = ("-q", "-W", "--keep-going", "-b", "html", "-d", folder / "trees")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *words, ROOT / "docs", folder / "html"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.mark.slow
def test_the_site_builds_without_a_warning(site):
    assert (site / "index.html").is_file()


def test_every_public_name_has_an_entry(site):
    page = (site / "reference" / "api.html").read_text(encoding="utf-8")
    for module in MODULES:
        for name in set(importlib.import_module(module).__all__):
            assert f'id="{module}.{name}"' in page, f"{module}.{name}"


def test_every_equation_is_drawn_without_a_script_from_elsewhere(site):
    page = (site / "model.html").read_text(encoding="utf-8")
    source = (ROOT / "docs" / "model.md").read_text(encoding="utf-8")
    assert page.count('<div class="equation"') == len(re.findall(r"\$\$.+?\$\$", source, re.S))
    outside = r'<(?:script|link|img)[^>]+(?:src|href)="(https?:[^"]+)"'
    for one in site.rglob("*.html"):
        assert not re.findall(outside, one.read_text("utf-8")), one.name


def test_pages_made_of_the_code_are_current():
    for path, text in reference.made().files().items():
        assert path.read_text(encoding="utf-8") == text, "run: python -m docs.make reference"


def test_every_number_of_a_summary_is_explained():
    summary = simulate(Scene(), 0.5, settle=0.1, error_estimate=False).summary()
    assert [column.name for column in SUMMARY_COLUMNS] == list(summary)
    assert {column.name for column in ENERGY_COLUMNS} == set(summary["energy"])
