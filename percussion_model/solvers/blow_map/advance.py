"""Blows out of a table, and closed-form flight between them (docs/fidelity.md)."""

from __future__ import annotations

from percussion_model.physics.blows import close_gap, open_gap, start_blow
from percussion_model.physics.body import (
    bit_load,
    book_bit_load,
    book_piston_load,
    piston_acceleration,
)
from percussion_model.physics.drive import drive_force, turn_drive
from percussion_model.physics.elementary import log
from percussion_model.physics.kernel import kernel
from percussion_model.physics.records import Status
from percussion_model.solvers.blow_map.flight import PIECES, bit_at, move, plan
from percussion_model.solvers.blow_map.records import (
    ENTRIES,
    Axis,
    Entry,
    Next,
    Refusal,
)

# Rows of the event list that one event can fill.
ROWS = 3


@kernel
def cell_and_share(par, axis, value, count):
    """Cell of an axis that holds a value, and the share of it that lies before."""
    at = (log(value) - par.origin[axis]) / par.step[axis]
    cell = int(min(max(at, 0.0), count - 2.0))  # as numbers: far outside there is no whole one
    return cell, min(max(at - cell, 0.0), 1.0)


@kernel
def find_blow(par, table, found, k_r, v, load, drive):
    """Interpolate the table linearly in the logarithms of its coordinates.

    Counts are those of the nearest node; the time of rest and that of the
    last opening are the latest of the nodes around.

    Parameters
    ----------
    table : float array, shape (nodes of each axis, ENTRIES)
    found : float array, shape (ENTRIES,)
        Filled, in the scales of the table.
    k_r, v, load, drive : float
        Coordinates (`Axis`).
    """
    i, a = cell_and_share(par, Axis.STIFFNESS, k_r, table.shape[0])
    j, b = cell_and_share(par, Axis.VELOCITY, v, table.shape[1])
    k, c = cell_and_share(par, Axis.LOAD, load, table.shape[2])
    m, d = cell_and_share(par, Axis.DRIVE, drive, table.shape[3])
    for e in range(ENTRIES):
        found[e] = 0.0
    rest = 0.0
    opened = 0.0
    best = -1.0
    contacts = 0.0
    cycles = 0.0
    for corner in range(16):
        di, dj, dk, dm = (corner >> 3) & 1, (corner >> 2) & 1, (corner >> 1) & 1, corner & 1
        weight = (a if di else 1.0 - a) * (b if dj else 1.0 - b)
        weight *= (c if dk else 1.0 - c) * (d if dm else 1.0 - d)
        if weight <= 0.0:
            continue
        node = table[i + di, j + dj, k + dk, m + dm]
        for e in range(ENTRIES):
            found[e] += weight * node[e]
        rest = max(rest, node[Entry.REST])
        opened = max(opened, node[Entry.OPENED])
        if weight > best:
            best = weight
            contacts = node[Entry.CONTACTS]
            cycles = node[Entry.CYCLES]
    found[Entry.REST] = rest
    found[Entry.OPENED] = opened
    found[Entry.CONTACTS] = contacts
    found[Entry.CYCLES] = cycles


@kernel
def refuse(s, reason, value):
    """Note why there is no answer."""
    s.refusal = reason
    s.refused_value = value
    return Status.REFUSED


@kernel
def check_range(par, s, v):
    """Look whether an impact lies in the table; `REFUSED` if not."""
    if not par.lowest[Axis.VELOCITY] <= v <= par.highest[Axis.VELOCITY]:
        return refuse(s, Refusal.VELOCITY, v)
    if not par.lowest[Axis.STIFFNESS] <= s.next_k_r <= par.highest[Axis.STIFFNESS]:
        return refuse(s, Refusal.STIFFNESS, s.next_k_r)
    if not par.lowest[Axis.LOAD] <= s.feed <= par.highest[Axis.LOAD]:
        return refuse(s, Refusal.FEED, s.feed)
    if not par.lowest[Axis.DRIVE] <= s.drive_force <= par.highest[Axis.DRIVE]:
        return refuse(s, Refusal.DRIVE, s.drive_force)
    return Status.DONE


