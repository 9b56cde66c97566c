"""Shared parts of the commands: options, loading a scene, outputs, messages."""

from __future__ import annotations

import gc
import hashlib
import os
import secrets
import signal
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn, TypeVar

import typer

from percussion_model.interface.messages import wrapped
from percussion_model.interface.streams import end_process
from percussion_model.simulation.interruption import is_interruption

if TYPE_CHECKING:
    from types import FrameType

    from percussion_model.scene.scene import Scene
    from percussion_model.simulation.files import ResultError
    from percussion_model.simulation.origin import Claim

T = TypeVar("T")
BAD_INPUT = 2
FAILED = 1
INTERRUPTED = 130  # what shells report for Ctrl-C
TERMINATED = 143  # and for SIGTERM
# Starting makes hundreds of thousands of objects that stay [objects].
COLLECT_AFTER = 100_000
# So many files of a folder have a line each.
FEW_FILES = 3
# Extras of packages that more than one kind of command needs.
EXTRAS = {"scipy": "fit", "numba": "compile", "llvmlite": "compile"}


class BadValue(typer.BadParameter):
    """A bad value of an option, whose message names the option and is told as it is.

    What a parser of typer raises must be no `ValueError`: of these it drops the message.
    """


def number_option(option: str, metavar: str, key: str, words: str) -> Any:
    """Return an option whose value is that of a parameter, with its unit or in SI."""

    def read(text: str) -> float:
        from percussion_model.scene.parameters import read_number
        from percussion_model.scene.rows import SceneError

        try:
            return read_number(key, text, option)
        except SceneError as error:
            raise BadValue(str(error)) from None

    return typer.Option(option, metavar=metavar, parser=read, help=words)


SceneFile = Annotated[
    Path, typer.Argument(metavar="SCENE", help="A scene file (TOML), or a preset, as reference.")
]
SolverName = Annotated[
    Literal["wave", "modal", "fem", "rigid"] | None,
    typer.Option("--solver", help="Solver; rigid makes piston and bit rigid."),
]
Cells = Annotated[
    int | None, typer.Option("--cells", help="Cells, modes or elements of the piston.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set any parameter, as in rock.unloading_ratio=10 or feed.force=5kN; may be repeated.",
    ),
]
RockName = Annotated[
    str | None,
    typer.Option(
        "--rock",
        metavar="NAME[:BUTTONS]",
        help="Take law and numbers of a rock, as kuru-granite:10 for a bit of 10 buttons; --set "
        "wins. `percussion rocks` lists them.",
    ),
]
BitName = Annotated[
    str | None,
    typer.Option(
        "--bit",
        metavar="NAME",
        help="Drill with a button bit, as dth-140, that turns and breaks rock. `percussion bits` "
        "lists them.",
    ),
]
_ACCURACY = "Wanted relative error of the rate, in place of cells."
Accuracy = Annotated[
    float | None, number_option("--accuracy", "ERROR", "solver.accuracy", _ACCURACY)
]
Check = Annotated[
    bool | None, typer.Option("--check/--no-check", help="Verify --accuracy by a finer run.")
]
ErrorEstimate = Annotated[
    bool | None,
    typer.Option(
        "--error-estimate/--no-error-estimate",
        help="Estimate the error of the rate by short runs on coarser cells.",
    ),
]
_DURATION = "Simulated time, in s or with its unit."
Duration = Annotated[float | None, number_option("--duration", "TIME", "run.duration", _DURATION)]
_SETTLE = "Time before blows count, in s or with its unit."
Settle = Annotated[float | None, number_option("--settle", "TIME", "run.settle", _SETTLE)]
_ALTITUDE = "Height above the sea, by the standard atmosphere: pressure and temperature around."
Altitude = Annotated[float | None, number_option("--altitude", "HEIGHT", "start.depth", _ALTITUDE)]
JsonFile = Annotated[
    str | None,
    typer.Option("--json", metavar="FILE|-", help="Write the summary as JSON; - for stdout."),
]
Out = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for results.")]
# Of commands that write without being told where; each says which folder that is.
OutOrDefault = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Folder for what is written, in place of that."),
]
Force = Annotated[
    bool, typer.Option("--force", help="Replace what another scene or run has left there.")
]
Trust = Annotated[
    bool, typer.Option("--trust", help="Allow any size, and FMUs outside of the archive.")
]
Tolerance = Annotated[
    float, typer.Option("--tolerance", help="Relative change of a blow that is no change.")
]


def own_process() -> None:
    """Let this process start faster; a library must not do so to the process of its caller."""
    from percussion_model.physics import kernel

    kernel.own_process()
    gc.set_threshold(COLLECT_AFTER)


