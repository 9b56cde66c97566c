"""What the reader of a result must know before trusting it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from percussion_model.result import Result

# The ledger closes to rounding; more than this is an error of the solver.
MOST_RESIDUAL = 1e-6
# Between the nodes of a blow map energy is kept as well as the map is interpolated.
MOST_MAP_RESIDUAL = 1e-2
# A larger error of the wave speed shows in the answers.
MOST_WAVE_SPEED_ERROR = 1e-3


def find_warnings(result: Result) -> Iterator[str]:
    """Go through the warnings that a result deserves."""
    yield from _about_scene(result)
    yield from _about_grid(result)
    yield from _about_blows(result)
    yield from _about_trust(result)


def _about_scene(result: Result) -> Iterator[str]:
    scene = result.scene
    if scene.unused:
        yield f"given, but without effect in this scene: {', '.join(scene.unused)}"
    if scene.solver_name != "rigid" and not scene.loss_on:
        if scene.barrier_on:
            yield (
                "structural loss is off: vibration trapped in the bit keeps its kinetic energy "
                "above the energy barrier, the rate of penetration grows with refinement and "
                "must not be trusted"
            )
        else:
            yield (
                "structural loss is off: vibration trapped in the bars never decays, so the "
                "rate of penetration depends on the cells and must not be trusted"
            )


def _about_grid(result: Result) -> Iterator[str]:
    error = result.wave_speed_error
    if error > MOST_WAVE_SPEED_ERROR:
        yield (
            f"the lengths fit no common cell: wave speeds are off by up to {100 * error:.2g} %; "
            "more solver.cells bring them closer"
        )
    if result.scene.loss_on:
        for bar, count in result.cells.items():
            if count == 1:
                yield (
                    f"the {bar} is a single cell: structural loss acts between cells, so it has "
                    "none; set more solver.cells"
                )


def _about_blows(result: Result) -> Iterator[str]:
    count = len(result.counted)
    if result.scene.piston.model == "absent":
        yield "there is no piston, so there are no blows: the rate of penetration is undefined"
    elif len(result.blows) == 0:
        yield "no whole blow in this run: the rate of penetration is undefined"
    elif count < 3:
        yield (
            f"only {count} whole blow{'s' if count != 1 else ''} after settling, fewer than 3: "
            "the rate of penetration is undefined; run longer"
        )


def _about_trust(result: Result) -> Iterator[str]:
    residual = result.energy["residual_relative"]
    mapped = result.solver == "blow-map"
    limit = MOST_MAP_RESIDUAL if mapped else MOST_RESIDUAL
    if not abs(residual) <= limit and any(result.energy[name] for name in _FLOWS):
        yield (
            f"the energy ledger does not close: {residual:.2g} of the energy put in is "
            + ("unexplained; raise blow_map.density" if mapped else _ERROR)
        )
    locked = result.statistics.get("locked", 0)
    if locked:
        yield (
            f"in {locked} time step{'s' if locked != 1 else ''} the rock law crossed more modes "
            "than it can: check the result with more solver.cells"
        )


_ERROR = "unexplained; this is an error of the solver"
_FLOWS = ("initial", "drive", "feed", "gravity")
