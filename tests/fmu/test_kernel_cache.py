"""The cache of compiled kernels: what somebody else could have put there is not run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLANTED = "PLANTED"

# What a host sees of an instance: where its code lies, and what it says.
LOOK = """
import sys
from scenarios.harness import Instance

instance = Instance(sys.argv[1]).start()
instance.step(1e-3)
for name, module in sys.modules.items():
    if name.endswith("fmu_src.parts.rock_filter"):
        print("code:", module.__file__)
print("log:", *instance.messages)
instance.free()
"""
posix = pytest.mark.skipif(
    not hasattr(os, "geteuid"), reason="Windows has no modes: profiles are closed by themselves"
)


def look(fmu, cache, **environment):
    """Run an FMU with a cache; where its code was, and its log."""
    kept = {k: v for k, v in os.environ.items() if k not in environment}
    given = {k: v for k, v in environment.items() if v is not None}
    if cache is not None:
        given["PERCUSSION_FMU_CACHE"] = str(cache)
    else:
        kept.pop("PERCUSSION_FMU_CACHE", None)
    done = subprocess.run(
        [sys.executable, "-c", LOOK, str(fmu)], cwd=ROOT, env=kept | given,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    code, log = done.stdout.split("log:")
    return Path(code.split("code: ")[1].strip()), log.strip()


@pytest.fixture
def fmu(fmus):
    return fmus / "RockFilter.fmu"


@pytest.fixture
def filled(fmu, tmp_path):
    """A cache that holds the sources, and a module in it."""
    cache = tmp_path / "cache"
    code, log = look(fmu, cache)
    assert code.is_relative_to(cache)
    assert log == ""
    assert look(fmu, cache) == (code, "")
    return cache, code


def plant(code):
    """Change a module, its size being as before."""
    text = code.read_text()
    lines = "# Standard deviations of an interval of 95 %.\nSURE = 1.96"
    planted = text.replace(lines, f'SURE = print("{PLANTED}") or 1.96'.ljust(len(lines)))
    code.write_text(planted)
    assert PLANTED in planted
    assert len(planted) == len(text)


def test_a_changed_source_of_equal_size_is_not_run(fmu, filled):
    cache, code = filled
    text = code.read_text()
    plant(code)
    found, log = look(fmu, cache)
    assert PLANTED not in log
    assert found == code
    assert found.read_text() == text  # mended
    assert len(list(cache.iterdir())) == 1


@posix
@pytest.mark.parametrize("open_to", [0o020, 0o002])
def test_a_cache_that_others_can_write_to_is_not_used(fmu, filled, open_to):
    cache = filled[0]
    cache.chmod(0o755 | open_to)
    found, log = look(fmu, cache)
    assert not found.is_relative_to(cache)
    assert "can be written by others" in log
    assert str(cache) in log
    assert not found.exists()  # the private one is taken away


@posix
def test_a_package_or_a_file_that_others_can_write_is_not_used(fmu, filled):
    cache, code = filled
    package = next(cache.iterdir())
    assert package.stat().st_mode & 0o077 == 0  # as it is made
    code.chmod(0o666)
    assert look(fmu, cache)[0] == code  # which nobody reaches
    package.chmod(0o755)
    found, log = look(fmu, cache)
    assert not found.is_relative_to(cache)
    assert code.name in log
    code.chmod(0o644)
    assert look(fmu, cache)[0] == code


@posix
@pytest.mark.parametrize("of", ["cache", "package", "file"])
def test_a_cache_of_another_user_is_not_used(fmu, filled, of):
    if os.geteuid() != 0:
        pytest.skip("only root can give a file away")
    cache, code = filled
    package = next(cache.iterdir())
    package.chmod(0o755)
    os.chown({"cache": cache, "package": package, "file": code}[of], 12345, -1)
    found, log = look(fmu, cache)
    assert not found.is_relative_to(cache)
    assert "belongs to another user" in log


@posix
def test_a_link_to_an_open_folder_is_not_used(fmu, filled, tmp_path):
    cache, _ = filled
    cache.chmod(0o777)
    link = tmp_path / "link"
    link.symlink_to(cache)
    found, log = look(fmu, link)
    assert not found.is_relative_to(link)
    assert "can be written by others" in log


NOBODY = """
import os, pathlib, runpy, sys

def no_home():
    raise RuntimeError("Could not determine home directory.")

pathlib.Path.home = no_home
"""


def test_without_a_home_it_runs_from_a_private_folder(fmu, tmp_path):
    (tmp_path / "sitecustomize.py").write_text(NOBODY)
    path = f"{tmp_path}{os.pathsep}{ROOT}"
    found, log = look(fmu, None, HOME=None, XDG_CACHE_HOME=None, PYTHONPATH=path)
    assert "home directory" in log
    assert not found.exists()
