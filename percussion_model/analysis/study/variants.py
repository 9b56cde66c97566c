"""Simulations of scenes that differ in a few plain numbers, set up in a tenth of the time."""

from __future__ import annotations

from percussion_model.components import COMPONENTS
from percussion_model.engine.scene_image import words_in_image
from percussion_model.engine.solver import EngineSolver
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.parameters import find_row
from percussion_model.scene.scene import Scene
from percussion_model.simulation.simulate import Simulation

# Numbers of these groups decide neither what contradicts what nor which solver computes a scene,
# nor when its blows have settled.
PLAIN_GROUPS = frozenset(
    ["drive", "feed", "gravity", "rock", "start", *(one.name for one in COMPONENTS if one.is_drive)]
)


class Variants:
    """Simulations of a scene with other numbers, one after the other.

    Parameters
    ----------
    scene : Scene
        One of them.
    keys : tuple of str
        What changes.
    """

    def __init__(self, scene: Scene, keys: tuple[str, ...]) -> None:
        rows = [find_row(key) for key in keys]
        self._rows = [row for row in rows if row and row.kind == "number"]
        are_plain = all(key.partition(".")[0] in PLAIN_GROUPS for key in keys)
        self._simulation = Simulation(scene, record_events=False)
        self._solver, numbers = self._simulation.solver, numbers_of(scene)
        self._words = [words_in_image(numbers, key.replace(".", "_")) for key in keys if are_plain]
        self.are_there = are_plain and len(self._rows) == len(keys)

    def simulation(self, values: list[float]) -> Simulation | None:
        """Simulation of the scene with these values.

        It is the one that was given before, begun again, and its `scene` is that of all.

        Returns
        -------
        Simulation or None
            None where the scene has to be made: it may be refused, or its solver is not one of
            this package.
        """
        if not (self.are_there and isinstance(self._solver, EngineSolver)):
            return None
        given = list(zip(self._rows, self._words, values, strict=True))
        if not all(row.allows(value) for row, _, value in given):
            return None
        if not self._solver.vary([(word, value) for _, words, value in given for word in words]):
            return None
        self._simulation.begin_again()
        return self._simulation
