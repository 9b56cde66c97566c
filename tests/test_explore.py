"""The explorer: its numbers are those of the command line, in a real browser; what it refuses."""

from __future__ import annotations

import asyncio
import html
import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import urllib.parse
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from percussion_model import Scene, SceneError, settled
from percussion_model.interface.cli import app
from percussion_model.interface.terminal import show_settled
from percussion_model.scene.parameters import find_row
from percussion_model.scene.scene import Scene as SceneClass
from tests.browser import browser, find_browser, tab

pytest.importorskip("bokeh", reason="the explorer needs bokeh")

from bokeh.document import Document

from percussion_model.interface.explore.inputs import SLIDERS, keys_of, range_of, short
from percussion_model.interface.explore.response import (
    Overtaken,
    numbers,
    refuse_scene,
    respond,
    verdict,
)
from percussion_model.interface.explore.server import MOST_PAGES, Explored
from percussion_model.interface.explore.worker import Worker

LONG = os.environ.get("PERCUSSION_LONG") == "1"
needs_browser = pytest.mark.skipif(
    find_browser() is None, reason="no Chromium is installed to open pages with"
)
COMMAND = (sys.executable, "-c", "from percussion_model.interface.cli import main; main()")
MODEL = "Bokeh.documents[0].get_model_by_name"
READY = (
    f"window.Bokeh && Bokeh.documents.length && {MODEL}('numbers')"
    f" && {MODEL}('numbers').tags[1] > 0"
)
RATE = "Rate of penetration"
# Each slider, and where it is moved to.
MOVES = {
    "feed.force": 6000.0,
    "drive.force": 4000.0,
    "drive.reversal_distance": 0.03,
    "rock.loading_stiffness": 1.2e9,
    "rock.unloading_ratio": 8.0,
    "rock.barrier_energy": 0.1,
    "piston.sections.0.length": 0.2,
    "bit.sections.0.length": 0.25,
}


# ---------------------------------------------------------------------- numbers and inputs


def test_numbers_are_those_that_settled_prints(capsys):
    scene = Scene()
    shown = numbers(respond(scene).found)
    show_settled(settled(scene, error_estimate=True))
    printed = " ".join(capsys.readouterr().out.split())
    assert len(shown) == 6
    for name, text in shown.items():
        assert f"{name} {text.split('; ')[0]}".replace(" ", "") in re.sub(r"[ │|]", "", printed)


def test_metres_an_hour_are_the_same_rate():
    text = numbers(respond(Scene()).found)[RATE]
    (slow, slow_error), (fast, fast_error) = (
        map(float, part.split()[0:3:2]) for part in text.split("; ")
    )
    assert fast == pytest.approx(3.6 * slow, abs=0.0018 + 0.0005)
    assert fast_error == pytest.approx(3.6 * slow_error, abs=0.0018 + 0.0005)


def test_an_undecided_rate_is_said_and_not_shown():
    found = respond(Scene()).found
    by_cells = replace(found, depends_on_cells=True)
    assert numbers(by_cells)[RATE] == "undecided"
    assert any("depends on the resolution" in text for text in verdict(by_cells))
    unsure = replace(found, grid_errors=found.grid_errors | {"rate_of_penetration": 1.0})
    assert numbers(unsure)[RATE] == "undecided"
    assert any("no smaller than the rate" in text for text in verdict(unsure))


def test_a_hammer_that_stalls_has_no_rate():
    response = respond(Scene(effects={"drive": "none"}))
    assert response.found.kind == "stalled"
    assert RATE not in numbers(response.found)
    assert any("have ceased" in text for text in verdict(response.found))
    assert response.window is not None


def test_a_response_that_takes_too_long_is_given_up():
    response = respond(Scene(effects={"feed": False}), most_time=1e-3)
    assert "No stationary response within 0.001 s" in response.refusal
    assert response.found is None


def test_a_response_gives_way_to_a_newer_one(monkeypatch):
    monkeypatch.setattr("percussion_model.interface.explore.response.PATIENCE", 0.0)
    with pytest.raises(Overtaken):
        respond(Scene(), is_overtaken=lambda: True)


def test_scenes_that_cannot_follow_a_slider_are_refused():
    with pytest.raises(SceneError, match=r"piston\.model"):
        refuse_scene(Scene(piston={"model": "absent"}, effects={"drive": "none"}))


def test_sliders_lie_in_the_bounds_of_the_table_and_reach_every_default():
    for key in keys_of(Scene()):
        row = find_row(key)
        start, end, step = range_of(key, float(Scene()[key]))
        assert row.allows(start)
        assert row.allows(end)
        assert start <= Scene()[key] <= end
        assert 50 <= (end - start) / step <= 250
    assert range_of("feed.force", 1e6)[1] == 1e6


