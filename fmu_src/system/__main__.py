"""Command line: `python -m fmu_src.system [-o FOLDER] [SYSTEM.toml ...]`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from fmpy.validation import validate_fmu

from fmu_src.archive import ROOT, content, fault, state_of
from fmu_src.system.archive import (
    SystemPlanError,
    build_fmus,
    plans,
    read_plan,
    write_system,
)
from percussion_model.interface.terminal import progress
from percussion_model.scene.scene import SceneError


def main(arguments: list[str]) -> int:
    """Build the FMUs and archives of systems, and validate each FMU."""
    parser = argparse.ArgumentParser(
        prog="build.py system", description="Build systems of FMUs as SSP archives."
    )
    parser.add_argument("systems", nargs="*", type=Path, help="files; left out: all that ship")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "dist", help="folder")
    parser.add_argument("--force", action="store_true", help="replace FMUs of other hammers")
    choice = parser.parse_args(arguments)
    problems = 0
    checked = set()
    try:
        for plan in [read_plan(path) for path in choice.systems] or plans():
            before = {path: content(path) for path in choice.output.glob("*.*")}
            with progress(f"building {plan.name}"):
                fmus = build_fmus(plan, choice.output, choice.force)
            for fmu in fmus.values():
                if fmu in checked:
                    continue
                checked.add(fmu)
                with progress(f"validating {fmu.name}"):
                    found = validate_fmu(str(fmu))
                valid = "valid" if not found else "; ".join(found)
                print(f"{fmu}: {state_of(fmu, before.get(fmu))}, {valid}", flush=True)
                problems += len(found)
            path = write_system(plan, fmus, choice.output / f"{plan.name}.ssp")
            print(f"{path}: {state_of(path, before.get(path))}", flush=True)
    except (SystemPlanError, SceneError, OSError) as error:
        print(f"error: {fault(error)}", file=sys.stderr)
        return 1
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
