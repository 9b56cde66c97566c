"""A scene: what is there, which effects are on, and how long it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from percussion_model.scene.parameters import (
    GROUPS,
    BitBar,
    Contact,
    Drive,
    Effects,
    Feed,
    Gravity,
    Loss,
    PistonBar,
    RockLaw,
    Start,
)
from percussion_model.scene.rows import Row
from percussion_model.scene.rules import SceneError, SceneRules, refuse_contradictions
from percussion_model.scene.solver_options import (
    BlowMapOptions,
    FemOptions,
    RunOptions,
    SolverOptions,
)
from percussion_model.scene.table import find_row, parameter_table
from percussion_model.scene.text import (
    commented_scene,
    explain_validation,
    flat_keys,
    read_setting,
    read_toml,
    set_key,
    unknown_key,
    write_text,
)

__all__ = ["Scene", "SceneError", "read_setting"]


class Scene(SceneRules, BaseModel):
    """Everything that a run needs to know; immutable.

    Without arguments it is the reference scene of the paper. Bad values raise
    `SceneError`, as do effects that contradict each other.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str = Field("", strict=True)
    effects: Effects = Effects()
    piston: PistonBar = PistonBar()
    bit: BitBar = BitBar()
    gravity: Gravity = Gravity()
    feed: Feed = Feed()
    drive: Drive = Drive()
    loss: Loss = Loss()
    rock: RockLaw = RockLaw()
    contact: Contact = Contact()
    start: Start = Start()
    solver: SolverOptions = SolverOptions()
    fem: FemOptions = FemOptions()
    blow_map: BlowMapOptions = BlowMapOptions()
    run: RunOptions = RunOptions()

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise SceneError(explain_validation(error)) from None
        refuse_contradictions(self)

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Read a scene file.

        Parameters
        ----------
        path : str or Path
            A TOML file.

        Raises
        ------
        SceneError
            If the file cannot be read or is no sensible scene.
        """
        path = Path(path)
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
            text = commented_scene(self.title, values, silent)
        else:
            text = tomli_w.dumps(self._tree())
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
        tree = self.model_dump(exclude_unset=True)
        for key, value in changes.items():
            if key not in ("title", *GROUPS) and find_row(key) is None:
                raise SceneError(unknown_key(key))
            self._list_sections(tree, key)
            set_key(tree, key, value)
        return type(self)(**tree)

    def computed_by(self, solver: str, **changes: Any) -> Self:
        """Return the scene for a solver, with other changes; rigid makes piston and bit rigid."""
        changes["solver.fidelity"] = "blow-map" if solver == "blow-map" else None
        changes["solver.name"] = "auto" if solver == "blow-map" else solver
        if solver == "rigid":
            changes["bit.model"] = "rigid"
            if changes.get("piston.model", self.piston.model) == "elastic":
                changes["piston.model"] = "rigid"
        return self.replace(**changes)

    def __getitem__(self, key: str) -> Any:
        """Return the value of a dotted key."""
        try:
            return super().__getitem__(key)
        except KeyError:
            raise KeyError(unknown_key(key)) from None

    @property
    def given(self) -> frozenset[str]:
        """Dotted keys that were given, not left to their defaults."""
        return frozenset(flat_keys(self.model_dump(exclude_unset=True)))

    @property
    def unused(self) -> tuple[str, ...]:
        """Dotted keys that were given though the effect that needs them is off."""
        given = self.given
        return tuple(
            row.key for row in _plain_rows() if row.key in given and not self.matters(row.key)
        )

    def row_of(self, key: str) -> Row:
        """Row of a dotted key in the parameter table."""
        row = find_row(key)
        if row is None:
            raise SceneError(unknown_key(key))
        return row

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
            "barrier": self.barrier_on,
            "rock": self.effects.rock != "none",
        }

    def _tree(self) -> dict[str, Any]:
        """Return what a scene file holds, as nested plain values."""
        tree: dict[str, Any] = {"title": self.title} if self.title else {}
        given = self.given
        for row in _plain_rows():
            value = self[row.key]
            if value is None or not (self.matters(row.key) or row.key in given):
                continue
            if row.kind == "sections":
                value = [section.model_dump() for section in value]
            set_key(tree, row.key, value)
        return tree

    def _list_sections(self, tree: dict[str, Any], key: str) -> None:
        """Make the sections of a bar a list in `tree`, so that one can be changed."""
        bar, *rest = key.split(".")
        if len(rest) > 1 and rest[0] == "sections":
            sections = self[f"{bar}.sections"]
            present = tree.setdefault(bar, {}).get("sections")
            if not isinstance(present, list):
                tree[bar]["sections"] = [section.model_dump() for section in sections]


def _plain_rows() -> tuple[Row, ...]:
    """Rows of the keys that stand in a group itself, sections as one."""
    return tuple(row for row in parameter_table() if "*" not in row.key)
