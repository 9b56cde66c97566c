"""The command `percussion`; its subcommands are in `percussion_model.interface.commands`.

Those that make FMUs are added by `fmu_src.command_line`, which stands above this package.
"""

from __future__ import annotations

import functools
import os
import sys
import tempfile
from collections.abc import Callable, Mapping
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from percussion_model.interface.commands.accuracy import accuracy
from percussion_model.interface.commands.bench_controller import bench_controller
from percussion_model.interface.commands.bits import bits
from percussion_model.interface.commands.calibrate import calibrate
from percussion_model.interface.commands.common import (
    BAD_INPUT,
    EXTRAS,
    INTERRUPTED,
    ended_by,
    exit_code,
    forget_moving,
    heed_termination,
    needs_extra,
    own_process,
    package_of,
    print_message,
    refusal,
)
from percussion_model.interface.commands.compare import compare
from percussion_model.interface.commands.couple import couple
from percussion_model.interface.commands.drive_map import drive_map
from percussion_model.interface.commands.effects import effects
from percussion_model.interface.commands.explore import explore
from percussion_model.interface.commands.hammers import hammers
from percussion_model.interface.commands.identify import identify
from percussion_model.interface.commands.paper import paper
from percussion_model.interface.commands.rocks import rocks
from percussion_model.interface.commands.scene import explain, new, plot, run, settled
from percussion_model.interface.commands.stability import stability
from percussion_model.interface.commands.study import study
from percussion_model.interface.commands.upgrade import upgrade
from percussion_model.interface.commands.validate import validate
from percussion_model.interface.messages import usage_text
from percussion_model.interface.progress import lines
from percussion_model.interface.streams import end_process
from percussion_model.scene.writing import remove_abandoned
from percussion_model.simulation.interruption import is_interruption

app = typer.Typer(
    help="Percussive drilling: elastic piston and bit, and rock, blow by blow.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # its help cuts names of options at 80 columns
    pretty_exceptions_enable=False,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from percussion_model import __version__

        typer.echo(f"percussion {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Percussive drilling: elastic piston and bit, and rock, blow by blow."""


def _heard(command: Callable[..., Any], waits: bool = False) -> Callable[..., Any]:
    """Tell on a pipe that a command still runs, and let `_guarded` know of Ctrl-C.

    After Ctrl-C typer would end without a word. A command that `waits` for others, as a server
    does, is not said to run.
    """

    @functools.wraps(command)
    def call(*words: Any, **options: Any) -> Any:
        _begun.append(command.__name__)
        try:
            with nullcontext() if waits or sys.stderr.isatty() else lines("still running"):
                _refuse_output_over_input(options)
                return command(*words, **options)
        except (KeyboardInterrupt, SystemError) as error:
            if not is_interruption(error):
                raise
            raise typer.Abort from None

    return call


# Parameters of commands that name a file to write, by what users call them.
_OUTPUTS = {"json_file": "--json", "out": "--out", "output": "-o", "figure": "--figure"}


def _refuse_output_over_input(options: Mapping[str, Any]) -> None:
    """Refuse a file to write that the command reads: nothing may replace that, --force neither."""
    read = [
        file
        for name, value in options.items()
        if name not in _OUTPUTS
        for word in (value if isinstance(value, list) else [value])
        if isinstance(word, str | Path)
        # FILE@SPEED and FILE.py:NAME as well
        for file in {str(word), str(word).rpartition("@")[0], str(word).rpartition(":")[0]}
        if os.path.isfile(file)
    ]
    for name, option in _OUTPUTS.items():
        written = options.get(name)
        if written is None or not os.path.isfile(written):
            continue
        if any(os.path.samefile(written, file) for file in read):
            raise refusal(
                f"{option} {written}: cannot be written: the command reads this file; name another"
            )


# Commands that have begun: typer ends without a word on Ctrl-C before.
_begun: list[str] = []
# Packages whose own errors are messages.
_packages: set[str] = set()


def add(
    command: Callable[..., Any],
    name: str | None = None,
    settings: dict[str, Any] | None = None,
    waits: bool = False,
) -> None:
    """Add a command; its first line stands whole in the list of all.

    Parameters
    ----------
    command : callable
        As typer takes it. Errors that its package defines are messages.
    name : str, optional
        That of the function if left out.
    settings : dict, optional
        Of the context, as click takes them.
    waits : bool
        Whether it waits for others, as a server does.
    """
    _packages.add(command.__module__.partition(".")[0])
    first = (command.__doc__ or "").partition("\n")[0]
    app.command(name, short_help=first, context_settings=settings)(_heard(command, waits))


for _command in (
    run,
    settled,
    study,
    explain,
    plot,
    compare,
    accuracy,
    effects,
    paper,
    validate,
    calibrate,
    identify,
    stability,
    couple,
    bench_controller,
    new,
    upgrade,
    rocks,
    bits,
    hammers,
    drive_map,
):
    add(_command)
add(explore, waits=True)


def main() -> None:
    """Run the command line; errors are one message and an exit code."""
    own_process()
    heed_termination()
    with suppress(OSError):  # no such folder can be written
        remove_abandoned(tempfile.gettempdir())
    end_process(lambda: ended_by(_guarded(lambda: app(standalone_mode=False))))


def _guarded(work: Callable[[], Any]) -> int:
    """Turn errors that a user can mend into a message."""
    _begun.clear()
    forget_moving()
    try:
        code = exit_code(work())
        if code == INTERRUPTED and not _begun:
            raise KeyboardInterrupt
        return code
    except (KeyboardInterrupt, typer.Abort):
        return print_message("interrupted before there was a result", INTERRUPTED)
    except Exception as error:
        if is_interruption(error):  # while kernels load with the commands
            return print_message("interrupted before there was a result", INTERRUPTED)
        if type(error).__module__.partition(".")[0] in _packages:
            return print_message(str(error), BAD_INPUT)
        if isinstance(error, ImportError) and package_of(error) in EXTRAS:
            return print_message(needs_extra(error, EXTRAS[package_of(error)]), BAD_INPUT)
        # Bad arguments: typer hides the class of its errors.
        told = getattr(error, "format_message", None)
        if told is None:
            raise
        if "\n" in told():  # the help, for no words at all
            print(told(), file=sys.stderr)
            return BAD_INPUT
        return print_message(usage_text(error), BAD_INPUT)


if __name__ == "__main__":
    main()
