"""Command line: `python -m fmu_src [--scene FILE] [-o FILE.fmu]`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from fmu_src.archive import ROOT, content, fault, state_of
from fmu_src.hammer.build import build_hammer, hammer_name, refuse_other
from fmu_src.parts import pneumatic_drive
from fmu_src.parts.build import build_part
from percussion_model.interface.terminal import progress
from percussion_model.scene.scene import Scene, SceneError

DIST = ROOT / "dist"
REFERENCE = ROOT / "scenarios" / "reference.toml"
DEFAULT = DIST / hammer_name(REFERENCE)
DEFAULT_DRIVE = ROOT / "dist" / "PneumaticDrive.fmu"


def main(arguments: list[str]) -> int:
    """Build an FMU, with its reference signals beside it."""
    parser = argparse.ArgumentParser(
        prog="build.py fmu", description="Bake a scene into an FMU for co-simulation."
    )
    parser.add_argument("--scene", type=Path, help="a scene file; left out: the reference")
    parser.add_argument(
        "-o", "--output", type=Path, help="the FMU to write; left out: dist/, by the scene's name"
    )
    parser.add_argument("--force", action="store_true", help="replace the FMU of another scene")
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
            path = choice.output or DEFAULT_DRIVE
            before = content(path)
            guid = build_part(pneumatic_drive.TABLE, path)
            print(f"{path} {{{guid}}}: {state_of(path, before)}")
            return 0
        file = choice.scene or REFERENCE
        scene = Scene.from_toml(file)
        table = None
        if choice.blow_map or scene.solver_name == "blow-map":
            from percussion_model.interface.commands.blow_map import ready_map

            table = ready_map(scene)
        path = choice.output or DIST / hammer_name(file, "Ladder" if choice.blow_map else "")
        refuse_other(path, scene, table is not None, choice.force)
        before = content(path)
        with progress("building the FMU"):
            guid = build_hammer(scene, path, table)
    except (SceneError, OSError) as error:
        print(f"error: {fault(error)}", file=sys.stderr)
        return 1
    print(f"{path} {{{guid}}}: {state_of(path, before)}")
    if not choice.no_reference:
        from fmu_src.reference import write_reference

        with progress("running the FMU; the first run compiles"):
            files = write_reference(path)
        for written in files:
            print(written)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
