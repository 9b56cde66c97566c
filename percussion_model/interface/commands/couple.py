"""Command `couple`: a system of FMUs from an SSP archive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from percussion_model.interface.commands import common
from percussion_model.interface.messages import wrapped
from percussion_model.scene.rows import shortened
from percussion_model.simulation.files import staged
from percussion_model.simulation.uncertain import (
    NOT_ESTIMATED,
    UNDECIDED,
    in_digits,
    with_error,
)

if TYPE_CHECKING:
    from percussion_model.coupling import Coupling
    from percussion_model.coupling.coupled_run import CoupledRun
    from percussion_model.coupling.verdict import Verdict

SystemFile = Annotated[Path, typer.Argument(metavar="SYSTEM.ssp", help="A system (SSP 1.0).")]
# Numbers of a summary as they are shown: key, name, factor, unit.
SHOWN = (
    ("time", "Simulated", 1.0, "s"),
    ("step", "Communication step", 1e3, "ms"),
    ("steps", "Steps", 1, ""),
    ("depth", "Depth of the bit", 1e3, "mm"),
    ("rate_second_half", "Rate in the second half", 1e3, "mm/s"),
    ("hammer_energy_residual", "Hammer: energy unexplained", 1.0, "of the energy put in"),
    ("string_energy_residual", "String: energy unexplained", 1.0, "of the energy put in or stored"),
    ("shoulder_energy", "Energy lost at the bit's shoulder", 1.0, "J"),
    ("feed_work", "Work of the feed on the bit", 1.0, "J"),
    ("shoulder_by_blows", "Share lost at the bit's shoulder", 100.0, "% of blow energy"),
)
# Those that are given, and have all their digits.
GIVEN = ("time", "step", "steps")
# What the error of the rate is of, where there is one.
SCATTER = "scatter alone"
# Of a loss that its error may make.
HIDDEN = "its error may be as large"
# Of a run whose archive has no default experiment, and no --duration [s].
DURATION = 6.0
# Rows of a run without --interval.
ROWS = 5000
# Of a number of steps; no run has so many.
MOST_DIGITS = 9


def _time(option: str, words: str) -> Any:
    return common.number_option(option, "TIME", "run.duration", words)


_DURATION = f"Simulated time, in s or with its unit; else that of the archive, or {DURATION:g}."
_START = "Time of the start; else that of the archive, or 0."
_INTERVAL = f"Time between rows; else {ROWS} rows."


def couple(
    system: SystemFile,
    duration: Annotated[float | None, _time("--duration", _DURATION)] = None,
    start: Annotated[float | None, _time("--start", _START)] = None,
    step: Annotated[float, _time("--step", "Communication step.")] = 1e-3,
    interval: Annotated[float | None, _time("--interval", _INTERVAL)] = None,
    order: Annotated[
        Literal["jacobi", "gauss-seidel"], typer.Option(help="Who sees what in a step.")
    ] = "jacobi",
    tolerance: Annotated[
        float | None,
        typer.Option("--tolerance", help="Take steps back whose error is larger, by the signals."),
    ] = None,
    every: Annotated[
        list[str] | None,
        typer.Option("--every", metavar="COMPONENT=STEPS", help="A slow part: steps as one."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="COMPONENT.VARIABLE=VALUE", help="Set any parameter."),
    ] = None,
    signals: Annotated[
        list[str] | None,
        typer.Option("--signal", metavar="COMPONENT.VARIABLE", help="Keep this output too."),
    ] = None,
    trust: common.Trust = False,
    out: common.OutOrDefault = None,
    json_file: common.JsonFile = None,
    force: common.Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the signals.")] = True,
) -> int:
    """Run a system of FMUs, an SSP archive: signals as CSV, balances, a figure, a verdict.

    Ends with 1 where the energies do not balance or the step is too long. Files go to
    out/SYSTEM.
    """
    from percussion_model.interface.progress import progress, progress_bar

    with common.needing("fmu"):
        from percussion_model.coupling import Coupling
        from percussion_model.coupling.coupled_run import known_signals, summary
    common.check_json(json_file)
    coupling = Coupling(
        system,
        dict(read_value(text) for text in settings or ()),
        order=order,
        every=dict(_read_pace(text) for text in every or ()),
        trust=trust,
    )
    try:
        duration = _set_time(coupling, start, duration)
        claimed = common.claim(
            "couple", out, Path("out") / system.stem, force, system=common.digest(system),
            start=coupling.start, duration=duration, step=step, interval=interval, order=order,
            tolerance=tolerance,
            every=common.by_name(every), set=common.by_name(settings), signals=signals,
        )  # fmt: skip
        _tell_of_rest(duration, step)
        wanted = [*known_signals(coupling.outputs), *(signals or ())]
        rows_every = max(step, duration / ROWS) if interval is None else interval
        with progress_bar(duration) as bar:
            run = coupling.run(
                duration, step, wanted, rows_every, tolerance, bar, "keep", common.print_message
            )
    finally:
        coupling.free()
    found = summary(run)
    path = common.write_folder(claimed, lambda folder: _write_signals(run, folder))
    folder = claimed.folder
    common.write_json(json_file, found)
    if json_file != "-":
        for line in _lines(found):
            typer.echo(line)
    common.list_files([path])
    if figures and run.steps:  # else there is nothing to draw
        with common.if_drawable():
            with progress("drawing the figure"):
                # to load what draws takes its time too
                from percussion_model.interface.plotting.coupled_signals import save_signals

                figure = save_signals(run, folder / "signals.png", system.stem)
            common.list_files([figure])
    common.list_files(common.sign(claimed))
    return _tell(run.verdict, common.INTERRUPTED if run.interrupted else common.FAILED)


def _write_signals(run: CoupledRun, folder: Path) -> Path:
    with staged(folder) as draft:
        run.write_csv(draft / "signals.csv")
    return folder / "signals.csv"


def _set_time(coupling: Coupling, start: float | None, duration: float | None) -> float:
    """Set the start of a run; return its duration. The archive has its say where none is given."""
    if start is not None:
        coupling.start = start
    if duration is not None or coupling.stop is None:
        return DURATION if duration is None else duration
    if not coupling.stop > coupling.start:
        raise common.refusal(
            f"{coupling.path}: stopTime = {coupling.stop:g}: is not after the start at "
            f"{coupling.start:g} s: give --duration"
        )
    return coupling.stop - coupling.start


def _tell_of_rest(duration: float, step: float) -> None:
    """Say where the time that was asked for is no multiple of the step."""
    from percussion_model.coupling.master import ROUNDING, whole_steps

    count, _ = whole_steps(duration, step, None)
    if duration - count * step > ROUNDING * duration:
        common.print_message(
            f"--duration {duration:g}: {count * step:.6g} s are simulated, {count} whole "
            f"{'step' if count == 1 else 'steps'} of {step:g} s"
        )


def _lines(found: Mapping[str, Any]) -> Iterator[str]:
    """Lines of a summary: names, numbers and units."""
    for key, name, factor, unit in SHOWN:
        if key not in found:
            continue
        value, error = factor * found[key], found.get(f"{key}_error")
        if error is None and found.get(f"{key}_undecided"):
            yield f"{name:33s} {UNDECIDED} ({HIDDEN})"
            continue
        number = f"{value:.6g}" if key in GIVEN else in_digits(value)
        note = ""
        if error is not None:
            number = with_error(value, factor * error)
            note = SCATTER
        elif key in found["without_error"]:
            note = NOT_ESTIMATED
        yield f"{name:33s} {number} {unit}".rstrip() + (f" ({note})" if note else "")
    if found.get("rate_second_half_error") is not None:
        *others, last = found["not_in_errors"]
        yield wrapped(
            "± is the scatter of the blows, also by the rock: the error by "
            f"{', '.join(others)} and {last} is not in it."
        )


def _tell(verdict: Verdict, code: int) -> int:
    """Say the verdict; return the exit code."""
    for remark in verdict.remarks:
        common.print_message(remark)
    return common.print_message(verdict.text, code if verdict.is_bad else 0)


def read_value(text: str) -> tuple[str, float | bool | str]:
    """Signal and value of `component.variable=value`; words are for enumerations."""
    signal, equals, value = text.partition("=")
    if not equals or "." not in signal or not value:
        raise common.refusal(f"--set {text}: must be COMPONENT.VARIABLE=VALUE")
    if value in ("true", "false"):
        return signal, value == "true"
    try:
        return signal, float(value)
    except ValueError:
        return signal, value


def _read_pace(text: str) -> tuple[str, int]:
    """Component and steps of `component=steps`."""
    name, _, steps = text.partition("=")
    if not name or not steps.isdecimal() or len(steps) > MOST_DIGITS:
        raise common.refusal(
            f"--every {shortened(text)}: must be COMPONENT=STEPS, a whole number from 1"
        )
    return name, int(steps)
