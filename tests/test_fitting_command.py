"""`percussion calibrate`: files in, a calibrated scene out."""

from __future__ import annotations

import json
import re

import pytest
from fitting_data import STIFFNESS, bit, drops, noisy_curve
from typer.testing import CliRunner

from percussion_model import Scene
from percussion_model.analysis.fitting import ROCK, FitError
from percussion_model.interface.cli import app


def written(path, heading, *columns):
    rows = zip(*(column.tolist() for column in columns), strict=True)
    lines = [heading, *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def test_the_command_writes_a_calibrated_scene(tmp_path):
    curve = written(tmp_path / "slow.csv", "penetration, force", *noisy_curve(2))
    drops_of = [
        written(tmp_path / f"{k}.csv", "time,bit_position", test.time, test.values)
        + f"@{test.speed}"
        for k, test in enumerate(drops(bit(), 2, step=1e-3))
    ]
    guess = bit().replace(**{"rock.barrier_damping": 9.5e3, "rock.loading_stiffness": 5e8})
    guess.to_toml(tmp_path / "guess.toml")
    words = ["calibrate", str(tmp_path / "guess.toml"), "--curve", curve]
    words += [word for drop in drops_of for word in ("--drop", drop)]
    out = tmp_path / "found.toml"
    ended = CliRunner().invoke(app, [*words, "--span", "1", "--out", str(out), "--json", "-"])
    assert ended.exit_code == 0, ended.output
    found = json.loads(ended.stdout)
    estimates = found["drop tests"]["estimates"]
    assert list(estimates) == list(ROCK)
    scene = Scene.from_toml(out)
    assert {key: scene[key] for key in ROCK} == {k: v["value"] for k, v in estimates.items()}
    assert found["curve"]["estimates"]["rock.loading_stiffness"]["low"] < STIFFNESS


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--curve", "none.csv"], "none.csv: cannot be read"),
        (["--curve", "{swapped}"], "the columns must be penetration, force"),
        (["--curve", "{ragged}"], "row 2 has 1 columns, the heading 2"),
        (["--curve", "{words}"], "could not convert string to float: 'much'"),
        (["--curve", "{empty}"], "is empty"),
        (["--drop", "drop.csv"], "--drop drop.csv: must be CSV@SPEED"),
        (["--drop", "{swapped}@5"], "the columns must be time and one signal"),
        (["--drop", "{gap}@5"], "signal = 'gap': must be one of"),
    ],
)
def test_the_command_refuses_bad_files(words, says, tmp_path):
    texts = {
        "swapped": "force,penetration\n1,2\n",
        "ragged": "penetration,force\n1,2\n3\n",
        "words": "penetration,force\n1,much\n",
        "gap": "time,gap\n" + "\n".join(f"{k}e-3,0" for k in range(20)),
        "empty": "",
    }
    files = {name: tmp_path / f"{name}.csv" for name in texts}
    for name, text in texts.items():
        files[name].write_text(text, encoding="utf-8")
    bit().to_toml(tmp_path / "scene.toml")
    words = [word.format(**files) for word in words]
    with pytest.raises(FitError, match=re.escape(says)):
        CliRunner().invoke(
            app, ["calibrate", str(tmp_path / "scene.toml"), *words], catch_exceptions=False
        )


def test_the_command_wants_something_to_fit(tmp_path):
    bit().to_toml(tmp_path / "scene.toml")
    ended = CliRunner().invoke(app, ["calibrate", str(tmp_path / "scene.toml")])
    assert ended.exit_code == 2
    assert "nothing to fit" in ended.output