@pytest.mark.parametrize("value", [0.0, 0.04, 2500.0, 7.5e8, 1.9370000001e-7, -20e3, 1 / 3])
def test_numbers_in_fields_read_back(value):
    assert float(short(value)) == pytest.approx(value, rel=1e-9)
    assert len(short(value)) <= 15


def test_of_many_wishes_the_newest_is_computed_and_owners_take_turns():
    worker, done, begun, go = Worker(), [], threading.Event(), threading.Event()
    over = threading.Event()

    def first(is_overtaken):
        begun.set()
        go.wait(10.0)
        done.append(("a", 0, is_overtaken()))

    worker.ask("a", first)
    assert begun.wait(10.0)
    for k in (1, 2, 3):
        worker.ask("a", lambda is_overtaken, k=k: done.append(("a", k, is_overtaken())))
    worker.ask("b", lambda _: over.set())
    go.set()
    assert over.wait(10.0)
    worker.stop()
    assert done == [("a", 0, True), ("a", 3, False)]


# ---------------------------------------------------------------------- command line


def test_a_busy_port_is_one_line():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        found = subprocess.run(
            [*COMMAND, "explore", "--no-browser", "--port", str(port)],
            capture_output=True, text=True, timeout=120, check=False,
        )  # fmt: skip
    assert found.returncode == 2
    (line,) = found.stderr.splitlines()
    assert line.startswith(f"percussion: --port {port}: cannot be used on 127.0.0.1")


def test_without_bokeh_the_extra_is_named(monkeypatch):
    for name in [one for one in sys.modules if one.startswith("percussion_model.interface.exp")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "bokeh.application", None)
    found = CliRunner().invoke(app, ["explore", "--no-browser"])
    assert found.exit_code == 2
    assert 'is missing: pip install "percussion_model[report]"' in found.stderr


def test_the_page_without_a_server_has_scenes_of_its_own():
    found = CliRunner().invoke(app, ["explore", "reference", "--page", "--no-browser"])
    assert found.exit_code == 2
    assert "--page: has hammers, bits and rocks of its own" in found.output


def test_a_bad_scene_is_refused_before_a_page_is_served(tmp_path):
    file = tmp_path / "drop.toml"
    file.write_text('[piston]\nmodel = "absent"\n[effects]\ndrive = "none"\n')
    found = CliRunner().invoke(app, ["explore", str(file), "--no-browser", "--port", "0"])
    assert isinstance(found.exception, SceneError)
    assert "piston.model" in str(found.exception)


# ---------------------------------------------------------------------- the server


