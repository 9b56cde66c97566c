"""The page that runs the hammer: its numbers are the package's, and it survives what users do."""

from __future__ import annotations

import asyncio
import base64
import json
import os
import random

import numpy as np
import pytest

from percussion_model.analysis.stationary import settled
from percussion_model.engine.compiler import NoCompilerError
from percussion_model.interface.cli import app
from percussion_model.interface.explore.build import engine_folder, own_link, page, with_scene
from percussion_model.scene.bits import bit
from percussion_model.scene.hammers import hammer, with_chambers
from percussion_model.scene.rocks import rock, rocks
from percussion_model.scene.rocks.breaking import parameters_under
from percussion_model.scene.scene import Scene
from percussion_model.scene.typical import hint_of
from percussion_model.simulation.driller_numbers import driller_text
from percussion_model.simulation.uncertain import in_digits, mean_text
from tests.browser import browser, find_browser, tab

pytest.importorskip("tornado", reason="a browser is driven through tornado")
pytestmark = pytest.mark.skipif(
    find_browser() is None, reason="no Chromium is installed to open pages with"
)
LONG = os.environ.get("PERCUSSION_LONG") == "1"  # as `build.py page` has it
AT_ONCE = 40  # moves
SETTINGS, SURVIVED = (40, 1000) if LONG else (10, 40)
HAMMERS = {
    "reference": ("dth-90",),
    "dth3": ("dth-90",),
    "dth4": ("dth-115",),
    "dth5": ("dth-140",),
}
# What the page shows of a response, and how a test waits for it.
SHOWN = "(explorer.state.found && explorer.state.shown === explorer.state.asked)"
WITH_ERRORS = f"{SHOWN} && (explorer.state.found.refusal || explorer.state.found.errors || null)"
ROW = (
    "[...document.querySelectorAll('#numbers div')]"
    ".map(one => [one.children[0].textContent, one.children[1].textContent])"
)
NUMBERS = {
    "Blow frequency": ("blow_frequency", 1.0, "Hz"),
    "Impact velocity": ("impact_velocity", 1.0, "m/s"),
    "Energy into the rock": ("transfer_efficiency", 100.0, "%"),
    "Percussive power": ("percussive_power", 1e-3, "kW"),
    "Specific energy": ("specific_energy", 1e-6, "MJ/m³"),
    "Blow period": ("blow_period", 1e3, "ms"),
}
# Moves of chance, faster than answers.
MOVES = """
(async () => {
  let seed = SEED;
  const random = () => (seed = seed * 16807 % 2147483647) / 2147483647;
  const {tables, Scene, show} = explorer, any = list => list[Math.floor(random() * list.length)];
  const hammers = Object.keys(tables.hammers).filter(one => !tables.presets[one].rods.length);
  for (let k = 0; k < COUNT; k++) {
    const hammer = any(hammers), rock = any(Object.keys(tables.rocks));
    show(new Scene(tables, hammer, any(tables.hammers[hammer].bits), rock, {
      "feed.force": 2e4 * random(), "rock.barrier_energy": random(),
      "rock.loading_stiffness": 3e9 * random(), "loss.time": 1e-5 * random() ** 4,
      "drive.reversal_distance": 0.1 * random(), "rotation.speed": 30 * random(),
    }));
    await new Promise(done => setTimeout(done, WAIT * random()));
  }
  show(new Scene(tables, "reference"));
  return true;
})()
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The page as a file."""
    try:
        engine = engine_folder()
    except NoCompilerError as error:
        pytest.skip(f"the engine for browsers is not there: {error}")
    file = tmp_path_factory.mktemp("page") / "explore.html"
    file.write_text(page(engine), encoding="utf-8")
    return file


