"""Rocks by name: law and numbers of the bit's force, with intervals and sources."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Self

from percussion_model.scene.rows import SceneError, shortened
from percussion_model.scene.text import read_stored, stored_names

_HERE = Path(__file__).parent
# More buttons than any bit has.
MOST_BUTTONS = 1000
LAW, STIFFNESS, BUTTONS = "effects.rock", "rock.loading_stiffness", "rock.buttons"
CHIPPING, REFERENCE = "rock.chipping_penetration", "rock.reference_penetration"
KINDS = ("measured", "computed", "derived", "assumed")


@dataclass(frozen=True)
class Number:
    """One number of a rock, SI units.

    Attributes
    ----------
    key : str
        Dotted key of the parameter table; or "strength".
    value, low, high : float
        The number, and the interval that it is believed to lie in.
    kind : str
        One of `KINDS`: fitted to measured or to computed numbers of others; derived from other
        properties of the rock; or assumed, as no source has it.
    second_hand : bool
        Whether its source was read in a quotation.
    why : str
        Where the interval comes from.
    """

    key: str
    value: float
    low: float
    high: float
    kind: str
    why: str
    second_hand: bool = False

    def times(self, value: float, low: float, high: float) -> Self:
        """Return the number times a share, and its interval times that of the share."""
        return replace(self, value=value * self.value, low=low * self.low, high=high * self.high)


@dataclass(frozen=True)
class Rock:
    """A rock under one kind of bit.

    Attributes
    ----------
    name, title, rock, origin : str
        Name of the preset; what it is; the rock; where that comes from.
    law : str
        Value of `effects.rock`.
    numbers : tuple of Number
        Parameters of that law.
    indenter, fitted_to, holds_for : str
        Bit that the numbers belong to; what they were fitted to; blows that they hold for.
    buttons : int or None
        Of that bit; None where they are not known.
    button_radius : float or None
        Radius of a spherical button [m].
    strength : Number or None
        Compressive strength of the rock [Pa].
    source : dict of str
        `cited`, `published`, `doi` and `read_in`.
    asked : int or None
        Buttons of the bit that it was asked for.
    breaking : tuple of Number
        What is known of its own craters, by keys of `[breaking]` and `[rotation]`.
    """

    name: str
    title: str
    rock: str
    origin: str
    law: str
    numbers: tuple[Number, ...]
    indenter: str
    fitted_to: str
    holds_for: str
    source: dict[str, str]
    buttons: int | None = None
    button_radius: float | None = None
    strength: Number | None = None
    asked: int | None = None
    breaking: tuple[Number, ...] = ()

    @property
    def parameters(self) -> dict[str, Any]:
        """Law and numbers by their dotted keys, as `Scene.replace` takes them."""
        found = {LAW: self.law, **{one.key: one.value for one in self.numbers}}
        if self.law == "power":  # whose stiffness is that of one button
            found[BUTTONS] = self.asked or self.buttons
            found.setdefault(CHIPPING, 0.0)  # not that of the scene before
        return found

    def number(self, key: str) -> Number:
        """Return a number by its key."""
        return next(one for one in self.numbers if one.key == key)

    def of_buttons(self, count: int) -> Rock:
        """Return the same rock under a bit of `count` buttons, each of which takes its share.

        Raises
        ------
        SceneError
            If there cannot be so many, or the buttons behind the numbers are not known.
        """
        if not 1 <= count <= MOST_BUTTONS:
            raise SceneError(f"rock {self.name}: {count} buttons: must be from 1 to {MOST_BUTTONS}")
        if self.buttons is None:
            raise SceneError(
                f"rock {self.name}: its numbers are those of a whole bit of unknown buttons: ask "
                "for it without a number of buttons"
            )
        share = 1.0 if self.law == "power" else count / self.buttons
        return replace(self.with_stiffness_times(share, share, share), asked=count)

    def with_stiffness_times(self, value: float, low: float, high: float) -> Rock:
        """Return the same rock with its loading stiffness times a share, as `Number.times`."""
        numbers = (
            one.times(value, low, high) if one.key == STIFFNESS else one for one in self.numbers
        )
        return replace(self, numbers=tuple(numbers))


def rocks() -> list[str]:
    """Names of the rocks that there are."""
    return stored_names(_HERE)


def rock(name: str, buttons: int | None = None) -> Rock:
    """Return a rock.

    Parameters
    ----------
    name : str
        One of `rocks()`.
    buttons : int, optional
        Of the bit; that of the source if left out.

    Raises
    ------
    SceneError
        If there is no such rock, or it cannot be had for so many buttons.
    """
    found = _read(name)
    return found if buttons is None else found.of_buttons(buttons)


def read_rock(text: str) -> Rock:
    """Return the rock that "NAME" or "NAME:BUTTONS" asks for.

    Raises
    ------
    SceneError
        As `rock` does, or if the buttons are no whole number.
    """
    name, colon, count = (part.strip() for part in text.partition(":"))
    if not colon:
        return rock(name)
    found = rock(name)
    if not (count.isascii() and count.isdecimal() and len(count) < 10):
        raise SceneError(
            f"rock {shortened(text)}: must be NAME or NAME:BUTTONS, as in {name}:10, with a whole "
            f"number from 1 to {MOST_BUTTONS}"
        )
    return found.of_buttons(int(count))


@cache
def _read(name: str) -> Rock:
    """Rock of a file; these files are our own, and a test reads them all."""
    tree = read_stored("rock", name, rocks(), _HERE)
    numbers, breaking = (
        tuple(Number(key, **one) for key, one in tree.get(part, {}).items())
        for part in ("parameters", "craters")
    )
    strength = Number("strength", **tree["strength"]) if "strength" in tree else None
    known = {"strength": strength, "breaking": breaking, "source": tree["source"]}
    return Rock(name, **tree["rock"], numbers=numbers, **known)
