"""A scene: what is there, which effects are on, and how long it runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from percussion_model.components import COMPONENTS
from percussion_model.scene.bar_groups import Bar, BitBar, Damper, DrillString, PistonBar
from percussion_model.scene.chain import chain_as_groups, refuse_joints
from percussion_model.scene.contradictions import TEXTS, Bodies, Rule, find_contradiction
from percussion_model.scene.group import Parameters
from percussion_model.scene.parameters import (
    GROUPS,
    HOLE_DIAMETER,
    Contact,
    Drive,
    Effects,
    Feed,
    FemOptions,
    Gravity,
    Loss,
    RockLaw,
    RunOptions,
    SolverOptions,
    Start,
    find_row,
    parameter_table,
    row_of,
    unknown_key,
)
from percussion_model.scene.retired import BLOW_MAP_TABLE
from percussion_model.scene.rows import (
    REFUSED,
    Faults,
    ParameterRow,
    SceneError,
    show_value,
    unprintable,
)
from percussion_model.scene.solver_choice import REASONS, why_waves
from percussion_model.scene.solver_names import BODIES
from percussion_model.scene.text import commented_scene, plain_scene, read_toml, write_text
from percussion_model.scene.units import read_value, refuse
from percussion_model.scene.values import values_of

__all__ = ["Scene", "SceneError"]

# Figures, pages and FMUs carry it [characters].
LONGEST_TITLE = 1000
# Groups that nothing was given of; they cannot change, so all scenes share them.
_DEFAULTS = {name: group() for name, group in GROUPS.items()}

# Parameters of components that have no default.
_REQUIRED = [
    row_of(f"{one.name}.{name}")
    for one in COMPONENTS
    for name, (default, *_) in one.parameters.items()
    if default is None
]
# Keys of the pressure law.
LAW = ("drive.force", "drive.reversal_distance")


@dataclass(frozen=True, init=False)
class Scene:
    """Everything that a run needs to know; immutable.

    Without arguments it is the reference scene of the paper. Bad values raise
    `SceneError`, as do effects that contradict each other.

    Parameters
    ----------
    **values
        A title, the diameter of the hole, and groups as tables of values or as objects.
    """

    # Given keys that a change of solver has left without effect: nobody has to be warned of them.
    _set_aside = frozenset[str]()

    title: str
    hole_diameter: float | None
    effects: Effects
    piston: PistonBar
    string: DrillString
    bit: BitBar
    damper: Damper
    gravity: Gravity
    feed: Feed
    drive: Drive
    loss: Loss
    rock: RockLaw
    contact: Contact
    start: Start
    solver: SolverOptions
    fem: FemOptions
    run: RunOptions
    # fields of the dataclass: those above, and groups that effects have added
    __annotations__ = (
        {"title": "str", "hole_diameter": "float | None"}
        | dict.fromkeys(GROUPS, Parameters)
        | __annotations__
    )

    def __init__(self, **values: Any) -> None:
        faults = Faults()
        kept = self.__dict__
        if "bars" in values:
            values = chain_as_groups(values)
        kept["title"] = title = values.get("title", "")
        if not isinstance(title, str) or len(title) > LONGEST_TITLE or unprintable(title):
            faults.add(_refuse_title, title)
        kept["hole_diameter"] = hole = read_value(HOLE_DIAMETER, values.get("hole_diameter"))
        if hole is REFUSED:
            faults.add(refuse, HOLE_DIAMETER, "hole_diameter", values["hole_diameter"])
        for name, group in GROUPS.items():
            if name in values:
                kept[name] = group.read(values[name], name, faults)
            else:
                kept[name] = _DEFAULTS[name]
        for name, value in values.items():
            if name not in kept and (name, value) != (BLOW_MAP_TABLE, {}):
                faults.add(unknown_key, name)
        faults.refuse()
        refuse_contradictions(self)

    def __repr__(self) -> str:
        own = (key for key in sorted(self.given) if self[key] != self.row_of(key).default)
        return f"Scene({', '.join([repr(self.title), *(f'{key}={self[key]!r}' for key in own)])})"

    def _repr_html_(self) -> str:
        from percussion_model.scene.html_table import scene_html  # no run needs it

        return scene_html(self)

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Read a scene file, or a scene that ships.

        Parameters
        ----------
        path : str or Path
            A TOML file, or the name of a preset, as "reference"; a file of that name comes first.

        Raises
        ------
        SceneError
            If there is no such file or preset, or it is no sensible scene.
        """
        from percussion_model.scene.presets import scene_file  # no run needs it

        path = scene_file(Path(path))
        tree = read_toml(path)
        try:
            return cls(**tree)
        except SceneError as error:
            raise SceneError(f"{path}: {error}") from None

    def to_toml(self, path: str | Path | None = None, *, comments: bool = False) -> str:
        """Write the scene so that reading it back gives an equal one.

        Every parameter that has an influence is written, whether given or not,
        and every one that was given; so a later change of defaults does not
        change a stored scene.

        Parameters
        ----------
        path : str or Path, optional
            Where to write; nothing is written if left out.
        comments : bool
            Whether to say of each parameter what it means and what is allowed.

        Returns
        -------
        str
            The text of the file.
        """
        if comments:
            values = {row.key: self[row.key] for row in _plain_rows()}
            given = self.given
            silent = [key for key in values if not (self.matters(key) or key in given)]
            text = commented_scene(self._head(), values, silent)
        else:
            text = plain_scene(self._tree())
        if path is not None:
            write_text(Path(path), text)
        return text

    def replace(self, **changes: Any) -> Self:
        """Return a scene with some values changed.

        Parameters
        ----------
        **changes
            Values by dotted key, as in `replace(**{"rock.unloading_ratio": 10})`;
            sections are counted from 0, as in `piston.sections.0.length`. None
            goes back to the default. A whole group may be given as well.
        """
        tree = self._head()
        tree |= {name: self.__dict__[name] for name in GROUPS if self.__dict__[name]._given}
        for key, value in changes.items():
            if key not in ("title", *GROUPS) and find_row(key) is None:
                raise SceneError(unknown_key(key))
            self._change(tree, key, value)
        scene = type(self)(**tree)
        if self._set_aside:
            scene.__dict__["_set_aside"] = self._set_aside.difference(changes)
        return scene

    def _change(self, tree: dict[str, Any], key: str, value: Any) -> None:
        """Change a known key in the groups that a scene will be made of."""
        if getattr(value, "shape", None) == ():
            value = value.item()  # a number of numpy
        name, *rest = key.split(".")
        entries = tree
        if rest:
            present = tree.get(name, {})
            if not isinstance(present, (Parameters, Mapping)):
                raise SceneError(unknown_key(key))
            entries = present.given_values() if isinstance(present, Parameters) else dict(present)
            tree[name], (name, *rest) = entries, rest
        if rest:
            entries, name = self._entry_to_change(entries, key), rest[-1]
        if value is None:
            entries.pop(name, None)
        else:
            entries[name] = value

    def _entry_to_change(self, group: dict[str, Any], key: str) -> dict[str, Any]:
        """Make the bars and sections on the way to a key lists of their own; the last of them."""
        first, *parts = key.split(".")[:-1]
        path, entries = first, group
        try:
            for name, place in zip(parts[::2], parts[1::2], strict=True):
                here = self[f"{path}.{name}"]
                entries[name] = rows = list(entries.get(name, here))
                path = f"{path}.{name}.{place}"
                row = rows[int(place)]
                rows[int(place)] = entries = (
                    row.given_values() if isinstance(row, Parameters) else dict(row)
                )
        except IndexError:
            raise SceneError(
                f"{path}: no such {name.removesuffix('s')}; there are {len(rows)}, counted from 0"
            ) from None
        except (KeyError, TypeError, ValueError):  # what was given before is no list of tables
            raise SceneError(unknown_key(key)) from None
        return entries

    def computed_by(self, solver: str, **changes: Any) -> Self:
        """Return the scene for a solver, with other changes; that of rigid bodies makes them so.

        `SceneError` if the solver needs elastic bars and the scene has none.
        """
        changes |= {"solver.fidelity": None, "solver.name": solver}
        if BODIES.get(solver) == "rigid":
            changes["bit.model"] = "rigid"
            if changes.get("piston.model", self.piston.model) == "elastic":
                changes["piston.model"] = "rigid"
        elif (
            BODIES.get(solver) == "elastic" and changes.get("bit.model", self.bit.model) == "rigid"
        ):
            raise SceneError(
                f'the scene has rigid bodies (bit.model = "rigid"), and {solver} computes elastic '
                'bars alone: set bit.model = "elastic", and piston.model too, or take the solver '
                "rigid"
            )
        scene = self.replace(**changes)
        acted = {key for key in self.given if self.matters(key)}
        scene.__dict__["_set_aside"] = (self._set_aside | acted).difference(changes)
        return scene

    def __getitem__(self, key: str) -> Any:
        """Return the value of a dotted key."""
        value: Any = self
        try:
            for part in key.split("."):
                value = value[int(part)] if part.isdecimal() else getattr(value, part)
        except (AttributeError, IndexError):
            raise KeyError(unknown_key(key)) from None
        return value

    @property
    def given(self) -> frozenset[str]:
        """Dotted keys that were given, not left to their defaults."""
        keys = (f"{group}.{name}" for group in GROUPS for name in self.__dict__[group]._given)
        return frozenset([*keys, *self._head()]) - {"title"}

    def _head(self) -> dict[str, Any]:
        """What stands before the groups: the title, and the diameter of the hole if it is known."""
        hole = {} if self.hole_diameter is None else {"hole_diameter": self.hole_diameter}
        return {"title": self.title, **hole}

    def given_values(self) -> dict[str, Any]:
        """Return what was given as nested plain values: `Scene(**values)` is an equal scene."""
        tree = self._head()
        for group in GROUPS:
            for name, value in self.__dict__[group].given_values().items():
                tree.setdefault(group, {})[name] = _as_tables(value)
        return tree

    @property
    def unused(self) -> tuple[str, ...]:
        """Dotted keys that were given though the effect that needs them is off."""
        given = self.given
        return tuple(
            row.key for row in _plain_rows() if row.key in given and not self.matters(row.key)
        )

    @property
    def given_in_vain(self) -> tuple[str, ...]:
        """Those of `unused` that had no effect either before `computed_by` changed the solver.

        A whole pressure law beside a drive of another kind is there to be set back to.
        """
        found = tuple(key for key in self.unused if key not in self._set_aside)
        is_law = set(LAW) <= set(found) and self.effects.drive not in ("none", "external")
        return tuple(key for key in found if not (is_law and key in LAW))

    def row_of(self, key: str) -> ParameterRow:
        """Row of a dotted key in the parameter table."""
        return row_of(key)

    def matters(self, key: str) -> bool:
        """Tell whether a parameter has any influence on this scene."""
        return all(self[need] in values for need, values in self.row_of(key).needs.items())

    @property
    def solver_name(self) -> str:
        """Solver that computes the scene: "wave", "modal", "fem" or "rigid"."""
        if self.bit.model == "elastic" and self.solver.fidelity != "wave":
            return str(self.solver.fidelity)
        if self.effects.string and self.solver.name == "auto":
            return "wave"
        if self.solver.name != "auto":
            return str(self.solver.name)
        if self.bit.model == "rigid":
            return "rigid"
        return "wave" if self._against_modes else "modal"

    @cached_property
    def bars(self) -> dict[str, Bar]:
        """Bars from the drive to the rock by name: "piston", "rod 1", ..., "bit"."""
        piston = {} if self.piston.model == "absent" else {"piston": self.piston}
        rods = self.string.rods if self.effects.string else ()
        return {**piston, **{f"rod {k}": rod for k, rod in enumerate(rods, 1)}, "bit": self.bit}

    @property
    def why_solver(self) -> str:
        """Why `solver.name = "auto"` took the solver; empty where something else names it."""
        if self.solver.name != "auto" or self.solver.fidelity != "wave":
            return ""
        if self.effects.string:
            return "bars between piston and bit"
        if self.solver_name == "rigid":
            return "the bit is rigid" if self.bit.model == "rigid" else ""
        return self._against_modes or "elastic bars with loss"

    @cached_property
    def _against_modes(self) -> str:
        """Why waves drill better than as many modes; empty where they do not."""
        bit = self.bit.transit_time
        found = why_waves(
            self.effects.rock == "wall",
            self.effects.loss,
            self.loss.time,
            self.piston.transit_time if self.piston.model == "elastic" else bit,
            bit,
        )
        return REASONS[found]

    @property
    def has_waves(self) -> bool:
        """Whether the bit is computed as an elastic bar."""
        return self.bit.model == "elastic" and BODIES.get(self.solver_name) != "rigid"

    @property
    def loss_on(self) -> bool:
        """Whether bars lose energy to structural loss."""
        return self.effects.loss and self.has_waves and self.loss.time > 0

    @property
    def motor_stalls(self) -> bool:
        """Whether the bit is turned by a motor that slows by its torque, and may jam."""
        return self["effects.rotation"] and self["rotation.stall_torque"] > 0.0

    @property
    def is_undamped(self) -> bool:
        """Whether waves run without loss: then the rate of penetration depends on the cells."""
        return self.has_waves and not self.loss_on

    @property
    def barrier_on(self) -> bool:
        """Whether the rock law has an energy barrier (mode DFC)."""
        wanted = self.effects.barrier and self.effects.rock in ("bilinear", "power")
        return bool(wanted and self.rock.barrier_energy > 0 and self.rock.barrier_damping > 0)

    @property
    def loading_stiffness(self) -> float:
        """Loading stiffness of the rock under all buttons [N/m]."""
        buttons = self.rock.buttons if self.effects.rock == "power" else 1
        return buttons * self.rock.loading_stiffness

    @property
    def cuttings_on(self) -> bool:
        """Whether cuttings that flushing leaves stay in the crater."""
        return self.effects.cuttings and self.effects.rock in ("bilinear", "power")

    @property
    def effects_on(self) -> tuple[str, ...]:
        """Names of the effects that are computed."""
        return tuple(name for name, is_on in self._switches().items() if is_on)

    @property
    def effects_off(self) -> tuple[str, ...]:
        """Names of the effects that are not computed."""
        return tuple(name for name, is_on in self._switches().items() if not is_on)

    def _switches(self) -> dict[str, bool]:
        return {
            "gravity": self.effects.gravity,
            "feed": self.effects.feed,
            "drive": self.effects.drive != "none",
            "loss": self.loss_on,
            **self._string_switches(),
            "barrier": self.barrier_on,
            "cuttings": self.cuttings_on,
            "rock": self.effects.rock != "none",
            **{one.name: self[f"effects.{one.name}"] for one in COMPONENTS if not one.is_drive},
        }

    def _string_switches(self) -> dict[str, bool]:
        """Effects of a drill string; none without one."""
        if not self.effects.string:
            return {}
        joints = any(rod.joint != "perfect" for rod in self.string.rods)
        damper = self.effects.damper
        return {"string": True, "joints": self.effects.joints and joints, "damper": damper}

    def _tree(self) -> dict[str, Any]:
        """Return what a scene file holds, as nested plain values."""
        tree = {name: value for name, value in self._head().items() if value != ""}
        given = self.given
        for row in _plain_rows():
            value = self[row.key]
            if value is None or not (self.matters(row.key) or row.key in given):
                continue
            group, _, name = row.key.rpartition(".")
            if not group:  # the diameter of the hole, which stands in the head
                continue
            tree.setdefault(group, {})[name] = _as_tables(value)
        return tree


