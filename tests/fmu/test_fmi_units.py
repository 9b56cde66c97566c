"""Units of the interface: products of the known ones."""

import pytest

from fmu_src import units
from percussion_model.components import UNITS


@pytest.mark.parametrize(
    ("unit", "name", "base"),
    [
        ("-", "1", {}),
        ("N s/m^2", "N.s/m2", {"kg": 1, "m": -1, "s": -1}),
        ("m^3/(s Pa)", "m3/(s.Pa)", {"kg": -1, "m": 4, "s": 1}),
        ("rad/s", "rad/s", {"rad": 1, "s": -1}),
        ("kg m^2", "kg.m2", {"kg": 1, "m": 2}),
        ("J/(kg K)", "J/(kg.K)", {"m": 2, "s": -2, "K": -1}),
        ("1/s", "1/s", {"s": -1}),
    ],
)
def test_a_unit_is_a_product_of_known_ones(unit, name, base, monkeypatch):
    monkeypatch.setattr(units, "UNITS", dict(units.UNITS))  # it keeps what it meets
    assert units.fmi_unit(unit) == name
    assert units.UNITS[name].base == base


def test_an_unknown_unit_is_named():
    with pytest.raises(ValueError, match="unit 'furlong/s': 'furlong' must be one of 1, m, "):
        units.fmi_unit("furlong/s")


@pytest.mark.parametrize("unit", UNITS)
def test_units_of_components_are_known(unit):
    assert units.fmi_unit(unit) == unit
