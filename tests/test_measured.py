"""Published experiments are read, and what makes no sense is refused in one line."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
import tomli_w

from percussion_model.verification import measured
from percussion_model.verification.measured import ExperimentError, load, read_experiment, wanted

FOLDER = Path(measured.__file__).parent


def test_every_experiment_is_read():
    found = load()
    assert [one.name for one in found] == sorted(path.stem for path in FOLDER.glob("*_*.toml"))
    for one in found:
        assert not one.scene.unused, one.name
        assert "10." in one.source["doi"]
        used = {name for fit in one.fits for name in (*fit.to, *fit.predicts)}
        assert used == set(one.measured), one.name


def test_the_criteria_are_those_that_were_fixed_first():
    wanted_of = {
        "first_wave": 0.10,
        "indentation_velocity": 0.20,
        "penetration": 0.15,
        "residual_penetration": 0.15,
        "rebound_velocity": 0.20,
        "restitution": 0.10,
        "peak_force": 0.15,
        "loading_stiffness": 0.15,
        "secant_stiffness": 0.15,
    }
    for experiment in load():
        for one in experiment.measured.values():
            if one.no_criterion:
                assert one.quantity in ("loading_end", "peak_force")
            else:
                assert one.within == pytest.approx(wanted_of[one.quantity]), one.id


def test_the_bit_of_the_single_insert_has_its_mass():
    for name in ("single_insert_st_anne", "single_insert_kuru"):
        (one,) = load([name])
        assert one.scene.bit.mass == pytest.approx(1.509, rel=1e-3)


def test_what_could_not_be_read_is_listed():
    assert len(wanted()) >= 5
    assert all(all(row.values()) for row in wanted())


def changed(tmp_path, change):
    tree = tomllib.loads((FOLDER / "triple_button_kuru.toml").read_text(encoding="utf-8"))
    change(tree)
    path = tmp_path / "own.toml"
    path.write_text(tomli_w.dumps(tree), encoding="utf-8")
    return path


def fixing(values, law="power"):
    return lambda tree: tree["fits"][0].update(law=law, fixed=values)


def test_a_fit_by_the_power_law_is_read_with_what_it_fixes(tmp_path):
    fixed = {"rock.reference_penetration": "0.5 mm", "rock.loading_exponent": 1.7}
    plan = read_experiment(changed(tmp_path, fixing(fixed))).fits[0]
    assert plan.law == "power"
    assert plan.fixed == pytest.approx(
        {"rock.reference_penetration": 5e-4, "rock.loading_exponent": 1.7}
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.pop("rock"), "rock: is missing"),
        (lambda t: t.update(colour="red"), "colour: unknown key"),
        (lambda t: t["measured"][0].update(value="162 m"), "measured.0.value"),
        (lambda t: t["measured"][0].update(error=0), "must be above 0"),
        (lambda t: t["measured"][0].update(kind="heard"), "must be one of measured, computed"),
        (lambda t: t["measured"][0].pop("within"), "either within or no_criterion"),
        (lambda t: t["measured"].append(t["measured"][0]), "every id must be there once"),
        (lambda t: t["fits"][0].update(law="cubic"), "must be one of bilinear, power"),
        (lambda t: t["fits"][0].update(to=[]), "must be as many"),
        (lambda t: t["fits"][0].update(predicts=["loading stiffness"]), "both fitted and"),
        (lambda t: t["scene"]["rock"].update(loading_stiffness=-1.0), "loading_stiffness"),
        (lambda t: t["fits"][0].update(parameters=["rock.loading_exponent"]), "must be one of roc"),
        (fixing({"rock.loading_exponent": 0.5}), "loading_exponent = 0.5: must be a number"),
        (fixing({"rock.loading_exponent": "much"}), 'loading_exponent = "much": must be a number'),
        (fixing({"rock.barrier_energy": 0.1}), "fixed.rock.barrier_energy: unknown key"),
        (fixing({"rock.loading_stiffness": 1e8}), "rock.loading_stiffness: unknown key; must be"),
        (fixing({"rock.loading_exponent": 1.5}, "bilinear"), "rock.loading_exponent: unknown key"),
        (lambda t: t["fits"][0].update(fixed=1.5), "fits.0.fixed: must be a table"),
        (lambda t: t.update(gauge="3 m"), "the bit's length"),
        (lambda t: t["scene"]["run"].update(duration=2.0), "must be at most 0.05 s"),
        (lambda t: t["scene"].update(piston={"model": "rigid"}), "elastic or absent"),
        (lambda t: t["measured"][1].update(id="a\nb"), "must be one line of text"),
    ],
)
def test_bad_experiments_are_refused_in_one_line(tmp_path, change, message):
    path = changed(tmp_path, change)
    with pytest.raises(ExperimentError) as refused:
        read_experiment(path)
    text = str(refused.value)
    assert message in text
    assert "own.toml" in text
    assert "\n" not in text


def test_unknown_experiments_are_refused():
    with pytest.raises(ExperimentError, match="must be one of one_button_flat"):
        load(["nothing"])
    with pytest.raises(ExperimentError, match="no such file"):
        load(["nothing.toml"])
    with pytest.raises(ExperimentError, match="is there twice"):
        load(["one_button_flat"] * 2)
