"""Entries of solvers that have no tables to share, and read fields without shapes."""

from __future__ import annotations

from percussion_model.physics.kernel import preparing


@preparing
def table_key(image, key):
    """0: tables follow from nothing that other scenes have as well."""
    return 0


@preparing
def shape_form(base, moving, bar):
    """-1: no shapes are needed."""
    return -1


@preparing
def shapes(image, bar, form, out):
    """0: there are none."""
    return 0
