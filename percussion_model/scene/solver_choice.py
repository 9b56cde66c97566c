"""Which solver computes elastic bars where a scene names none."""

from __future__ import annotations

from enum import IntEnum

# Modes are taken where the loss time is such a share of the shorter transit time, or more: below
# fronts stay sharp and ring (docs/modal.md, section 9).
LEAST_LOSS = 5e-4
# And where no bar is longer than so many times the other, by its transit time: it takes as
# many times the modes, whose tables fill a gigabyte.
MOST_UNLIKE = 16.0


class WhyWaves(IntEnum):
    """Why waves drill better than as many modes."""

    NOT = 0  # they do not
    WALL = 1
    NO_LOSS = 2
    UNLIKE = 3
    LITTLE_LOSS = 4


REASONS = {
    WhyWaves.NOT: "",
    WhyWaves.WALL: "the rock is a wall",
    WhyWaves.NO_LOSS: "loss is off",
    WhyWaves.UNLIKE: f"one bar is more than {MOST_UNLIKE:g} times as long by transit time",
    WhyWaves.LITTLE_LOSS: f"loss.time is below {LEAST_LOSS:g} of the shorter transit time",
}


def why_waves(
    is_wall: bool,
    has_loss: bool,
    loss_time: float,
    piston: float,
    bit: float,
) -> WhyWaves:
    """Tell why waves drill better than as many modes.

    Parameters
    ----------
    is_wall, has_loss : bool
        Of the rock, and of the bars.
    loss_time : float
        [s]
    piston, bit : float
        Transit times [s]; without an elastic piston that of the bit twice.
    """
    if is_wall:
        return WhyWaves.WALL
    if not has_loss:
        return WhyWaves.NO_LOSS
    if max(piston, bit) > MOST_UNLIKE * min(piston, bit):
        return WhyWaves.UNLIKE
    return WhyWaves.LITTLE_LOSS if loss_time < LEAST_LOSS * min(piston, bit) else WhyWaves.NOT
