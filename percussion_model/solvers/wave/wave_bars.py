"""The bars of the travelling-wave solver, and what a state tells without its kernels."""

from __future__ import annotations

import numpy as np

from percussion_model.scene.parameters import Bar
from percussion_model.scene.scene import Scene
from percussion_model.solvers.wave.advance import GRID_ROUNDING
from percussion_model.solvers.wave.bar_cells import cut_bars
from percussion_model.solvers.wave.grid import Grid, section_count
from percussion_model.solvers.wave.records import Coef
from percussion_model.solvers.wave.state import WORD, WaveState


class WaveBars:
    """Piston and bit of a scene, cut into cells of equal transit time.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    time_step : float
        Transit time of a cell [s].
    cells : dict of int
        Cells in each elastic bar.
    wave_speed_error : float
        Largest relative error of a section's wave speed, from lengths that
        fit no common cell.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        bars = self._bars = cut_bars(scene)
        self.time_step = bars.time_step
        self._bit, self._cb = bars.bit.grid, bars.bit.coefficients
        self._piston: Grid | None = None
        self._cp = np.zeros((len(Coef), 1))
        if bars.piston is not None:
            self._piston, self._cp = bars.piston.grid, bars.piston.coefficients
        self.cells = {"bit": self._bit.n}
        if self._piston is not None:
            self.cells = {"piston": self._piston.n, **self.cells}
        self.wave_speed_error = max(bar.grid.fit for bar in bars.both)

    @property
    def static_wave(self) -> np.ndarray:
        """Down-going wave of a bit at rest under unit body acceleration, by cell [s]."""
        return self._cb[Coef.STATIC, : self._bit.n]

    def time(self, state: WaveState) -> float:
        """Time up to which the state is committed [s]."""
        return self._time_of(state, int(state.words[WORD["step"]]))

    def readable_until(self, state: WaveState) -> float:
        """Time up to which `sample` answers without advancing the state [s]."""
        words = state.words
        return self._time_of(state, max(int(words[WORD["leap_end"]]), int(words[WORD["step"]]) + 1))

    def grid_point_after(self, state: WaveState, t: float) -> float:
        """First grid point at or after `t` [s]."""
        base = float(state.numbers[WORD["t_base"]])
        return self._time_of(state, int(np.ceil((t - base) / self.time_step - GRID_ROUNDING)))

    def _time_of(self, state: WaveState, step: int) -> float:
        return float(state.numbers[WORD["t_base"]]) + step * self.time_step

    def fields(self, state: WaveState) -> dict[str, np.ndarray]:
        """Force [N] and velocity [m/s] of each cell, top to bottom, by bar."""
        wp, wb = state.bars
        r = 2 * int(state.record[0]["parity"])
        out = {}
        for name, w, grid in (("piston", wp, self._piston), ("bit", wb, self._bit)):
            if grid is not None:
                d, u = w[r, : grid.n], w[r + 1, : grid.n]
                out[f"{name}_force"] = grid.impedance * (d - u)
                out[f"{name}_velocity"] = d + u
        return out

    def force_in(self, state: WaveState, bar: str, cell: int) -> float:
        """Force in one cell of "piston" or "bit" [N], as `fields` reads it."""
        grid = self.grid_of(bar)
        if grid is None:
            return 0.0
        w = state.bars[bar == "bit"]
        r = 2 * int(state.words[WORD["parity"]])
        return float(grid.impedance[cell] * (w[r, cell] - w[r + 1, cell]))

    def grid_of(self, bar: str) -> Grid | None:
        """Cells of "piston" or "bit", None where it has none."""
        return {"piston": self._piston, "bit": self._bit}[bar]

    def section_cells(self, bar: Bar) -> list[int]:
        """Cells in each section of an elastic bar."""
        return [section_count(section, self.time_step) for section in bar.sections]

    def statistics(self, state: WaveState) -> dict[str, int]:
        """Counts of what the solver did."""
        s = state.record[0]
        names = ("steps", "leaps", "leap_steps", "wakes", "events", "blows")
        return {name: int(s[f"count_{name}"]) for name in names} | {"locked": int(s["locked"])}
