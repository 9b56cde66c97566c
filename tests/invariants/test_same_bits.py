"""The same bits from other builds of the kernels and of the linear algebra."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys

import pytest

from percussion_model import Scene, Simulation

LONG = os.environ.get("PERCUSSION_LONG") == "1"
# A stepped bit that fits no cells as well: its tables are made of products.
SCENES = {
    "reference": {},
    "stepped": {
        "bit.sections": [
            {"length": 0.13, "area": 5.5e-3, "youngs_modulus": 2.1e11, "density": 7850.0},
            {"length": 0.0911, "area": 3.0e-3, "youngs_modulus": 2.1e11, "density": 7850.0},
        ]
    },
}
DURATION = 0.5


def digest(name: str) -> str:
    """Hash of all blows and events of a run."""
    run = Simulation(Scene().replace(**SCENES[name]))
    run.advance(DURATION)
    return hashlib.sha256(run.blows.tobytes() + run.events.tobytes()).hexdigest()


def elsewhere(name: str, **variables: str) -> str:
    """The same in a process of its own with other variables."""
    command = [sys.executable, "-m", "tests.invariants.test_same_bits", name]
    done = subprocess.run(
        command, env=os.environ | variables, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


@pytest.mark.parametrize("name", list(SCENES))
@pytest.mark.parametrize("kind", ["Prescott", "Haswell"])
def test_linear_algebra_of_another_processor_changes_no_bit(name, kind):
    assert elsewhere(name, OPENBLAS_CORETYPE=kind) == digest(name)


@pytest.mark.skipif(not LONG, reason="compiles for minutes; set PERCUSSION_LONG=1")
@pytest.mark.parametrize(
    ("processor", "features"), [("generic", ""), ("haswell", "+avx2,+fma")], ids=["SSE2", "AVX2"]
)
def test_kernels_for_another_processor_have_the_same_bits(processor, features, tmp_path):
    build = {
        "NUMBA_CPU_NAME": processor,
        "NUMBA_CPU_FEATURES": features,
        "NUMBA_CACHE_DIR": str(tmp_path),
    }
    for name in SCENES:
        assert elsewhere(name, **build) == digest(name)


if __name__ == "__main__":
    print(digest(sys.argv[1]))
