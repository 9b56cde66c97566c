"""A second solver: the percussive drill as two chains of point masses and springs.

It shares nothing with the library but the model. Each bar is a row of springs between lumped
masses (half masses at the ends) with true Kelvin-Voigt loss in every spring, the piston/bit
contact is a penalty spring, and time is integrated by velocity Verlet whose damping force sees
the predicted velocity: explicit, of second order, one force evaluation a step. A step in which a
state changes is cut just behind the change, found by bisection on the length of the step.

Errors fall with the square of the element length and of the step, and with 1/contact_stiffness
(the contact acts as a bar of length EA/contact_stiffness put between piston and bit).

    python lumped_chain.py --piston-elements 50 --bit-elements 58
"""

import argparse
import dataclasses
import json
import math
import typing

import numba
import numpy as np

FREE, DISSIPATIVE, FORWARD, BACKWARD, STANDSTILL = range(5)
CONTACT_EVENT, DRIVE_EVENT, ROCK_EVENT = 1, 2, 4
REST_SPEED = 1e-9  # m/s; a bit that leaves standstill slower than this starts a drilling cycle
MAX_SPEED = 30.0  # m/s; bound of the mean relative speed: how long the drive need not look
LOG_CONTACT, LOG_DRIVE, LOG_ROCK = 0.0, 1.0, 2.0


class Drill(typing.NamedTuple):
    """What the kernel needs to know, SI units; the defaults are the reference drill."""

    piston_elements: int = 50
    bit_elements: int = 58
    area: float = 5.5e-3
    youngs_modulus: float = 210e9
    density: float = 7850.0
    piston_length: float = 0.175
    bit_length: float = 0.20125
    loss_time: float = 2 * 0.5 * (0.20125 / 58) / math.sqrt(12 * 210e9 / 7850)
    contact_stiffness: float = 1e12
    gravity: float = 10.0
    feed: float = 2500.0
    drive_force: float = 3000.0
    switch_distance: float = 0.040
    rock_stiffness: float = 7.5e8
    unloading_ratio: float = 5.0
    rock_damping: float = 1e4
    barrier_energy: float = 0.05
    start_speed: float = 10.0
    start_gap: float = 1e-5
    start_rock_gap: float = 1e-5

    @property
    def stable_step(self) -> float:
        """A stable step: elastic limit of chain and contact spring, viscous limit of the chain."""
        wave = math.sqrt(self.youngs_modulus / self.density)
        element = min(
            self.piston_length / self.piston_elements, self.bit_length / self.bit_elements
        )
        end_mass = self.density * self.area * element / 2
        elastic = (2 * wave / element) ** 2
        highest = math.sqrt(elastic + 2 * self.contact_stiffness / end_mass)
        return 1 / (highest / 2 + self.loss_time * elastic)


@numba.njit(fastmath={"reassoc", "contract", "nsz"}, error_model="numpy")
def advance(h, n, old, new, w, loss, stiff, accel, end, contact, rock):
    """One step of velocity Verlet from `old` to `new`; rows are displacement, velocity, force/mass.

    `n` counts the piston's nodes; `stiff` is k/m of each bar, `accel` its body force per mass and
    `end` one over the mass of its end nodes. `rock` is (stiffness, damping, place of no force).
    """
    u, v, a = old[0], old[1], old[2]
    u1, v1, a1 = new[0], new[1], new[2]
    m = u.size
    for i in range(m):
        u1[i] = u[i] + h * (v[i] + 0.5 * h * a[i])
        w[i] = u1[i] + loss * (v[i] + h * a[i])
    for i in range(n - 2):  # counting from zero spares numba's wrap-around of negative indices
        a1[i + 1] = accel[0] + stiff[0] * (w[i + 2] - 2 * w[i + 1] + w[i])
    w2, a2 = w[n:], a1[n:]
    for i in range(m - n - 2):
        a2[i + 1] = accel[1] + stiff[1] * (w2[i + 2] - 2 * w2[i + 1] + w2[i])
    push = contact[0] * max(0.0, u1[n - 1] - u1[n] - contact[1])
    rock_force = rock[0] * (u1[m - 1] - rock[2]) + rock[1] * (v[m - 1] + h * a[m - 1])
    a1[0] = accel[0] + 2 * stiff[0] * (w[1] - w[0])
    a1[n - 1] = accel[0] - 2 * stiff[0] * (w[n - 1] - w[n - 2]) - push * end[0]
    a1[n] = accel[1] + 2 * stiff[1] * (w[n + 1] - w[n]) + push * end[1]
    a1[m - 1] = accel[1] - 2 * stiff[1] * (w[m - 1] - w[m - 2]) - rock_force * end[1]
    for i in range(m):
        v1[i] = v[i] + 0.5 * h * (a[i] + a1[i])


