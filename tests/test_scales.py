"""Scales of a scene against Table II of the paper and against each other, and eq. 30's warning."""

import pytest

from percussion_model import Scene, simulate
from percussion_model.scene.scales import scales
from percussion_model.simulation.validity import MOST_BARRIER

RIGID = {"piston.model": "rigid", "bit.model": "rigid"}


def values(scene):
    return {scale.symbol: scale.value for scale in scales(scene).values()}


def test_the_reference_has_the_scales_of_table_2():
    found = values(Scene())
    assert found["T_1"] == pytest.approx(3.38e-5, abs=0.005e-5)
    assert found["T_4"] == pytest.approx(0.108e-3, abs=0.0005e-3)
    assert found["T_5"] == pytest.approx(3.15e-7, abs=0.005e-7)
    assert found["L_1"] == 0.175
    assert found["L_2"] == pytest.approx(0.40e-3)
    # eq. 27, and the two forms of the ratio that section 2.5 gives for a bar of one section
    assert found["T_3"] == pytest.approx((7850.0 * 5.5e-3 * 0.175 * 0.04 / 3000.0) ** 0.5)
    assert found["eta = K_R L_b/(EA)"] == pytest.approx(7.5e8 * 0.20125 / (210e9 * 5.5e-3))
    assert found["eta = K_R L_b/(EA)"] == pytest.approx((found["T_2"] / found["T_4"]) ** 2)


def test_a_bar_in_two_sections_has_the_scales_of_the_whole():
    half = {"length": 0.100625, "area": 5.5e-3}
    halves = Scene(bit={"sections": [half, half]})
    assert values(halves) == pytest.approx(values(Scene()))


@pytest.mark.parametrize(
    ("changes", "missing"),
    [
        ({"piston.model": "absent", "effects.drive": "none"}, {"T_1", "L_1", "T_3", "T_5", "L_2"}),
        ({"effects.barrier": False}, {"T_5", "W_R/(F_0 D_1)"}),
        ({"effects.rock": "wall"}, {"T_4", "T_5", "L_2", "eta = K_R L_b/(EA)"}),
        ({"drive.force": 0.0}, {"T_3", "T_5", "L_2"}),
    ],
)
def test_what_a_scene_has_not_is_left_out(changes, missing):
    every = set(values(Scene()))
    assert not missing & set(values(Scene().replace(**changes)))
    assert every - set(values(Scene().replace(**changes))) <= missing | {"W_R/(F_0 D_1)"}


@pytest.mark.parametrize("key", ["T_5/T_4", "W_R/(F_0 D_1)"])
@pytest.mark.parametrize("above", [False, True])
def test_a_barrier_that_is_not_small_is_told(key, above):
    """Eq. 30 of the paper, on either side of what still is small."""
    wanted = MOST_BARRIER * (1.01 if above else 0.99)
    if key == "T_5/T_4":  # through the dashpot alone
        changes = {"rock.barrier_damping": 1e4 * values(Scene())["T_5"] / values(Scene())["T_4"]}
        changes["rock.barrier_damping"] /= wanted
    else:  # with a dashpot so strong that it is quick
        changes = {"rock.barrier_energy": wanted * 120.0, "rock.barrier_damping": 1e6}
    result = simulate(Scene().replace(**RIGID, **changes), 0.01, settle=0.0)
    told = [text for text in result.warnings if "energy barrier is not small" in text]
    assert len(told) == above
    assert all(f"{wanted:.2g}" in text and key in text for text in told)
