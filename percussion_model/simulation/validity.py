"""Limits of validity of a run, and notes on what its guards had to do.

Standard library only: an exported simulation gives the same notes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from percussion_model.physics.power_law import secant_stiffness
from percussion_model.scene.scene import Scene

# The ledger closes to rounding; more than this is an error of the solver.
MOST_RESIDUAL = 1e-6
# What the discretisation takes is never negative, but for the rounding of its sums ...
LEAST_NUMERICAL = -1e-9
# ... and above this share of the energy put in it shows in peaks and rates.
MOST_NUMERICAL = 1e-2
# Buttons of a percussive bit stand out by 5 to 15 mm; deeper in, its face meets the rock,
# which the model does not have [m].
BUTTON_LENGTH = 0.010
# The fastest percussive drills make 0.1 m/s in the softest rock, and the softest corner of
# the paper's ranges 0.22 m/s: a rate far beyond is no drilling [m/s].
MOST_RATE = 0.5
# What the paper's eq. 30 wants to be much less than 1 is at most this.
MOST_BARRIER = 0.1
# A bit that meets no rock for so long, five blows of the reference, is off bottom [s].
LONGEST_FLIGHT = 0.25
# Depth that is pressed in may cut off this share of the volume broken.
MOST_LIMITED = 0.05
# A casing is held where so much more than the recoil holds it.
HELD = 1.001
# Specific energy by strength: below, and above what drills of any kind need.
LEAST_ENERGY, MOST_ENERGY = 0.3, 5.0


def ledger_note(residual: float) -> Iterator[str]:
    """Say that a share of the energy put in is unexplained, where it is."""
    if not abs(residual) <= MOST_RESIDUAL:
        yield (
            f"the energy ledger does not close: {residual:.2g} of the energy put in is "
            "unexplained; this is an error of the solver"
        )


def numerical_note(share: float, solver: str) -> Iterator[str]:
    """Say that the discretisation took too much of the energy put in, or gave some."""
    if not share >= LEAST_NUMERICAL:
        yield (
            f"numerical is {share:.2g} of the energy put in: the discretisation gives energy, "
            "which it cannot; this is an error of the solver"
        )
    elif share > MOST_NUMERICAL:
        cause, remedy = {
            "fem": ("the time scheme", "set a smaller fem.courant or more fem.elements"),
            "wave": ("averaging fronts within steps", "set more solver.cells"),
        }.get(solver, ("the discretisation", "refine it"))
        percent = float(f"{100.0 * share:.2g}")
        yield (
            f"{percent:g} % of the energy put in is taken by {cause} (entry numerical "
            f"of its balance), not by anything in the equations: peaks and rates suffer; {remedy}"
        )


def guard_notes(statistics: Mapping[str, int]) -> Iterator[str]:
    """Say what the guards of a solver had to do (docs/numerics.md, section 12)."""
    locked, storms = statistics.get("locked", 0), statistics.get("storms", 0)
    if locked:
        yield (
            f"in {locked} time step{'s' if locked != 1 else ''} the rock law crossed more modes "
            "than it can: check the result with more solver.cells"
        )
    if storms:
        yield (
            f"{storms} storm{'s' if storms != 1 else ''} of events: more within a moment than can "
            "mean anything; rebounds were omitted or events postponed: bounded but not exact"
        )


def stiffness_at(scene: Scene, force: float, loading_stiffness: float) -> float:
    """Force of the rock by the penetration that loads it, at a force [N/m].

    Parameters
    ----------
    scene : Scene
    force : float
        [N]
    loading_stiffness : float
        Of one button, at the reference penetration [N/m].
    """
    if scene.effects.rock != "power":
        return loading_stiffness
    rock = scene.rock
    bent = rock.loading_exponent, rock.reference_penetration
    return float(secant_stiffness(force, rock.buttons * loading_stiffness, *bent))


def button_note(peak_bit_force: float, loading_stiffness: float) -> Iterator[str]:
    """Say that the rock is pressed in deeper than buttons stand out, where it is.

    Parameters
    ----------
    peak_bit_force : float
        [N]
    loading_stiffness : float
        [N/m]
    """
    depth = peak_bit_force / loading_stiffness
    if depth > BUTTON_LENGTH:
        yield (
            f"the rock is pressed in by {1e3 * depth:.3g} mm, deeper than the buttons of a bit "
            f"stand out ({1e3 * BUTTON_LENGTH:g} mm): beyond that the model does not hold"
        )


def barrier_note(time_share: float, energy_share: float) -> Iterator[str]:
    """Say that the energy barrier is no small part of a blow, where it is not.

    Parameters
    ----------
    time_share : float
        T_5/T_4: time that the barrier takes, by that of a drilling cycle.
    energy_share : float
        W_R/(F_0 D_1): its energy, by that which the drive gives a blow.
    """
    if max(time_share, energy_share) > MOST_BARRIER:
        yield (
            f"the energy barrier is not small: it takes {time_share:.2g} of a drilling cycle's "
            f"time (T_5/T_4) and {energy_share:.2g} of a blow's energy (W_R/(F_0 D_1)), each of "
            f"which the rock law wants far below 1, at most {MOST_BARRIER:g}: lower "
            "rock.barrier_energy, or raise rock.barrier_damping for the time"
        )


def flight_note(flight: float) -> Iterator[str]:
    """Say that the bit met no rock for long, where it did not; flight in s."""
    if flight > LONGEST_FLIGHT:
        yield (
            f"the bit is off bottom: it met no rock for {flight:.3g} s, more than "
            f"{LONGEST_FLIGHT:g} s; feed or start do not hold it on the rock"
        )


def rate_note(rate: float) -> Iterator[str]:
    """Say that a rate of penetration [m/s] is no drilling, where it is not."""
    if rate > MOST_RATE:
        yield (
            f"a rate of penetration of {rate:.3g} m/s is no drilling: above {MOST_RATE:g} m/s "
            "the model does not hold"
        )


def limit_note(limited: float, volume: float) -> Iterator[str]:
    """Say that less volume was gained than broken [m^3], where it is much less."""
    if limited > MOST_LIMITED * (limited + volume):
        share = 100.0 * limited / (limited + volume)
        yield (
            f"{share:.3g} % of the volume broken is not gained: flushing limits it, or more would "
            "break than the buttons press in, and breaking.crushing_energy is too small"
        )


def jam_note(needed: float, stall: float) -> Iterator[str]:
    """Say that the rotation has jammed, where it needs more torque [N m] than the motor has."""
    if needed > stall:
        yield (
            f"the rotation has jammed: it needs {needed:.3g} N m, and its motor stalls at "
            f"{stall:.3g} N m (rotation.stall_torque); less feed lets it turn again"
        )


def recoil_note(recoil: float, held: float, is_throttled: bool) -> Iterator[str]:
    """Say that the casing lifts off, where the recoil takes all that holds it [N].

    Parameters
    ----------
    is_throttled : bool
        Whether a casing that lifts lessens the drive (physics/feed.py).
    """
    if recoil * HELD > held:
        then = (
            "so the hammer lifts and has less than its full force"
            if is_throttled
            else "so a real hammer would lift and drill slower; this one does not, and its rate is "
            "too high"
        )
        yield (
            f"the feed does not hold the casing: the recoil takes all of the {1e-3 * held:.3g} kN "
            f"that feed and weight press on it, {then}; more feed.force holds it"
        )


def specific_energy_note(energy: float, rock: str, strength: float) -> Iterator[str]:
    """Say that the blow energy by volume [J/m^3] does not go with the strength of the rock [Pa]."""
    share = energy / strength
    if LEAST_ENERGY <= share <= MOST_ENERGY:
        return
    yield (
        f"a specific energy of {1e-6 * energy:.3g} MJ/m^3 is {share:.2g} times the compressive "
        f"strength of {rock}; drills need {LEAST_ENERGY:g} to {MOST_ENERGY:g} times: "
        + (
            "the hole advances by what buttons press in, not by what breaks (effects.breaking, "
            "--bit)"
            if share < LEAST_ENERGY
            else "the blows hardly break it"
        )
    )