def opened(built, folder, use, fragment="", width=1280):
    """What `use` returns of a tab with the page, which must ask for nothing and find no fault."""

    async def visit():
        with browser(folder / "profile") as port:
            async with tab(port) as one:
                calm = {"name": "prefers-reduced-motion", "value": "reduce"}
                await one.call("Emulation.setEmulatedMedia", features=[calm])
                await one.open(f"{built.as_uri()}{fragment}", width)
                await one.until(SHOWN)
                answer = await use(one)
                assert one.found.errors == []
                assert [
                    at
                    for at in one.found.requests
                    if not at.startswith(("file:", "blob:", "data:"))
                ] == []
                return answer

    return asyncio.run(visit())


async def follow(one, link):
    """Change the address to another link, and wait until the page has taken it up."""
    await one.ask(
        "new Promise(done => {addEventListener('hashchange', () => done(), {once: true});"
        f" location.hash = '{link}'}})"
    )


def random_settings(seed):
    """Names and values of a scene: as a link of the page, and as a scene of the package."""
    chance = random.Random(seed)
    name = chance.choice(list(HAMMERS))
    values = {
        "feed.force": round(chance.uniform(1e3, 15e3)),
        "drive.force": round(chance.uniform(2e3, 14e3)),
        "rock.barrier_energy": round(chance.uniform(0.02, 0.2), 3),
    }
    head, stone = chance.choice(HAMMERS[name]), chance.choice(rocks())
    scene = Scene() if name == "reference" else hammer(name)
    scene = scene.replace(**bit(head).parameters)
    scene = scene.replace(**parameters_under(rock(stone), scene)).replace(**values)
    parts = {"hammer": name, "bit": head, "rock": stone, **values}
    return "&".join(f"{key}={value}" for key, value in parts.items()), scene


def test_numbers_are_those_of_settled(built, tmp_path):
    """To the digits shown, with their errors."""
    settings = [random_settings(seed) for seed in range(SETTINGS)]

    async def use(one):
        shown = []
        for link, _ in settings:
            await follow(one, link)
            await one.until(WITH_ERRORS)
            rate = await one.ask(
                "['rate', 'numerical'].map(id => document.getElementById(id).textContent).join('|')"
            )
            shown.append(
                (
                    rate,
                    dict(await one.ask(ROW)),
                    await one.ask("document.getElementById('motion').textContent"),
                )
            )
        return shown

    for (link, scene), (rate, row, motion) in zip(
        settings, opened(built, tmp_path, use), strict=True
    ):
        found = settled(scene, error_estimate=True)
        summary = found.summary()
        if scene.effects.rotation:
            torque = float(np.mean(found.counted["rotation_torque"]))
            assert row["Torque of the rotation"] == f"{in_digits(torque)} N m", link
        for name, text in row.items():
            if name in NUMBERS:
                key, factor, unit = NUMBERS[name]
                assert text == f"{mean_text(summary, key, factor)} {unit}", (link, name)
        expected = driller_text(summary, "rate_of_penetration")
        value, _, error = rate.partition(" m/h|")
        if "undecided" not in expected and error:
            assert f"{value} {error.removesuffix(' m/h by the computation')}" == expected, link
        assert ("alike" in motion) == (found.kind == "periodic" and found.order == 1), link


def test_a_link_holds_the_scene_and_is_written_as_toml(built, tmp_path):
    """The file and the program that the page writes give the scene of the package."""
    link, scene = random_settings(SETTINGS)

    async def use(one):
        return await one.ask("['toml', 'python', 'link'].map(form => explorer.state.scene[form]())")

    toml, python, again = opened(built, tmp_path, use, f"#{link}")
    (tmp_path / "scene.toml").write_text(toml, encoding="utf-8")
    assert Scene.from_toml(tmp_path / "scene.toml") == scene
    assert toml in python
    assert again.startswith("version=")
    assert again.endswith(link)


MEANS = (
    "(({found: {rate, means, errors}}) => [rate, means.impact_velocity, means.transfer_efficiency,"
    "errors.rate_of_penetration, errors.impact_velocity, errors.blow_period])(explorer.state)"
)
ERRORS_OF = ("rate_of_penetration", "impact_velocity", "blow_period")


