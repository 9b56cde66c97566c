"""Points of a study: grids, samples and tables."""

from __future__ import annotations

import numpy as np
import pytest

from percussion_model import Scene, SceneError
from percussion_model.analysis.study import grid, latin_hypercube, read_axis, study, table
from percussion_model.analysis.study.points import refuse_unknown, whole_number

AXES = {"feed.force": [1500.0, 2500.0, 4000.0], "rock.loading_stiffness": [3e8, 7.5e8]}


def test_a_grid_has_all_combinations():
    points = grid(AXES)
    assert (len(points), points.shape, points.is_grid) == (6, (3, 2), True)
    assert points.changes(3) == {"feed.force": 2500.0, "rock.loading_stiffness": 7.5e8}


def test_values_of_an_axis_may_come_in_any_order():
    """Maps, cuts and cells between values all take it that an axis rises."""
    stirred = {key: [values[-1], *values[:-1]] for key, values in AXES.items()}
    assert grid(stirred).digest() == grid(AXES).digest()
    falling = grid(dict([read_axis("feed.force=30:10:3"), read_axis("gravity.acceleration=1,0")]))
    assert falling.changes(0) == {"feed.force": 10.0, "gravity.acceleration": 0.0}


def test_a_table_has_a_point_for_each_row_as_it_comes():
    points = table({"feed.force": [3e3, 1e3, 2e3], "rock.loading_stiffness": ["1 GN/m", 2e9, 3e9]})
    assert (points.keys, points.shape, len(points)) == (
        ("feed.force", "rock.loading_stiffness"), (3,), 3,
    )  # fmt: skip
    assert points.values.tolist() == [[3e3, 1e9], [1e3, 2e9], [2e3, 3e9]]
    assert table({"feed.force": [1, 2]}).values.dtype == float
    assert table({"feed.force": [1, 2]}).digest() == grid({"feed.force": [1, 2]}).digest()


def test_points_dear_to_set_up_come_together():
    points = grid(AXES)
    stiffness = points.values[points.in_cheap_order(), 1]
    assert np.count_nonzero(np.diff(stiffness)) == 1
    assert grid({"feed.force": [1.0, 2.0]}).in_cheap_order().tolist() == [0, 1]  # none is dear


def test_samples_fill_every_slice_and_repeat_with_their_seed():
    ranges = {"feed.force": (500.0, 5e3), "rock.loading_stiffness": (1e8, 1e10)}
    points = latin_hypercube(ranges, 50, seed=3, logarithmic=["rock.loading_stiffness"])
    assert (points.shape, points.is_grid) == ((50,), False)
    even = (points.values[:, 0] - 500.0) / 4500.0 * 50
    slices = np.log(points.values[:, 1] / 1e8) / np.log(100.0) * 50
    for one in (even, slices):
        assert sorted(one.astype(int)) == list(range(50))
    again = latin_hypercube(ranges, 50, seed=3, logarithmic=["rock.loading_stiffness"])
    assert again.digest() == points.digest()
    assert latin_hypercube(ranges, 50, seed=4).digest() != points.digest()
    assert len(latin_hypercube({"loss.time": ("0.25 s", 0.5)}, 1, 0, ["loss.time"])) == 1


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: grid({}), "at least one parameter"),
        (lambda: grid({"feed.force": []}), "feed.force: values of a study must be finite"),
        (lambda: grid({"feed.force": ["much"]}), 'feed.force = "much": must be a number from'),
        (lambda: grid({"feed.force": [2.0, 1.0, 2.0]}), "feed.force: 2.0 is given twice"),
        (lambda: grid(dict([read_axis("feed.force=3:3:2")])), "feed.force: 3.0 is given twice"),
        (lambda: table({"feed.force": [1.0], "loss.time": [0, 1]}), "of one length"),
        (lambda: latin_hypercube({"feed.force": (2.0, 1.0)}, 3), "two rising numbers"),
        (lambda: latin_hypercube({"feed.force": (0, 1)}, 3, 0, ["feed.force"]), "above 0"),
        (lambda: latin_hypercube({"feed.force": (0, 1)}, 0), "count = 0"),
        (lambda: latin_hypercube({"feed.force": (1, 1)}, 3), "feed.force: must be two rising"),
        (lambda: latin_hypercube({"feed.force": ("x", 1)}, 3), 'feed.force = "x": must be a num'),
        (lambda: grid({"feed.force": [{}]}), "feed.force: values of a study must be numbers"),
        (lambda: read_axis("feed.force"), "--over feed.force: must be"),
        (lambda: read_axis("feed.force=1:2"), "must be KEY=FIRST:LAST:COUNT"),
        (lambda: read_axis("feed.force=1:2:0"), "COUNT must be a whole number from 1 to"),
        (lambda: read_axis("feed.force=-1:2:3log"), "both ends must be above 0"),
        (lambda: read_axis("feed.force=0:2:3log"), "force=0:2:3log: both ends must be above 0"),
        (lambda: read_axis("=1,2"), "must be KEY=FIRST:LAST:COUNT"),
        (lambda: read_axis("feed.force=1=2"), "must be"),
        (lambda: read_axis("feed.force=1kN,2"), "--over feed.force=1kN,2: give each value its"),
        (lambda: read_axis("feed.force=1kN:2:3"), "--over feed.force=1kN:2:3: give each value"),
        (lambda: refuse_unknown(Scene(), grid({"effects.feed": [0, 1]})), "a study varies numbers"),
    ],
)
def test_senseless_points_are_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()


def test_axes_of_the_command_line():
    key, values = read_axis("rock.loading_stiffness=1e8:1e10:3log")
    assert key == "rock.loading_stiffness"
    assert values == pytest.approx([1e8, 1e9, 1e10])
    assert read_axis("feed.force=0:10:3")[1].tolist() == [0.0, 5.0, 10.0]
    assert read_axis("feed.force=3,7")[1].tolist() == [3.0, 7.0]
    assert read_axis("feed.force=3kN,500N")[1].tolist() == [3000.0, 500.0]
    assert read_axis("feed.force = 1kN:3kN:3")[1].tolist() == [1000.0, 2000.0, 3000.0]
    assert read_axis("feed.force=5:9:1")[1].tolist() == [5.0]
    assert read_axis("loss.time=0.25:0.5:2log")[1].tolist() == [0.25, 0.5]
    # what would be 20.000000000000004 by the logarithm
    assert read_axis("solver.cells=10:80:4log")[1].tolist() == [10.0, 20.0, 40.0, 80.0]


def test_a_whole_number_is_not_cut_from_a_broken_one(tmp_path):
    with pytest.raises(SceneError, match=r"solver.cells = 17.5: must be a whole number"):
        study(Scene(), grid({"solver.cells": [10, 17.5, 25]}), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_only_whole_numbers_are_made_whole():
    cells, force = whole_number("solver.cells", 20.0), whole_number("feed.force", 20.0)
    assert (cells, type(cells)) == (20, int)
    assert (force, type(force)) == (20.0, float)
    refuse_unknown(Scene(), grid({"feed.force": [0.5], "solver.cells": [20.0]}))
