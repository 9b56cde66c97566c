"""Command line of the scripted scenarios, and the folders that their results go to."""

from __future__ import annotations

import argparse
import sys
import zipfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from percussion_model.interface.commands.common import claim, digest, end_script
from percussion_model.interface.commands.common import list_files as list_files
from percussion_model.interface.messages import wrapped

# Each scenario has a folder in it, by its name.
FOLDER = Path("out") / "scenarios"
DIST = Path("dist")


class ScenarioError(ValueError):
    """Words or files that a scenario cannot be run with; the message says why."""


@dataclass(frozen=True)
class Archive:
    """A file that a scenario runs."""

    metavar: str  # what it is called in the help
    default: Path  # taken where none is named
    entry: str  # file that every archive of the kind has in it
    make: Callable[[], object] | None = None  # makes the default one where it is not there

    def found(self, named: Path | None) -> Path:
        """The archive that is named, or else the default one; refused where it is none."""
        path = named or self.default
        if named is None and not path.exists() and self.make is not None:
            self.make()
        if not path.is_file():
            how = "" if named else f"; `percussion system {path.stem}` makes it"
            raise ScenarioError(f"{path}: no such file{how}")
        if not self._is_valid(path):
            kind = "FMU" if path.suffix != ".ssp" else "SSP archive"
            raise ScenarioError(f"{path}: is no {kind}: there is no {self.entry} in it")
        return path

    def _is_valid(self, path: Path) -> bool:
        try:
            with zipfile.ZipFile(path) as archive:
                return self.entry in archive.namelist()
        except (OSError, zipfile.BadZipFile):
            return False


def system(name: str) -> Archive:
    """An archive of a system, in `dist` where none is named."""
    return Archive("SYSTEM.ssp", DIST / f"{name}.ssp", "SystemStructure.ssd")


def tell(text: str) -> None:
    """Say on stderr what takes long."""
    print(wrapped(text), file=sys.stderr)


class _Parser(argparse.ArgumentParser):
    """Words of a scenario; what is wrong with them is one line."""

    def error(self, message: str) -> NoReturn:
        raise ScenarioError(f"{message}; see {self.prog} --help")


def command_line(
    name: str,
    about: str | None,
    archives: Sequence[Archive],
    work: Callable[[Sequence[Path], Path], Iterable[Path]],
    arguments: Sequence[str] | None = None,
) -> NoReturn:
    """Run a scenario by `python -m scenarios.NAME`, and end the process.

    Its results go to a folder of its own, which is claimed as those of `percussion` are: what
    another archive gave is not replaced.

    Parameters
    ----------
    name : str
    about : str
        Docstring of the scenario, for the help.
    archives : sequence of Archive
        That it runs.
    work : callable
        Runs it: takes paths of the archives and the folder; gives the files that it wrote.
    arguments : sequence of str, optional
        Words of the command line.
    """
    end_script(f"{__package__}.{name}", lambda: _run(name, about or "", archives, work, arguments))


def _run(
    name: str,
    about: str,
    archives: Sequence[Archive],
    work: Callable[[Sequence[Path], Path], Iterable[Path]],
    arguments: Sequence[str] | None,
) -> None:
    command = f"python -m {__package__}.{name}"
    parser = _Parser(prog=command, description=about.partition(": `python -m")[0] + ".")
    for k, one in enumerate(archives):
        words = f"default: dist/{one.default.name}" + (", made if need be" if one.make else "")
        parser.add_argument(f"archive{k}", nargs="?", type=Path, metavar=one.metavar, help=words)
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help=f"folder of the results; default: {FOLDER / name}"
    )
    parser.add_argument("--force", action="store_true", help="replace what else is in it")
    words = parser.parse_args(arguments)
    paths = [one.found(getattr(words, f"archive{k}")) for k, one in enumerate(archives)]
    made_from = {one.metavar: digest(path) for one, path in zip(archives, paths, strict=True)}
    claimed = claim(command, words.out, FOLDER / name, words.force, archives=made_from)
    files = list(work(paths, claimed.folder))
    list_files([*files, claimed.sign()])
