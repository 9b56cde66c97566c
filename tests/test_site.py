"""The documentation site: it builds without a warning, and its reference is complete."""

from __future__ import annotations

import importlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from docs import words
from docs.pages import reference
from percussion_model import Scene, simulate
from percussion_model.simulation.columns import ENERGY_COLUMNS, SUMMARY_COLUMNS

ROOT = Path(__file__).resolve().parent.parent
API = (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
SEARCH = Path(__file__).with_name("search_in_node.cjs")
# What drillers, control engineers, users of simulation tools and researchers look for, and where.
WANTED = {
    "rate of penetration granite": "tutorials/drilling_engineer",
    "air pressure": "how_to/from_a_data_sheet",
    "data sheet hammer": "how_to/from_a_data_sheet",
    "list of rocks": "tutorials/drilling_engineer",
    "hammer lifts off": "how_to/trouble",
    "torque stall": "how_to/trouble",
    "top hammer rods": "top_hammer",
    "calibrate rock": "how_to/calibrate_a_rock",
    "drop test": "how_to/calibrate_a_rock",
    "published rates": "field",
    "write a controller": "how_to/couple_a_controller",
    "controller score": "how_to/couple_a_controller",
    "drill string shoulder": "system",
    "communication step": "system",
    "Simulink": "hosts",
    "FMU without Python": "hosts",
    "saved state": "fmu",
    "discretisation error": "accuracy",
    "normal modes": "solvers",
    "finite elements penalty": "solvers",
    "energy barrier": "model",
    "sweep parameters": "studies",
    "own metric": "how_to/your_own",
    "compiles minutes": "how_to/trouble",
}
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


def test_a_click_on_a_figure_opens_it_in_full(site):
    opened = 0
    for page in site.rglob("*.html"):
        for link, image in re.findall(
            r'<a [^>]*href="([^"]*)"><img [^>]*src="([^"]*)"', page.read_text("utf-8")
        ):
            assert link == image
            assert (page.parent / link).is_file()
            opened += 1
    assert opened > 50


@pytest.fixture(scope="module")
def found(site):
    """Pages that the search of the site lists first, by what is looked for."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed, which runs the scripts of the search")
    done = subprocess.run(
        [node, SEARCH, site], input=json.dumps([*WANTED]), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return dict(zip(WANTED, json.loads(done.stdout), strict=True))


@pytest.mark.parametrize("query", WANTED)
def test_the_search_finds_the_page_among_the_first_three(found, query):
    assert WANTED[query] in found[query][:3]


def test_the_search_lists_pages_of_the_guide_alone(found):
    guide = {page.relative_to(words.DOCS).with_suffix("").as_posix() for page in words.menu()}
    listed = {page for pages in found.values() for page in pages}
    assert {page for page in listed if not page.startswith("notebooks/")} <= guide


def test_pages_made_of_the_code_are_current():
    for path, text in reference.made().files().items():
        assert path.read_text(encoding="utf-8") == text, "run: python -m docs.make reference"


def test_every_number_of_a_summary_is_explained():
    summary = simulate(Scene(), 0.5, settle=0.1, error_estimate=False).summary()
    assert [column.name for column in SUMMARY_COLUMNS] == list(summary)
    assert {column.name for column in ENERGY_COLUMNS} == set(summary["energy"])
