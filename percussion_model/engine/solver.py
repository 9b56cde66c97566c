"""A solver by its compiled entries."""

from __future__ import annotations

import ctypes
import math
import threading
import weakref
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from percussion_model.engine.fault_texts import fault_text
from percussion_model.engine.faults import Fault
from percussion_model.engine.library import entries_of
from percussion_model.engine.records import (
    ADVANCE,
    COMMIT,
    ENTRIES,
    ENTRIES_AT,
    ENTRY_WORDS,
    HEAD,
    RECORD,
    GaugeBar,
)
from percussion_model.engine.scene_image import image_of
from percussion_model.physics.records import READING, Status
from percussion_model.scene.bar_groups import Bar
from percussion_model.scene.inputs import INPUTS
from percussion_model.scene.numbers import numbers_of
from percussion_model.scene.scene import Scene, SceneError
from percussion_model.solvers.base import MOST_AHEAD, Solver
from percussion_model.solvers.state import State, words_of

# So many motions are kept as those whose tables others use.
MOST_KEPT = 4
# Numbers that tables follow from besides the bars, at most; and facts of a fault.
KEY_NUMBERS, FACTS = 8, 4


class Grid(NamedTuple):
    """Cells of one bar, in which its fields are read.

    Attributes
    ----------
    mass : ndarray
        Of each, top to bottom [kg].
    in_sections : list of int
        Cells of each section.
    """

    mass: np.ndarray
    in_sections: list[int]

    @property
    def n(self) -> int:
        """How many there are."""
        return len(self.mass)


class Motion:
    """Memory that `create` of the entries has made; given back with this object.

    Parameters
    ----------
    entries : namespace
        Of a solver.
    image : int64 array
        Of a scene.
    like : Motion, optional
        Whose tables it uses.
    """

    def __init__(self, entries: Any, image: np.ndarray, like: Motion | None = None) -> None:
        given = 0 if like is None else like.base
        self.base: int = entries.create(image.ctypes.data, int(GaugeBar.NONE), 0.0, given)
        if self.base == 0:
            raise MemoryError("no memory is left for the tables of a scene")
        self._like = like  # lives as long as this
        weakref.finalize(self, entries.free, self.base)
        self.head = self._at(0, HEAD, 1)[0]

    def _at(self, offset: int, dtype: Any, count: int) -> np.ndarray:
        size = count * np.dtype(dtype).itemsize
        memory = (ctypes.c_char * size).from_address(self.base + int(offset))
        return np.ndarray(count, dtype, memory)

    def parameters(self, dtype: np.dtype) -> np.ndarray:
        """Parameters of the solver, as an array of one record."""
        return self._at(self.head["par_at"], dtype, 1)

    @property
    def table_bytes(self) -> int:
        """Bytes of its tables, or of those that it uses."""
        if self._like is not None:
            return self._like.table_bytes
        return int(self.head["bytes"] - self.head["shared_at"])

    @property
    def directory(self) -> np.ndarray:
        """Offset and dimensions of each array."""
        rows = self._at(ENTRIES_AT, np.int64, ENTRIES * ENTRY_WORDS)
        return rows.reshape(ENTRIES, ENTRY_WORDS)

    def array(self, row: int, dimensions: int, dtype: Any = np.float64) -> np.ndarray:
        """An array of the directory that does not move."""
        offset, *shape = self.directory[row, : 1 + dimensions].tolist()
        return self._at(offset, dtype, math.prod(shape)).reshape(shape)

    def shapes(self) -> tuple[tuple[int, int], ...]:
        """Of the arrays that move, in their order."""
        first, count = int(self.head["moving_row"]), int(self.head["moving_rows"])
        rows = self.directory[first : first + count, 1:3].tolist()
        return tuple(map(tuple, rows))

    def moving(self) -> bytes:
        """What moves, at time zero."""
        size = int(self.head["state_bytes"])
        return self._at(self.head["state_at"], np.uint8, size).tobytes()


# Motions that were made last, by the solver and what tables follow from.
_kept: dict[tuple[Any, ...], Motion] = {}
_keeping = threading.Lock()