@kernel
def apply_blow(par, s, found, v):
    """Let the blow of `found` act on bit, piston and ledger from the present time on."""
    s.t_blow = s.t
    s.penetration = v * found[Entry.PENETRATION]
    s.rest = found[Entry.REST]
    s.opened = found[Entry.OPENED]
    for k in range(PIECES):
        s.path[k] = v * found[Entry.PATH + k]
    s.y = v * found[Entry.OFFSET]
    s.v_p = v * found[Entry.REBOUND]
    crushing, barrier = v * v * found[Entry.CRUSHING], v * v * found[Entry.BARRIER]
    standstill = v * v * found[Entry.STANDSTILL]
    s.rock_work = crushing + barrier + standstill
    s.b_rock0 = 0.0  # counted from each blow on, which keeps the digits
    s.b_peak_contact = v * found[Entry.PEAK_CONTACT]
    s.b_peak_bit = v * found[Entry.PEAK_BIT]
    s.b_cycles = int(found[Entry.CYCLES])
    impulse = par.mass_p * (v - s.v_p)
    s.i_contact += impulse
    s.i_bit += impulse
    # The flight is carried back to the start of the blow, where it begins at y and not
    # at 0: the works on that way are missing in what `move` adds.
    book_piston_load(par, s, -s.drive_force, s.y, 0.0)
    book_bit_load(par, s, s.penetration)
    s.e_crushing += crushing
    s.e_barrier += barrier
    s.e_standstill += standstill
    s.e_loss += v * v * found[Entry.LOSS]
    s.e_numerical += v * v * found[Entry.NUMERICAL]
    if s.t >= s.peak_from:
        s.peak_bit_force = max(s.peak_bit_force, s.b_peak_bit)
        s.peak_contact_force = max(s.peak_contact_force, s.b_peak_contact)


@kernel
def strike(par, s, table, found, t):
    """Find the blow of the piston that strikes the bit at `t`, or refuse."""
    v = s.v_p + piston_acceleration(par, drive_force(par, s)) * (t - s.t)
    status = check_range(par, s, v)
    if status != Status.DONE:
        return status
    if not t - s.t_blow >= s.rest:
        return refuse(s, Refusal.MOVING, t - s.t_blow)
    find_blow(par, table, found, s.next_k_r, v, bit_load(par, s) / v, s.drive_force / v)
    if not found[Entry.PENETRATION] == found[Entry.PENETRATION]:
        return refuse(s, Refusal.FEED, s.feed)
    return Status.DONE


@kernel
def process_event(par, s, table, found, blows, events):
    """Process what ends the present piece of flight; a `Status`."""
    t = s.t_next
    if s.next == Next.TURN:
        if t < s.t_blow + s.opened:
            return refuse(s, Refusal.TURNED, s.reversal)
        s.p = bit_at(s, t)[0]
        move(par, s, t)
        turn_drive(s, events, t, -s.reversal)
    elif s.next == Next.IMPACT:
        status = strike(par, s, table, found, t)
        if status != Status.DONE:
            return status
        move(par, s, t)
        v = s.v_p
        s.x_r += s.penetration
        s.p = 0.0
        start_blow(par, s, blows, t, v, s.x_r, bit_load(par, s))
        apply_blow(par, s, found, v)
        turn_drive(s, events, t, 0.0)
        close_gap(s, events, t, v)
        s.b_contacts = int(found[Entry.CONTACTS])
        opened = t + s.opened
        s.p = bit_at(s, opened)[0]
        rebound = s.v_p + piston_acceleration(par, drive_force(par, s)) * s.opened
        open_gap(s, events, opened, rebound)
        s.b_rebound = rebound
    else:
        return refuse(s, Refusal.FALLEN, s.drive_force)
    plan(par, s)
    return Status.DONE


@kernel
def advance(pars, states, table, found, t, blows, events):
    """Process all that happens up to `t`; a `Status`.

    Parameters
    ----------
    pars, states : arrays of MAP_PAR and MAP_STATE of length 1
    table, found : float array
        As in `find_blow`.
    t : float
        [s]
    blows, events : arrays of BLOW and EVENT
        Filled from index 0; the state says how far.
    """
    par = pars[0]
    s = states[0]
    s.n_blows = 0
    s.n_events = 0
    while s.t_next <= t:
        if s.n_blows == len(blows):
            return Status.BLOWS_FULL
        if s.events_on == 1 and s.n_events + ROWS > len(events):
            return Status.EVENTS_FULL
        status = process_event(par, s, table, found, blows, events)
        if status != Status.DONE:
            return status
    return Status.DONE
