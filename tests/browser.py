"""A headless Chromium that opens pages and tells what they did: errors, requests, a picture.

It is driven through the DevTools protocol, which tornado carries.
"""

from __future__ import annotations

import asyncio
import base64
import json
import shutil
import subprocess
import time
import urllib.request
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
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


# Codes of keys that have no text of their own.
KEYS = {"Tab": 9, "Enter": 13, "ArrowLeft": 37, "ArrowRight": 39, "Home": 36, "End": 35}


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
    return asyncio.run(_look(page, folder, steps, picture, width))


async def _look(
    page: Path, folder: Path, steps: tuple[str | Drag, ...], picture: Path | None, width: int
) -> Visit:
    with browser(folder, width) as port:
        async with tab(port) as opened:
            await opened.open(page.resolve().as_uri(), width)
            await opened.wait(1500)  # figures draw after loading
            for step in steps:
                if isinstance(step, str):
                    opened.found.answers.append(await opened.ask(step))
                else:
                    await opened.drag(step)
            opened.found.height = await opened.ask("document.documentElement.scrollHeight")
            if picture is not None:
                await opened.shoot(picture)
            return opened.found


@contextmanager
def browser(folder: Path, width: int = 1280) -> Iterator[int]:
    """Start a browser without a window; the port that it is driven through.

    Parameters
    ----------
    folder : Path
        For its profile.
    width : int
        Of its window [pixels].
    """
    program = find_browser()
    assert program is not None
    command = [program, *OPTIONS, f"--user-data-dir={folder}", f"--window-size={width},900"]
    process = subprocess.Popen(
        [*command, "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield _port(folder / "DevToolsActivePort")
    finally:
        process.kill()
        process.wait()


def _port(file: Path) -> int:
    end = time.monotonic() + WAIT
    while time.monotonic() < end:
        if file.exists() and len(lines := file.read_text().split()) == 2:
            return int(lines[0])
        time.sleep(0.1)
    raise TimeoutError("the browser did not start")


def _new_tab(port: int) -> str:
    """Address of a new tab."""
    direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    wanted = urllib.request.Request(f"http://127.0.0.1:{port}/json/new?about:blank", method="PUT")
    with direct.open(wanted) as answer:
        return str(json.load(answer)["webSocketDebuggerUrl"])


@asynccontextmanager
async def tab(port: int) -> AsyncIterator[Tab]:
    """Open a tab of a browser that is driven through a port."""
    from tornado.websocket import websocket_connect

    socket = await websocket_connect(_new_tab(port), max_message_size=2**28)
    try:
        yield Tab(socket)
    finally:
        socket.close()


class Tab:
    """A tab of a browser; `found` is what happened in it."""

    def __init__(self, socket: Any) -> None:
        self.socket, self.count, self.found = socket, 0, Visit()
        self.size: dict[str, Any] = {}

    async def _receive(self) -> dict[str, Any]:
        text = await asyncio.wait_for(self.socket.read_message(), WAIT)
        assert text is not None, "the browser went away"
        message: dict[str, Any] = json.loads(text)
        _note(self.found, message)
        return message

    async def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Call a method of the DevTools protocol; its result."""
        self.count += 1
        call = {"id": self.count, "method": method, "params": params}
        await self.socket.write_message(json.dumps(call))
        while (message := await self._receive()).get("id") != self.count:
            pass
        assert "error" not in message, message["error"]
        answer: dict[str, Any] = message["result"]
        return answer

    async def open(self, url: str, width: int = 1280, height: int = 900) -> None:
        """Open an address, and wait until it is loaded."""
        for domain in ("Page", "Runtime", "Log", "Network"):
            await self.call(f"{domain}.enable")
        self.size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        await self.call("Emulation.setDeviceMetricsOverride", **self.size)
        await self.call("Page.navigate", url=url)
        while (await self._receive()).get("method") != "Page.loadEventFired":
            pass

    async def ask(self, expression: str) -> Any:
        """Value of an expression of JavaScript, whose promise is waited for."""
        answer = await self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    async def wait(self, milliseconds: int) -> None:
        """Let some time of the page go by."""
        await self.ask(f"new Promise(done => setTimeout(done, {milliseconds}))")

    async def until(self, expression: str, longest: float = WAIT) -> Any:
        """Wait until an expression is true; its value."""
        end = time.monotonic() + longest
        while time.monotonic() < end:
            if value := await self.ask(expression):
                return value
            await asyncio.sleep(0.05)
        raise TimeoutError(f"never true: {expression}")

    async def press(self, key: str, text: str = "") -> None:
        """Press and release a key, by its name, as ShiftTab; `text` is what it writes."""
        shift = 8 if key.startswith("Shift") else 0
        key = key.removeprefix("Shift")
        code = KEYS.get(key, 0)
        more = {"key": key, "code": key, "windowsVirtualKeyCode": code, "modifiers": shift}
        down = {"type": "keyDown", "text": text} if text else {"type": "rawKeyDown"}
        await self.call("Input.dispatchKeyEvent", **down, **more)
        await self.call("Input.dispatchKeyEvent", type="keyUp", **more)

    async def drag(self, what: Drag) -> None:
        """Drag the mouse."""
        left, top, wide, high = await self.ask(what.place)
        for kind, (x, y) in (
            ("mouseMoved", what.start),
            ("mousePressed", what.start),
            ("mouseMoved", what.end),
            ("mouseReleased", what.end),
        ):
            button = {} if kind == "mouseMoved" else {"button": "left", "clickCount": 1}
            at = {"x": left + x * wide, "y": top + y * high}
            pressed = int(kind != "mouseReleased" and (x, y) == what.end)
            await self.call("Input.dispatchMouseEvent", type=kind, **at, **button, buttons=pressed)
        await self.wait(300)

    async def shoot(self, picture: Path, whole: bool = True) -> None:
        """Take a picture, of the whole page or of what is seen."""
        if whole:
            height = await self.ask("document.documentElement.scrollHeight")
            await self.call("Emulation.setDeviceMetricsOverride", **self.size | {"height": height})
            await self.wait(500)
        shot = await self.call("Page.captureScreenshot")
        picture.write_bytes(base64.b64decode(shot["data"]))
        await self.call("Emulation.setDeviceMetricsOverride", **self.size)


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
