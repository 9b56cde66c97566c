"""Models of parts without FMI, begun with the starts of their tables."""

from __future__ import annotations

from fmu_src.parts.build import PARTS


def make_model(name, **values):
    """Model of a part; `values` are parameters and inputs by name, `__` for a dot."""
    part = PARTS[name]
    given = {key.replace("__", "."): value for key, value in values.items()}
    assert given.keys() <= part.inputs.keys() | part.parameters.keys()
    model = part.slave.MODEL(_starts(part.parameters) | given)
    model.begin(start_inputs(name) | given)
    return model


def start_inputs(name):
    """Inputs of a part at their starts."""
    return _starts(PARTS[name].inputs)


def _starts(entries):
    starts = {name: entry[3] for name, entry in entries.items()}
    return {name: s[0] if isinstance(s, tuple) else s for name, s in starts.items()}
