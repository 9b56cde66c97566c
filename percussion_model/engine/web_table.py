"""What a page has to know of scenes and of what is computed, by the tables of the package.

Scenes are given as JSON: `values` by the keys of parameters, those that are not the default;
`piston` and `bit`, sections from top to bottom, each as length, area, Young's modulus and
density; `rods` with `sections` and `joint`, six numbers as `joint_numbers` has them.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from percussion_model.engine import judgement, library, records
from percussion_model.engine.entries import ENTRIES
from percussion_model.engine.fault_texts import faults
from percussion_model.engine.faults import Fault
from percussion_model.engine.scene_image import AT, COUNTS, PRESSED, Own
from percussion_model.physics.judgement import Grid
from percussion_model.physics.ledger import ENERGIES
from percussion_model.physics.records import (
    BLOW,
    BLOW_COLUMNS,
    EVENT,
    EVENT_COLUMNS,
    SAMPLE_COLUMNS,
    Column,
    EventKind,
    Mode,
    Status,
)
from percussion_model.physics.settling import REQUEST, Verdict
from percussion_model.scene.bar_groups import Rod, Section
from percussion_model.scene.bits import bit, bit_of, bits
from percussion_model.scene.hammers import CHAMBERS, hammer, hammers, with_chambers
from percussion_model.scene.inputs import INPUTS
from percussion_model.scene.numbers import joint_numbers
from percussion_model.scene.parameters import GROUPS, parameter_table
from percussion_model.scene.presets import scene_presets
from percussion_model.scene.rocks import rock, rocks
from percussion_model.scene.rocks.breaking import parameters_under
from percussion_model.scene.rows import ParameterRow
from percussion_model.scene.scene import Scene
from percussion_model.scene.units import QUANTITIES, factor
from percussion_model.scene.values import SCENE_NUMBERS
from percussion_model.solvers.modal.records import MODAL_STATE
from percussion_model.solvers.rigid.records import RIGID_STATE
from percussion_model.solvers.state import words_of
from percussion_model.solvers.wave.records import WAVE_STATE

# Solvers that a page has, and their states; finite elements are for comparison alone.
STATES = {"modal": MODAL_STATE, "wave": WAVE_STATE, "rigid": RIGID_STATE}
SOLVERS = tuple(STATES)
# Of the supply of hammers with chambers [Pa].
PRESSURES = {"pneumatic": 2.4e6, "hydraulic": 2.0e7}
# What a page shows: the choices of what is computed, and groups with its numbers.
SHOWN_GROUPS = (
    "effects",
    "gravity",
    "feed",
    "drive",
    "loss",
    "rock",
    "start",
    "breaking",
    "rotation",
)
SHOWN = (
    "hole_diameter",
    "piston.model",
    "bit.model",
    *(f"{one}.supply_pressure" for one in PRESSURES),
)
# Symbols of the paper.
SYMBOLS = {
    "feed.force": "F_S", "drive.force": "F_0", "drive.reversal_distance": "D_1", "loss.time": "eta",
    "rock.loading_stiffness": "K_R", "rock.unloading_ratio": "gamma", "rock.barrier_damping": "C_R",
    "rock.barrier_energy": "W_R", "rock.reference_penetration": "P_0", "start.gap": "g_0",
    "start.rock_gap": "P_u", "start.drive_direction": "alpha",
}  # fmt: skip


def scenes() -> dict[str, Scene]:
    """Scenes that ship and hammers, by name; those with chambers have it in their name."""
    found = {name: Scene.from_toml(name) for name in scene_presets()}
    found |= {name: hammer(name) for name in hammers()}
    found |= {
        f"{name} chambers": with_chambers(
            name, PRESSURES["pneumatic" if name.startswith("dth") else "hydraulic"]
        )
        for name in CHAMBERS
    }
    return found


def table() -> dict[str, Any]:
    """All that `engine.js` and a page read."""
    return {
        "stamp": library.stamp(),
        "entries": ENTRIES,
        "kinds": {name: int(kind) for name, kind in records.KINDS.items()},
        "solvers": SOLVERS,
        "parameters": [_parameter(name) for name in SCENE_NUMBERS.names or ()],
        "section": [_row(row) | {"key": name} for name, row in Section.rows.items()],
        "joint": [
            _row(row) | {"key": name} for name, row in Rod.rows.items() if row.kind != "sections"
        ],
        "units": {unit: _units(unit) for unit in QUANTITIES},
        "inputs": _inputs(),
        "image": {
            "counts": COUNTS,
            "own": {one.name.lower(): int(one) for one in Own},
            "pressed": PRESSED,
            "force": AT["drive_force"],
            "drive": AT["effects_drive"],
        },
        "columns": {
            "blow": _columns(BLOW_COLUMNS, BLOW),
            "event": _columns(EVENT_COLUMNS, EVENT),
            "sample": _columns(SAMPLE_COLUMNS, None),
        },
        "bytes": {
            "blow": BLOW.itemsize,
            "event": EVENT.itemsize,
            "reading": records.READING_BYTES,
            "record": records.RECORD,
        },
        "head": {name: records.HEAD.fields[name][1] // 8 for name in HEAD_WORDS},  # type: ignore[index]
        "gauge_bars": {one.name.lower(): int(one) for one in records.GaugeBar},
        "faults": faults(),
        "fault": {one.name.lower(): int(one) for one in Fault},
        "status": {one.name.lower(): int(one) for one in Status},
        "request": words_of(REQUEST),
        "judgement": {
            name.removeprefix("judge_"): form for name, (_, form) in judgement.EXPORTED.items()
        },
        "grids": {one.name.lower(): int(one) for one in Grid},
        "energies": len(ENERGIES),
        "verdicts": {one.name.lower(): int(one) for one in Verdict},
        "modes": {one.value: one.name for one in Mode},
        "event_kinds": {one.value: one.name.lower() for one in EventKind},
        "presets": {name: scene_as_json(scene) for name, scene in scenes().items()},
        "bits": {
            name: {"title": bit(name).title, "values": bit(name).parameters} for name in bits()
        },
        "rocks": {name: _rock(name) for name in rocks()},
    }


# Fields of the head of a motion that a page reads.
HEAD_WORDS = ("state_at", "state_bytes", "time_step", "blow_count_at", "event_count_at")


def _row(row: ParameterRow) -> dict[str, Any]:
    return {
        "key": row.key, "kind": row.kind, "unit": row.unit, "default": row.default,
        "lower": row.lower, "lowerOpen": row.lower_open, "upper": row.upper,
        "upperOpen": row.upper_open, "choices": row.choices, "required": row.required,
        "description": row.description, "allowed": row.allowed, "typical": row.typical,
        "needs": row.needs, "effect": row.effect,
    }  # fmt: skip


def _parameter(field: str) -> dict[str, Any]:
    """A parameter that is a word of an image, in the order of the words."""
    row = next(one for one in parameter_table() if one.key.replace(".", "_") == field)
    group = row.key.partition(".")[0]
    return _row(row) | {
        "word": AT[field],
        "whole": SCENE_NUMBERS[field].kind == "i",
        "symbol": SYMBOLS.get(row.key, ""),
        "shown": row.key in SHOWN or group in SHOWN_GROUPS,
        "group": (GROUPS[group].__doc__ or "").partition("\n")[0] if group in GROUPS else "",
    }


def _units(unit: str) -> dict[str, float]:
    """Units in which people give a quantity: the SI value of one of each."""
    return {name: float(factor(name, unit)) for name in QUANTITIES[unit].usual}


def _inputs() -> dict[str, dict[str, Any]]:
    """Parameters that may change during a run: word of each in the state of a solver."""
    return {
        one.key: {
            "atOnce": one.at_once,
            "words": {name: words_of(state).get(one.field, -1) for name, state in STATES.items()},
        }
        for one in INPUTS.values()
    }


def _columns(columns: Iterable[Column], record: np.dtype | None) -> list[dict[str, Any]]:
    """Names, units and meanings, and where each stands in a record."""
    words = words_of(record) if record is not None else {}
    return [
        {
            "name": one.name, "unit": one.unit, "meaning": one.meaning,
            "whole": one.kind == "i8", "word": words.get(one.name, k),
        }
        for k, one in enumerate(columns)
    ]  # fmt: skip


def scene_as_json(scene: Scene) -> dict[str, Any]:
    """A scene as a page has it."""
    keys = [one.replace("_", ".", 1) for one in SCENE_NUMBERS.names or ()]
    keys = ["hole_diameter" if key == "hole.diameter" else key for key in keys]
    joints = joint_numbers(scene).tolist() if scene.effects.string else []
    return {
        "title": scene.title,
        "solver": scene.solver_name,
        "bit_name": bit_of(scene),
        "values": {key: scene[key] for key in keys if scene[key] != scene.row_of(key).default},
        "piston": scene.piston.numbers,
        "bit": scene.bit.numbers,
        "rods": [
            {"sections": rod.numbers, "joint": joint}
            for rod, joint in zip(scene.string.rods, joints, strict=False)
        ],
    }


def _rock(name: str) -> dict[str, Any]:
    """A rock: its values in a scene without a bit, and in one with each of the bits."""
    found, plain = rock(name), Scene()
    under = {one: parameters_under(found, plain.replace(**bit(one).parameters)) for one in bits()}
    return {
        "title": found.title,
        "law": found.law,
        "buttons": found.buttons,
        "holds_for": found.holds_for,
        "under": {"": parameters_under(found, plain)} | under,
    }