def load_scene(
    path: Path | None,
    solver: str | None = None,
    cells: int | None = None,
    settings: list[str] | None = None,
    accuracy: float | None = None,
    check: bool | None = None,
    is_run: bool = True,
    rock: str | None = None,
    bit: str | None = None,
) -> Scene:
    """Read a scene (a file, a preset, else the reference), and apply what the command line changes.

    Where the solver that the scene names will run it, tell of its kernels.
    """
    from percussion_model.scene.scene import Scene
    from percussion_model.scene.text import read_setting

    scene = Scene() if path is None else Scene.from_toml(path)
    scene, given = with_bit(scene, bit), dict(read_setting(text) for text in settings or ())
    # the rock is taken for the bit that is set
    of_bit = {key: value for key, value in given.items() if key.startswith(OF_BIT)}
    changes: dict[str, Any] = rock_changes(rock, scene.replace(**of_bit) if rock else scene)
    changes |= given
    if solver is not None:
        scene = scene.computed_by(solver, **changes)
    elif changes:
        scene = scene.replace(**changes)
    asked = {"solver.accuracy": accuracy, "run.check": check}
    scene = scene.replace(**{key: value for key, value in asked.items() if value is not None})
    if cells is not None:
        key = "fem.elements" if scene.solver_name == "fem" else "solver.cells"
        scene = scene.replace(**{key: cells})
    hint_at_unusual(scene)
    if is_run:
        tell_of_compiling(scene.solver_name)
    return scene


# Keys of what a bit has.
OF_BIT = ("effects.breaking", "effects.rotation", "hole_diameter", "breaking.", "rotation.")


def with_bit(scene: Scene, name: str | None) -> Scene:
    """Return the scene with the bit that --bit names, if any."""
    from percussion_model.scene.bits import bit

    return scene if name is None else scene.replace(**bit(name).parameters)


def rock_changes(text: str | None, scene: Scene) -> dict[str, Any]:
    """Law and numbers of the rock that --rock names, by their keys; none where it is left out.

    Hint at the number of buttons where none is asked for, or another one than the bit has.
    """
    from percussion_model.scene.rocks import read_rock
    from percussion_model.scene.rocks.breaking import parameters_under

    if text is None:
        return {}
    rock = read_rock(text)
    own = scene["breaking.buttons"] if scene["effects.breaking"] else None
    if own is not None and rock.asked not in (None, own):
        hint("--rock", f"{text} takes a bit of {rock.asked} buttons in place of {own}")
    if own is None and rock.asked is None and rock.buttons is not None:
        many = "button" if rock.buttons == 1 else "buttons"
        hint(
            "--rock",
            f"rock {rock.name}: its stiffness is that of {rock.buttons} {many}: for a bit of 10 "
            f"ask for {rock.name}:10",
        )
    return parameters_under(rock, scene)


# Parameters of which this process has hinted.
_hinted: set[str] = set()


def hint(key: str, text: str) -> None:
    """Print a hint on stderr, once for each parameter of all sections and scenes."""
    from percussion_model.scene.rows import generic_key

    if text and generic_key(key) not in _hinted:
        _hinted.add(generic_key(key))
        print_message(f"hint: {text}")


def hint_at_unusual(scene: Scene) -> None:
    """Hint at values of a scene that are far from what is usual, as by a slip of the unit."""
    from percussion_model.scene.typical import unusual_values

    for key, text in unusual_values(scene):
        hint(key, text)


def tell_of_compiling(*solvers: str) -> None:
    """Compile the solvers that have to be, and say so on stderr."""
    from percussion_model.engine.compiler import NoCompilerError
    from percussion_model.engine.library import make, place_to_compile
    from percussion_model.interface.progress import lines

    places = {name: place_to_compile(name) for name in dict.fromkeys(solvers)}
    for name, place in places.items():
        if place is None:
            continue
        print_message(f"compiling the solver {name}: once, for about a minute; kept in {place}")
        # without a linker it is loaded as it is, without a compiler refused where it is used
        with lines("compiling") as report, suppress(NoCompilerError):
            make(name, report)


def check_outputs(folder: Path | None, json_file: str | None) -> None:
    """Refuse a folder or a file that could not be written, before anything is computed."""
    from percussion_model.simulation.files import check_writable

    if folder is not None:
        check_writable(folder)
    check_json(json_file)