def _bar_number(name: str) -> int:
    """`GaugeBar` of a bar by its name."""
    if name.startswith("rod "):
        return int(GaugeBar.ROD) + int(name.removeprefix("rod ")) - 1
    return int({"piston": GaugeBar.PISTON, "bit": GaugeBar.BIT}[name])


class EngineSolver(Solver):
    """A solver by its entries; subclasses name it.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    time_step : float or None
        Longest step [s].
    PAR, STATE : dtype
        Of its parameters, and of its state's record.
    """

    PAR: ClassVar[np.dtype]
    STATE: ClassVar[np.dtype]

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._entries = entries_of(self.name)
        self._lock = threading.Lock()  # a motion has room for one call at a time
        self._blows: np.ndarray | None = None
        self._events: np.ndarray | None = None
        self._blows_at = self._events_at = 0
        self._facts, self._key_numbers = np.zeros(FACTS), np.zeros(KEY_NUMBERS)
        self._facts_at, self._key_at = self._facts.ctypes.data, self._key_numbers.ctypes.data
        numbers = numbers_of(scene)
        self._image = image_of(numbers)
        self._image_numbers, self._image_at = self._image.view(np.float64), self._image.ctypes.data
        bars = numbers.piston.tobytes(), numbers.bit.tobytes(), numbers.values.piston_model
        self._bars_key: tuple[Any, ...] = (self.name, *bars)
        self._set_up()
        words = words_of(self.STATE)
        self._blow_word, self._event_word = words["n_blows"], words["n_events"]
        self._names = self._elastic_bars()
        self._grids: dict[str, Grid] = {}
        self._shapes: dict[tuple[str, int], np.ndarray] = {}
        # what `sample` works in
        self._spare = State(self.STATE, self._array_shapes, RECORD)
        self._seen, self._done = np.zeros(1, READING), np.zeros(1, np.int64)
        self._seen_at, self._done_at = self._seen.ctypes.data, self._done.ctypes.data

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is made anew of the scene: a motion lies in memory of its own."""
        return type(self), (self.scene,)

    def refusal(self, scene: Scene) -> str:
        """Why this solver cannot be set up for another scene; empty where it can."""
        return self._refusal(image_of(numbers_of(scene)))

    def _refusal(self, image: np.ndarray) -> str:
        facts = np.zeros(FACTS)
        fault = self._entries.refuse(image.ctypes.data, facts.ctypes.data)
        return fault_text(fault, facts) if fault else ""

    def _set_up(self) -> None:
        """Make the motion of the image."""
        if refused := self._refusal(self._image):
            raise SceneError(refused)
        self._like = self._find_like()
        motion = self._motion = Motion(self._entries, self._image, self._like)
        self._base, self._array_shapes = motion.base, motion.shapes()
        head = motion.head
        self.time_step = float(head["time_step"]) or None
        self.wave_speed_error = float(head["wave_speed_error"])
        self.operator_bytes = motion.table_bytes

    @property
    def _par(self) -> np.ndarray:
        """Parameters of the motion, as an array of one record."""
        return self._motion.parameters(self.PAR)

    def vary(self, changes: list[tuple[int, float]]) -> bool:
        """Compute another scene, which differs in some numbers of the image; states go on no more.

        Parameters
        ----------
        changes : list of (int, float)
            Words of the image, as `words_in_image` tells them, and values in SI units.

        Returns
        -------
        bool
            False if the solver cannot be set up for it.
        """
        for word, value in changes:
            self._image_numbers[word] = value
        if self._entries.refuse(self._image_at, self._facts_at):
            return False
        if self._like is not None and self._find_like() is self._like:
            # what else is known of a motion follows from its tables
            self._motion = Motion(self._entries, self._image, self._like)
            self._base = self._motion.base
            return True
        self.__dict__.pop("cells", None)
        self._shapes.clear()
        self._set_up()
        return True

    def _find_like(self) -> Motion | None:
        """A motion whose tables are those of the image; None where motions share none."""
        self._key_numbers[:] = 0.0
        if self._entries.table_key(self._image_at, self._key_at) == 0:
            return None
        key = (*self._bars_key, self._key_numbers.tobytes())
        with _keeping:
            like = _kept.get(key)
        if like is None:
            like = Motion(self._entries, self._image)
            with _keeping:
                while len(_kept) >= MOST_KEPT:
                    del _kept[next(iter(_kept))]
                _kept[key] = like
        return like

    def _elastic_bars(self) -> list[str]:
        """Names of the bars that have cells."""
        piston = ["piston"] * (self.scene.piston.model == "elastic")
        return [*piston, "bit"]

    # counted when asked for: of many rods that takes as long as a blow
    @cached_property
    def cells(self) -> dict[str, int]:
        """As in `Solver`."""
        return {name: self._grid(name).n for name in self._names}

    def _grid(self, name: str) -> Grid:
        if name not in self._grids:
            bar = _bar_number(name)
            sections = np.zeros(len(self.scene.bars[name].sections), np.int64)
            image = self._image.ctypes.data
            mass = np.zeros(self._entries.cells(image, bar, sections.ctypes.data, 0))
            self._entries.cells(image, bar, 0, mass.ctypes.data)
            self._grids[name] = Grid(mass, sections.tolist())
        return self._grids[name]

    # states

    def new_state(self) -> State:
        """State at time zero."""
        return State(self.STATE, self._array_shapes, RECORD, self._motion.moving())

    def time(self, state: State) -> float:
        """Time up to which the state is committed [s]."""
        return float(self._entries.state_time(self._base, state.address))

    def grid_point_after(self, state: State, t: float) -> float:
        """First time at or after `t` at which inputs can change [s]."""
        return float(self._entries.grid_point_after(self._base, state.address, t))

    def readable_until(self, state: State) -> float:
        """Time up to which `read` answers without advancing the state far [s]."""
        return float(self._entries.readable_until(self._base, state.address))

    def time_of_blow(self, state: State) -> float:
        """As in `Solver`."""
        return float(self._entries.time_of_blow(self._base, state.address))

    def state_fault(self, state: State, t: float) -> str:
        """What is wrong with a state that comes from outside, of time `t` [s]; empty: nothing."""
        facts = self._facts
        fault = self._entries.find_fault(self._base, state.address, t, facts.ctypes.data)
        of_numbers = (Fault.MODAL_FIELD, Fault.WAVE_FIELD, Fault.FEM_FIELD, Fault.RIGID_FIELD)
        is_bounded = fault not in (*of_numbers, Fault.WORKSPACE)
        if is_bounded and not self.time(state) <= t + MOST_AHEAD:
            return f"its time of {self.time(state)!r} s, far after {t!r} s"
        return fault_text(fault, facts).removeprefix("the saved state has ") if fault else ""

    # motion

    def _take_rooms(self, blows: np.ndarray, events: np.ndarray) -> None:
        # callers have the same ones again, and to ask for an address takes a microsecond
        if self._blows is not blows:
            self._blows, self._blows_at = blows, blows.ctypes.data
        if self._events is not events:
            self._events, self._events_at = events, events.ctypes.data

    def _run(
        self, task: int, state: State, t: float, blows: np.ndarray, events: np.ndarray,
        record_events: bool,
    ) -> tuple[int, int, int]:  # fmt: skip
        with self._lock:
            self._take_rooms(blows, events)
            status = self._entries.run(
                self._base, state.address, task, t, self._blows_at, len(blows),
                self._events_at, len(events), record_events,
            )  # fmt: skip
        words = state.words
        return status, int(words[self._blow_word]), int(words[self._event_word])

    def advance(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Commit as far as `t` allows; as in `Solver`."""
        return self._run(ADVANCE, state, t, blows, events, record_events)

    def commit(
        self, state: State, t: float, blows: np.ndarray, events: np.ndarray, record_events: bool
    ) -> tuple[int, int, int]:
        """Bring an advanced state to the first grid point at or after `t`; as `advance`."""
        end = self.grid_point_after(state, t)
        return self._run(COMMIT, state, end, blows, events, record_events)

    def read(
        self, state: State, t: float, reading: np.ndarray, spare: State | None = None,
        peaks: bool = True,
    ) -> State:  # fmt: skip
        """Evaluate at `t`; a copy at the last grid point up to it. As in `Solver`."""
        copy = spare if spare is not None else State(self.STATE, state.shapes, RECORD)
        with self._lock:
            status = self._entries.read(
                self._base, state.address, copy.address, t, reading.ctypes.data, peaks
            )
        if status != Status.DONE:
            raise RuntimeError(f"the {self.name} solver stopped: {Status(status).name}")
        return copy

    def set_inputs(self, state: State, **inputs: float) -> None:
        """Change inputs of a committed state; those of the rock wait for the next cycle."""
        words = words_of(self.STATE)
        for name, value in inputs.items():
            state.numbers[words[INPUTS[name].field]] = value

    def settle(self, state: State, asked: np.ndarray, blows: np.ndarray) -> int:
        """Run until blows repeat; as in `Solver`."""
        with self._lock:
            status: int = self._entries.settle(
                self._base, state.address, asked.ctypes.data, blows.ctypes.data, len(blows)
            )
        return status

    # samples

    def sample(self, state: State, times: np.ndarray, out: np.ndarray) -> None:
        """Evaluate at `times` into rows of `SAMPLE_FIELDS`."""
        self._sample(state, times, out, self._no_blows, self._no_events, False, False)

    def sample_ahead(
        self, state: State, times: np.ndarray, out: np.ndarray, blows: np.ndarray,
        events: np.ndarray, record_events: bool,
    ) -> tuple[int, int, int, int]:  # fmt: skip
        """Advance through rising `times` and evaluate at each; as in `Solver`."""
        return self._sample(state, times, out, blows, events, record_events, True)

    def _sample(
        self, state: State, times: np.ndarray, out: np.ndarray, blows: np.ndarray,
        events: np.ndarray, record_events: bool, advances: bool,
    ) -> tuple[int, int, int, int]:  # fmt: skip
        times, rows = np.ascontiguousarray(times, np.float64), np.ascontiguousarray(out)
        with self._lock:
            self._take_rooms(blows, events)
            status = self._entries.sample(
                self._base, state.address, self._spare.address, advances, times.ctypes.data,
                len(times), self._seen_at, rows.ctypes.data, self._blows_at, len(blows),
                self._events_at, len(events), record_events, self._done_at,
            )  # fmt: skip
            count = int(self._done[0])
        if rows is not out:
            out[:] = rows
        words = state.words
        return status, int(words[self._blow_word]), int(words[self._event_word]), count

    # fields

    def fields(self, state: State) -> dict[str, np.ndarray]:
        """Elastic force [N] and velocity [m/s] of each cell, top to bottom, by bar."""
        out = {}
        for name in self._names:
            force, velocity = self._fields_of(name, state)
            out[f"{name}_force"], out[f"{name}_velocity"] = force, velocity
        return out

    def _fields_of(self, name: str, state: State) -> np.ndarray:
        bar, mass = _bar_number(name), self._grid(name).mass
        form = self._entries.shape_form(self._base, state.address, bar)
        shapes, out = self._shapes_of(name, form), np.zeros((2, len(mass)))
        self._entries.fields(
            self._base, state.address, bar, mass.ctypes.data, shapes.ctypes.data, shapes.shape[1],
            len(mass), out.ctypes.data, out[1:].ctypes.data,
        )  # fmt: skip
        return out

    def _shapes_of(self, name: str, form: int) -> np.ndarray:
        """What modes have in the cells of a bar; none where there are no modes."""
        key = (name, form)
        if key not in self._shapes:
            image, bar, count = self._image.ctypes.data, _bar_number(name), 0
            if form >= 0:
                count = self._entries.shapes(image, bar, form, 0)
            shapes = np.zeros((2, count, self._grid(name).n))
            if count:
                self._entries.shapes(image, bar, form, shapes.ctypes.data)
            self._shapes[key] = shapes
        return self._shapes[key]

    def force_in(self, state: State, bar: str, cell: int) -> float:
        """Force in one cell of a bar [N], as `fields` reads it."""
        return float(self._fields_of(bar, state)[0, cell]) if bar in self._names else 0.0

    def grid_of(self, bar: str) -> Grid | None:
        """Cells of a bar, None where it has none."""
        return self._grid(bar) if bar in self._names else None

    def section_cells(self, bar: Bar) -> list[int]:
        """Cells in each section of an elastic bar."""
        name = next(name for name, one in self.scene.bars.items() if one is bar)
        return list(self._grid(name).in_sections)
