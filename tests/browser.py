"""A headless Chromium that opens a page and tells what it did: errors, requests, a picture.

It is driven through the DevTools protocol; tornado, which carries it, comes with bokeh.
"""

from __future__ import annotations

import asyncio
import base64
import json
import shutil
import subprocess
import time
import urllib.request
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
WAIT = 60.0  # until the browser answers [s]
OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars",
    "--disable-dev-shm-usage", "--disable-background-networking", "--disable-component-update",
    "--remote-debugging-port=0", "--remote-allow-origins=*", "--proxy-server=127.0.0.1:9",
)  # fmt: skip


def find_browser() -> str | None:
    """Path of a Chromium, None where there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


@dataclass(frozen=True)
class Drag:
    """A drag of the mouse within a part of the page, by shares of its width and height."""

    number: int  # of the figure, from 0
    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def place(self) -> str:
        """JavaScript that scrolls there and returns left, top, width and height."""
        return (
            f"(() => {{const f = document.querySelectorAll('figure')[{self.number}];"
            "f.scrollIntoView({block: 'start'}); const r = f.getBoundingClientRect();"
            "return [r.left, r.top, r.width, r.height];})()"
        )


@dataclass
class Visit:
    """What happened on a page."""

    errors: list[str] = field(default_factory=list)  # exceptions, and errors in the console
    requests: list[str] = field(default_factory=list)  # addresses asked for
    answers: list[Any] = field(default_factory=list)  # values of the questions
    height: int = 0  # of the page [pixels]


def visit(
    page: Path,
    folder: Path,
    steps: tuple[str | Drag, ...] = (),
    picture: Path | None = None,
    width: int = 1280,
) -> Visit:
    """Open a page, ask it some JavaScript, drag the mouse, and take a picture of all of it.

    Parameters
    ----------
    page : Path
    folder : Path
        For the profile of the browser.
    steps : tuple of str or Drag
        Expressions to answer, whose promises are waited for, and drags.
    picture : Path, optional
        PNG to write.
    width : int
        Of the window [pixels].
    """
    browser = find_browser()
    assert browser is not None
    command = [browser, *OPTIONS, f"--user-data-dir={folder}", f"--window-size={width},900"]
    process = subprocess.Popen(
        [*command, "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        address = _address(folder / "DevToolsActivePort")
        return asyncio.run(_look(address, page, steps, picture, width))
    finally:
        process.kill()
        process.wait()


def _address(file: Path) -> str:
    """Address of the first tab."""
    end = time.monotonic() + WAIT
    while time.monotonic() < end:
        if file.exists() and len(lines := file.read_text().split()) == 2:
            direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
            with direct.open(f"http://127.0.0.1:{lines[0]}/json") as answer:
                tabs = [tab for tab in json.load(answer) if tab["type"] == "page"]
            if tabs:
                return str(tabs[0]["webSocketDebuggerUrl"])
        time.sleep(0.1)
    raise TimeoutError("the browser did not start")


async def _look(
    address: str, page: Path, steps: tuple[str | Drag, ...], picture: Path | None, width: int
) -> Visit:
    from tornado.websocket import websocket_connect

    socket = await websocket_connect(address, max_message_size=2**28)
    found, count = Visit(), 0

    async def receive() -> dict[str, Any]:
        text = await asyncio.wait_for(socket.read_message(), WAIT)
        assert text is not None, "the browser went away"
        message: dict[str, Any] = json.loads(text)
        _note(found, message)
        return message

    async def call(method: str, **params: Any) -> dict[str, Any]:
        nonlocal count
        count += 1
        await socket.write_message(json.dumps({"id": count, "method": method, "params": params}))
        while (message := await receive()).get("id") != count:
            pass
        assert "error" not in message, message["error"]
        answer: dict[str, Any] = message["result"]
        return answer

    async def ask(expression: str) -> Any:
        answer = await call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    async def drag(what: Drag) -> None:
        left, top, wide, high = await ask(what.place)
        for kind, (x, y) in (
            ("mouseMoved", what.start),
            ("mousePressed", what.start),
            ("mouseMoved", what.end),
            ("mouseReleased", what.end),
        ):
            button = {} if kind == "mouseMoved" else {"button": "left", "clickCount": 1}
            at = {"x": left + x * wide, "y": top + y * high}
            pressed = int(kind != "mouseReleased" and (x, y) == what.end)
            await call("Input.dispatchMouseEvent", type=kind, **at, **button, buttons=pressed)
        await ask("new Promise(done => setTimeout(done, 300))")

    for domain in ("Page", "Runtime", "Log", "Network"):
        await call(f"{domain}.enable")
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    await call("Emulation.setDeviceMetricsOverride", **size)
    await call("Page.navigate", url=page.resolve().as_uri())
    while (await receive()).get("method") != "Page.loadEventFired":
        pass
    await ask("new Promise(done => setTimeout(done, 1500))")  # figures draw after loading
    for step in steps:
        if isinstance(step, str):
            found.answers.append(await ask(step))
        else:
            await drag(step)
    found.height = await ask("document.documentElement.scrollHeight")
    if picture is not None:
        await call("Emulation.setDeviceMetricsOverride", **(size | {"height": found.height}))
        await ask("new Promise(done => setTimeout(done, 500))")
        shot = await call("Page.captureScreenshot")
        picture.write_bytes(base64.b64decode(shot["data"]))
    socket.close()
    return found


def _note(found: Visit, message: dict[str, Any]) -> None:
    params = message.get("params", {})
    match message.get("method"):
        case "Runtime.exceptionThrown":
            found.errors.append(json.dumps(params["exceptionDetails"]))
        case "Runtime.consoleAPICalled" if params["type"] in ("error", "warning", "assert"):
            found.errors.append(json.dumps(params["args"]))
        case "Log.entryAdded" if params["entry"]["level"] in ("error", "warning"):
            found.errors.append(json.dumps(params["entry"]))
        case "Network.requestWillBeSent":
            found.requests.append(params["request"]["url"])
