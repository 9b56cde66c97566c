"""What a variable of an FMU is, as model description and instance need it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

from percussion_model.scene.rows import Row

Causality = Literal["parameter", "input", "output"]


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU.

    Bounds are inclusive; those of a row that leave out the bound itself are checked
    when the value is used. `items` are those of an enumeration, by name.
    """

    name: str
    reference: int
    type: Literal["Real", "Integer", "Boolean", "Enumeration"]
    causality: Causality
    description: str
    variability: Literal["fixed", "continuous", "discrete"]
    unit: str | None = None
    display: str | None = None
    lower: float | None = None
    upper: float | None = None
    nominal: float | None = None
    start: Any = None
    row: Row | None = None
    key: str | None = None
    left_out: Any = None
    enumeration: str | None = None
    items: tuple[tuple[str, int, str], ...] = ()  # name, value, description

    def for_instance(self) -> dict[str, Any]:
        """What `runtime.folder.Known` holds, as plain values."""
        return {
            "name": self.name,
            "reference": self.reference,
            "type": self.type,
            "causality": self.causality,
            "start": self.start,
            "row": None if self.row is None else plain_row(self.row),
            "key": self.key,
            "left_out": self.left_out,
        }


def plain_row(row: Row) -> dict[str, Any]:
    """A row as plain values; those of `Row` are JSON but for tuples."""
    return asdict(row) | {"needs": {key: list(values) for key, values in row.needs.items()}}


def number_row(
    key: str, unit: str, lower: float, upper: float, description: str, lower_open: bool = False
) -> Row:
    """Row of a number that only an FMU has."""
    return Row(
        key=key,
        kind="number",
        unit=unit,
        lower=lower,
        lower_open=lower_open,
        upper=upper,
        upper_open=False,
        default=None,
        required=False,
        choices=(),
        description=description,
        needs={},
    )


def magnitude(value: float) -> float | None:
    """Power of ten near a value, for the attribute `nominal`; None for 0."""
    return None if value == 0 else float(f"1e{int(f'{abs(value):e}'.partition('e')[2])}")
