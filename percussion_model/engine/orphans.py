"""Processes that end with the one that has started them."""

from __future__ import annotations

import os
import threading
import time
from multiprocessing import parent_process

# Between looks at the parent of what is no worker [s].
EVERY = 1.0


def end_with_parent() -> None:
    """Let this process end as soon as the one that has started it has ended, however that was.

    Without this a worker of a process that was killed waits for its next task for ever.
    """
    threading.Thread(target=_wait, args=(os.getppid(),), name="parent", daemon=True).start()


def _wait(first: int) -> None:
    parent = parent_process()
    if parent is not None:  # of multiprocessing
        parent.join()
    while parent is None and os.getppid() == first:  # which never changes on Windows
        time.sleep(EVERY)
    os._exit(1)
