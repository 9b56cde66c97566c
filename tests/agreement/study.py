"""Waves against finite elements over a range of parameters, both refined.

python tests/agreement/study.py            # writes the rows of docs/data/agreement.md to stdout
python tests/agreement/study.py K_R gamma  # some of them
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from percussion_model import Scene, simulate

REFERENCE = Scene()
# Finite elements: elements in the piston, CFL multiple, contact stiffness [N/m].
LEVELS = ((50, 1.0, 1e13), (100, 1.0, 2e13), (200, 1.0, 4e13))
# With 80 cells the stiffest rock passes by a threshold: some blows lack a drilling cycle.
CELLS = (40, 120)
# How well the solvers must agree.
RATE_WITHIN, PERIOD_WITHIN = 5e-3, 2e-3
# A level whose rate is within this of the one before it is fine enough.
OWN_CHANGE = 2e-3


@dataclass(frozen=True)
class Answer:
    """What a run says of its stationary motion."""

    rate: float  # [m/s]
    error: float  # standard error of the rate [m/s]
    period: float  # [s]
    contacts: float  # a blow
    cycles: float


@dataclass(frozen=True)
class Case:
    """One parameter changed."""

    group: str
    name: str
    changes: dict[str, Any]


def power_kept(reversal: float) -> dict[str, float]:
    """D_1 and the F_0 that keeps the power scale of the paper's eq. 14."""
    drive = REFERENCE.drive
    force = drive.force * (drive.reversal_distance / reversal) ** (1.0 / 3.0)
    return {"drive.reversal_distance": reversal, "drive.force": force}


def cases() -> Iterator[Case]:
    """All cases with a promise of agreement."""
    for value in (1e8, 2e8, 4e8, 7.5e8, 1e9, 1.5e9, 2e9):
        yield Case("K_R", f"{value:g} N/m", {"rock.loading_stiffness": value})
    for value in (2.0, 3.0, 5.0, 7.0, 10.0):
        yield Case("gamma", f"{value:g}", {"rock.unloading_ratio": value})
    for value in (500.0, 1000.0, 2500.0, 5000.0, 10000.0, 20000.0):
        yield Case("F_S", f"{value:g} N", {"feed.force": value})
    for value in (4e-3, 8e-3, 0.02, 0.04, 0.08):
        yield Case("D_1", f"{1e3 * value:g} mm", power_kept(value))


def beyond() -> Iterator[Case]:
    """Cases without a promise, to be looked at under refinement."""
    for value in (30.0, 60.0, 100.0):
        yield Case("gamma, chatter", f"{value:g}", {"rock.unloading_ratio": value})
    for value in (3e4, 1e5):
        yield Case("C_R", f"{value:g} N s/m", {"rock.barrier_damping": value})
    yield Case("D_1, aperiodic", "2 mm", power_kept(2e-3))
    yield Case("F_S, aperiodic", "200 N", {"feed.force": 200.0})


def answer(scene: Scene, duration: float, settle: float) -> Answer:
    """Run a scene and take its means over whole blows."""
    result = simulate(scene, duration, settle=settle, record_events=False)
    summary = result.summary()
    return Answer(
        summary["rate_of_penetration"],
        summary["rate_of_penetration_standard_error"],
        summary["blow_period"],
        summary["contacts_per_blow"],
        summary["drilling_cycles_per_blow"],
    )


def waves(case: Case, cells: int, duration: float = 4.0, settle: float = 1.0) -> Answer:
    """Answer of the travelling waves."""
    scene = REFERENCE.computed_by("wave", **case.changes, **{"solver.cells": cells})
    return answer(scene, duration, settle)


def elements(
    case: Case, level: tuple[int, float, float], duration: float = 4.0, settle: float = 1.0
) -> Answer:
    """Answer of the finite elements."""
    count, courant, stiffness = level
    options = {
        "solver.name": "fem",
        "fem.elements": count,
        "fem.courant": courant,
        "fem.contact_stiffness": stiffness,
    }
    return answer(REFERENCE.replace(**case.changes, **options), duration, settle)


def row(*cells: Any) -> None:
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def shown(found: Answer) -> str:
    error = f" ± {1e3 * found.error:.3f}" if found.error > 1e-3 * found.rate else ""
    return f"{1e3 * found.rate:.3f}{error} | {1e3 * found.period:.4f} | {found.cycles:.2f}"


def study(case: Case, most_levels: int = len(LEVELS)) -> None:
    """Print a row for each resolution of a case, until the finite elements settle."""
    fine = waves(case, CELLS[0])
    row(case.name, f"waves, {CELLS[0]} cells", shown(fine), "", "")
    finer = waves(case, CELLS[1])
    row("", f"waves, {CELLS[1]} cells", shown(finer), "", "")
    before = None
    for level in LEVELS[:most_levels]:
        found = elements(case, level)
        off = f"{100 * (found.rate / finer.rate - 1):+.2f} %"
        late = f"{100 * (found.period / finer.period - 1):+.3f} %"
        row("", f"elements, {level[0]}, K_C {level[2]:g}", shown(found), off, late)
        if before is not None and abs(found.rate / before.rate - 1) < OWN_CHANGE:
            break
        before = found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("groups", nargs="*", help="as K_R, gamma, F_S, D_1")
    parser.add_argument("--beyond", action="store_true", help="cases without a promise")
    parser.add_argument("--levels", type=int, default=len(LEVELS))
    chosen = parser.parse_args()
    group = ""
    for case in beyond() if chosen.beyond else cases():
        if chosen.groups and case.group.split(",")[0] not in chosen.groups:
            continue
        if case.group != group:
            group = case.group
            print(f"\n{group}\n")
            row("value", "solver", "rate, mm/s", "period, ms", "cycles", "rate off", "period off")
            row(*["---"] * 7)
        study(case, chosen.levels)


if __name__ == "__main__":
    main()
