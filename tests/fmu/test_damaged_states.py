"""Damaged saved states are refused in words and leave nothing behind (docs/data/fmu_details.md)."""

from __future__ import annotations

import os

import pytest

from tests.fmu.damaged_states import KINDS, build, first_states, run

LONG = os.environ.get("PERCUSSION_LONG") == "1"
# States of each FMU: some hundreds in all, or twenty thousand.
COUNT = 1820 if LONG else 60


@pytest.fixture(scope="module")
def folders(built_library, tmp_path_factory):
    """Folders of the unpacked FMUs; without a library elastic bars compile for minutes."""
    names = [name for name in KINDS if LONG or name != "NumbaHammer"]
    return build(names, tmp_path_factory.mktemp("damaged"))


@pytest.fixture(scope="module")
def foreign(folders):
    """A state of each FMU."""
    return first_states(folders)


@pytest.mark.parametrize("name", KINDS)
def test_damaged_states_end_in_a_message_and_change_nothing(folders, foreign, name):
    if name not in folders:
        pytest.skip("compiles for minutes; set PERCUSSION_LONG=1")
    others = [state for other, state in foreign.items() if folders[other] != folders[name]]
    found, fault = run(name, folders[name], others, COUNT)
    assert not fault
    assert found.total() == COUNT
    assert sum(count for kind, count in found.items() if kind.endswith("refused")) > COUNT // 3
