"""Outputs of the hammer from its motion, in the order of the FMU's outputs."""

from __future__ import annotations

import numpy as np

from fmu_src.hammer.motion import INSTANT, NO_CONTACT
from fmu_src.hammer.outputs import OUTPUTS, OfBlow, Sample
from fmu_src.native.motion import (
    rate_decay,
    read,
    read_stress,
    settle_before,
)
from percussion_model.engine.layout import last_blow, motion_of
from percussion_model.physics.kernel import preparing
from percussion_model.physics.ledger import DISSIPATED, NUMERICAL, STORED, WORKS
from percussion_model.physics.records import BLOW, READING, Mode
from percussion_model.solvers.state import words_of

# Flags of a reading, as the shell has them (fmu_src/native/shell.h).
WITH_PEAKS, WITH_STRESS, TO_SAVE = 1, 2, 4

_WORD, _BLOW_WORD = words_of(READING), words_of(BLOW)
# Words of a reading by the entry of the ledger that they are.
_START = _WORD["e_start"]
_WORKS = tuple(_WORD[f"e_{name}"] for name in WORKS)
_DISSIPATED = tuple(_WORD[f"e_{name}"] for name in DISSIPATED)
_NUMERICAL = tuple(_WORD[f"e_{name}"] for name in NUMERICAL)
_STORED = tuple(_WORD[name if name in _WORD else f"e_{name}"] for name in STORED)

AT = {name: k for k, name in enumerate(OUTPUTS)}
OUTPUT_COUNT = len(AT)
# Places of outputs that are a field of what is read, or of the last blow; the word, and the sign.
_SOURCES = {name: one.source for name, one in OUTPUTS.items()}
_READ = tuple(
    (AT[name], _WORD[of.field], of.sign) for name, of in _SOURCES.items() if isinstance(of, Sample)
)
_OF_BLOW = tuple(
    (AT[name], _BLOW_WORD[of.field]) for name, of in _SOURCES.items() if isinstance(of, OfBlow)
)
RATE, FREQUENCY, EFFICIENCY = (
    AT[name] for name in ("rate_of_penetration", "blow_frequency", "transfer_efficiency")
)
BIT_MEAN, CONTACT_MEAN = AT["bit.force_mean"], AT["contact.force_mean"]
BIT_PEAK, CONTACT_PEAK = AT["bit.force_peak"], AT["contact.force_peak"]
STRESS, RESIDUAL = AT["gauge_stress"], AT["energy_residual"]
BLOWS, OFF_BOTTOM = AT["blow_count"], AT["off_bottom"]


@preparing
def defined(value):
    """A number, 0 where it is not defined."""
    return value if value == value else 0.0


@preparing
def sum_of(seen, words):
    """Sum of some numbers of a reading."""
    total = 0.0
    for word in words:
        total += defined(seen[word])
    return total


@preparing
def energy_put_in(seen):
    """Energy put in so far, to which what is unexplained is compared [J]."""
    moved = 0.0
    for word in _WORKS:
        moved += abs(defined(seen[word]))
    return abs(defined(seen[_START])) + moved


@preparing
def residual(reading):
    """Share of the energy put in that the ledger leaves unexplained."""
    seen = reading.view(np.float64)
    rest = defined(seen[_START]) + sum_of(seen, _WORKS) - sum_of(seen, _STORED)
    rest = rest - sum_of(seen, _DISSIPATED) - sum_of(seen, _NUMERICAL)
    scale = energy_put_in(seen)
    return rest / scale if scale > 0.0 else 0.0


@preparing
def numerical(reading):
    """Share of the energy put in that the discretisation took."""
    seen = reading.view(np.float64)
    scale = energy_put_in(seen)
    return defined(seen[_NUMERICAL[0]]) / scale if scale > 0.0 else 0.0


@preparing
def mean_force(motion, impulse, before, force):
    """Mean force over the last step, by the impulses at its end and start; or that now [N]."""
    if 0.0 < motion.step_size < INSTANT:
        return force
    return (impulse - before) / motion.step_size if motion.step_size != 0.0 else 0.0


@preparing
def fill_outputs(base, flags, out):
    """Fill the outputs; peaks and stress only where they are asked for."""
    if flags & TO_SAVE:
        # what was read is no part of a saved state: another may come to stand here
        settle_before(base)
        motion_of(base).is_read = 0
        return
    peaks = flags & WITH_PEAKS != 0
    motion, reading, blow = motion_of(base), read(base, peaks), last_blow(base)[0]
    row = reading[0]
    settle_before(base)
    seen, hit = reading.view(np.float64), last_blow(base).view(np.float64)
    for at, word, sign in _READ:
        out[at] = sign * defined(seen[word])
    for at, word in _OF_BLOW:
        out[at] = defined(hit[word])
    share = rate_decay(base)
    out[RATE] = share * defined(blow.hole_advance) / blow.period if share > 0.0 else 0.0
    out[FREQUENCY] = share / blow.period if share > 0.0 else 0.0
    energy = blow.blow_energy
    out[EFFICIENCY] = defined(blow.rock_energy) / energy if energy > 0.0 else 0.0
    bit_force, contact_force = defined(row.bit_force), defined(row.contact_force)
    out[BIT_MEAN] = mean_force(motion, row.bit_impulse, motion.before[0], bit_force)
    out[CONTACT_MEAN] = mean_force(motion, row.contact_impulse, motion.before[1], contact_force)
    out[BIT_PEAK] = defined(row.peak_bit_force)
    out[CONTACT_PEAK] = defined(row.peak_contact_force)
    if peaks and 0.0 < motion.step_size < INSTANT:
        out[BIT_PEAK] = max(out[BIT_PEAK], bit_force)
        out[CONTACT_PEAK] = max(out[CONTACT_PEAK], contact_force)
    if flags & WITH_STRESS:
        out[STRESS] = read_stress(base)
    out[RESIDUAL] = residual(reading)
    out[BLOWS] = motion.blow_count
    free = int(row.drilling_mode) == Mode.FF
    out[OFF_BOTTOM] = free and abs(row.bit_impulse - motion.before[0]) < NO_CONTACT