def means(scene):
    """The numbers of `MEANS`, by the package."""
    found = settled(scene, error_estimate=True).summary()
    names = ("rate_of_penetration", "impact_velocity", "transfer_efficiency")
    return [found[name] for name in (*names, *(f"{one}_error" for one in ERRORS_OF))]


CHANGED = {
    "piston.sections.1.length": 0.21,
    "bit.sections.0.length": 0.11,
    "effects.gravity": "false",
    "effects.rock": "power",
}


OWN = {
    "t38_rods": Scene.from_toml("t38_rods"),
    "rigid": Scene.from_toml("rigid"),
    "dth4_kuru": Scene.from_toml("dth4_kuru"),
    "air": with_chambers("dth3", 1.8e6),
    "rigid on air": with_chambers("dth3", 1.8e6).computed_by("rigid"),
}


@pytest.mark.parametrize("name", OWN)
def test_a_scene_of_the_user_is_begun_with_shared_and_written(name, built, tmp_path):
    """All of it, with errors: rods, rigid bodies, a bit that breaks rock, and hammers on air."""
    scene = OWN[name]
    file = tmp_path / "own.html"
    file.write_text(with_scene(built.read_text("utf-8"), scene), encoding="utf-8")
    changes = CHANGED if name == "dth4_kuru" else {"feed.force": "3500.0"}

    async def use(one):
        await one.until(WITH_ERRORS)
        before = await one.ask(MEANS)
        link = await one.ask("explorer.state.scene.link()")
        for key, value in changes.items():
            link += f"&{key}={value}"
        await follow(one, link)
        await one.until(WITH_ERRORS)
        forms = await one.ask("['toml', 'link'].map(form => explorer.state.scene[form]())")
        return before, await one.ask(MEANS), forms

    before, after, (toml, link) = opened(file, tmp_path, use)
    assert before == pytest.approx(means(scene), rel=1e-7)
    changed = scene.replace(
        **{key: {"false": False}.get(value, value) for key, value in changes.items()
           if key != "feed.force"},
        **{"feed.force": 3500.0} if "feed.force" in changes else {},
    )  # fmt: skip
    (tmp_path / "scene.toml").write_text(toml, encoding="utf-8")
    assert Scene.from_toml(tmp_path / "scene.toml") == changed
    assert after == pytest.approx(means(changed), rel=1e-7)
    assert all(f"{key}=" in link for key in changes)


WRONG = {
    "letters": "own=%%%",
    "not JSON": "own=abcd",
    "no bars": {"preset": {"piston": [], "bit": [], "rods": [], "values": {}}},
    "piston.sections.0.area = -1.0 m^2: must be a number above 0 and up to 10 m^2": {
        "preset": {"piston": [[1, -1, 2e11, 7850]]}
    },
    "effects.none: there is no such parameter": {"preset": {"values": {"effects.none": 1}}},
    "a rod that is none": {"preset": {"rods": [None]}},
    "no values": {"preset": {"values": None}},
    "nothing": "own=bnVsbA",
    "feed.force = 1000000000000000.0 N": {"preset": {"values": {"feed.force": 1e15}}},
}


def test_links_of_strangers_are_checked(built, tmp_path):
    """What is wrong is told, and the page shows what it has."""
    links = {}
    for why, given in WRONG.items():
        if isinstance(given, dict):
            whole = json.loads(base64.urlsafe_b64decode(own_link(Scene())[4:] + "==="))
            whole["preset"] |= given["preset"]
            letters = base64.urlsafe_b64encode(json.dumps(whole).encode()).decode()
            given = f"own={letters.rstrip('=')}"
        links[why] = given

    async def use(one):
        said = []
        for link in links.values():
            await one.ask(
                f"document.getElementById('said').textContent = ''; location.hash = '{link}'"
            )
            said.append(await one.until("document.getElementById('said').textContent"))
            await one.until(SHOWN)
        return said

    for why, text in zip(WRONG, opened(built, tmp_path, use), strict=True):
        expected = why if "." in why else "the scene is not whole"
        assert text.startswith("In the link, "), why
        assert expected in text


