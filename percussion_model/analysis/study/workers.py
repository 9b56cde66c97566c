"""Worker processes: on this machine, or of a Dask cluster."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from multiprocessing import active_children, current_process, get_context
from threading import current_thread, main_thread
from typing import Any

from percussion_model.engine.orphans import end_with_parent
from percussion_model.scene.inputs import SimulationError

# Exit code of a worker that came to start workers itself, since it ran the script again.
STARTED_AGAIN = 97
# A pool whose workers die is made anew so often.
MOST_RESTARTS = 3
# A pool has found by then that its workers were ended [s].
FOUND_GONE = 5.0
# One thread a process: their matrices are small, and the processes fill the machine.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

Task = tuple[Any, ...]


def on_this_machine(
    work: Callable[..., Any], tasks: list[Task], processes: int
) -> Generator[tuple[int, Any], None, None]:
    """Do the tasks in so many processes; yield number and outcome as they end.

    One process is the present one. A worker that dies takes its task with it, which is
    done again by another.
    """
    if processes == 1:
        for number, task in enumerate(tasks):
            yield number, work(*task)
        return
    waiting = dict(enumerate(tasks))
    for _ in range(MOST_RESTARTS + 1):
        try:
            with closing(_in_a_pool(work, dict(waiting), processes)) as ended:
                for number, outcome in ended:
                    del waiting[number]
                    yield number, outcome
            return
        except BrokenProcessPool:
            continue
    raise SimulationError(
        f"worker processes died {MOST_RESTARTS + 1} times, out of memory perhaps: what is "
        "finished is kept; run again with fewer processes"
    )


def end_if_started_again() -> None:
    """End a worker that reads the script again, and would start workers itself."""
    if getattr(current_process(), "_inheriting", False):  # as multiprocessing asks, which refuses
        sys.exit(STARTED_AGAIN)


def _in_a_pool(
    work: Callable[..., Any], tasks: dict[int, Task], processes: int
) -> Generator[tuple[int, Any], None, None]:
    end_if_started_again()
    others, workers = set(active_children()), set()
    pool = ProcessPoolExecutor(
        processes, mp_context=get_context("spawn"), initializer=end_with_parent
    )
    running: dict[Future[Any], int] = {}
    try:
        with _one_thread_each(), _interrupts_left_to_this_process():
            for number, task in tasks.items():
                running[pool.submit(work, *task)] = number
        workers = set(active_children()) - others
        while running:
            ended, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in ended:
                yield running.pop(future), future.result()
    except BrokenProcessPool:
        if any(worker.exitcode == STARTED_AGAIN for worker in workers):
            raise SimulationError(
                "worker processes read the script again, and would start workers themselves: put "
                'what the script does under `if __name__ == "__main__":`'
            ) from None
        raise
    finally:
        if running:  # interrupted: what workers have begun is not waited for
            for worker in set(active_children()) - others:
                worker.terminate()
            # told to shut down before it finds them gone, a pool waits for ever for one to read on
            wait(running, timeout=FOUND_GONE)
        pool.shutdown(wait=False, cancel_futures=True)


@contextmanager
def _interrupts_left_to_this_process() -> Iterator[None]:
    """Let processes that are started meanwhile ignore Ctrl-C from their first line on.

    What this process does on Ctrl-C or SIGTERM waits until they are known, so that it can end
    them.
    """
    if current_thread() is not main_thread():  # others may not touch signals
        yield
        return
    told: list[tuple[Any, ...]] = []
    before: dict[int, Any] = {
        number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)
    }
    heeded = [number for number, act in before.items() if callable(act)]
    for number in heeded:  # another thread may hear what this one blocks
        signal.signal(number, lambda *given: told.append(given))
    # A new process inherits what its thread blocks, but not what a handler does.
    mask = getattr(signal, "pthread_sigmask", None)
    blocked = mask(signal.SIG_BLOCK, {signal.SIGINT}) if mask else set()
    try:
        yield
    finally:
        for number in heeded:
            signal.signal(number, before[number])
        if mask:
            mask(signal.SIG_SETMASK, blocked)
        for number, frame in told[:1]:
            before[number](number, frame)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Give processes started meanwhile one thread of linear algebra each."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def on_a_cluster(
    work: Callable[..., Any], tasks: list[Task], address: str
) -> Generator[tuple[int, Any], None, None]:
    """Do the tasks on a Dask cluster; yield number and outcome as they end.

    Parameters
    ----------
    address : str
        Of the scheduler, as in tcp://127.0.0.1:8786.
    """
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise SimulationError(
            f'a cluster needs {error.name}: pip install "percussion_model[cluster]"'
        ) from None
    try:
        client = Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise SimulationError(f"{address}: no Dask scheduler answers there ({error})") from None
    with client:
        running = {
            client.submit(work, *task, pure=False): number for number, task in enumerate(tasks)
        }
        for future in as_completed(list(running)):
            yield running.pop(future), future.result()
