"""What the documents show is true: examples run, tables are current, citations lead somewhere."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from docs import make, words
from docs.blocks import renewed
from docs.pages import parameters
from percussion_model import Scene

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
SOURCES = [
    path for folder in ("percussion_model", "tests") for path in (ROOT / folder).rglob("*.py")
]
PAGES = [
    page.relative_to(ROOT).as_posix()
    for page in [
        *sorted((ROOT / "docs").rglob("*.md")),
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
    ]
]


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def cited(page, word):
    """Numbers that the sources cite of a page, as {number: file}."""
    found = {}
    for path in SOURCES:
        text = re.sub(r"\s+#?\s*", " ", path.read_text(encoding="utf-8"))
        for match in re.finditer(rf"{page},? {word}s?\.? ([\d, and–-]+)", text):
            numbers = [int(n) for n in re.findall(r"\d+", match[1])]
            span = range(numbers[0], numbers[-1] + 1) if "-" in match[1] else numbers
            found |= dict.fromkeys(span, path.name)
    return found


def test_python_example_runs(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    (example,) = blocks("python")
    assert len([line for line in example.splitlines() if line]) <= 12
    exec(compile(example, "README.md", "exec"), {})
    assert "mm/s" in capsys.readouterr().out


def test_scene_excerpt_is_a_scene():
    (excerpt,) = blocks("toml")
    scene = Scene(**tomllib.loads(excerpt))
    assert not scene.unused


def test_parameter_page_is_current():
    ((path, text),) = parameters.made().files().items()
    assert text == path.read_text(encoding="utf-8"), "run: python -m docs.make parameters"


def test_what_can_be_made_is_told():
    with pytest.raises(SystemExit) as told:
        make.main(["what"])
    assert re.findall(r"^(\w+): ", str(told.value), re.MULTILINE) == make.names()


@pytest.mark.parametrize("name", ["model", "numerics"])
def test_equations_are_numbered_in_order(name):
    text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    numbers = [int(n) for n in re.findall(r"\\tag\{(\d+)\}", text)]
    assert numbers == list(range(1, len(numbers) + 1))


@pytest.mark.parametrize("name", ["model", "numerics"])
def test_citations_exist(name):
    text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    for number, where in cited(rf"docs/{name}\.md", "eq").items():
        assert f"\\tag{{{number}}}" in text, f"{where} cites equation {number}"
    for number, where in cited(rf"docs/{name}\.md", "section").items():
        assert f"\n## {number} " in text, f"{where} cites section {number}"


@pytest.mark.parametrize(
    ("page", "names"),
    [
        ("data/effects", "effects"),
        ("data/fidelity", "errors costs"),
        ("data/stability", "verdict"),
        ("data/undamped", "rates"),
        ("top_hammer", "rock shares changes"),
        ("data/top_hammer", "presets stresses joints"),
    ],
)
def test_what_scripts_write_into_a_page_has_its_place(page, names):
    made = {name: f"made anew: {name}" for name in names.split()}
    text = renewed(ROOT / "docs" / f"{page}.md", made)
    assert [text.count(one) for one in made.values()] == [1] * len(made)


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    path = ROOT / page
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", path.read_text(encoding="utf-8")):
        assert (path.parent / target).exists(), f"{page} links to {target}"


def test_the_guide_is_short():
    """Pages of the menu, and their prose; no other page is searched (tests/test_site.py)."""
    pages = words.menu()
    assert len(set(pages)) == len(pages) <= words.MOST_PAGES
    assert sum(map(words.count, pages)) <= words.MOST_WORDS
    aside = ("data", "accuracy", "developers")
    beside = {ROOT / "docs" / f"{name}.md" for name in ("modal", "numerics")}
    for page in set((ROOT / "docs").rglob("*.md")) - set(pages) - beside:
        assert page.parent.name in aside, f"{page.name} is in no menu"


def test_a_count_of_words_is_right():
    text = "---\na: b\n---\nOne $K_R = 1$ [two](x.md), three.\n\n| a | b |\n```\nx y\n```\n"
    text += "$$a b$$\n    code it\n<!-- begin x -->\nmade\n<!-- end -->\n"
    assert words.prose(text).split() == ["One", "formula", "[two](x.md),", "three."]


# What scripts write in full, or but for a head; other pages mark what scripts write into them.
MADE = (
    *("parameters.md", "reference/outputs.md", "reference/command_line.md"),
    *("data/fmu_interface.md", "data/system_variables.md", "data/hard_cases.md"),
    *("data/paper_statements.md", "data/coupling_step.md", "data/step_rejection.md"),
    *("data/rocks.md", "data/hammers.md"),
)


def test_all_prose_by_hand_is_short():
    """That of pages aside too, README, CONTRIBUTING and the record of speed; no CHANGELOG."""
    docs = ROOT / "docs"
    made = {docs / name for name in MADE}
    assert all(page.is_file() for page in made)
    pages = {*docs.rglob("*.md")} - {*(docs / "accuracy").glob("*.md")} - made
    pages |= {ROOT / name for name in ("README.md", "CONTRIBUTING.md", "benchmarks/RECORD.md")}
    assert len(pages) > 55
    assert sum(map(words.count, pages)) <= 25_000


@pytest.mark.parametrize("page", words.menu(), ids=lambda page: page.stem)
def test_a_page_says_first_what_it_is_for(page):
    """A title, then a sentence: no picture, table or command."""
    lines = [line for line in page.read_text(encoding="utf-8").splitlines() if line]
    assert lines[0].startswith("# ")
    assert re.match(r"[A-Z`]", lines[1])


def test_no_banned_word_is_read_by_users():
    assert not words.banned(), "docs/developers/style.md has better ones"


@pytest.mark.parametrize("pair", range(10))
def test_the_style_page_has_ten_pairs_that_the_check_separates(pair):
    page = (ROOT / "docs" / "developers" / "style.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (.+) \| (.+) \|$", page, re.MULTILINE)[1:]
    assert len(rows) == 10
    bad, good = rows[pair]
    assert words.BANNED_WORDS.search(bad)
    assert not words.BANNED_WORDS.search(good)


def test_pictures_are_small():
    for path in (ROOT / "docs" / "images").iterdir():
        assert path.stat().st_size < 300_000, path.name


def test_every_equation_has_its_place_and_every_place_its_functions():
    text = (ROOT / "docs" / "data" / "equations.md").read_text(encoding="utf-8")
    placed = set()
    for line in text.splitlines():
        row = re.fullmatch(r"\| ([\d, ]+) [^|]* \| ([^|]+) \| ([^|]+) \|", line)
        if row:
            placed |= {int(n) for n in re.findall(r"\d+", row[1])}
            files = re.findall(r"`([^`]+)`", row[2])
            code = "".join((ROOT / "percussion_model" / f).read_text("utf-8") for f in files)
            for name in re.findall(r"`([^`]+)`", row[3]):
                assert f"def {name}(" in code, (name, files)
    model = (ROOT / "docs" / "model.md").read_text(encoding="utf-8")
    assert placed == {int(n) for n in re.findall(r"\\tag\{(\d+)\}", model)}
