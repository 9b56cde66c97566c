"""Parts that are compiled, in the order of their numbers in the library."""

from __future__ import annotations

from fmu_src.parts import (
    controller,
    drill_string,
    rig_feed,
    rock_profile,
    supply,
    wave_string,
)

COMPILED = (
    rig_feed.TABLE,
    rock_profile.TABLE,
    controller.TABLE,
    supply.TABLE,
    drill_string.TABLE,
    wave_string.TABLE,
)
