"""Scripts of coupled systems run, and their tables say what they measured."""

from __future__ import annotations

import pytest

from scenarios import coupling_step


def test_the_error_against_the_step_is_measured(feed_control, tmp_path):
    rows = coupling_step.simulate(feed_control, (5e-4, 1e-3), ("jacobi", "gauss-seidel"))
    assert [row[:2] for row in rows] == [
        ("jacobi", 5e-4), ("jacobi", 1e-3), ("gauss-seidel", 5e-4), ("gauss-seidel", 1e-3),
    ]  # fmt: skip
    found = coupling_step.errors(rows)
    assert found[0][1] == 0.0
    # the default step is within the figure that docs/system.md has for it
    assert all(abs(error) < 0.015 for _, error in found)
    assert all(feed == pytest.approx(3000.0, rel=0.05) for _, _, _, feed, _ in rows)
    assert all(abs(share) < 0.005 for *_, share in rows)
    assert coupling_step.table(rows).count("\n") == 5
    path = coupling_step.draw(rows, tmp_path / "step.png")
    assert path.stat().st_size > 10_000
