"""The tables of a part of the drilling system, as `tables` has them of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fmu_src.native.tables import Image, TableWriter
from fmu_src.parts.compiled import COMPILED
from fmu_src.parts.part import PartTable
from fmu_src.variables import Variable
from percussion_model.engine.fault_texts import of_field
from percussion_model.solvers.state import WORKSPACE

# Counts of bars, of which a part has none; `tables.c` looks at them.
BARS = ("#piston", "#bit", "#rods")


def part_tables(part: PartTable, variables: Sequence[Variable], guid: str) -> bytes:
    """Contents of `model.bin`.

    Parameters
    ----------
    part : PartTable
        With a law.
    variables : sequence of Variable
        Of the part, in the order of its table.
    guid : str
        Of the model description.
    """
    assert part.law is not None
    image = Image()
    for name in BARS:
        image.add(name, 0)
    image.add("#part", [one.name for one in COMPILED].index(part.name))
    given = [replace(one, key=one.name) for one in variables]
    for causality in ("parameter", "input"):
        for one in given:
            if one.causality == causality:
                first = one.start - 1 if one.type == "Enumeration" else one.start
                whole = one.type != "Real"
                image.add(one.name.replace(".", "_"), int(first) if whole else float(first))
    field = of_field([name for name, *_ in part.law.words])
    faults = ("", "memory is exhausted", field, f"the saved state has {WORKSPACE}")
    return TableWriter(given, image).write(guid, [*faults, *part.law.faults])
