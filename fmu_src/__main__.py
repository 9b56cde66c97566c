"""Command line: `python -m fmu_src [--scene FILE] [-o FILE.fmu]`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from fmu_src.archive import ROOT
from fmu_src.hammer.build import build_hammer
from fmu_src.parts import pneumatic_drive
from fmu_src.parts.build import build_part
from percussion_model.interface.terminal import progress
from percussion_model.scene.scene import Scene, SceneError

DEFAULT = ROOT / "dist" / "PercussiveHammer.fmu"
DEFAULT_DRIVE = ROOT / "dist" / "PneumaticDrive.fmu"


def main(arguments: list[str]) -> int:
    """Build an FMU, with its reference signals beside it."""
    parser = argparse.ArgumentParser(
        prog="build.py fmu", description="Bake a scene into an FMU for co-simulation."
    )
    parser.add_argument("--scene", type=Path, help="a scene file; left out: the reference")
    parser.add_argument("-o", "--output", type=Path, default=DEFAULT, help="the FMU to write")
    parser.add_argument(
        "--pneumatics", action="store_true", help="write the simple pneumatic drive instead"
    )
    parser.add_argument(
        "--no-reference", action="store_true", help="do not run it for _in.csv and _ref.csv"
    )
    parser.add_argument(
        "--blow-map", action="store_true", help="bring the table that solver.fidelity needs along"
    )
    choice = parser.parse_args(arguments)
    try:
        if choice.pneumatics:
            path = DEFAULT_DRIVE if choice.output == DEFAULT else choice.output
            print(f"{path} {{{build_part(pneumatic_drive.TABLE, path)}}}")
            return 0
        scene = Scene.from_toml(choice.scene or ROOT / "scenarios" / "reference.toml")
        table = None
        if choice.blow_map or scene.solver_name == "blow-map":
            from percussion_model.interface.commands.blow_map import ready_map

            table = ready_map(scene)
        with progress("building the FMU"):
            guid = build_hammer(scene, choice.output, table)
    except (SceneError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"{choice.output} {{{guid}}}")
    if not choice.no_reference:
        from fmu_src.reference import write_reference

        with progress("running the FMU; the first run compiles"):
            files = write_reference(choice.output)
        for path in files:
            print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
