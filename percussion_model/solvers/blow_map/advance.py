"""Blows out of a table, and closed-form flight between them (docs/fidelity.md)."""

from __future__ import annotations

import math

from percussion_model.physics.kernel import kernel
from percussion_model.physics.records import EventKind, Mode, Status
from percussion_model.solvers.blow_map.flight import bit_at, move, plan
from percussion_model.solvers.blow_map.records import (
    ENTRIES,
    PATH_TIMES,
    Axis,
    Entry,
    Next,
    Refusal,
)

STIFFNESS, VELOCITY = int(Axis.STIFFNESS), int(Axis.VELOCITY)
LOAD, DRIVE = int(Axis.LOAD), int(Axis.DRIVE)
TURN, IMPACT = int(Next.TURN), int(Next.IMPACT)
DONE, BLOWS_FULL, EVENTS_FULL = int(Status.DONE), int(Status.BLOWS_FULL), int(Status.EVENTS_FULL)
REFUSED = int(Status.REFUSED)
OUT_STIFFNESS, OUT_VELOCITY = int(Refusal.STIFFNESS), int(Refusal.VELOCITY)
OUT_FEED, OUT_DRIVE = int(Refusal.FEED), int(Refusal.DRIVE)
MOVING, TURNED, FALLEN = int(Refusal.MOVING), int(Refusal.TURNED), int(Refusal.FALLEN)
CLOSED, OPENED = int(EventKind.CONTACT_CLOSED), int(EventKind.CONTACT_OPENED)
UP, DOWN = int(EventKind.DRIVE_UP), int(EventKind.DRIVE_DOWN)
FF, SS = int(Mode.FF), int(Mode.SS)

E_PENETRATION, E_REBOUND, E_OFFSET = (
    int(Entry.PENETRATION),
    int(Entry.REBOUND),
    int(Entry.OFFSET),
)
E_REST, E_OPENED = int(Entry.REST), int(Entry.OPENED)
E_CONTACTS, E_CYCLES = int(Entry.CONTACTS), int(Entry.CYCLES)
E_PEAK_CONTACT, E_PEAK_BIT = int(Entry.PEAK_CONTACT), int(Entry.PEAK_BIT)
E_CRUSHING, E_BARRIER = int(Entry.CRUSHING), int(Entry.BARRIER)
E_STANDSTILL, E_LOSS, E_NUMERICAL = (
    int(Entry.STANDSTILL),
    int(Entry.LOSS),
    int(Entry.NUMERICAL),
)
E_PATH = int(Entry.PATH)
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
    i, a = place(par, STIFFNESS, k_r, table.shape[0])
    j, b = place(par, VELOCITY, v, table.shape[1])
    k, c = place(par, LOAD, load, table.shape[2])
    m, d = place(par, DRIVE, drive, table.shape[3])
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
        rest = max(rest, node[E_REST])
        opened = max(opened, node[E_OPENED])
        if weight > best:
            best = weight
            contacts = node[E_CONTACTS]
            cycles = node[E_CYCLES]
    found[E_REST] = rest
    found[E_OPENED] = opened
    found[E_CONTACTS] = contacts
    found[E_CYCLES] = cycles


@kernel
def refuse(s, reason, value):
    """Note why there is no answer."""
    s.refusal = reason
    s.refused_value = value
    return REFUSED


