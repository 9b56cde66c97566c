"""Compilation of all that can be compiled beforehand, so that later starts only load it.

`python -m fmu_src.warm_up` is a part of the installation from a clone: the kernels of the
package, and the native library that FMUs bring along.
"""

from __future__ import annotations

from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from typing import Any

from fmu_src.native.library import library_here
from percussion_model.interface.progress import lines
from percussion_model.simulation.orphans import end_with_parent
from percussion_model.simulation.warm_up import SOLVERS, compile_kernels


def main() -> None:
    """Compile, two at a time, the longest first."""
    with ProcessPoolExecutor(max_workers=2, initializer=end_with_parent) as pool:
        jobs: list[Future[Any]] = [pool.submit(library_here)]
        jobs += [pool.submit(compile_kernels, solver) for solver in SOLVERS]
        # processes are forked by now: none inherits the thread that prints
        with lines("compiling") as report:
            for done, job in enumerate(as_completed(jobs), 1):
                job.result()
                # no share of the time: the library takes as long as all others together
                report(f"compiling, {done} of {len(jobs)} parts are ready", None)


if __name__ == "__main__":
    main()
