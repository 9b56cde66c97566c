"""Server of the explorer: bokeh's, for this machine alone."""

from __future__ import annotations

import logging
import signal
import threading
import webbrowser
from collections.abc import Callable, Mapping
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.util import bind_sockets
from bokeh.settings import settings
from jinja2 import Environment, PackageLoader, StrictUndefined
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.web import RequestHandler

from percussion_model.interface.explore.page import Explorer, page_variables
from percussion_model.interface.explore.worker import Worker
from percussion_model.scene.scene import Scene

ADDRESS = "127.0.0.1"
# So many pages at once; each keeps figures and waits for its turn.
MOST_PAGES = 8
# A page sends changes of single values [bytes].
LARGEST_MESSAGE = 100_000
# A page that was closed is forgotten after this [ms].
FORGOTTEN_AFTER = 3000


class PortError(ValueError):
    """A port that cannot be had."""


class Refusal(RequestHandler):
    """What is not asked for by a page of this server."""

    def prepare(self) -> None:
        """Refuse, whatever the method."""
        self.set_status(403)
        self.finish("refused: open the address that percussion explore has printed\n")


class OwnPages(BokehTornado):  # type: ignore[misc]
    """Bokeh's application for requests of its own pages.

    A page of a stranger could reach this address through a name that he lets point here (DNS
    rebinding). Its requests carry his name as `Host`, and those across pages an `Origin`: both
    must be ours. Nothing but the page, its socket and bokeh's files is served.
    """

    hosts: tuple[str, ...] = ()

    def find_handler(self, request: HTTPServerRequest, **more: Any) -> Any:
        """Handler of a request, or that of refusals."""
        origin = request.headers.get("Origin")
        ours = request.host in self.hosts and (
            origin is None or origin in [f"http://{host}" for host in self.hosts]
        )
        known = request.path in ("/", "/ws", "/favicon.ico") or request.path.startswith("/static/")
        if not (ours and known):
            return self.get_handler_delegate(request, Refusal)
        return super().find_handler(request, **more)


class Explored:
    """A server of pages on some scenes, bound to a port of this machine.

    Parameters
    ----------
    scenes : mapping of str to callable
        Scenes to start from, by name; the first is shown.
    port : int
        0 takes any that is free.

    Raises
    ------
    PortError
        If the port cannot be had.
    """

    def __init__(self, scenes: Mapping[str, Callable[[], Scene]], port: int) -> None:
        settings.resources = "server"  # bokeh's files come from here, whatever the environment says
        logging.getLogger("tornado.access").setLevel(logging.ERROR)
        try:
            sockets, self.port = bind_sockets(ADDRESS, port)
        except OSError as error:
            reason = error.strerror or str(error)
            raise PortError(
                f"--port {port}: cannot be used on {ADDRESS}: {reason}; give another --port, "
                "or 0 for any that is free"
            ) from None
        self.scenes, self.worker, self.pages = scenes, Worker(), 0
        folder = Environment(
            loader=PackageLoader("percussion_model.interface"), autoescape=False,
            undefined=StrictUndefined,
        )  # fmt: skip
        self.template = folder.get_template("explore.html.j2")
        hosts = tuple(f"{name}:{self.port}" for name in (ADDRESS, "localhost"))
        application = OwnPages(
            {"/": Application(FunctionHandler(self._open))},
            extra_websocket_origins=list(hosts),
            websocket_max_message_size_bytes=LARGEST_MESSAGE,
            unused_session_lifetime_milliseconds=FORGOTTEN_AFTER,
            check_unused_sessions_milliseconds=FORGOTTEN_AFTER,
        )
        application.hosts = hosts
        self.http = HTTPServer(application, max_body_size=LARGEST_MESSAGE)
        self.http.add_sockets(sockets)
        self.loop = IOLoop.current()
        self.server = BaseServer(self.loop, application, self.http)

    @property
    def url(self) -> str:
        """Address to open."""
        return f"http://{ADDRESS}:{self.port}/"

    def _open(self, document: Document) -> None:
        """Fill the document of a new session."""
        title = "Percussion explorer"
        document.title = title
        document.template = self.template
        document.template_variables.update(page_variables(title))
        if self.pages >= MOST_PAGES:
            document.template_variables["refusal"] = (
                f"{MOST_PAGES} pages are open, which is the limit: close one and load this again."
            )
            return
        document.template_variables["refusal"] = ""
        self.pages += 1
        document.on_session_destroyed(self._close)
        Explorer(document, self.scenes, self.worker)

    def _close(self, _: Any) -> None:
        self.pages -= 1

    def run(self, browser: bool, ready: Callable[[], None]) -> None:
        """Serve until Ctrl-C, which is a `KeyboardInterrupt`.

        Parameters
        ----------
        browser : bool
            Open the page.
        ready : callable
            Called when pages are answered and Ctrl-C is heard.
        """
        interrupted = threading.Event()

        def interrupt(*_: Any) -> None:
            interrupted.set()
            self.loop.add_callback(self.loop.stop)

        # one that is raised within a callback of others may be lost there
        before = signal.signal(signal.SIGINT, interrupt)
        try:
            self.server.start()
            ready()
            if browser:  # some do not return before they are closed
                threading.Thread(target=webbrowser.open, args=(self.url,), daemon=True).start()
            self.loop.start()
        finally:
            signal.signal(signal.SIGINT, before)
            self.worker.stop()
            self.server.stop()
        if interrupted.is_set():
            raise KeyboardInterrupt
