"""The hammer's outputs, a line for each.

The order makes the value references: new outputs go to the end.
"""

from __future__ import annotations

from percussion_model.physics.records import Mode

MODES = {
    Mode.FF: "free flight",
    Mode.DFC: "dissipative forward contact",
    Mode.FC: "forward contact",
    Mode.BC: "backward contact",
    Mode.SS: "standstill",
}

_FORCE, _SPEED, _ENERGY, _FAR = 1e12, 1e4, 1e12, 1e6
# Outputs in the order of their references: unit, bounds, nominal, description.
REAL_OUTPUTS: dict[str, tuple[str, float, float, float, str]] = {
    "rate_of_penetration": ("m/s", -_SPEED, _SPEED, 1e-2, "advance of the bit over the last whole blow by its period; falls towards 0 after two missed periods"),
    "bit.position": ("m", -_FAR, _FAR, 1e-2, "mean displacement of the bit since the start, down positive"),
    "bit.velocity": ("m/s", -_SPEED, _SPEED, 1.0, "mean velocity of the bit, down positive"),
    "bit.force": ("N", -_FORCE, _FORCE, 1e5, "force of the bit on the rock, compression positive"),
    "bit.force_mean": ("N", -_FORCE, _FORCE, 1e4, "mean of bit.force over the last communication step"),
    "bit.force_peak": ("N", 0.0, _FORCE, 1e5, "greatest bit.force in the last communication step"),
    "bit.impulse": ("N.s", -_FORCE, _FORCE, 1e2, "running integral of bit.force since the start"),
    "contact.force": ("N", -_FORCE, _FORCE, 1e5, "force of the piston on the bit, compression positive"),
    "contact.force_mean": ("N", -_FORCE, _FORCE, 1e3, "mean of the contact force over the last communication step"),
    "contact.force_peak": ("N", 0.0, _FORCE, 1e5, "greatest elastic contact force in the last communication step; the impact of two rigid bodies has none"),
    "contact.impulse": ("N.s", -_FORCE, _FORCE, 1e2, "running integral of the contact force since the start"),
    "piston.position": ("m", -_FAR, _FAR, 1e-1, "mean displacement of the piston since the start, down positive"),
    "piston.velocity": ("m/s", -_SPEED, _SPEED, 1.0, "mean velocity of the piston, down positive"),
    "piston.stroke": ("m", 0.0, _FAR, 1e-1, "greatest lift of the piston off the bit in the last whole blow"),
    "impact_velocity": ("m/s", -_SPEED, _SPEED, 1.0, "mean velocity of the piston at the start of the last whole blow"),
    "blow_energy": ("J", 0.0, _ENERGY, 1e2, "kinetic energy of the piston's mean motion at the start of the last whole blow"),
    "transfer_efficiency": ("1", -1e3, 1e3, 1.0, "energy given to the rock in the last whole blow, divided by blow_energy"),
    "blow_frequency": ("Hz", 0.0, 1e6, 10.0, "blows per time, from the last whole blow; falls towards 0 after two missed periods"),
    "penetration_per_blow": ("m", -_FAR, _FAR, 1e-3, "advance of the bit over the last whole blow"),
    "blow_time": ("s", 0.0, 1e9, 1.0, "start of the last whole blow, since the start of the simulation"),
    "blow_position": ("m", -_FAR, _FAR, 1e-2, "bit.position at the start of the last whole blow"),
    "casing_force": ("N", -_FORCE, _FORCE, 1e3, "reaction of the drive on the casing, down positive"),
    "casing.impulse": ("N.s", -_FORCE, _FORCE, 1e2, "running integral of casing_force since the start"),
    "gauge_stress": ("Pa", -1e13, 1e13, 1e8, "axial stress at the gauge at the last grid point, compression positive; 0 in a rigid bar"),
    "energy_residual": ("1", -1.0, 1.0, 1e-10, "share of the energy put in so far that the ledger leaves unexplained"),
}  # fmt: skip
