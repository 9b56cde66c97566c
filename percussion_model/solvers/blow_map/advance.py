"""Blows out of a table, and closed-form flight between them (docs/fidelity.md)."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel
from percussion_model.physics.records import EventKind, Status
from percussion_model.solvers.blow_map.flight import bit_at, move, plan
from percussion_model.solvers.blow_map.records import (
    ENTRIES,
    PATH_TIMES,
    Axis,
    Entry,
    Next,
    Refusal,
)

PIECES = len(PATH_TIMES)
# Rows of the event list that one call of `happen` can fill.
ROWS = 3


@kernel
def place(par, axis, value, count):
    """Cell of an axis that holds a value, and the share of it that lies before."""
    at = (math.log(value) - par.origin[axis]) / par.step[axis]
    cell = min(max(int(at), 0), count - 2)
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
    i, a = place(par, Axis.STIFFNESS, k_r, table.shape[0])
    j, b = place(par, Axis.VELOCITY, v, table.shape[1])
    k, c = place(par, Axis.LOAD, load, table.shape[2])
    m, d = place(par, Axis.DRIVE, drive, table.shape[3])
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
def outside(par, s, v):
    """Look whether an impact lies in the table; `REFUSED` if not."""
    if not par.lowest[Axis.VELOCITY] <= v <= par.highest[Axis.VELOCITY]:
        return refuse(s, Refusal.VELOCITY, v)
    if not par.lowest[Axis.STIFFNESS] <= s.k_r <= par.highest[Axis.STIFFNESS]:
        return refuse(s, Refusal.STIFFNESS, s.k_r)
    if not par.lowest[Axis.LOAD] <= s.feed <= par.highest[Axis.LOAD]:
        return refuse(s, Refusal.FEED, s.feed)
    if not par.lowest[Axis.DRIVE] <= s.drive_force <= par.highest[Axis.DRIVE]:
        return refuse(s, Refusal.DRIVE, s.drive_force)
    return Status.DONE


@kernel
def push(s, events, n, time, kind, value, position):
    """Append a row to the event list."""
    s.count_events += 1
    row = events[n]
    row.time = time
    row.kind = kind
    row.value = value
    row.bit_position = position
    return n + 1


@kernel
def finish_blow(par, s, row):
    """Write the row of the blow that ends at the present impact."""
    row.time = s.b_time
    row.period = s.t - s.b_time
    row.impact_velocity = s.b_impact
    row.rebound_velocity = s.b_rebound
    row.stroke = s.b_stroke
    row.blow_energy = 0.5 * par.mass_p * s.b_impact * s.b_impact
    row.rock_energy = s.b_rock
    row.penetration = s.x_rest - s.b_position
    row.bit_position = s.b_position
    row.peak_contact_force = s.b_peak_contact
    row.peak_bit_force = s.b_peak_bit
    row.standstill_force = s.b_standstill
    row.contact_impulse = s.b_contact
    row.bit_impulse = s.i_bit - s.b_bit0
    row.drive_impulse = s.i_drive - s.b_drive0
    row.contacts = int(s.b_contacts)
    row.drilling_cycles = int(s.b_cycles)


@kernel
def take_blow(par, s, found, v):
    """Let the blow of `found` begin at the present time."""
    a = par.gravity - s.drive_force / par.mass_p
    s.t_blow = s.t
    s.penetration = v * found[Entry.PENETRATION]
    s.rest = found[Entry.REST]
    s.opened = found[Entry.OPENED]
    for k in range(PIECES):
        s.path[k] = v * found[Entry.PATH + k]
    s.y = v * found[Entry.OFFSET]
    s.v = v * found[Entry.REBOUND]
    s.alpha = -1.0
    static = s.feed + par.mass_b * par.gravity
    crushing, barrier = v * v * found[Entry.CRUSHING], v * v * found[Entry.BARRIER]
    standstill = v * v * found[Entry.STANDSTILL]
    s.b_started = 1.0
    s.b_time = s.t
    s.b_impact = v
    s.b_rebound = s.v + a * s.opened
    s.b_stroke = 0.0
    s.b_peak_contact = v * found[Entry.PEAK_CONTACT]
    s.b_peak_bit = v * found[Entry.PEAK_BIT]
    s.b_position = s.x_rest
    s.b_standstill = static
    s.b_rock = crushing + barrier + standstill
    s.b_contact = par.mass_p * (v - s.v)
    s.b_bit0 = s.i_bit
    s.b_drive0 = s.i_drive
    s.b_contacts = found[Entry.CONTACTS]
    s.b_cycles = found[Entry.CYCLES]
    s.count_blows += 1
    s.i_contact += s.b_contact
    s.i_bit += s.b_contact
    # The flight is carried back to the start of the blow, where it begins at y and not
    # at 0: the works on that way are missing in what `move` adds.
    s.e_drive += s.y * -s.drive_force
    s.e_gravity += s.y * par.mass_p * par.gravity
    s.e_gravity += par.mass_b * par.gravity * s.penetration
    s.e_feed += s.feed * s.penetration
    s.e_crushing += crushing
    s.e_barrier += barrier
    s.e_standstill += standstill
    s.e_loss += v * v * found[Entry.LOSS]
    s.e_numerical += v * v * found[Entry.NUMERICAL]
    if s.t >= s.peak_from:
        s.peak_bit = max(s.peak_bit, s.b_peak_bit)
        s.peak_contact = max(s.peak_contact, s.b_peak_contact)


@kernel
def strike(par, s, table, found, t):
    """Let the piston strike the bit at `t`, or refuse and leave the state alone."""
    v = s.v + (par.gravity + s.alpha * s.drive_force / par.mass_p) * (t - s.t)
    status = outside(par, s, v)
    if status != Status.DONE:
        return status
    if not t - s.t_blow >= s.rest:
        return refuse(s, Refusal.MOVING, t - s.t_blow)
    load = (s.feed + par.mass_b * par.gravity) / v
    find_blow(par, table, found, s.k_r, v, load, s.drive_force / v)
    if not found[Entry.PENETRATION] == found[Entry.PENETRATION]:
        return refuse(s, Refusal.FEED, s.feed)
    return Status.DONE


@kernel
def happen(par, s, table, found, blows, n_blows, events, n_events, events_on):
    """Let what ends the present piece of flight happen.

    Returns
    -------
    status, n_blows, n_events : int
    """
    t = s.t_next
    position = s.x_rest + bit_at(s, t)[0]
    if s.next == Next.TURN:
        if t < s.t_blow + s.opened:
            return refuse(s, Refusal.TURNED, s.reversal), n_blows, n_events
        move(par, s, t)
        s.alpha = 1.0
        if events_on:
            n_events = push(s, events, n_events, t, EventKind.DRIVE_DOWN, -s.reversal, position)
    elif s.next == Next.IMPACT:
        status = strike(par, s, table, found, t)
        if status != Status.DONE:
            return status, n_blows, n_events
        move(par, s, t)
        v = s.v
        s.x_rest += s.penetration
        if s.b_started > 0.0:
            finish_blow(par, s, blows[n_blows])
            n_blows += 1
        take_blow(par, s, found, v)
        if events_on:
            n_events = push(s, events, n_events, t, EventKind.DRIVE_UP, 0.0, s.x_rest)
            n_events = push(s, events, n_events, t, EventKind.CONTACT_CLOSED, v, s.x_rest)
            opened = t + s.opened
            position = s.x_rest + bit_at(s, opened)[0]
            n_events = push(
                s, events, n_events, opened, EventKind.CONTACT_OPENED, s.b_rebound, position
            )
    else:
        return refuse(s, Refusal.FALLEN, s.drive_force), n_blows, n_events
    plan(par, s)
    return Status.DONE, n_blows, n_events


@kernel
def advance(pars, states, table, found, t, blows, events, events_on, counts):
    """Let all that happens up to `t` happen; `counts` gets the rows filled.

    Parameters
    ----------
    pars, states : arrays of BLOW_PAR and BLOW_STATE of length 1
    """
    par = pars[0]
    s = states[0]
    n_blows = 0
    n_events = 0
    status = Status.DONE
    while status == Status.DONE and s.t_next <= t:
        if n_blows == len(blows):
            status = Status.BLOWS_FULL
        elif events_on and n_events + ROWS > len(events):
            status = Status.EVENTS_FULL
        else:
            status, n_blows, n_events = happen(
                par, s, table, found, blows, n_blows, events, n_events, events_on
            )
    counts[0] = n_blows
    counts[1] = n_events
    return status
