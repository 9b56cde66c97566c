"""A thread that computes the newest wish of each owner; older ones are dropped."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

# Takes a function that says whether the work is overtaken.
Work = Callable[[Callable[[], bool]], None]

log = logging.getLogger(__name__)


class Worker:
    """One thread for all owners, who take turns: however many wish, one thing is computed."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._wishes: dict[object, Work] = {}
        self._over = False
        # a daemon: Ctrl-C does not wait for what is computed
        self._thread = threading.Thread(target=self._run, name="responses", daemon=True)
        self._thread.start()

    def ask(self, owner: object, work: Work) -> None:
        """Take the newest wish of an owner in place of what it still waits for."""
        with self._changed:
            self._wishes[owner] = work  # keeps its turn
            self._changed.notify()

    def drop(self, owner: object) -> None:
        """Forget what an owner waits for."""
        with self._changed:
            self._wishes.pop(owner, None)

    def stop(self) -> None:
        """End the thread after what it computes."""
        with self._changed:
            self._over = True
            self._wishes.clear()
            self._changed.notify()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._wishes or self._over)
                if self._over:
                    return
                owner = next(iter(self._wishes))
                work = self._wishes.pop(owner)
            try:
                work(lambda owner=owner: self._over or owner in self._wishes)  # type: ignore[misc]
            except Exception:  # the next wish may well be computed
                log.exception("a response could not be computed")
