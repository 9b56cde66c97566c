"""What pages say of accuracy and speed follows from the stored data."""

from __future__ import annotations

import math
import tomllib
from itertools import islice
from pathlib import Path

import pytest

from docs import accuracy_page
from docs.pages import accuracy
from docs.pages.drawn_scenes import COUNT, drawn
from percussion_model import Scene
from percussion_model.verification.accuracy.references import fingerprint

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_pages_say_what_the_data_say():
    for path, text in accuracy.pages().files().items():
        assert path.read_text(encoding="utf-8") == text, "run: python -m docs.make accuracy page"


def test_readme_states_the_advantage_of_the_stored_studies_and_no_other():
    sentence = accuracy_page.advantage()
    assert sentence in README
    found = accuracy_page.contests(list(accuracy_page.load_studies().values()))
    worst = min(one.ratio for one in found[1e-2] if math.isfinite(one.ratio))
    assert accuracy_page.two(worst) in sentence


def test_a_faster_peer_changes_the_sentence(monkeypatch):
    studies = accuracy_page.load_studies()
    before = accuracy_page.advantage()
    for study in studies.values():
        for point in study.points:
            if point.ladder == "explicit":
                object.__setattr__(point, "second", 0.1 * point.second)
    monkeypatch.setattr(
        accuracy_page,
        "load_studies",
        lambda names=accuracy_page.COMPARED: {name: studies[name] for name in names},
    )
    assert accuracy_page.advantage() != before


@pytest.mark.parametrize("place", range(COUNT))
def test_drawn_scenes_are_those_of_the_seed(place):
    path = ROOT / "scenarios" / "drawn" / f"drawn_{place + 1}.toml"
    title = tomllib.loads(path.read_text(encoding="utf-8"))["title"]
    number = int(title.rsplit(" ", 1)[1])
    scene = next(islice(drawn(), number - 1, None))
    assert fingerprint(Scene.from_toml(path)) == fingerprint(scene)