@kernel
def outside(par, s, v):
    """Look whether an impact lies in the table; `REFUSED` if not."""
    if not par.lowest[VELOCITY] <= v <= par.highest[VELOCITY]:
        return refuse(s, OUT_VELOCITY, v)
    if not par.lowest[STIFFNESS] <= s.k_r <= par.highest[STIFFNESS]:
        return refuse(s, OUT_STIFFNESS, s.k_r)
    if not par.lowest[LOAD] <= s.feed <= par.highest[LOAD]:
        return refuse(s, OUT_FEED, s.feed)
    if not par.lowest[DRIVE] <= s.drive_force <= par.highest[DRIVE]:
        return refuse(s, OUT_DRIVE, s.drive_force)
    return DONE


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
    s.penetration = v * found[E_PENETRATION]
    s.rest = found[E_REST]
    s.opened = found[E_OPENED]
    for k in range(PIECES):
        s.path[k] = v * found[E_PATH + k]
    s.y = v * found[E_OFFSET]
    s.v = v * found[E_REBOUND]
    s.alpha = -1.0
    static = s.feed + par.mass_b * par.gravity
    crushing, barrier = v * v * found[E_CRUSHING], v * v * found[E_BARRIER]
    standstill = v * v * found[E_STANDSTILL]
    s.b_started = 1.0
    s.b_time = s.t
    s.b_impact = v
    s.b_rebound = s.v + a * s.opened
    s.b_stroke = 0.0
    s.b_peak_contact = v * found[E_PEAK_CONTACT]
    s.b_peak_bit = v * found[E_PEAK_BIT]
    s.b_position = s.x_rest
    s.b_standstill = static
    s.b_rock = crushing + barrier + standstill
    s.b_contact = par.mass_p * (v - s.v)
    s.b_bit0 = s.i_bit
    s.b_drive0 = s.i_drive
    s.b_contacts = found[E_CONTACTS]
    s.b_cycles = found[E_CYCLES]
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
    s.e_loss += v * v * found[E_LOSS]
    s.e_numerical += v * v * found[E_NUMERICAL]
    if s.t >= s.peak_from:
        s.peak_bit = max(s.peak_bit, s.b_peak_bit)
        s.peak_contact = max(s.peak_contact, s.b_peak_contact)


@kernel
def strike(par, s, table, found, t):
    """Let the piston strike the bit at `t`, or refuse and leave the state alone."""
    v = s.v + (par.gravity + s.alpha * s.drive_force / par.mass_p) * (t - s.t)
    status = outside(par, s, v)
    if status != DONE:
        return status
    if not t - s.t_blow >= s.rest:
        return refuse(s, MOVING, t - s.t_blow)
    load = (s.feed + par.mass_b * par.gravity) / v
    find_blow(par, table, found, s.k_r, v, load, s.drive_force / v)
    if not found[E_PENETRATION] == found[E_PENETRATION]:
        return refuse(s, OUT_FEED, s.feed)
    return DONE


@kernel
def happen(par, s, table, found, blows, n_blows, events, n_events, events_on):
    """Let what ends the present piece of flight happen.

    Returns
    -------
    status, n_blows, n_events : int
    """
    t = s.t_next
    position = s.x_rest + bit_at(s, t)[0]
    if s.next == TURN:
        if t < s.t_blow + s.opened:
            return refuse(s, TURNED, s.reversal), n_blows, n_events
        move(par, s, t)
        s.alpha = 1.0
        if events_on:
            n_events = push(s, events, n_events, t, DOWN, -s.reversal, position)
    elif s.next == IMPACT:
        status = strike(par, s, table, found, t)
        if status != DONE:
            return status, n_blows, n_events
        move(par, s, t)
        v = s.v
        s.x_rest += s.penetration
        if s.b_started > 0.0:
            finish_blow(par, s, blows[n_blows])
            n_blows += 1
        take_blow(par, s, found, v)
        if events_on:
            n_events = push(s, events, n_events, t, UP, 0.0, s.x_rest)
            n_events = push(s, events, n_events, t, CLOSED, v, s.x_rest)
            opened = t + s.opened
            position = s.x_rest + bit_at(s, opened)[0]
            n_events = push(s, events, n_events, opened, OPENED, s.b_rebound, position)
    else:
        return refuse(s, FALLEN, s.drive_force), n_blows, n_events
    plan(par, s)
    return DONE, n_blows, n_events


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
    status = DONE
    while status == DONE and s.t_next <= t:
        if n_blows == len(blows):
            status = BLOWS_FULL
        elif events_on and n_events + ROWS > len(events):
            status = EVENTS_FULL
        else:
            status, n_blows, n_events = happen(
                par, s, table, found, blows, n_blows, events, n_events, events_on
            )
    counts[0] = n_blows
    counts[1] = n_events
    return status
