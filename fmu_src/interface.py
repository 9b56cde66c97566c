"""Names and value references of the hammer: an interface, given once and kept.

`interface-1.json` holds them. New variables get the next free number of their kind
by `python -m fmu_src.interface`; entries are never changed or taken out. What cannot
keep to that is version 2.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

VERSION = 1
FILE = Path(__file__).with_name(f"interface-{VERSION}.json")

# First value reference by causality; outputs that are no reals have their own.
FIRST = {"input": 100, "output": 200, "discrete output": 300, "parameter": 1000}
# Sections of a bar: this, plus SECTION for each, plus the place of the field in it.
FIRST_SECTION = {"piston": 10_000, "bit": 20_000}
SECTION = 10


@cache
def known() -> dict[str, dict[str, Any]]:
    """Entries of the interface by name; those of sections follow a rule instead."""
    if not FILE.exists():
        return {}
    found: dict[str, dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8"))
    return found


@cache
def reference(name: str, kind: str) -> int:
    """Value reference of a variable; a free one for what is not in the file yet."""
    if name in known():
        return int(known()[name]["reference"])
    taken = _given.setdefault(kind, [])
    if name not in taken:
        taken.append(name)
    used = [entry["reference"] for entry in known().values() if entry["kind"] == kind]
    return max([FIRST[kind] - 1, *used]) + 1 + taken.index(name)


_given: dict[str, list[str]] = {}


def section_reference(bar: str, section: int, field: int) -> int:
    """Value reference of a number of a section, both counted from 0."""
    return FIRST_SECTION[bar] + SECTION * section + field


def main() -> None:
    """Add the variables that are not in the file yet."""
    from fmu_src.hammer.variables import hammer_variables
    from percussion_model.scene.scene import Scene

    entries = dict(known())
    for variable in hammer_variables(Scene()):
        if "[" not in variable.name and variable.name not in entries:
            discrete = variable.causality == "output" and variable.variability == "discrete"
            entries[variable.name] = {
                "reference": variable.reference,
                "kind": ("discrete " if discrete else "") + variable.causality,
                "type": variable.type,
                "variability": variable.variability,
            }
    lines = [f"  {json.dumps(name)}: {json.dumps(entry)}" for name, entry in entries.items()]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
