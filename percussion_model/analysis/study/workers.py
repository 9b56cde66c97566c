"""Worker processes: on this machine, or of a Dask cluster."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from multiprocessing import current_process, get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from threading import current_thread, main_thread
from typing import Any

from percussion_model.engine.orphans import end_with_parent
from percussion_model.scene.inputs import SimulationError

# Exit code of a worker that came to start workers itself, since it ran the script again.
STARTED_AGAIN = 97
# So many workers may die and are replaced.
MOST_RESTARTS = 3
# One thread a process: their matrices are small, and the processes fill the machine.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

# What a worker that has died has sent.
_DIED = object()

Task = tuple[Any, ...]


def on_this_machine(
    work: Callable[..., Any], tasks: list[Task], processes: int
) -> Generator[tuple[int, Any], None, None]:
    """Do the tasks in so many processes; yield number and outcome as they end.

    One process is the present one. A worker that dies takes its task with it, which is
    done again by another. What workers have begun is not waited for when this is closed.
    """
    if processes == 1:
        for number, task in enumerate(tasks):
            yield number, work(*task)
        return
    end_if_started_again()
    waiting = list(reversed(range(len(tasks))))  # the next one last
    workers: dict[Connection, BaseProcess] = {}
    doing: dict[Connection, int] = {}
    deaths = 0
    try:
        while waiting or doing:
            _start(work, min(processes, len(waiting) + len(doing)), workers)
            for end in workers.keys() - doing.keys():
                _give(end, tasks, waiting, doing)
            ready = wait(list(doing))
            for end in [one for one in doing if one in ready]:
                number, outcome = doing.pop(end), _hear(end)
                if outcome is _DIED:
                    waiting.append(number)
                    deaths += 1
                    _bury(workers.pop(end), deaths)
                    continue
                _give(end, tasks, waiting, doing)  # before others look at the outcome
                if isinstance(outcome, BaseException):
                    raise outcome
                yield number, outcome
    finally:
        # Pipes are read by this thread alone: a message that breaks off holds nobody up.
        for worker in workers.values():
            worker.terminate()
        for end, worker in workers.items():
            end.close()
            worker.join()


def end_if_started_again() -> None:
    """End a worker that reads the script again, and would start workers itself."""
    if getattr(current_process(), "_inheriting", False):  # as multiprocessing asks, which refuses
        sys.exit(STARTED_AGAIN)


def _start(work: Callable[..., Any], count: int, workers: dict[Connection, BaseProcess]) -> None:
    """Start workers until there are so many, each beside this process's end of a pipe."""
    if len(workers) >= count:
        return
    context = get_context("spawn")
    if os.name != "nt":  # started by the first worker, it would let that one hear Ctrl-C
        resource_tracker.ensure_running()
    with _one_thread_each(), _interrupts_left_to_this_process():
        while len(workers) < count:
            here, there = context.Pipe()
            worker = context.Process(target=_serve, args=(work, there), daemon=True)
            worker.start()
            there.close()  # so that the pipe ends with the worker
            workers[here] = worker


def _give(
    end: Connection, tasks: list[Task], waiting: list[int], doing: dict[Connection, int]
) -> None:
    """Send the next task, if there is one; who listens finds that a worker has died."""
    if waiting:
        doing[end] = waiting.pop()
        with suppress(OSError):
            end.send(tasks[doing[end]])


def _hear(end: Connection) -> Any:
    try:
        return end.recv()
    except (EOFError, OSError):
        return _DIED


def _serve(work: Callable[..., Any], end: Connection) -> None:
    """Do the tasks that come, in a process of its own, until this one is ended."""
    end_with_parent()
    while True:
        task = end.recv()
        try:
            outcome = work(*task)
        except Exception as error:
            outcome = error
        end.send(outcome)


def _bury(worker: BaseProcess, deaths: int) -> None:
    """Say why workers die, unless they may go on doing so."""
    worker.join()
    if worker.exitcode == STARTED_AGAIN:
        raise SimulationError(
            "worker processes read the script again, and would start workers themselves: put "
            'what the script does under `if __name__ == "__main__":`'
        )
    if deaths > MOST_RESTARTS:
        raise SimulationError(
            f"worker processes died {deaths} times, out of memory perhaps: what is finished is "
            "kept; run again with fewer processes"
        )


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