def test_switches_and_choices_change_the_scene(built, tmp_path):
    async def use(one):
        await one.ask("document.getElementById('more').open = true")
        shown = await one.ask(
            "[...document.querySelectorAll('.choice:not([hidden]) span')].map(o => o.textContent)"
        )
        await one.ask("document.querySelector('.choice input').click()")
        await one.until(SHOWN)
        off = await one.ask("explorer.state.scene.get('effects.breaking')")
        await one.ask(
            "(() => {const one = [...document.querySelectorAll('.choice select')]"
            ".find(o => o.value === 'bilinear'); one.value = 'wall';"
            "one.dispatchEvent(new Event('change'));})()"
        )
        await one.until(SHOWN)
        return shown, off, await one.ask("explorer.state.found.rate")

    shown, off, rate = opened(built, tmp_path, use)
    assert "Joints of the rods" not in shown  # of top hammers
    assert "Energy barrier before the rock breaks" in shown
    assert off is False
    assert rate == 0


def test_the_command_writes_the_page_with_a_scene(built, tmp_path, capsys, monkeypatch):
    told = []
    monkeypatch.setattr("webbrowser.open", told.append)
    file = tmp_path / "mine.html"
    app(["explore", "rigid", "--set", "feed.force=3kN", "--out", str(file)], standalone_mode=False)
    assert capsys.readouterr().out.strip() == file.as_uri() == told[0]
    text = file.read_text("utf-8")
    assert own_link(Scene.from_toml("rigid").replace(**{"feed.force": 3e3})) in text


def test_bad_values_answer_in_place_in_the_words_of_the_package(built, tmp_path):
    async def use(one):
        said = []
        for text in ("1e12", "ab", "11"):
            await one.ask(
                "(() => {const field = document.querySelector('#sliders input[type=text]');"
                f"field.value = '{text}'; field.dispatchEvent(new Event('change'));}})()"
            )
            said.append(await one.ask("document.querySelector('#sliders .refusal').textContent"))
        await one.ask("explorer.change({'rotation.string_stiffness': 5})")
        await one.until(
            "explorer.state.found?.refusal && explorer.state.shown === explorer.state.asked"
        )
        said.append(await one.ask("document.getElementById('refusal').textContent"))
        await one.ask("explorer.change({'rotation.string_stiffness': 0})")
        await one.until(f"{SHOWN} && !explorer.state.found.refusal")
        return said

    large, word, fine, refused = opened(built, tmp_path, use)
    assert large == "feed.force = 1000000000000000.0 N: must be a number from -1e9 to 1e9 N"
    assert word == 'feed.force = "ab": must be a number from -1e9 to 1e9 N'
    assert fine == ""
    assert refused.startswith("rotation.string_stiffness = 5.0 N m/rad needs rotation.inertia")


@pytest.mark.parametrize(
    "values",
    [
        {"feed.force": 2000.0},
        {"effects.breaking": False, "rock.loading_stiffness": 2e7, "feed.force": 1e6},
    ],
)
def test_doubts_are_told_in_the_words_of_the_package(values, built, tmp_path):
    """A casing that lifts off; rock that is pressed in too deep, by a feed that no drill has."""
    scene = hammer("dth4").replace(**values)
    link = "&".join(f"{key}={str(value).lower()}" for key, value in values.items())

    async def use(one):
        await one.until(WITH_ERRORS)
        return await one.ask("[...document.querySelectorAll('#notes p')].map(o => o.textContent)")

    told = opened(built, tmp_path, use, f"#hammer=dth4&{link}")
    hints = [hint for key in values if (hint := hint_of(key, [values[key]]))]
    warned = settled(scene, error_estimate=True).warnings
    assert len(told) == len(values)
    assert set(told) <= {*hints, *warned}