def claim(
    command: str, out: Path | None, default: Path | None, force: bool, **made_from: Any
) -> Claim:
    """Claim the folder of a result: refuse what holds another one, before anything is computed.

    A folder that is not named by the user is numbered instead, which `list_files` says: what is
    refused after this went nowhere.

    Parameters
    ----------
    command : str
    out, default : Path or None
        Named by the user, and else.
    force : bool
        Replace what is there.
    made_from : dict
        All that the result follows from: scenes, plain values, lists and tables of them.
    """
    from percussion_model.simulation.origin import Claim

    folder = out or default
    assert folder is not None
    origin = {"command": command, **{name: _entries(one) for name, one in made_from.items()}}
    claimed = Claim(folder, origin, force, numbered=out is None)
    _moved[:] = [claimed.moved] * bool(claimed.moved)
    return claimed


# Why results go to another folder than usual, until files are written there.
_moved: list[str] = []


def forget_moving() -> None:
    """Forget what a command before was to say: it was refused."""
    _moved.clear()


def tell_of_moving() -> None:
    """Say once why files that are written now are in another folder than usual."""
    while _moved:
        print_message(_moved.pop())


def _entries(value: Any) -> Any:
    """A scene as a tree, and others as they are."""
    from percussion_model.scene.scene import Scene

    if isinstance(value, dict):
        return {name: _entries(one) for name, one in value.items()}
    return tomllib.loads(value.to_toml()) if isinstance(value, Scene) else value


def by_name(words: list[str] | None) -> dict[str, str]:
    """Values by name, of words NAME=VALUE."""
    return {name: value for name, _, value in (word.partition("=") for word in words or ())}


def digest(path: Path | None) -> str | None:
    """What a file holds, in short; nothing where there is no file."""
    if path is None or not path.is_file():
        return None
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]


def refuse_existing(file: Path, force: bool) -> None:
    """Refuse a file that is there, unless it is to be replaced."""
    if file.is_file() and not force:
        raise refusal(f"{file}: exists already; --force overwrites it")


def check_json(json_file: str | None) -> None:
    """Refuse a file that could not be written, before anything is computed."""
    if json_file not in (None, "-"):
        check_file("--json", Path(json_file))


def check_file(option: str, path: Path | None) -> None:
    """Refuse a file of an option that could not be written, before anything is computed."""
    from percussion_model.simulation.files import ResultError
    from percussion_model.simulation.files import check_file as check

    try:
        if path is not None:
            check(path)
    except ResultError as error:
        raise refusal(f"{option} {error}") from None


def write_json(json_file: str | None, values: dict[str, Any]) -> None:
    """Write plain values as JSON to a file, to stdout (-), or nowhere (None)."""
    from percussion_model.simulation.files import to_json

    if json_file == "-":
        typer.echo(to_json(values))
    elif json_file is not None:
        file = Path(json_file)
        word = "replaced" if file.is_file() else "wrote"
        if write_file(file, to_json(values) + "\n") == file:
            print(f"{word} {file}", file=sys.stderr)


def told_as_json(json_file: str | None, chosen: list[Any], plain: Callable) -> bool:
    """Write what is stored under names as JSON, and say whether that is all to be told.

    Parameters
    ----------
    chosen : list
        Bits, rocks or hammers.
    plain : callable
        Plain values of one.
    """
    check_json(json_file)
    write_json(json_file, {one.name: plain(one) for one in chosen})
    return json_file == "-"


def with_parameters(one: Any) -> dict[str, Any]:
    """Return a bit or a rock as plain values, with what it is for a scene."""
    return asdict(one) | {"parameters": one.parameters}


# What could not be written where it was asked for, though it is kept elsewhere or only drawn.
_missed: list[str] = []


def write_file(file: Path, text: str) -> Path:
    """Write what was computed into a file, or elsewhere where that cannot be; return the file."""
    from percussion_model.simulation.files import ResultError, staged_file

    try:
        staged_file(file, text)
    except ResultError as error:
        return _write_elsewhere(file, partial(staged_file, content=text), error)[0]
    return file


def write_folder(claimed: Claim, write: Callable[[Path], T]) -> T:
    """Write what was computed into the folder of a claim, or elsewhere where that cannot be."""
    from percussion_model.simulation.files import ResultError

    try:
        return write(claimed.folder)
    except ResultError as error:
        folder, found = _write_elsewhere(claimed.folder, write, error)
    claimed.move_to(folder)
    return found


def sign(claimed: Claim) -> list[Path]:
    """Sign a claimed folder; where that cannot be what is there counts all the same."""
    from percussion_model.simulation.files import ResultError

    try:
        return [claimed.sign()]
    except ResultError as error:
        print_message(str(error))
        _missed.append(str(error))
        return []


def write_texts(claimed: Claim, texts: Mapping[str, str]) -> None:
    """Write texts by their names into the folder of a claim, as `write_folder`, and say so."""
    from percussion_model.simulation.files import staged_texts

    list_files(write_folder(claimed, partial(staged_texts, texts=texts)))