@numba.njit(fastmath={"reassoc", "contract", "nsz"})
def mean(x):
    """Mean over a chain with half masses at its ends."""
    return (x.sum() - 0.5 * (x[0] + x[-1])) / (x.size - 1)


@numba.njit(fastmath={"reassoc", "contract", "nsz"})
def kinetic(v, mass):
    """Kinetic energy of a chain of total `mass`."""
    total = -0.5 * (v[0] ** 2 + v[-1] ** 2)
    for i in range(v.size):
        total += v[i] ** 2
    return 0.5 * mass / (v.size - 1) * total


@numba.njit
def rock_change(drill, mode, old, new, n, x_r, p_u, work, bit_mass):
    """Mode that follows from state `new`: the rock law's table of transitions."""
    p, rate, before = new[0, -1] - x_r, new[1, -1], old[1, -1]
    k_up = drill.unloading_ratio * drill.rock_stiffness
    barrier = drill.barrier_energy
    if mode == FREE:
        if p >= p_u and rate > 0:
            return DISSIPATIVE if kinetic(new[1, n:], bit_mass) > barrier else STANDSTILL
    elif mode == DISSIPATIVE:
        if before >= 0 and rate < 0:
            return BACKWARD
        if work >= barrier:
            return FORWARD
    elif mode == FORWARD:
        if rate < 0:
            return BACKWARD
    elif mode == BACKWARD:
        if p <= p_u:
            return FREE
        if rate > 0:
            return DISSIPATIVE if kinetic(new[1, n:], bit_mass) > barrier else STANDSTILL
    else:
        if k_up * (p - p_u) + drill.rock_damping * rate <= 0:
            return FREE
        if kinetic(new[1, n:], bit_mass) > barrier:
            return BACKWARD if rate < -REST_SPEED else DISSIPATIVE
    return mode


@numba.njit
def simulate(drill, step, duration, log):
    """Run the drill and fill `log` with rows (time, kind, detail, mean bit displacement).

    Returns the number of rows and of steps.
    """
    n = drill.piston_elements + 1
    m = n + drill.bit_elements + 1
    rho_a = drill.density * drill.area
    piston_mass, bit_mass = rho_a * drill.piston_length, rho_a * drill.bit_length
    squared_wave = drill.youngs_modulus / drill.density
    stiff = (
        squared_wave * (drill.piston_elements / drill.piston_length) ** 2,
        squared_wave * (drill.bit_elements / drill.bit_length) ** 2,
    )
    end = (2 * drill.piston_elements / piston_mass, 2 * drill.bit_elements / bit_mass)
    contact = (drill.contact_stiffness, drill.start_gap)
    k_up = drill.unloading_ratio * drill.rock_stiffness
    old, new, w = np.zeros((3, m)), np.zeros((3, m)), np.zeros(m)
    old[1, :n] = drill.start_speed

    mode, alpha, closed, rock = FREE, 1.0, False, (0.0, 0.0, 0.0)
    x_r, p_u, work = 0.0, drill.start_rock_gap, 0.0
    drive, pull = drill.drive_force / piston_mass, drill.gravity
    accel = (pull + alpha * drive, pull + drill.feed / bit_mass)
    old[2, :n], old[2, n:] = accel[0], accel[1]
    time, rows, steps, quiet = 0.0, 0, 0, 0

    while time < duration and rows < log.shape[0] - 8:
        low, high, h, found = 0.0, step, step, 0
        while True:
            advance(h, n, old, new, w, drill.loss_time, stiff, accel, end, contact, rock)
            steps += 1
            trial = work + 0.5 * h * drill.rock_damping * (old[1, -1] ** 2 + new[1, -1] ** 2)
            events = 0
            if (new[0, n - 1] - new[0, n] > drill.start_gap) != closed:
                events |= CONTACT_EVENT
            if quiet <= 0:
                relative = mean(new[0, :n]) - mean(new[0, n:]) - drill.start_gap
                if (relative >= 0) if alpha > 0 else (relative <= -drill.switch_distance):
                    events |= DRIVE_EVENT
            if rock_change(drill, mode, old, new, n, x_r, p_u, trial, bit_mass) != mode:
                events |= ROCK_EVENT
            # Bisect for the shortest step that still ends behind a change.
            if events:
                high, found = h, events
                if high - low < 1e-7 * step:
                    break
            elif h == step:
                break
            else:
                low = h
                if high - low < 1e-7 * step:
                    h = high
                    continue
            h = 0.5 * (low + high)
        events = found
        time += h
        if mode == DISSIPATIVE:
            work = trial
        if quiet <= 0 and not events & DRIVE_EVENT:
            room = -relative if alpha > 0 else relative + drill.switch_distance
            quiet = int(room / (MAX_SPEED * step))
        quiet -= 1

        if events:
            place = mean(new[0, n:])
            if events & CONTACT_EVENT:
                closed = not closed
                log[rows] = np.array((time, LOG_CONTACT, 1.0 if closed else 0.0, place))
                rows += 1
            if events & DRIVE_EVENT:
                alpha, quiet = -alpha, 0
                accel = (pull + alpha * drive, accel[1])
                log[rows] = np.array((time, LOG_DRIVE, alpha, place))
                rows += 1
            if events & ROCK_EVENT:
                following = rock_change(drill, mode, old, new, n, x_r, p_u, trial, bit_mass)
                p = new[0, -1] - x_r
                if following == DISSIPATIVE:
                    x_r += p if mode == FREE else p - drill.unloading_ratio * (p - p_u)
                    work = 0.0
                elif following == BACKWARD and mode != STANDSTILL:
                    p_u = p * (drill.unloading_ratio - 1) / drill.unloading_ratio
                mode = following
                loading = mode in (DISSIPATIVE, FORWARD)
                spring = 0.0 if mode == FREE else drill.rock_stiffness if loading else k_up
                dashpot = drill.rock_damping if mode in (DISSIPATIVE, STANDSTILL) else 0.0
                rock = (spring, dashpot, x_r if loading else x_r + p_u)
                log[rows] = np.array((time, LOG_ROCK, float(mode), place))
                rows += 1
            # Forces of the new state at the same instant: a step of no length.
            old, new = new, old
            advance(0.0, n, old, new, w, drill.loss_time, stiff, accel, end, contact, rock)
        old, new = new, old
    return rows, steps


