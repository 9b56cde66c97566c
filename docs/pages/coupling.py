"""Measured tables of the drilling system.

Errors against the communication step, verdicts by step and steps that are taken back, all of the
feed-controlled system with the rigid hammer, `dist/FeedControlRigid.ssp`; takes some minutes.
"""

from __future__ import annotations

from pathlib import Path

from docs.blocks import Made
from percussion_model.coupling import Coupling
from percussion_model.coupling.coupled_run import CoupledRun, known_signals, summary
from percussion_model.interface.progress import progress
from percussion_model.simulation.markdown import table
from percussion_model.simulation.uncertain import in_digits, with_error
from scenarios import coupling_step, step_rejection
from scenarios.results import system, tell

# Steps of which the verdict is shown, the time of each run, and the least between rows [s].
JUDGED = (1e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 2.5e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5)
DURATION = 1.0
INTERVAL = 2e-4
HEADINGS = (
    *("step [ms]", "shoulder", "string's residual", "shoulder divided by blows"),
    *("largest change", "rate [mm/s]", "verdict"),
)


def verdicts(archive: Path) -> str:
    """Table of verdicts by step, Markdown."""
    rows = []
    with progress("verdicts with every step"):
        for step in JUDGED:
            coupling = Coupling(archive)
            signals, interval = known_signals(coupling.outputs), max(step, INTERVAL)
            rows.append(_verdict(coupling.run(DURATION, step, signals, interval, tell=tell)))
    return table(HEADINGS, rows)


def _verdict(run: CoupledRun) -> list[str]:
    found, verdict = summary(run), run.verdict
    stiffness = run["string.shoulder_stiffness"]
    rate, error = (found.get(f"rate_second_half{end}") for end in ("", "_error"))
    proposed = "" if verdict.step is None else f": {1e3 * verdict.step:g} ms"
    return [
        f"{1e3 * run.step:g}",
        _percent(float(stiffness.min() / stiffness[0])),
        _percent(found["string_energy_residual"]),
        f"{100 * found['shoulder_by_blows']:+.1f} %",
        _percent(verdict.numbers["largest_jump"]),
        with_error(1e3 * rate, 1e3 * error) if rate is not None and error is not None else "",
        verdict.word + proposed,
    ]


def _percent(share: float) -> str:
    return f"{in_digits(share, 2)} times" if share >= 1.05 else f"{in_digits(100.0 * share, 2)} %"


def made() -> Made:
    """Measure everything."""
    archive = system("FeedControlRigid").found(None)
    exact, ones, eights = coupling_step.measure(archive)
    blocks = {
        "one": coupling_step.table_of_one(ones, exact),
        "eight": coupling_step.table_of_eight(eights),
        "verdicts": verdicts(archive),
    }
    with progress("one blow in every way"):
        blocks["rejection"] = step_rejection.table(*step_rejection.measure(archive))
    return Made(("data/coupling_step.md", "data/step_rejection.md"), blocks)