def _write_elsewhere(
    wanted: Path, write: Callable[[Path], T], error: ResultError
) -> tuple[Path, T]:
    """Write into the present folder, else that for temporary files, else home, and say where."""
    from percussion_model.simulation.files import ResultError

    for place in (Path.cwd, lambda: Path(tempfile.gettempdir()), Path.home):
        try:
            path = place() / f"{wanted.stem}-kept-{secrets.token_hex(4)}{wanted.suffix}"
            found = write(path)
        except (ResultError, OSError, RuntimeError):  # no home, and no present folder any more
            continue
        print_message(f"{error}: what was computed is kept in {path}")
        _missed.append(str(error))
        return path, found
    raise error


def exit_code(code: Any) -> int:
    """Code with which a command ends: not 0 where something is not where it was asked for."""
    found = code if isinstance(code, int) else 0
    found = found or (FAILED if _missed else 0)
    _missed.clear()
    return found


@contextmanager
def if_drawable() -> Iterator[None]:
    """Draw figures, or say on stderr what they lack: results count without them."""
    from percussion_model.simulation.files import ResultError

    try:
        yield
    except ImportError as error:
        print_message(needs_plot_extra(error))
    except ResultError as error:  # as on a disk that is full by now
        print_message(f"no figures: {error}")
        _missed.append(str(error))


def list_files(paths: Iterable[Path]) -> None:
    """Name on stderr the files that were written; many of one folder together.

    Why they are in another folder than usual is said before.
    """
    tell_of_moving()
    folders: dict[Path, list[str]] = {}
    for path in paths:
        folders.setdefault(path.parent, []).append(path.name)
    for folder, names in folders.items():
        if len(names) <= FEW_FILES:
            for name in names:
                print(f"wrote {folder / name}", file=sys.stderr)
            continue
        print(wrapped(f"wrote to {folder}{os.sep}: {', '.join(names)}"), file=sys.stderr)


def needs_plot_extra(error: ImportError) -> str:
    """Say which package the figures lack and how to get it."""
    return f"no figures, since {needs_extra(error, 'plot')}"


def needs_extra(error: ImportError, extra: str) -> str:
    """Say which package is missing, and the extra that installs it: its own, or else this one."""
    name = package_of(error)
    extra = EXTRAS.get(name, extra)
    return f'{name or error} is missing: pip install "percussion_model[{extra}]"'


def package_of(error: ImportError) -> str:
    """Name of the package that is missing."""
    return (error.name or "").partition(".")[0]


@contextmanager
def needing(extra: str) -> Iterator[None]:
    """Refuse to go on where a package is missing that an extra installs."""
    try:
        yield
    except ImportError as error:
        raise refusal(needs_extra(error, extra)) from None


def refusal(message: str) -> typer.Exit:
    """Print one message on stderr; return what ends the command as bad input."""
    return typer.Exit(print_message(message, BAD_INPUT))


def end_script(name: str, work: Callable[[], object]) -> NoReturn:
    """Do the work of a script of this project, and end the process.

    What its user can mend, Ctrl-C and SIGTERM are a message, as those of `percussion`.

    Parameters
    ----------
    name : str
        Module of the script, as `python -m` takes it.
    work : callable
    """

    def coded() -> int:
        try:
            work()
        except (KeyboardInterrupt, SystemError) as error:
            if not is_interruption(error):
                raise
            message = "interrupted before there was a result"
            return ended_by(print_message(message, INTERRUPTED, name))
        except ValueError as error:
            package = type(error).__module__.partition(".")[0]
            if package not in ("percussion_model", name.partition(".")[0]):
                raise
            return print_message(str(error), BAD_INPUT, name)
        return 0

    heed_termination()
    end_process(coded, name)


def heed_termination() -> None:
    """Let SIGTERM do what Ctrl-C does; `ended_by` tells them apart."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        _terminated.append(number)
        there = signal.getsignal(signal.SIGINT)
        if not callable(there):  # of a process in the background, which ignores Ctrl-C
            raise KeyboardInterrupt
        there(signal.SIGINT, frame)

    signal.signal(signal.SIGTERM, interrupt)


_terminated: list[int] = []


def ended_by(code: int) -> int:
    """Exit code of an interruption: another one where it was SIGTERM."""
    return TERMINATED if code == INTERRUPTED and _terminated else code


def print_message(message: str, code: int = 0, program: str = "percussion") -> int:
    """Print one message on stderr; return the exit code.

    What refuses bad input is one line, for scripts; others are broken to fit.
    """
    text = f"{program}: {message}"
    with suppress(OSError):  # the exit code tells it as well
        print(text if code == BAD_INPUT else wrapped(text), file=sys.stderr)
    return code