@dataclasses.dataclass
class Answer:
    """Stationary answer over whole blows after settling."""

    rate_of_penetration: float  # m/s
    period: float  # s
    blows: int
    contacts_per_blow: float
    cycles_per_blow: float
    rate_spread: float  # standard deviation of the rate of single blows, m/s
    steps: int


def solve(drill: Drill, step: float, duration: float = 3.0, settle: float = 1.0) -> Answer:
    """Run `drill` and take its rate from the first to the last blow start after `settle`.

    A closure counts as a contact when the gap was open for one bar transit before: end masses
    chatter on the penalty spring while the fronts of a coarse chain ring.
    """
    log = np.zeros((int(2e5 * duration), 4))
    rows, steps = simulate(drill, step, duration, log)
    transit = drill.piston_length / math.sqrt(drill.youngs_modulus / drill.density)
    starts, contacts, cycles = [], [], []
    armed, opened = True, -math.inf
    for time, kind, detail, place in log[:rows]:
        if kind == LOG_DRIVE and detail > 0:
            armed = True
        elif kind == LOG_CONTACT and detail == 0:
            opened = time
        elif kind == LOG_CONTACT and time - opened > transit:
            if armed and time > settle:
                starts.append((time, place))
            armed = False
            contacts.append(time)
        elif kind == LOG_ROCK and detail == DISSIPATIVE:
            cycles.append(time)
    if len(starts) < 3:
        raise RuntimeError("fewer than three blows after settling")
    t, x = np.array(starts).T
    inside = [sum(t[0] <= s < t[-1] for s in what) / (t.size - 1) for what in (contacts, cycles)]
    rate = (x[-1] - x[0]) / (t[-1] - t[0])
    spread = float(np.std(np.diff(x) / np.diff(t)))
    period = (t[-1] - t[0]) / (t.size - 1)
    return Answer(float(rate), float(period), t.size - 1, *inside, spread, steps)


def main() -> None:
    """Print the answer of one run as a line of JSON; every parameter of the drill is an option."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    run = {"courant": 1.0, "duration": 3.0, "settle": 1.0}  # courant: step over stable_step
    for name, value in (Drill._field_defaults | run).items():
        parser.add_argument("--" + name.replace("_", "-"), type=type(value), default=value)
    args = vars(parser.parse_args())
    drill = Drill(**{name: args[name] for name in Drill._fields})
    step = args["courant"] * drill.stable_step
    answer = solve(drill, step, args["duration"], args["settle"])
    print(json.dumps(args | {"step": step} | dataclasses.asdict(answer)))


if __name__ == "__main__":
    main()
