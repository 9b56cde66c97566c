"""Where compiled kernels are kept: sets by their sources, read-only installations and homes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import percussion_model
from percussion_model.physics import kept_kernels, user_cache
from percussion_model.physics.kept_kernels import MOST_KEPT, exchange

RUN = "from percussion_model.physics.elementary import exp; print(exp.dispatcher(1.0))"


@pytest.fixture
def package(tmp_path):
    """Folders of a package, without a kernel."""
    for folder in ("components", "physics/__pycache__", "solvers/__pycache__"):
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
    return tmp_path


def change(package, digest):
    """Exchange sets; then keep a kernel if there is none, and return the one that is there."""
    exchange(package, package / "physics/__pycache__", digest)
    kernel = package / "solvers/__pycache__/step.run-1.py311.nbi"
    if not kernel.exists():
        kernel.write_text(digest)
    return kernel.read_text()


def test_a_set_comes_back_with_its_sources(package, caplog):
    assert change(package, "a" * 64) == "a" * 64
    assert not caplog.text  # nothing was compiled before
    (package / "components/drag.py").touch()
    assert change(package, "b" * 64) == "b" * 64
    assert "components (drag) have changed: kernels are compiled anew" in caplog.text
    caplog.clear()
    (package / "components/drag.py").unlink()
    assert change(package, "a" * 64) == "a" * 64
    assert not caplog.text
    (package / "solvers/__pycache__/step.run-1.py311.nbi").write_text("own")
    assert change(package, "b" * 64) == "b" * 64
    assert change(package, "a" * 64) == "own"  # the same file, not one made again


def test_other_sources_are_named_as_such(package, caplog):
    change(package, "a" * 64)
    change(package, "b" * 64)
    assert "sources of the package have changed" in caplog.text


def test_a_bounded_number_of_sets_is_kept(package):
    for k in range(MOST_KEPT + 3):
        change(package, f"{k:064d}"[::-1])
    assert len(list((package / "physics/__pycache__/kernels").iterdir())) == MOST_KEPT


def test_kernels_of_which_nothing_is_known_are_deleted(package):
    change(package, "a" * 64)
    (package / "physics/__pycache__/kernels.sha256").unlink()
    assert change(package, "b" * 64) == "b" * 64
    assert change(package, "a" * 64) == "a" * 64
    assert (package / "solvers/__pycache__/step.run-1.py311.nbi").is_file()


def test_processes_that_start_at_once_exchange_one_set(package):
    change(package, "a" * 64)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda _: exchange(package, package / "physics/__pycache__", "b"), range(8)))
    assert change(package, "b") == "b"
    assert change(package, "a" * 64) == "a" * 64


def test_a_lock_of_a_process_that_was_killed_holds_nobody_up(package, monkeypatch):
    change(package, "a" * 64)
    (package / "physics/__pycache__/kernels.lock").touch()
    monkeypatch.setattr(kept_kernels, "PATIENCE", 0.0)
    assert change(package, "b" * 64) == "b" * 64
    assert not (package / "physics/__pycache__/kernels.lock").exists()


@pytest.fixture
def closed(tmp_path):
    """A copy of the package in which nothing can be kept, by root either."""
    source = Path(percussion_model.__file__).parent
    package = tmp_path / "package" / source.name
    shutil.copytree(source, package, ignore=shutil.ignore_patterns("__pycache__"))
    for folder in {path.parent for path in package.rglob("*.py")}:
        (folder / "__pycache__").touch()
    return package


def run(closed, **environment):
    """What a process of its own writes with a home that cannot be written, and its messages."""
    names = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA", "PERCUSSION_CACHE")
    kept = {key: value for key, value in os.environ.items() if key not in names}
    kept |= {"HOME": os.devnull, "USERPROFILE": os.devnull, "PYTHONPATH": str(closed.parent)}
    done = subprocess.run(
        [sys.executable, "-c", RUN], env=kept | environment, cwd=closed.parent,
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert float(done.stdout) == pytest.approx(2.718281828459045, rel=1e-15)
    return done.stderr.splitlines()


@pytest.mark.skipif(sys.platform == "win32", reason="its cache folder is found in another way")
def test_a_read_only_installation_and_home_keep_kernels_with_temporary_files(closed, tmp_path):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    kept = []
    for _ in range(2):
        (line,) = run(closed, TMPDIR=str(temporary))
        assert "cannot be written: what is compiled is kept in" in line
        kernels = temporary.rglob("*.nb[ci]")
        kept.append({path: path.stat().st_mtime_ns for path in kernels})
    assert kept[0]
    assert kept[1] == kept[0]  # loaded, not compiled again
    assert all(one.stat().st_mode & 0o077 == 0 for one in temporary.iterdir())


def test_where_nothing_can_be_kept_one_line_says_so(closed):
    (line,) = run(closed, PERCUSSION_CACHE=os.path.join(os.devnull, "none"))
    assert line.startswith("no folder can be written in which compiled kernels would be kept")


def test_kernels_beside_sources_that_cannot_be_written_are_taken_along(tmp_path):
    beside, place = tmp_path / "beside", tmp_path / "place"
    beside.mkdir()
    place.mkdir()
    for name in ("a.f-1.py311.nbi", "a.f-1.py311.1.nbc", "a.pyc"):
        (beside / name).write_text(name)
    kept_kernels.take_along(place, beside)
    assert sorted(one.name for one in place.iterdir()) == ["a.f-1.py311.1.nbc", "a.f-1.py311.nbi"]
    (beside / "a.f-1.py311.nbi").write_text("newer")
    kept_kernels.take_along.cache_clear()  # as another process
    kept_kernels.take_along(place, beside)
    assert (place / "a.f-1.py311.nbi").read_text() == "a.f-1.py311.nbi"  # its own by now


@pytest.mark.skipif(sys.platform == "win32", reason="it has no such modes")
def test_a_folder_for_temporary_files_that_others_can_write_is_not_used(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    planted = tmp_path / f"percussion_model-{os.getuid()}"
    planted.mkdir()
    planted.chmod(0o777)
    user_cache._temporary.cache_clear()
    found = user_cache._temporary("there is no home")
    user_cache._temporary.cache_clear()
    assert found != planted
    assert found.stat().st_mode & 0o077 == 0


def test_without_a_home_the_folder_for_temporary_files_serves(tmp_path, monkeypatch, caplog):
    def no_home():
        raise RuntimeError("Could not determine home directory.")

    for name in ("PERCUSSION_CACHE", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", no_home)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    user_cache._temporary.cache_clear()
    found = user_cache.cache_folder()
    assert found.is_relative_to(tmp_path)
    assert found.parent.stat().st_mode & 0o077 == 0
    assert "home directory" in caplog.text
    user_cache._temporary.cache_clear()
