"""Texts with numbers in them as templates, whose numbers others fill in."""

from __future__ import annotations

from collections.abc import Iterator


class Fact(float):
    """A number that writes itself as a place for a fact, to turn a text into a template.

    What is computed of it is the same fact: kernels give facts as they are to be written.
    """

    place: int

    def __new__(cls, place: int, value: float) -> Fact:
        """Make a fact that is compared as a value."""
        fact = super().__new__(cls, value)
        fact.place = place
        return fact

    def __format__(self, form: str) -> str:
        return f"{{{self.place}:{form}}}" if form else f"{{{self.place}}}"

    def __rmul__(self, factor: float) -> Fact:
        return Fact(self.place, float(self) * factor)

    def __truediv__(self, other: float) -> Fact:
        return Fact(self.place, float(self) / other)


def only(texts: Iterator[str]) -> str:
    """The one text that there is."""
    (text,) = texts
    return text
