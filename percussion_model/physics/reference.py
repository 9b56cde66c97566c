"""Named tuples that kernels pass on by address: an array costs nine words to pass otherwise."""

from __future__ import annotations

from percussion_model.physics.kernel import when_compiling


def refer(value):
    """The address of a named tuple, for as long as the kernel that asks for it runs."""
    return value


def _teach():
    from percussion_model.physics import reference_types
    from percussion_model.physics.compiling import instruct

    instruct(refer, reference_types.refer)


when_compiling(_teach)
