"""Numbers with a unit: exact factors, what is refused, and wherever a value is given."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tomllib
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from percussion_model import Scene, SceneError, Simulation, SimulationError
from percussion_model.analysis.study import grid, read_axis
from percussion_model.interface.cli import BAD_INPUT, _guarded, app
from percussion_model.interface.commands.calibrate import _read_range
from percussion_model.scene.bar_groups import Section
from percussion_model.scene.parameters import Feed, parameter_table
from percussion_model.scene.units import LONGEST, QUANTITIES, UnitError, factor, in_si

ROOT = Path(__file__).parents[1]
RIGID = str(ROOT / "scenarios" / "rigid.toml")
# By definition, written out: NIST SP 811, appendix B.
POUND, INCH, GRAVITY = Fraction(45359237, 10**8), Fraction(254, 10**4), Fraction(980665, 10**5)
FACTORS = {
    ("kN", "N"): Fraction(1000),
    ("MN", "N"): Fraction(10**6),
    ("mN", "N"): Fraction(1, 1000),
    ("lbf", "N"): POUND * GRAVITY,
    ("kgf", "N"): GRAVITY,
    ("kip", "N"): 1000 * POUND * GRAVITY,
    ("kg m/s^2", "N"): Fraction(1),
    ("mm", "m"): Fraction(1, 1000),
    ("µm", "m"): Fraction(1, 10**6),
    ("in", "m"): INCH,
    ("ft", "m"): 12 * INCH,
    ("cm²", "m^2"): Fraction(1, 10**4),
    ("in^2", "m^2"): INCH**2,
    ("us", "s"): Fraction(1, 10**6),
    ("min", "s"): Fraction(60),
    ("GPa", "Pa"): Fraction(10**9),
    ("bar", "Pa"): Fraction(10**5),
    ("psi", "Pa"): POUND * GRAVITY / INCH**2,
    ("g/cm^3", "kg/m^3"): Fraction(1000),
    ("lb/ft^3", "kg/m^3"): POUND / (12 * INCH) ** 3,
    ("kN/mm", "N/m"): Fraction(10**6),
    ("lbf/in", "N/m"): POUND * GRAVITY / INCH,
    ("kN*s/m", "N s/m"): Fraction(1000),
    ("N·s/mm", "N s/m"): Fraction(1000),
    ("kJ", "J"): Fraction(1000),
    ("ft lbf", "J"): 12 * INCH * POUND * GRAVITY,
    ("m min^-1", "m/s"): Fraction(1, 60),
    ("km/h", "m/s"): Fraction(5, 18),
    ("%", "-"): Fraction(1, 100),
    # free air of DIN 1343: 1.2923 kg in each m^3
    ("m^3/min", "kg/s"): Fraction(12923, 600_000),
}


@pytest.mark.parametrize("units", FACTORS, ids=" to ".join)
def test_factors_are_exact(units):
    assert factor(*units) == FACTORS[units]


@given(
    st.floats(-1e9, 1e9).filter(lambda x: x == 0 or abs(x) > 1e-9),
    st.sampled_from(list(FACTORS)),
    st.sampled_from(["{} {}", "{}{}", "  {} {} "]),
)
def test_a_value_is_rounded_once(value, units, form):
    """The text of a number, times the exact factor, to the nearest float."""
    found = in_si(form.format(repr(value), units[0]), units[1])
    assert found == float(Fraction(repr(value)) * FACTORS[units])


@given(st.floats(1e-3, 900.0), st.sampled_from([unit for unit, si in FACTORS if si == "N"]))
def test_a_scene_with_units_is_written_in_si_and_read_again(value, unit):
    scene = Scene().replace(**{"drive.force": f"{value!r} {unit}"})
    assert Scene(**tomllib.loads(scene.to_toml())) == scene
    assert f"force = {scene.drive.force!r}\n" in scene.to_toml()


@pytest.mark.parametrize("unit", QUANTITIES)
def test_examples_of_messages_are_the_same_value(unit):
    number, *texts = QUANTITIES[unit].example
    assert texts
    for text in texts:
        assert in_si(text, unit) == pytest.approx(float(number), rel=3e-4)
    assert all(factor(one, unit) > 0 for one in QUANTITIES[unit].usual)


def test_each_unit_of_the_table_has_a_name_and_examples():
    units = {row.unit for row in parameter_table() if row.kind == "number"}
    assert units <= set(QUANTITIES)


REFUSED = [
    ("5 kg", 'a force is wanted, for instance 5000, "5 kN" or "1124 lbf"'),
    ("5 KN", "KN is no known unit (did you mean kN?): a force is wanted"),
    ("5 kNN", "kNN is no known unit: a force is wanted"),
    ("5 ton", "ton has several meanings, write t or lb: a force is wanted"),
    ("20 degC", "a force is wanted"),
    ("5 N degC/K", "a force is wanted"),
    ("5 N rad", "a force is wanted"),
    ("5 N dB", "a force is wanted"),
    ("5 dBm s/m", "a force is wanted"),
    ("5 pi N", "a force is wanted"),
    ("5 nan", "nan is no known unit: a force is wanted"),
    ("5 %", "a force is wanted"),
    ("5", 'must be a number from -1e9 to 1e9 N, or text as "5 kN" or "1124 lbf"'),
    ("", "must be a number from -1e9 to 1e9 N, or text as"),
    ("much", "must be a number from -1e9 to 1e9 N, or text as"),
    ("5,5 kN", "must be a number from -1e9 to 1e9 N, or text as"),
    ("nan kN", "must be a number from"),
    ("inf kN", "must be a number from"),
    ("1_0 kN", "must be a number from"),
    ("9**9**9 N", "must be a number from"),
    ("5*(1 kN)", "must be a number from"),
    ("5 N; 3 N", "must be a number from"),
    ("5 kN\n", "must be a number from"),
    ("5 N^99", "must be a number from"),
    ("5 __class__", "must be a number from"),
    ("5 N^2.5", "must be a number from"),
    ("٥ kN", "must be a number from"),
    ("5" * 40 + " kN", "must be a number from"),
    ("5 N" + " m/m" * 20, f"is longer than {LONGEST} characters: must be a number from"),
    ("x" * 10**6, f"is longer than {LONGEST} characters: must be a number from"),
    ("5e9 kN", "(5e+12 N): must be a number from -1e9 to 1e9 N"),
    ("-1e400 kN", "(-inf N): must be a number from -1e9 to 1e9 N"),
]


@pytest.mark.parametrize(("text", "words"), REFUSED, ids=[text[:12] for text, _ in REFUSED])
def test_what_is_no_force_is_refused_in_one_line(text, words):
    with pytest.raises(SceneError) as error:
        Feed(force=text)
    message = str(error.value)
    assert message.startswith("feed.force = ")
    assert words in message
    assert "\n" not in message
    assert len(message) < 250


def found_or_said(read, *words):
    """What was read, or what was said of it."""
    try:
        return read(*words)
    except (SceneError, UnitError) as error:
        return str(error)


@given(st.text(max_size=80))
def test_any_text_is_a_force_or_one_line(text):
    found = found_or_said(lambda: Feed(force=text).force)
    assert "\n" not in found if isinstance(found, str) else math.isfinite(found)


@given(st.text("kKMmNsgftlbinqVA0123456789.+-eE^*/·²³% ", min_size=1, max_size=30))
def test_what_looks_like_a_force_is_one_or_is_refused(text):
    assert isinstance(found_or_said(in_si, text, "N"), (float, str))


def test_words_whole_numbers_and_flags_take_no_units():
    for key, text in (("solver.cells", "20 m"), ("effects.feed", "5 kN"), ("effects.rock", "1 m")):
        with pytest.raises(SceneError, match=f"{key} = .*: must be (a whole number|true|one of)"):
            Scene().replace(**{key: text})
    with pytest.raises(SceneError, match=r'a pure number is wanted, for instance 0.01 or "1 %"'):
        Scene().replace(**{"rock.unloading_ratio": "5 dB"})


# ------------------------------------------------------- wherever a value is given


def test_files_groups_and_replaced_values_take_units(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(
        'hole_diameter = "3.25 in"\n[feed]\nforce = "5 kN"\n[[piston.sections]]\n'
        'length = "175 mm"\narea = "55 cm^2"\nyoungs_modulus = "210 GPa"\ndensity = "7.85 g/cm^3"\n'
    )
    scene = Scene.from_toml(file)
    assert scene.hole_diameter == 0.08255
    assert scene.feed.force == 5000.0
    assert scene.piston.sections == (Section(length=0.175, area=0.0055),)
    assert (
        '"'
        not in scene.to_toml().replace('on = "bit"', "").partition("[feed]")[2].partition("[")[0]
    )
    changed = scene.replace(**{"piston.sections.0.length": "20 cm", "hole_diameter": None})
    assert (changed.piston.sections[0].length, changed.hole_diameter) == (0.2, None)
    with pytest.raises(SceneError, match=r"piston\.sections\.0\.area = .*: an area is wanted"):
        scene.replace(**{"piston.sections.0.area": "55 cm"})
    with pytest.raises(SceneError, match=r"hole_diameter = .*: a length is wanted"):
        scene.replace(hole_diameter="3 kg")


def test_bars_in_one_list_take_units():
    bar = {"sections": [{"length": "20 cm", "area": "10 cm^2"}]}
    scene = Scene(bars=[bar, bar])
    assert scene.bit.sections[0].area == 1e-3


def test_inputs_during_a_run_take_units():
    rigid = Scene().replace(**{"piston.model": "rigid", "bit.model": "rigid"})
    one, other = Simulation(rigid), Simulation(rigid)
    one.set_inputs(feed_force="3 kN")
    other.set_inputs(feed_force=3000.0)
    for simulation in (one, other):
        simulation.advance(0.1)
    assert one.observe() == other.observe()
    with pytest.raises(SimulationError, match=r"feed_force = .*: a force is wanted"):
        one.set_inputs(feed_force="3 m")


def test_axes_of_a_study_take_units():
    key, values = read_axis("feed.force=0.5kN:20kN:40")
    assert (key, len(values), values[0], values[-1]) == ("feed.force", 40, 500.0, 20000.0)
    assert read_axis("start.gap=10um,0.02 mm")[1].tolist() == [1e-5, 2e-5]
    assert read_axis("feed.force=1kN:100kN:3log")[1].tolist() == [1000.0, 10000.0, 100000.0]
    assert grid({"feed.force": ["1 kN", 2000.0]}).values.tolist() == [[1000.0], [2000.0]]
    for text in ("feed.force=0.5:20kN:4", "feed.force=1kN,2"):
        with pytest.raises(SceneError, match=r"give each value its unit, or none \(SI\)"):
            read_axis(text)
    with pytest.raises(SceneError, match="a force is wanted"):
        read_axis("feed.force=1kg:2kg:3")
    with pytest.raises(SceneError, match=r"unknown key feed\.forse: did you mean feed\.force"):
        read_axis("feed.forse=1kN:2kN:3")


def test_ranges_of_a_calibration_take_units():
    key, ends = _read_range("rock.loading_stiffness=0.1 GN/m:1e9")
    assert (key, ends) == ("rock.loading_stiffness", (1e8, 1e9))


def run_json(capsys, *words):
    code = _guarded(lambda: app(["run", RIGID, *words], standalone_mode=False))
    shown = capsys.readouterr()
    return code, shown.out, shown.err


def test_settings_and_times_of_the_command_line_take_units(capsys):
    units = ("--set", "feed.force=5kN", "--duration", "300 ms", "--settle", "0.001 min")
    plain = ("--set", "feed.force=5000", "--duration", "0.3", "--settle", "0.06")
    found = []
    for words in (units, plain):
        code, out, err = run_json(capsys, *words, "--json", "-")
        assert (code, err) == (0, "")
        found.append(json.loads(out))
    for key in ("rate_of_penetration", "duration", "settle", "blow_energy"):
        assert found[0][key] == found[1][key]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--set", "feed.force=5 kg"), 'feed.force = "5 kg": a force is wanted'),
        (("--duration", "5 kN"), '--duration = "5 kN": a time is wanted'),
        (("--settle", "soon"), '--settle = "soon": must be a number from 0 to 1e6 s'),
    ],
)
def test_bad_units_on_the_command_line_end_in_one_line(words, told, capsys):
    code, out, err = run_json(capsys, *words)
    assert (code, out) == (BAD_INPUT, "")
    assert told in err
    assert err.count("\n") == 1


def test_without_units_their_library_is_not_loaded():
    """Start-up is that of before: pint takes longer than a short run."""
    code = (
        "import sys; from percussion_model import Scene; import percussion_model.interface.cli;"
        f"Scene.from_toml({RIGID!r}).replace(**{{'feed.force': 3000.0}});"
        "assert 'pint' not in sys.modules;"
        "Scene(feed={'force': '1 kN'}); assert 'pint' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