class Served:
    """`percussion explore` in a process of its own."""

    def __init__(self, *words):
        self.process = subprocess.Popen(
            [*COMMAND, "explore", "--no-browser", "--port", "0", *words],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.url = self.process.stdout.readline().split(" ")[0]
        self.port = urllib.parse.urlsplit(self.url).port

    def end(self):
        self.process.send_signal(signal.SIGINT)
        _, told = self.process.communicate(timeout=30)
        return self.process.returncode, told


@pytest.fixture(scope="module")
def served():
    made = Served()
    yield made
    made.process.kill()
    made.process.communicate()


def status(port, path="/", method="GET", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    connection.putrequest(method, path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    answer = connection.getresponse()
    answer.read()
    connection.close()
    return answer.status


SOCKET = {
    "Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13",
    "Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ==",
}  # fmt: skip


def test_only_pages_of_its_own_are_answered(served):
    port = served.port
    assert status(port) == 200
    assert status(port, Host=f"localhost:{port}") == 200
    # a name of a stranger that leads here, another port, a page elsewhere
    assert status(port, Host=f"rebound.example:{port}") == 403
    assert status(port, Host="127.0.0.1:1") == 403
    assert status(port, Origin="http://stranger.example") == 403
    assert status(port, Origin="null") == 403
    for path in ("/autoload.js?bokeh-autoload-element=1", "/metadata", "/other"):
        assert status(port, path) == 403
    assert status(port, "/ws", Origin="http://stranger.example", **SOCKET) == 403
    assert status(port, "/ws", Host="rebound.example", Origin="http://rebound.example",
                  **SOCKET) == 403  # fmt: skip


def test_more_pages_than_the_limit_are_refused():
    async def open_one_more():
        served = Explored({"reference": Scene}, 0)
        served.pages = MOST_PAGES
        document = Document()
        served._open(document)
        served.worker.stop()
        served.http.stop()
        return document

    document = asyncio.run(open_one_more())
    assert document.roots == []
    assert "pages are open, which is the limit" in document.template_variables["refusal"]


def test_ctrl_c_ends_it_as_other_commands():
    made = Served()
    code, told = made.end()
    assert code == 130, told
    assert told.splitlines()[-1] == "percussion: ended"
    assert "Traceback" not in told


# ---------------------------------------------------------------------- in a browser


async def opened(page, url, width=1280):
    await page.open(url, width)
    await page.until(READY)
    await settled_page(page)


async def settled_page(page):
    await page.until(f"{MODEL}('numbers').tags[0] === {MODEL}('numbers').tags[1]")


async def set_input(page, name, value, field="value"):
    """Change a widget, and wait until its response is shown."""
    before = await page.ask(f"{MODEL}('numbers').tags[0]")
    await page.ask(f"{MODEL}({json.dumps(name)}).{field} = {json.dumps(value)}; 0")
    await page.until(f"{MODEL}('numbers').tags[0] > {before}")
    await settled_page(page)


async def shown_numbers(page):
    """Numbers by name, as the page draws them."""
    text = await page.ask(f"{MODEL}('numbers').text")
    found = re.findall(r'<dt>(.*?)</dt><dd class="now">(.*?)</dd>', text)
    return {name: html.unescape(value.replace("<br>", "; ")) for name, value in found}


def expected(scene):
    return numbers(settled(scene, error_estimate=True))


def in_page(work, folder):
    """Do work in a browser, of which nothing is left."""

    async def run():
        with browser(folder / "profile") as port:
            return await work(port)

    return asyncio.run(run())


def without_faults(found, url):
    assert found.errors == []
    assert [one for one in found.requests if not one.startswith((url, "data:"))] == []


@needs_browser
def test_each_slider_shows_the_rate_of_its_scene_and_tabs_are_independent(served, tmp_path):
    async def work(port):
        async with tab(port) as first, tab(port) as second:
            await opened(first, served.url)
            await opened(second, served.url, width=360)
            other = await shown_numbers(second)
            scene = Scene()
            assert other == expected(scene)
            for key, value in MOVES.items():
                await set_input(first, key, value)
                scene = scene.replace(**{key: value})
                assert await shown_numbers(first) == expected(scene), key
                assert await first.ask(f"{MODEL}('{key} field').value") == short(value)
            text = await first.ask(f"{MODEL}('toml').value")
            assert text == scene.to_toml()
            assert await shown_numbers(second) == other
            assert await second.ask("document.documentElement.scrollWidth") <= 360
            await set_input(second, "effects.barrier", False, "active")
            assert await shown_numbers(second) == expected(Scene(effects={"barrier": False}))
            assert await shown_numbers(first) == expected(scene)
            without_faults(first.found, served.url)
            without_faults(second.found, served.url)
            return text

    text = in_page(work, tmp_path)
    file = tmp_path / "scene.toml"
    file.write_text(text)
    printed = CliRunner().invoke(app, ["settled", str(file)]).stdout
    rate = numbers(settled(SceneClass.from_toml(file), error_estimate=True))[RATE]
    assert rate.split("; ")[0] in printed


ACTIVE = """(() => { let at = document.activeElement;
  while (at?.shadowRoot?.activeElement) at = at.shadowRoot.activeElement;
  return [at.tagName, at.className, at.getAttribute('aria-label') ?? at.textContent ?? ''];
})()"""
NAMED = f"{ACTIVE}[2]"
# Marks all of the text in the field of a key.
FOCUS = """(key => {
  const look = root => { for (const one of root.querySelectorAll('*')) {
      const named = one.getAttribute('aria-label') ?? '';
      if (one.matches('input') && named.startsWith(key)) return one;
      if (one.shadowRoot) { const found = look(one.shadowRoot); if (found) return found; } } };
  const field = look(document); field.focus(); field.select(); return true;
})(%s)"""


@needs_browser
def test_keys_move_a_slider_and_bad_values_change_nothing(served, tmp_path):
    key, value = "rock.unloading_ratio", "0.5"

    async def work(port):
        async with tab(port) as page:
            await opened(page, served.url)
            await page.wait(800)  # names for readers are given once sliders are drawn
            labels = []
            for _ in range(30):
                await page.press("Tab")
                labels.append(await page.ask(NAMED))
            order = [k for k, label in enumerate(labels) if label.startswith("feed force F_S")]
            assert len(order) == 2, labels  # the slider, then its field
            assert labels[order[1]].endswith("as a number")
            before = await shown_numbers(page)
            toml = await page.ask(f"{MODEL}('toml').value")
            await page.ask(FOCUS % json.dumps("gamma"))
            await page.call("Input.insertText", text=value)
            await page.press("Enter", "\r")
            note = f"{MODEL}('{key} field').css_classes.join() + document.title"
            await page.until(f"({note}).startsWith('refused')")
            told = await page.ask(f"{MODEL}('{key} note').text")
            await page.wait(300)
            assert await shown_numbers(page) == before
            assert await page.ask(f"{MODEL}('toml').value") == toml
            assert await page.ask(f"{MODEL}('{key}').value") == Scene().rock.unloading_ratio
            # a number with a unit becomes one in that of the table
            await page.ask(FOCUS % json.dumps("drive force"))
            await page.call("Input.insertText", text="4 kN")
            await page.press("Enter", "\r")
            await page.until(f"{MODEL}('drive.force').value === 4000")
            assert await page.ask(f"{MODEL}('drive.force field').value") == "4000"
            await settled_page(page)
            # back in the slider: an arrow is one step
            await page.ask(FOCUS % json.dumps("feed force"))
            for _ in range(30):
                await page.press("ShiftTab")
                if (await page.ask(ACTIVE))[1].startswith("noUi-handle"):
                    break
            asked = await page.ask(f"{MODEL}('numbers').tags[0]")
            await page.press("ArrowRight")
            await page.until(f"{MODEL}('numbers').tags[0] > {asked}")
            await settled_page(page)
            step = await page.ask(f"{MODEL}('feed.force').step")
            assert await page.ask(f"{MODEL}('feed.force').value") == 2500.0 + step
            assert await shown_numbers(page) == expected(
                Scene(feed={"force": 2500.0 + step}, drive={"force": 4000.0})
            )
            without_faults(page.found, served.url)
            return told

    told = re.sub("<.*?>", "", html.unescape(in_page(work, tmp_path)))
    scene = tmp_path / "reference.toml"
    Scene().to_toml(scene)
    found = CliRunner().invoke(app, ["settled", str(scene), "--set", f"{key}={value}"])
    assert told == str(found.exception)


CLICK = """(text => {
  const look = root => { for (const one of root.querySelectorAll('*')) {
      if (one.matches('button') && one.textContent === text) return one;
      if (one.shadowRoot) { const found = look(one.shadowRoot); if (found) return found; } } };
  look(document).click(); return true;
})(%s)"""


async def copied(page):
    """Copy the scene by its button: the clipboard has what the text area shows."""
    await page.call("Browser.grantPermissions",
                    permissions=["clipboardReadWrite", "clipboardSanitizedWrite"])  # fmt: skip
    await page.call("Page.bringToFront")
    await page.ask(CLICK % json.dumps("Copy as TOML"))
    await page.until(f"{MODEL}('copied').text.includes('copied')")
    assert await page.ask("navigator.clipboard.readText()") == (
        await page.ask(f"{MODEL}('toml').value")
    )


@needs_browser
def test_a_pinned_response_stays_and_reset_goes_back(served, tmp_path):
    async def work(port):
        async with tab(port) as page:
            await opened(page, served.url)
            before = await shown_numbers(page)
            await page.ask(f"{MODEL}('pin').active = true; 0")
            await page.until(f"{MODEL}('numbers').text.includes('class=\"pinned\"')")
            await set_input(page, "feed.force", 9000.0)
            text = await page.ask(f"{MODEL}('numbers').text")
            pinned = re.findall(r'<dd class="pinned">(.*?)</dd>', text)
            assert [one.replace("<br>", "; ") for one in pinned] == list(before.values())
            assert await shown_numbers(page) == expected(Scene(feed={"force": 9000.0}))
            assert "feed.force = 2500" in await page.ask(f"{MODEL}('remarks').text")
            await copied(page)
            # without a drive blows cease, which is said in words
            await set_input(page, "effects.drive", "none")
            assert set((await shown_numbers(page)).values()) == {"–"}
            assert "The blows have ceased" in await page.ask(f"{MODEL}('numbers').text")
            asked = await page.ask(f"{MODEL}('numbers').tags[0]")
            await page.ask(CLICK % json.dumps("Reset"))
            await page.until(f"{MODEL}('numbers').tags[0] > {asked}")
            await settled_page(page)
            assert await shown_numbers(page) == before
            assert await page.ask(f"{MODEL}('toml').value") == Scene().to_toml()
            without_faults(page.found, served.url)

    in_page(work, tmp_path)


@needs_browser
@pytest.mark.skipif(not LONG, reason="a minute; set PERCUSSION_LONG=1")
def test_every_choice_and_both_ends_of_each_slider_are_answered(served, tmp_path):
    async def work(port):
        async with tab(port) as page:
            await opened(page, served.url)
            for key in SLIDERS:
                for end in ("start", "end"):
                    value = await page.ask(f"{MODEL}('{key}').{end}")
                    await set_input(page, key, value)
                    assert await page.ask(f"{MODEL}('numbers').text") != ""
                await set_input(page, key, float(Scene()[key]))
            for name in ("gravity", "feed", "loss", "barrier"):
                for active in (False, True):
                    await set_input(page, f"effects.{name}", active, "active")
            for name in ("drive", "rock", "standstill_tension"):
                for choice in find_row(f"effects.{name}").choices[::-1]:
                    await set_input(page, f"effects.{name}", choice)
            assert await shown_numbers(page) == expected(Scene())
            without_faults(page.found, served.url)

    in_page(work, tmp_path)
