"""Reading a state of the blow map: closed forms, nothing is moved."""

from __future__ import annotations

from percussion_model.physics.kernel import kernel
from percussion_model.physics.records import SAMPLE_FIELDS, Mode
from percussion_model.solvers.blow_map.flight import acceleration, bit_at

SHORT = len(SAMPLE_FIELDS)


@kernel
def read(pars, states, t, row):
    """Fill a row (`SAMPLE_FIELDS`, or `LONG_SAMPLE_FIELDS` where it is long) at `t`.

    The bit is a rigid body on the path of the table. Its force is the static one, and
    what a blow gives to bodies and ledger is theirs from the start of the blow on.

    Parameters
    ----------
    pars, states : arrays of BLOW_PAR and BLOW_STATE of length 1
        A record by itself takes Python longer to pass than all of this.
    """
    par = pars[0]
    s = states[0]
    since = t - s.t
    a = acceleration(par, s)
    drive = s.alpha * s.drive_force
    static = s.feed + par.mass_b * par.gravity
    x, v_b = bit_at(s, t)
    way = since * (s.v + 0.5 * a * since)
    y = s.y + way
    v_p = s.v + a * since
    u_r = y - x
    if u_r > 0.0:
        # within the contacts of a blow there is no flight yet: the piston is at the bit
        u_r = 0.0
        y = x
    row[0] = t
    row[1] = s.x_rest + y + par.gap
    row[2] = v_p
    row[3] = row[5] = s.x_rest + x
    row[4] = row[6] = v_b
    row[7] = -u_r
    row[8] = u_r
    row[9] = static / s.k_r
    row[10] = static
    row[11] = 0.0
    row[12] = drive
    row[13] = Mode.SS if t - s.t_blow >= s.rest else Mode.FF
    row[14] = 0.5 * par.mass_b * v_b * v_b
    row[15] = s.i_bit + static * since
    row[16] = s.i_contact
    row[17] = s.i_drive + drive * since
    if len(row) <= SHORT:
        return
    row[18] = max(s.peak_bit, static)
    row[19] = s.peak_contact
    row[20] = s.e_drive + drive * way
    row[21] = s.e_feed
    row[22] = s.e_gravity + par.mass_p * par.gravity * way
    row[23] = s.e_crushing
    row[24] = s.e_barrier
    row[25] = s.e_standstill
    row[26] = s.e_loss
    row[27] = s.e_contact
    row[28] = s.e_numerical
    row[29] = s.e_overshoot
    row[30] = s.e_start
    row[31] = 0.5 * par.mass_p * v_p * v_p
    row[32] = 0.0
    row[33] = static * static / (2.0 * par.gamma * s.k_r)