def test_a_jam_and_the_work_of_a_great_feed_are_said(built, tmp_path):
    jam = "hammer=dth4&bit=dth-115&rock=kuru-granite&rotation.stall_torque=200&feed.force=30000"

    async def use(one):
        texts = "['motion', 'notes', 'why'].map(id => document.getElementById(id).textContent)"
        await one.until("document.getElementById('notes').textContent")
        jammed = await one.ask(texts)
        link = "hammer=dth4&bit=dth-115&rock=kuru-granite&feed.force=100000"
        await follow(one, link)
        await one.until(SHOWN)
        return jammed, await one.ask(texts)

    (motion, note, _), (_, _, why) = opened(built, tmp_path, use, f"#{jam}")
    assert "the bit does not turn" in motion
    assert "the rotation has jammed" in note
    assert "The feed does so much work besides" in why


def test_keys_alone_choose_move_and_play(built, tmp_path):
    async def use(one):
        await one.ask("document.querySelector('#hammers input:checked').focus()")
        await one.press("ArrowRight")
        await one.until(f"{SHOWN} && explorer.state.scene.hammer !== 'dth4'")
        name = await one.ask("document.activeElement.value")
        await one.ask("document.getElementById('in-feed-force').focus()")
        before = await one.ask("explorer.state.scene.get('feed.force')")
        await one.press("ArrowRight")
        after = await one.ask("explorer.state.scene.get('feed.force')")
        await one.until(f"{SHOWN} && explorer.state.blow")
        assert not await one.ask("explorer.player.playing")  # motion was asked to be reduced
        await one.ask("document.getElementById('play').focus()")
        await one.press("Enter", "\r")
        first = await one.ask("document.getElementById('clock').textContent")
        await one.wait(300)
        return (
            name,
            before,
            after,
            first,
            await one.ask("document.getElementById('clock').textContent"),
        )

    name, before, after, first, then = opened(built, tmp_path, use)
    assert name == "dth4 chambers"
    assert after > before
    assert then != first


NAMED = {"button", "radio", "slider", "textbox", "combobox", "checkbox", "image", "group", "region"}


def test_all_parts_have_a_role_and_a_name(built, tmp_path):
    """As those hear them who do not see: each part to act on, each picture, and what changes."""

    async def use(one):
        await one.until(f"{WITH_ERRORS} && explorer.state.blow")
        await one.call("Accessibility.enable")
        return (await one.call("Accessibility.getFullAXTree"))["nodes"]

    found = [
        (one["role"]["value"], one.get("name", {}).get("value", ""), one.get("properties", []))
        for one in opened(built, tmp_path, use)
        if not one["ignored"]
    ]
    assert [role for role, name, _ in found if role in NAMED and not name] == []
    assert {"slider", "radio", "button", "image", "heading", "status", "main"} <= {
        role for role, *_ in found
    }
    live = [one for *_, properties in found for one in properties if one["name"] == "live"]
    assert {one["value"]["value"] for one in live} >= {"polite"}
    (drawing,) = (name for role, name, _ in found if name.startswith("Piston, bit and rock"))
    assert "MPa" in drawing


def test_many_random_settings_leave_the_worker_alive(built, tmp_path):
    """Moves that come faster than answers; the last one has its own."""
    moves = MOVES.replace("COUNT", str(AT_ONCE)).replace("WAIT", "60")

    async def use(one):
        for part in range(SURVIVED // AT_ONCE):
            assert await one.ask(moves.replace("SEED", str(42 + part)))
        await one.until(f"{WITH_ERRORS} && explorer.state.found.rate")
        return await one.ask("explorer.state.found.rate")

    assert opened(built, tmp_path, use) == pytest.approx(16.350e-3, abs=1e-6)
