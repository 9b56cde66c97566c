"""Write the measured tables of docs/system.md: `python -m docs.make_coupling`.

Errors against the communication step, verdicts by step and steps that are taken back, all of the
feed-controlled system with the rigid hammer, `dist/FeedControlRigid.ssp`; takes some minutes.
"""

from __future__ import annotations

from pathlib import Path

from percussion_model.coupling import Coupling
from percussion_model.coupling.coupled_run import CoupledRun, known_signals, summary
from percussion_model.interface.progress import progress
from percussion_model.scene.text import write_text
from percussion_model.simulation.markdown import table
from percussion_model.simulation.uncertain import in_digits, with_error
from scenarios import coupling_step, step_rejection
from scenarios.results import system, tell

FOLDER = Path(__file__).parent / "data"
# Steps of which the verdict is shown, the time of each run, and the least between rows [s].
JUDGED = (1e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 2.5e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5)
DURATION = 1.0
INTERVAL = 2e-4
HEADINGS = (
    *("step [ms]", "shoulder", "string's residual", "shoulder divided by blows"),
    *("largest change", "rate [mm/s]", "verdict"),
)
STEPS_HEAD = """# Error against the communication step

This page has the numbers behind [section 4 and 5 of the drilling
system](../system.md#4-the-shoulder-and-the-step): how far results of a coupled run are off at
steps from 0.01 to 500 ms. The system is FeedControl with the rigid hammer in its first rock.
`.venv/bin/python -m docs.make_coupling` writes this page.
"""
ONE = """## One blow

From the first impact to just before the second one. Nothing here depends on where the bit happens
to be, so every quantity has a limit. Errors are in per cent against a run at {reference:g} ms. ±
is the error of that run itself, estimated from the shortest of the other steps and first order.
"""
EIGHT = """## Eight blows

The rate over whole blows, and its change against that of the shortest step. Each row is what its
step gives.
"""
FINDINGS = """## What they show

- Slopes of feed, casing and penetration are 1.0 to 1.3 up to 1 ms. The impulse of the rig changes
  the sign of its error. Gauss–Seidel halves the error of the penetration up to 0.2 ms, but has
  more in the casing, which moves 0.1 mm within the delay of 1 ms.
- At steps well below 0.2 ms the damper of the shoulder brakes the bit, which takes some 3 J of the
  first blow's 380 J. Longer steps do not see this. The energy of the shoulder is right only at the
  shortest steps.
- The rate over eight blows behaves as the penetration of one.
"""
VERDICTS = """## Verdicts

The [verdict](../system.md#5-balances-and-the-verdict) on runs of {duration:g} s. *Largest change*
is that of a force in a step. The rate is that of the second half, where it has enough blows to
scatter; ± is that scatter alone.
"""
REJECTION_HEAD = """# Steps that are taken back

This page has the numbers behind [section 4 of the drilling
system](../system.md#steps-that-are-taken-back): whether it pays to repeat steps whose error is
too large. It compares fixed steps with tolerances over one blow, with the usual shoulder and with
one of 10 kN/mm and 2 kN s/m. Errors are in per cent at the end of the blow. *Time* is processor
time on the machine that wrote this page, with `.venv/bin/python -m docs.make_coupling`.

Each step with a tolerance costs three, and saving and restoring six parts about as much again. A
tolerance of 0.003 is better than a fixed step of 0.02 ms with the stiff shoulder alone, at several
times the cost. Loose tolerances are worse than any fixed step in feed and casing: above 0.2 ms the
stiff shoulder is softened, and whole step and halves are wrong alike.
"""


def steps_page(archive: Path) -> str:
    """Text of the page on the communication step."""
    exact, ones, eights = coupling_step.measure(archive)
    parts = [
        STEPS_HEAD,
        ONE.format(reference=1e3 * coupling_step.REFERENCE),
        coupling_step.table_of_one(ones, exact) + "\n",
        EIGHT,
        coupling_step.table_of_eight(eights) + "\n",
        FINDINGS,
        VERDICTS.format(duration=DURATION),
        verdicts(archive),
    ]
    return "\n".join(parts) + "\n"


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


def rejection_page(archive: Path) -> str:
    """Text of the page on steps that are taken back."""
    return f"{REJECTION_HEAD}\n{step_rejection.table(*step_rejection.measure(archive))}\n"


def main() -> None:
    """Measure everything and write the pages."""
    archive = system("FeedControlRigid").found(None)
    FOLDER.mkdir(exist_ok=True)
    write_text(FOLDER / "coupling_step.md", steps_page(archive))
    with progress("one blow in every way"):
        write_text(FOLDER / "step_rejection.md", rejection_page(archive))


if __name__ == "__main__":
    main()
