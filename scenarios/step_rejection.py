"""Whether taking steps back pays: `python -m scenarios.step_rejection`.

One blow of the feed-controlled system with the rigid hammer, with the usual shoulder and with
one a hundred times as stiff; fixed steps against steps that are shortened where the forces
between the parts ask for it. Compared by error and by processor time.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from percussion_model.coupling import CoupledRun, Coupling
from percussion_model.interface.progress import progress
from percussion_model.simulation import markdown
from percussion_model.simulation.files import staged_texts
from percussion_model.simulation.uncertain import change_text

from .coupled import whole
from .coupling_step import ONE_BLOW, error_of_limit
from .results import command_line, system, tell

NAME = "step_rejection"
SHOULDERS: Mapping[str, Mapping[str, Any]] = {
    "usual": {},
    # the damper too: by critical damping of the bit on the shoulder
    "stiff": {"string.shoulder.stiffness": 1e7, "string.shoulder.damping": 2e3},
}
REFERENCE = 5e-6  # [s]
FIXED = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5)  # [s]
LONGEST = 1e-3  # [s]
TOLERANCES = (0.1, 0.03, 0.01, 0.003)
QUANTITIES = {
    "string.bit_impulse": "impulse of the feed",
    "string.casing_position": "way of the casing",
    "hammer.bit.position": "penetration",
}


@dataclass(frozen=True)
class Try:
    """A way through the blow: what it took, and where it led."""

    shoulder: str
    tolerance: float | None
    run: CoupledRun
    cost: float

    @property
    def way(self) -> str:
        """The step, or the tolerance of steps that are chosen."""
        if self.tolerance is None:
            return f"{1e3 * self.run.step:g} ms"
        return f"tolerance {self.tolerance:g}"


def attempt(archive: Path, shoulder: str, step: float, tolerance: float | None = None) -> Try:
    """Run one blow; the cost is processor time after the start [s]."""
    coupling = Coupling(archive, SHOULDERS[shoulder])
    began: list[float] = []

    def note(at: float) -> None:
        began.append(time.process_time())

    # rows of the longest step, so that the first one tells when the start was over
    rows = max(step, LONGEST)
    run = whole(coupling.run(ONE_BLOW, step, list(QUANTITIES), rows, tolerance, note, tell=tell))
    share = len(began) / max(len(began) - 1, 1)
    return Try(shoulder, tolerance, run, share * (began[-1] - began[0]))


def table(exact: Mapping[str, CoupledRun], tries: Sequence[Try]) -> str:
    """Markdown: errors at the end of the blow, in per cent."""
    rows = []
    for one in tries:
        same = [other for other in tries if other.shoulder == one.shoulder]
        shown = (
            change_text(_change(one, exact, name), _error_of_limit(same, exact, name))
            for name in QUANTITIES
        )
        counts = one.run.steps, one.run.steps + one.run.tried, one.run.rejected
        rows.append([one.shoulder, one.way, *map(str, counts), f"{one.cost:.2f}", *shown])
    head = ("shoulder", "steps", "done", "computed", "taken back", "time [s]")
    return markdown.table([*head, *(f"{name} [%]" for name in QUANTITIES.values())], rows)


def _change(one: Try, exact: Mapping[str, CoupledRun], name: str) -> float:
    """Relative change of a quantity against its reference."""
    return float(one.run[name][-1] / exact[one.shoulder][name][-1] - 1.0)


def _error_of_limit(tries: Sequence[Try], exact: Mapping[str, CoupledRun], name: str) -> float:
    """What the reference is off, by the shortest step that was not chosen."""
    given = [one for one in tries if one.tolerance is None]
    shortest = min(given, key=lambda one: one.run.step)
    reference = exact[shortest.shoulder].step
    return error_of_limit(shortest.run.step, _change(shortest, exact, name), reference)


def measure(
    archive: Path,
    fixed: Sequence[float] = FIXED,
    tolerances: Sequence[float] = TOLERANCES,
    reference: float = REFERENCE,
) -> tuple[dict[str, CoupledRun], list[Try]]:
    """All ways with all shoulders, and the reference of each shoulder."""
    exact = {name: attempt(archive, name, reference).run for name in SHOULDERS}
    tries = []
    for name in SHOULDERS:
        tries += [attempt(archive, name, step) for step in fixed]
        tries += [attempt(archive, name, LONGEST, tolerance) for tolerance in tolerances]
    return exact, tries


def main(paths: Sequence[Path], folder: Path) -> list[Path]:
    """Run the blow in every way, print the table and keep it."""
    with progress("one blow in every way"):
        found = measure(*paths)
    text = table(*found)
    print(text)
    return staged_texts(folder, {f"{NAME}.md": text + "\n"})


if __name__ == "__main__":
    command_line(NAME, __doc__, [system("FeedControlRigid")], main)
