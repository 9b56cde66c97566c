"""The product as a wheel installs it, without the clone: `python -m tests.installed [PYTHON ...]`.

For each Python that is named, or else for each of 3.11 to 3.13 that is found, an environment is
made, the wheel is installed with all that users need, and README's commands in their order and a
task of each kind are done from an empty folder. That takes some minutes a Python, most of them to
compile.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VERSIONS = ("3.11", "3.12", "3.13")
EVERYTHING = "all,compile"  # for a wheel that is for any system
FOLDERS = {"percussion_model": "percussion_model", "fmu_src": "fmu_src",
           "scenarios": "percussion_scenarios"}  # fmt: skip
# What an environment must not know of the clone, and what is not to be the user's.
CACHES = ("NUMBA_CACHE_DIR", "PERCUSSION_CACHE", "PERCUSSION_FMU_CACHE")
CHECK = """
import sys
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

for path in sys.argv[1:]:
    assert not (found := validate_fmu(path)), found
    result = simulate_fmu(path, stop_time=0.3, output_interval=1e-3)
    assert result["blow_count"][-1] > 3, result[-1]
"""


@dataclass(frozen=True)
class Environment:
    """A Python of its own, with the wheel installed.

    Attributes
    ----------
    folder : Path
        Of the environment.
    empty : Path
        Folder that its commands run in.
    variables : dict of str
        Of the environment of its commands.
    """

    folder: Path
    empty: Path
    variables: dict[str, str]

    def program(self, name: str) -> Path:
        """Path of a program of the environment."""
        return program(self.folder, name)

    def call(self, *words: object, name: str = "percussion") -> subprocess.CompletedProcess[str]:
        """Run a program to its end, whatever that is."""
        command = [str(self.program(name)), *map(str, words)]
        return subprocess.run(
            command, cwd=self.empty, env=self.variables, capture_output=True, text=True
        )

    def percussion(self, *words: object) -> str:
        """What a command prints; it must end well."""
        done = self.call(*words)
        assert done.returncode == 0, f"percussion {' '.join(map(str, words))}\n{done.stderr}"
        return done.stdout


def program(folder: Path, name: str) -> Path:
    """Path of a program of an environment."""
    return folder / "Scripts" / f"{name}.exe" if os.name == "nt" else folder / "bin" / name


def build_wheel(folder: Path) -> Path:
    """Build the wheel of this clone into a folder; return its path."""
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation"]
    subprocess.run([*command, "-w", str(folder), str(ROOT)], check=True)
    (path,) = folder.glob("percussion_model-*.whl")
    return path


def expected_files() -> set[str]:
    """Files that a wheel must have, all of these folders, by their installed names."""
    return {
        f"{installed}/{path.relative_to(ROOT / folder).as_posix()}"
        for folder, installed in FOLDERS.items()
        for path in (ROOT / folder).rglob("*")
        if path.is_file()
        and "__pycache__" not in path.parts
        and path.suffix not in (".nbi", ".nbc")
    }


def plain_environment(folder: Path, wheel: Path, outer: Sequence[str]) -> Environment:
    """An environment with the wheel alone, which finds what it needs in folders of others."""
    venv.create(folder / "venv", with_pip=False, symlinks=os.name != "nt")
    made = _environment(folder)
    (site,) = (folder / "venv").glob("[Ll]ib/**/site-packages")
    (site / "outer.pth").write_text("\n".join(outer) + "\n", encoding="utf-8")
    pip = [sys.executable, "-m", "pip", "--python", str(made.program("python")), "install", "-q"]
    subprocess.run([*pip, "--no-deps", "--no-index", str(wheel)], check=True, env=made.variables)
    return made


def whole_environment(folder: Path, wheel: Path, python: str, extra: str) -> Environment:
    """An environment of a Python with the wheel and an extra, installed as users do."""
    subprocess.run([python, "-m", "venv", str(folder / "venv")], check=True)
    made = _environment(folder)
    pip = [str(made.program("python")), "-m", "pip", "install", "-q"]
    if wheel.is_dir():  # of which pip takes the one for this system, and from nowhere else
        taken = ["--no-deps", "--no-index", "--find-links", str(wheel), "percussion_model"]
        subprocess.run([*pip, *taken], check=True, env=made.variables)
        subprocess.run([*pip, f"percussion_model[{extra}]"], check=True, env=made.variables)
    else:
        subprocess.run([*pip, f"{wheel}[{extra}]"], check=True, env=made.variables)
    return made


def _environment(folder: Path) -> Environment:
    variables = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    variables |= {name: str(folder / name.lower()) for name in CACHES}
    (folder / "empty").mkdir()
    return Environment(folder / "venv", folder / "empty", variables)


# Commands of README that an installed wheel cannot do or that wait for a reader: what follows
# `pip`, `build.py` and `explore`.
NOT_HERE = ("pip", "python3")
WAITS = "explore"


def readme_blocks() -> tuple[list[list[str]], list[str]]:
    """Words of README's commands that an installation can do, and its scripts in Python."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    scripts = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    fenced = "".join(re.findall(r"```sh\n(.*?)```", text, re.DOTALL))
    plain = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    lines = re.findall(r"^    (\S.*)$", plain, re.MULTILINE) + fenced.splitlines()
    words = [shlex.split(line, comments=True) for line in lines]
    return [one for one in words if one and one[0] not in NOT_HERE and WAITS not in one], scripts


