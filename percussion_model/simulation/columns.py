"""What each number of a summary is: name, unit, meaning."""

from __future__ import annotations

from percussion_model.physics.records import BLOW_COLUMNS, LEDGER_COLUMNS, Column

SUMMARY_COLUMNS = (
    Column(
        "rate_of_penetration",
        "m/s",
        "advance of the hole over the counted blows, divided by their time",
    ),
    Column("rate_of_penetration_standard_error", "m/s", "its error from the scatter of the blows"),
    Column(
        "rate_of_penetration_relative_error", "", "estimated numerical error divided by the rate"
    ),
    Column("rate_of_penetration_error", "m/s", "estimated numerical error, scatter included"),
    Column("rate_of_penetration_undecided", "", "whether that error exceeds the rate"),
    Column(
        "rate_of_penetration_depends_on_cells",
        "",
        "whether the scene has no loss, so that the rate has no limit for fine cells",
    ),
    Column(
        "rate_of_penetration_fixed_window",
        "m/s",
        "advance of the bit's mean position after the settling time, divided by that time",
    ),
    Column(
        "rate_of_penetration_fixed_window_error",
        "m/s",
        "its error, with the advance of one blow for the cut ends",
    ),
    Column("blow_period", "s", "mean time from blow to blow"),
    Column("impact_velocity", "m/s", "mean of the piston's mean velocity at the start of a blow"),
    Column(
        "rebound_velocity", "m/s", "mean of the piston's mean velocity when the last contact opens"
    ),
    Column("stroke", "m", "mean of the greatest distance of piston and bit in a blow"),
    Column("blow_energy", "J", "mean kinetic energy of the piston's mean motion at impact"),
    Column("rock_energy", "J", "mean work done on the rock in a blow"),
    Column("penetration_per_blow", "m", "mean growth of the hole depth in a blow"),
    Column("contacts_per_blow", "", "mean number of contacts of piston and bit in a blow"),
    Column("drilling_cycles_per_blow", "", "mean number of drilling cycles in a blow"),
    Column("standstill_bit_force", "N", "mean bit force at the end of a standstill"),
    *(
        Column(column.name, column.unit, f"mean of: {column.meaning}")
        for column in BLOW_COLUMNS
        if column.of
    ),
    Column("blow_frequency", "Hz", "one divided by the mean blow period"),
    Column("transfer_efficiency", "", "energy into the rock divided by the blow energy, of sums"),
    Column("mean_bit_force", "N", "impulse of the bit force divided by time"),
    Column("mean_contact_force", "N", "impulse of the contact force divided by time"),
    Column("percussive_power", "W", "blow energy times blow frequency, of sums"),
    Column("energy_per_advance", "J/m", "blow energy divided by the advance of the hole, of sums"),
    Column("net_percussive_power", "W", "the same less the rebound; none without chambers"),
    Column("energy_per_air", "J/kg", "blow energy divided by the air consumed, of sums"),
    Column("peak_bit_force", "N", "greatest bit force of the counted blows"),
    Column("peak_contact_force", "N", "greatest elastic contact force of the counted blows"),
    Column(
        "specific_energy",
        "J/m^3",
        "blow energy divided by the volume drilled, a hole of `hole_diameter`; none without it",
    ),
    Column(
        "hammer_pressure",
        "Pa",
        "pressure of the supply at the end, above that of the surroundings; none without chambers",
    ),
    Column(
        "air_efficiency",
        "",
        "percussive power divided by that of the air at this pressure, m R T ln(p/p_a) of what "
        "is consumed, with pressure and temperature of the surroundings",
    ),
    Column("standard_errors", "as above", "errors of these numbers from the scatter of the blows"),
    Column("errors", "as above", "estimated numerical errors of these numbers, scatter included"),
    Column("energy", "J", "the energy ledger since the start of the run, by its entries"),
    Column("blows", "", "whole blows"),
    Column("blows_after_settling", "", "whole blows that are counted"),
    Column("events", "", "number of events"),
    Column("cells", "", "modes, cells or elements of each bar"),
    Column("time_step", "s", "time step of the solver, or the shortest one"),
    Column("wave_speed_error", "", "greatest relative error of the wave speed in a section"),
    Column("wall_time", "s", "computing time, without preparation"),
    Column("setup_time", "s", "time to prepare the solver, compilation included"),
    Column("real_time_factor", "", "simulated time divided by computing time"),
    Column("end", "SI", "a sample at the end of the run, by the columns of a trace"),
    Column("fall", "SI", "what a drop test gives in place of blows"),
    Column("interrupted", "", "whether Ctrl-C ended the run"),
    Column("solver", "", "name of the solver"),
    Column("title", "", "title of the scene"),
    Column("duration", "s", "simulated time"),
    Column("settle", "s", "time from which blows count"),
    Column("statistics", "", "counts of what the solver did"),
    Column("warnings", "", "what a user should know of this run"),
    Column(
        "driller_numbers",
        "its own",
        "rate, frequency, power and specific energy in m/h, blows/min, kW and MJ/m^3, each with "
        "value, error, unit and definition",
    ),
)

# Entries of the ledger, and what is added up of them (docs/model.md, section 8).
ENERGY_COLUMNS = (
    Column("initial", "J", "stored at the start"),
    *LEDGER_COLUMNS,
    Column("kinetic", "J", "stored in motion at the end"),
    Column("elastic", "J", "stored in strain at the end"),
    Column("recoverable", "J", "stored in the rock at the end"),
    Column("input", "J", "sum of drive, feed, gravity and what rotation does"),
    Column("stored", "J", "sum of kinetic, elastic, recoverable and what components store"),
    Column("dissipated", "J", "sum of all that is taken, but for numerical and overshoot"),
    Column("residual", "J", "what no entry explains"),
    Column("numerical_relative", "", "numerical, divided by the energy put in"),
    Column("overshoot_relative", "", "overshoot, divided by the energy put in"),
    Column("residual_relative", "", "residual, divided by the energy put in"),
)
