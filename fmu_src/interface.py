"""References for new variables of the hammer: `python -m fmu_src.interface`."""

from __future__ import annotations

import json

from fmu_src.hammer.variables import INTERFACE, hammer_variables, interface_entries
from percussion_model.scene.scene import Scene


def main() -> None:
    """Add the variables that are not in the file yet."""
    entries = dict(interface_entries())
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
    INTERFACE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
