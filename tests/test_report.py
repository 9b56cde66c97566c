"""The report: one page, complete, and without any other file."""

from __future__ import annotations

import re
from html.parser import HTMLParser

import pytest

from percussion_model.interface.report import HEADLINES, headline_rows, ledger_rows, write_report
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import simulate
from percussion_model.simulation.uncertain import known_error

SHORT = Scene(title="A <short> run", run={"duration": 0.2, "settle": 0.0})
SCENES = {
    "elastic": SHORT,
    "rigid": SHORT.replace(**{"piston.model": "rigid", "bit.model": "rigid"}),
    "drop": Scene(
        effects={"drive": "none"},
        piston={"model": "absent"},
        start={"bit_velocity": 5.25},
        run={"duration": 0.06, "settle": 0.0},
    ),
}


class Outline(HTMLParser):
    """Collects what the tests look at."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.targets: list[str] = []
        self.tags: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(value)
            if name in ("href", "xlink:href", "src"):
                self.targets.append(value)


@pytest.fixture(scope="module", params=SCENES)
def case(request, tmp_path_factory):
    """A scene and its page."""
    result = simulate(SCENES[request.param])
    path = write_report(result, tmp_path_factory.mktemp("report"))
    return request.param, result, path.read_text(encoding="utf-8")


def test_page_needs_nothing_else(case):
    _, _, page = case
    outline = Outline(page)
    assert "://" not in page
    assert "link" not in outline.tags
    assert all(target.startswith(("#", "data:image/png;base64,")) for target in outline.targets)
    assert ("blow-data" in outline.ids) == (case[0] != "drop")  # no piston, no blow


def test_parts_of_drawings_are_told_apart(case):
    _, _, page = case
    outline = Outline(page)
    assert len(outline.ids) == len(set(outline.ids))
    inside = {target[1:] for target in outline.targets if target.startswith("#")}
    inside |= set(re.findall(r"url\(#([^)]+)\)", page))
    assert inside <= set(outline.ids)


def test_page_says_it_all(case):
    name, result, page = case
    outline = Outline(page)
    assert outline.tags.count("svg") == {"elastic": 4, "rigid": 3, "drop": 2}[name]
    assert ("Rate of penetration" in page) == (name != "drop")
    for key in ("rock.loading_stiffness", "bit.sections.0.length", "run.duration"):
        assert f"<code>{key}</code>" in page
    assert ("piston.sections" in page) == (name != "drop")
    for text in ("residual", "numba", "Parameter", "crushing of the rock"):
        assert text in page
    assert page.count('class="warning"') == len(result.warnings)
    if result.scene.title:
        assert "A &lt;short&gt; run" in page
        assert "<short>" not in page


def test_ledger_of_the_report_balances(case):
    _, result, _ = case
    parts = {part: sum(joule for _, joule, _ in rows) for part, rows in ledger_rows(result.energy)}
    put_in = parts.pop("Put in")
    assert sum(parts.values()) == pytest.approx(put_in, rel=1e-12)


def test_headlines_are_in_both_units():
    rows = headline_rows({key: None for key, *_ in HEADLINES} | {"rate_of_penetration": 0.0163934})
    hourly = ("Rate in an hour", "0.0164 m/s", "59.0 m/h")
    assert rows == [("Rate of penetration", "0.0164 m/s", "16.4 mm/s"), hourly]
    rows = headline_rows({"peak_bit_force": 594760.6, "rebound_velocity": -3.38})
    assert rows == [
        ("Rebound velocity (mean of the piston)", "−3.38 m/s", ""),
        ("Greatest bit force", "595000 N", "595 kN"),
    ]


def test_digits_that_nobody_knows_are_not_on_the_page(case):
    """Three where the error is not known, four where it does not show; an error has two."""
    name, result, _ = case
    summary = result.summary()
    keys = {what: key for key, what, *_ in HEADLINES}
    for what, si, other in headline_rows(summary):
        for text in filter(None, (si, other)):
            number = text.split(" ")[0].replace("−", "").lstrip("≈")
            if "±" in text or "below" in text:
                continue
            digits = number.partition("e")[0].replace(".", "").lstrip("0").rstrip("0")
            most = 3 if known_error(summary, keys[what]) is None else 4
            assert len(digits) <= most, (name, what, text)


def test_an_error_that_is_rounding_is_told_as_such():
    rows = headline_rows({"rate_of_penetration_standard_error": 5.1e-17,
                          "rate_of_penetration_relative_error": 2.0234e-3})  # fmt: skip
    assert [row[1:] for row in rows] == [
        ("below 1e-9 m/s", "below 1e-6 mm/s"), ("0.0020", "0.20 %"),
    ]  # fmt: skip


def test_the_folder_holds_no_drafts(tmp_path):
    write_report(simulate(SCENES["drop"]), tmp_path)
    assert {path.suffix for path in tmp_path.iterdir()} == {".html", ".png", ".svg"}