def do_readme(made: Environment) -> None:
    """Do README's commands in their order, and its scripts; `AssertionError` where one fails."""
    commands, scripts = readme_blocks()
    assert len(commands) > 3
    assert scripts
    for words in [*commands, *(["python", "-c", text] for text in scripts)]:
        done = made.call(*words[1:], name=words[0])
        assert done.returncode == 0, f"{' '.join(words)}\n{done.stderr}"


def do_tasks(made: Environment) -> None:
    """Do a task of each kind; `AssertionError` where one fails."""
    made.percussion("new", "mine.toml", "--hammer", "dth5")
    made.percussion("explain", "reference")
    made.percussion("run", "reference", "--duration", "1", "--settle", "0.3", "--out", "results")
    assert (made.empty / "results" / "report.html").is_file()
    over = ("--over", "feed.force=1000:3000:2")
    made.percussion("study", "rigid", *over, "--out", "study", "--processes", "1")
    made.percussion("fmu", "reference", "-o", "Hammer.fmu")
    made.percussion("native", "rigid", "-o", "native")
    fmus = ("Hammer.fmu", *sorted((made.empty / "native").glob("*.fmu")))
    checked = made.call("-c", CHECK, *fmus, name="python")
    assert checked.returncode == 0, checked.stderr
    made.percussion("system", "FeedControlRigid", "-o", "systems")
    made.percussion("couple", "systems/FeedControlRigid.ssp", "--duration", "1")


def try_python(python: str, wheel: Path, extra: str = EVERYTHING) -> None:
    """Install a wheel for a Python and do all tasks, in a folder that is removed again."""
    with tempfile.TemporaryDirectory(prefix="percussion-") as folder:
        made = whole_environment(Path(folder), wheel, python, extra)
        do_readme(made)
        do_tasks(made)


def found_pythons() -> list[str]:
    """Programs of the versions that are supported and installed here."""
    names = [shutil.which(f"python{version}") for version in VERSIONS]
    return [name for name in names if name and _answers(name)]


def _answers(python: str) -> bool:
    """Whether a program is a Python: a stand-in of a manager of versions may be none."""
    words = [python, "-c", "import venv"]
    return subprocess.run(words, capture_output=True).returncode == 0


def main() -> int:
    """Try each Python; return the number of those that fail."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition(":")[0])
    parser.add_argument("pythons", nargs="*", metavar="PYTHON", help="left out: those found")
    parser.add_argument("--extra", default=EVERYTHING, help="extras that are installed")
    parser.add_argument(
        "--wheels", type=Path, help="folder of wheels for platforms; left out: made"
    )
    words = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory(prefix="percussion-wheel-") as folder:
        wheel = words.wheels.resolve() if words.wheels else build_wheel(Path(folder))
        for python in words.pythons or found_pythons():
            began = time.monotonic()
            print(f"{python}: installing and trying ...", flush=True)
            try:
                try_python(python, wheel, words.extra)
                told = "all tasks done"
            except (AssertionError, subprocess.CalledProcessError) as error:
                failed, told = failed + 1, str(error)
            print(f"{python}: {told} ({time.monotonic() - began:.0f} s)", flush=True)
    return failed


if __name__ == "__main__":
    sys.exit(main())
