"""Systems built once for all tests, with a hammer of rigid bodies that compiles sooner."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fmu_src.hammer.build import build_hammer
from fmu_src.system.archive import SYSTEMS, build_fmus, read_plan, write_system
from percussion_model import Scene
from percussion_model.coupling import bench


def plan_of(name, **changes):
    return read_plan(SYSTEMS / f"{name}.toml", hammer="rigid", **changes)


@pytest.fixture(scope="session")
def fmus(built_library, tmp_path_factory):
    """FMUs by component."""
    return build_fmus(plan_of("feed_control"), tmp_path_factory.mktemp("parts"))


@pytest.fixture(scope="session")
def feed_control(fmus, tmp_path_factory):
    """Archive of the feed-controlled system."""
    folder = tmp_path_factory.mktemp("systems")
    return write_system(plan_of("feed_control"), fmus, folder / "FeedControl.ssp")


@pytest.fixture
def without_library(fmus, tmp_path):
    """The same with a hammer that runs by numba."""
    plan, path = plan_of("feed_control"), tmp_path / "RigidHammer.fmu"
    build_hammer(Scene.from_toml(plan.hammer), path, libraries={})
    return write_system(plan, fmus | {"hammer": path}, tmp_path / "FeedControl.ssp")


@pytest.fixture(scope="session")
def extremum_seeking(fmus, tmp_path_factory):
    """Archive of the system that seeks the best feed."""
    folder = tmp_path_factory.mktemp("systems")
    return write_system(plan_of("extremum_seeking"), fmus, folder / "ExtremumSeeking.ssp")


@pytest.fixture(scope="session")
def two_way(fmus, tmp_path_factory):
    """Archive of the system that seeks the best feed and pressure."""
    folder = tmp_path_factory.mktemp("systems")
    return write_system(plan_of("two_way_seeking"), fmus, folder / "TwoWaySeeking.ssp")


@pytest.fixture
def brief(monkeypatch):
    """Short runs of the bench, for what does not hang on the motion."""
    trials = tuple(replace(trial, duration=0.8) for trial in bench.STANDARD_RUNS)
    monkeypatch.setattr(bench, "STANDARD_RUNS", trials)
