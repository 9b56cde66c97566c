"""Compilation of all that can be compiled beforehand, so that later starts only load it.

`python -m fmu_src.warm_up` is a part of the installation from a clone: the solvers, and the
native libraries that FMUs bring along.
"""

from __future__ import annotations

import sys

from fmu_src.native.library import MODULES, PARTS, libraries, library_here
from percussion_model.engine.compiler import NoCompilerError, objects
from percussion_model.engine.entries import OTHERS, SOLVERS
from percussion_model.engine.library import make, module_of
from percussion_model.engine.platforms import this_platform
from percussion_model.interface.progress import lines


def main() -> None:
    """Compile, two at a time, and link."""
    with lines("compiling") as report:
        objects([*MODULES, *map(module_of, OTHERS)], [this_platform()], report)
    try:
        for solver in (*SOLVERS, *OTHERS):
            make(solver)
    except NoCompilerError as error:
        print(f"the solvers are loaded without a linker: {error}", file=sys.stderr)
    if library_here():
        libraries([this_platform()], which=PARTS)


if __name__ == "__main__":
    main()