def _as_tables(value: Any) -> Any:
    """Values of a scene as a file has them: lists of tables for bars and sections."""
    if not isinstance(value, tuple):
        return value
    return [{name: _as_tables(getattr(row, name)) for name in row.telling} for row in value]


def _plain_rows() -> tuple[ParameterRow, ...]:
    """Rows of the keys that stand in a group itself, sections as one."""
    return tuple(row for row in parameter_table() if "*" not in row.key)


def _refuse_title(title: Any) -> str:
    if isinstance(title, str) and len(title) <= LONGEST_TITLE:
        return f"title: has the control character {unprintable(title)!r}: must be printable text"
    return f"title = {show_value(title)}: must be text of up to {LONGEST_TITLE} characters"


def refuse_other(given: object) -> None:
    """Raise `SceneError` for what is no scene, as the name of a file."""
    if not isinstance(given, Scene):
        raise SceneError(f"{show_value(given)}: must be a Scene; Scene.from_toml(file) reads one")


def refuse_contradictions(scene: Scene) -> None:
    """Raise `SceneError` if parts of a scene contradict each other."""
    of_solver = BODIES.get(scene.solver.name)
    bodies = {"elastic": Bodies.ELASTIC, "rigid": Bodies.RIGID}.get(of_solver or "", Bodies.BOTH)
    found = find_contradiction(
        values_of(scene),
        bodies,
        has_rods=bool(scene.string.rods),
        is_barrier_given="barrier" in scene.effects._given,
    )
    if found != Rule.NOTHING:
        # places in the text name values by their keys
        groups = {name: scene.__dict__[name] for name in GROUPS}
        raise SceneError(TEXTS[found].format(**groups))
    for row in _REQUIRED:
        if scene[row.key] is None and scene.matters(row.key):
            raise SceneError(f"{row.effect} needs {row.key}, {row.description}: give it")
    refuse_joints(scene)
