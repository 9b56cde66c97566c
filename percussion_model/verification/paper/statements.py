"""Statements of the paper in words and numbers, beside the findings of this program."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass

import numpy as np

from percussion_model.analysis.study import LEAST_ERROR, Study
from percussion_model.physics.records import Mode
from percussion_model.scene.scales import scales
from percussion_model.scene.scene import Scene
from percussion_model.simulation.result import Result
from percussion_model.simulation.uncertain import in_digits, mean_text, rate_text, with_error
from percussion_model.verification.paper.runs import (
    CALIBRATED,
    DAMPINGS,
    ENERGIES,
    PAPER_CHATTER,
    PAPER_LEAST_DISTANCE,
    PAPER_LEAST_FEED,
    Drop,
    along,
    exponent_and_error,
    fit_text,
    line_errors,
    maxima,
    straight_line,
)

# An exponent this far from the paper's is the same: it gives two digits.
SAME_EXPONENT = 0.03
# A number that the paper gives with "about", and the period, which it gives with three digits.
ABOUT, SAME_PERIOD = 0.1, 0.01
# A straight line is one that explains this much.
STRAIGHT = 0.95
# Eq. 15 of the paper, and the exponent that its eq. 59 rounds to -1/3.
PERIOD_EXPONENT, VELOCITY_EXPONENT, RATE_EXPONENT = 2.0 / 3.0, 1.0 / 3.0, -0.36
# Table II of the paper [ms, mm]; what stands there of T_3 is cut off.
TABLE_2 = {"T_1": 3.38e-2, "T_2": 3.87e-2, "T_4": 0.108, "T_5": 3.15e-4, "L_1": 175.0, "L_2": 0.40}
# It has three digits.
SAME_DIGITS = 5e-3
# A rate that changes by less over an octave of gamma no longer depends on it.
INSENSITIVE = 0.05
# A flight of a sample or two is none [s].
SHORTEST_FLIGHT = 1e-4
# Two scatters of which one is this much larger are not alike.
TOLD_APART = 5.0
# Below this ratio nothing chatters: rises are those of the number of drilling cycles.
CHATTER_FROM = 20.0
# How near the paper's 40 the greatest rate lies, and from which share of its 100 chatter begins.
NEAR_PEAK, CHATTER_SHARE = 10.0, 0.8
# Convergence to standstill: kinetic energy of the bit below this share of the blow's.
AT_REST = 1e-3

# What is asked of digits of Table II, and of the place of the greatest rate.
_DIGITS = f"within {100 * SAME_DIGITS:g} %, the digits of the table"
_PEAK = f"the greatest rate within {NEAR_PEAK:g} of gamma = 40"
# What is known of the errors of the numbers found.
ERRORS = (
    "± is the error where one is known: of rates and means of the stationary blow (4.3) that by "
    "discretisation and scatter, of rates of the sweeps (4.4) that by convergence and "
    "scatter, which is "
    f"omitted up to {100 * LEAST_ERROR:g} % of a rate: that has three digits; of what is fitted "
    "the greater of the standard error of the fit and half of the difference between fits "
    "of the lower and the upper half of the points. Of all other numbers found here the error is "
    "not estimated, nor is the discretisation error of drop tests and sweeps."
)


@dataclass(frozen=True)
class Statement:
    """One statement of the paper, and whether it holds."""

    place: str  # in the paper
    says: str  # the paper
    found: str  # here
    agrees: bool
    why: str = ""  # why it differs
    # what is asked of a number to agree; empty where the words of the paper tell it
    agrees_if: str = ""

    def to_dict(self) -> dict[str, object]:
        """Plain values for JSON."""
        return asdict(self) | {"agrees": bool(self.agrees)}


def about_drops(drops: list[Drop]) -> Iterator[Statement]:
    """Go through section 4.2."""
    by = {(drop.energy, drop.damping): drop for drop in drops}
    middle = DAMPINGS[len(DAMPINGS) // 2]
    cycles = [by[energy, middle].cycles for energy in ENERGIES]
    rests = [by[energy, middle].rest for energy in ENERGIES]
    yield Statement(
        "4.2",
        "the larger the barrier W_R, the fewer drilling cycles before standstill",
        f"{', '.join(map(str, cycles))} cycles for W_R of {_list(ENERGIES, 'J')}",
        all(a >= b for a, b in itertools.pairwise(cycles)) and cycles[0] > cycles[-1],
    )
    yield Statement(
        "4.2",
        "penetration decreases with W_R",
        f"{', '.join(f'{1e3 * rest:.3f}' for rest in rests)} mm",
        all(a > b for a, b in itertools.pairwise(rests)),
    )
    spreads = []
    for energy in ENERGIES:
        row = [by[energy, damping].rest for damping in DAMPINGS]
        spreads.append((max(row) - min(row)) / max(row))
    yield Statement(
        "4.2",
        "the smaller W_R, the less C_R matters",
        f"over C_R of {_list(DAMPINGS, 'N s/m')} penetration spreads by "
        f"{', '.join(f'{100 * spread:.1f}' for spread in spreads)} %",
        all(a < b for a, b in itertools.pairwise(spreads)),
    )
    rest = [drop.rest for drop in drops]
    reduced = 1.0 - min(rest) / max(rest)
    yield Statement(
        "4.2",
        "a large W_R can reduce penetration by tens of per cent",
        f"by up to {100 * reduced:.0f} %",
        reduced > ABOUT,
        agrees_if=f"more than {100 * ABOUT:g} %",
    )


def about_cycle(
    result: Result, samples: Mapping[str, np.ndarray], origin: float
) -> Iterator[Statement]:
    """Go through section 4.3 with the last blow of a reference run, sampled from its start."""
    place = f"4.3, {result.solver}"
    summary = result.summary()
    period = summary["blow_period"]
    velocity = result.counted["impact_velocity"]
    yield Statement(
        place,
        "an attractive period-1 solution exists",
        f"after settling, impact velocities differ by {np.ptp(velocity) / np.mean(velocity):.0e}",
        bool(np.ptp(velocity) < 1e-6 * np.mean(velocity)),
        agrees_if="by less than 1e-06",
    )
    yield Statement(
        place,
        "the activation period is about 45.5 ms, 22 Hz",
        f"{mean_text(summary, 'blow_period', 1e3)} ms, {mean_text(summary, 'blow_frequency')} Hz",
        abs(period / 45.5e-3 - 1.0) < SAME_PERIOD,
        agrees_if=f"within {100 * SAME_PERIOD:g} % of 45.5 ms, which the paper calls about, "
        "whatever the error",
    )
    contacts = summary["contacts_per_blow"]
    yield Statement(
        place, "two successive piston/bit contacts", f"{contacts:.2f} a blow", contacts == 2.0
    )
    inside = samples["time"] >= origin
    peak = float(np.max(samples["penetration"][inside]))
    yield Statement(
        place,
        "peak penetration is of the order of a millimetre",
        f"{1e3 * peak:.2f} mm",
        0.3e-3 < peak < 3e-3,
        agrees_if="from 0.3 to 3 mm",
    )
    force = summary["standstill_bit_force"]
    yield Statement(
        place,
        "F_R tends to 2587 N at standstill",
        f"{force:.1f} N",
        abs(force - 2587.0) < 1.0,
        agrees_if="within 1 N",
    )
    yield _about_rest(place, samples, origin, period)
    yield from _about_backbone(place, samples, origin)
    if result.scene.solver_name == "fem":
        yield from _about_interpenetration(place, samples, result.scene.fem.contact_stiffness)
    yield from _about_fixed_window(place, result)
    flights = _flights(samples, origin)
    yield Statement(
        place,
        "drilling cycles separated by free flights of decreasing amplitude",
        f"flights of {', '.join(f'{1e3 * flight:.2f}' for flight in flights)} ms",
        len(flights) > 1 and all(a > b for a, b in itertools.pairwise(flights)),
    )


def _about_rest(
    place: str, samples: Mapping[str, np.ndarray], origin: float, period: float
) -> Statement:
    """Compare the time to standstill by energy with the paper's, beside that by the rock law."""
    rest = time_to_rest(samples, origin)
    return Statement(
        place,
        "standstill is reached in about 10 ms",
        f"{1e3 * rest:.1f} ms until kinetic energy is below {AT_REST:g} of its peak, "
        f"{1e3 * standstill_from(samples, origin):.1f} ms until the rock law stays in standstill",
        abs(rest / 10e-3 - 1.0) < ABOUT,
        "the paper does not say what it takes for standstill; by either measure it is reached "
        f"long before the next impact, after {1e3 * period:.1f} ms, which is what it concludes",
        agrees_if=f"kinetic energy within {100 * ABOUT:g} % of 10 ms, which the paper calls about",
    )


def _about_fixed_window(place: str, result: Result) -> Iterator[Statement]:
    window, whole = result.rate_of_penetration_fixed_window, result.rate_of_penetration
    share, summary = 1.0 / len(result.counted), result.summary()
    off = window / whole - 1.0
    yield Statement(
        f"{place}, eq. 58",
        "the rate is that over 3 s from 1 s on",
        f"{mean_text(summary, 'rate_of_penetration_fixed_window', 1e3)} mm/s; over whole blows "
        f"{rate_text(summary)}: "
        f"{100 * off:+.2f} %, within the {100 * share:.2f} % of one blow",
        abs(off) < share,
    )


def _about_backbone(
    place: str, samples: Mapping[str, np.ndarray], origin: float
) -> Iterator[Statement]:
    """Compare the scatter about a line over the mean displacement with that over the end's."""
    mean, end = (
        scatter_about_line(samples, origin, name) for name in ("bit_position", "bit_end_position")
    )
    yield Statement(
        f"{place}, figure 7",
        "the force fluctuates about the bilinear backbone over the mean displacement; over that of "
        "the bit's end the law is recovered",
        f"while loading, scatter about a line of {100 * mean:.1f} % of the peak over the mean, "
        f"{100 * end:.1g} % over the end",
        mean > TOLD_APART * end,
        agrees_if=f"more than {TOLD_APART:g} times as much over the mean",
    )


def scatter_about_line(samples: Mapping[str, np.ndarray], origin: float, name: str) -> float:
    """Standard deviation of the bit force from a line over a position, by its peak.

    Over the forward contact of a blow with the greatest force. The force of waves at a grid
    point is the mean of the step before: the first, which still has the dashpot, is left out.
    """
    loading = (samples["drilling_mode"] == Mode.FC) & (samples["time"] >= origin)
    spans = [slice(begin + 1, end) for begin, end in _spans(loading) if end - begin > 2]
    span = max(spans, key=lambda one: np.max(samples["bit_force"][one]))
    x, force = samples[name][span] - samples[name][span][0], samples["bit_force"][span]
    slope, intercept = np.polyfit(x, force, 1)
    return float(np.std(force - slope * x - intercept) / np.max(force))


def _about_interpenetration(
    place: str, samples: Mapping[str, np.ndarray], stiffness: float
) -> Iterator[Statement]:
    depth, force = -float(np.min(samples["gap"])), float(np.nanmax(samples["contact_force"]))
    yield Statement(
        place,
        "the interpenetration of piston and bit is of the order of 1e-3 mm",
        f"{1e3 * depth:.2e} mm; contact force by K_C of Table II {1e3 * force / stiffness:.2e} mm",
        0.3e-6 < depth < 3e-6,
        agrees_if="from 0.3e-3 to 3e-3 mm",
    )


def about_double_impact(
    drops: list[Drop], result: Result, samples: Mapping[str, np.ndarray], origin: float
) -> Iterator[Statement]:
    """Compare standstill after a blow with that after a drop of the same barrier."""
    blow = standstill_from(samples, origin)
    (drop,) = (drop for drop in drops if (drop.energy, drop.damping) == CALIBRATED)
    touching = (np.nan_to_num(samples["contact_force"]) > 0.0) & (samples["time"] >= origin)
    contacts = _spans(touching)
    begin, end = contacts[1] if len(contacts) > 1 else (1, 0)
    velocity = samples["bit_velocity"]
    yield Statement(
        f"4.3, {result.solver}",
        "by the double impact the bit comes to standstill faster than in the drop test",
        f"{1e3 * blow:.1f} ms after the impact, {1e3 * drop.settling:.1f} ms after a drop's first "
        f"contact; the second of {len(contacts)} contacts takes the bit's velocity from "
        f"{velocity[begin - 1]:.2f} to {velocity[end]:.2f} m/s",
        blow < drop.settling and abs(velocity[end]) < abs(velocity[begin - 1]),
    )


def about_scales(scene: Scene) -> Iterator[Statement]:
    """Go through the reference scales of Table II."""
    found = {one.symbol: 1e3 * one.value for one in scales(scene).values() if one.unit != "-"}
    off = {name: found[name] / value - 1.0 for name, value in TABLE_2.items()}
    told = [name for name in TABLE_2 if name != "T_2"]
    yield Statement(
        "Table II",
        ", ".join(f"{name} {TABLE_2[name]:g}" for name in told) + " (ms, mm)",
        ", ".join(f"{name} {found[name]:.4g}" for name in told)
        + f"; T_3, cut off in print, {found['T_3']:.4g} ms",
        all(abs(off[name]) < SAME_DIGITS for name in told),
        agrees_if=_DIGITS,
    )
    speed = scene.bit.sections[0].wave_speed
    yield Statement(
        "Table II",
        f"T_2 = {TABLE_2['T_2']:g} ms",
        f"L_b/c_0 = {found['T_2']:.4g} ms by eq. 26, {100 * off['T_2']:+.2f} %",
        abs(off["T_2"]) < SAME_DIGITS,
        f"a misprint: with E and rho of the same table c_0 = {speed:.1f} m/s, and the printed "
        f"T_2 would need L_b = {TABLE_2['T_2'] * speed:.2f} mm, where the table has "
        f"{1e3 * scene.bit.length:.2f}; T_2/T_1 = L_b/L_p is {found['T_2'] / found['T_1']:.3f}, "
        f"in print {TABLE_2['T_2'] / TABLE_2['T_1']:.3f}",
        agrees_if=_DIGITS,
    )
    ratio = scales(scene)["stiffness_ratio"].value
    yield Statement(
        "2.5",
        "eta = K_R L_b/(EA) = T_2^2/T_4^2 = O(10^-1)",
        f"{ratio:.4f}; (T_2/T_4)^2 = {(found['T_2'] / found['T_4']) ** 2:.4f}",
        0.03 < ratio < 0.3,
        agrees_if="from 0.03 to 0.3",
    )


def about_sweeps(found: Mapping[str, Study]) -> Iterator[Statement]:
    """Go through section 4.4 with the sweeps by letter."""
    yield from _about_stiffness(found["a"])
    yield from _about_rigid_ratio(found["b_rigid"])
    yield from _about_ratio(found["b"], "waves")
    yield from _about_ratio(found["b_table"], "elements, K_C of Table II")
    yield from _about_ratio(found["b_text"], "elements, K_C of the text")
    yield from _about_feed(found["c"])
    yield from _about_distance(found["d"])
    yield from _about_scaling(found["d"])


def _rate(found: Study, k: int) -> str:
    """Rate of a point [mm/s] with its error."""
    return found.rate_text(k, "")


def _about_stiffness(found: Study) -> Iterator[Statement]:
    x, rate, _periodic = along(found)
    yield Statement(
        "4.4 a",
        "the rate decreases monotonically with K_R",
        f"from {_rate(found, 0)} to {_rate(found, -1)} mm/s, "
        f"{int(np.sum(np.diff(rate) >= 0))} rises",
        bool((np.diff(rate) < 0).all()),
    )
    exponent, error = exponent_and_error(x, rate)
    yield Statement(
        "4.4 a",
        "rate ~ K_R^c1 with c1 = -0.55",
        f"c1 = {fit_text(exponent, error)}",
        abs(exponent + 0.55) <= SAME_EXPONENT,
        agrees_if=_exponent_near(-0.55),
    )


def _about_rigid_ratio(found: Study) -> Iterator[Statement]:
    x, rate, _periodic = along(found)
    error = found.rows["rate_of_penetration_error"]
    best = int(np.argmax(rate))
    peak, spacing = float(x[best]), float(x[1] / x[0] - 1.0)
    after = rate[best:]
    yield Statement(
        "4.4 b, rigid bodies",
        "the trend of rigid bodies does not rise again: numerical chatter is that of waves",
        f"greatest rate {_rate(found, best)} mm/s at gamma = "
        f"{peak:.1f} (± {100 * spacing:.0f} %), {_rate(found, -1)} at {x[-1]:.0f}; "
        f"{int(np.sum(np.diff(after) > error[best:-1]))} rises beyond it",
        abs(peak - 40.0) < NEAR_PEAK and bool((np.diff(after) <= error[best:-1]).all()),
        agrees_if=f"no rise beyond its error, and {_PEAK}",
    )
    octave = float(np.interp(0.5 * x[-1], x, rate))
    change = rate[-1] / octave - 1.0
    yield Statement(
        "4.4 b, rigid bodies",
        "the rate becomes insensitive to gamma where it is large",
        f"{100 * change:+.1f} % from gamma = {0.5 * x[-1]:.0f} to {x[-1]:.0f}, "
        f"{100 * (np.interp(2 * x[0], x, rate) / rate[0] - 1.0):+.0f} % from {x[0]:g} to "
        f"{2 * x[0]:g}",
        abs(change) < INSENSITIVE,
        agrees_if=f"by less than {100 * INSENSITIVE:g} % over the last octave",
    )


def _about_ratio(found: Study, how: str) -> Iterator[Statement]:
    place = f"4.4 b, {how}"
    x, rate, _periodic = along(found)
    onset = chatter_onset(x, rate)
    before = x < onset if onset > x[0] else x <= PAPER_CHATTER
    best, lowest = int(np.argmax(np.where(before, rate, -np.inf))), int(np.argmax(x == onset))
    peak, greatest, least = float(x[best]), float(rate[best]), float(rate[lowest])
    yield Statement(
        place,
        "the rate grows with gamma to a greatest value, falls, and rises again by chatter",
        f"{_rate(found, 0)} mm/s at gamma = {x[0]:g}, {_rate(found, best)} at {peak:.0f}, "
        f"{_rate(found, lowest)} at {onset:.0f}, {_rate(found, -1)} at {x[-1]:.0f}",
        rate[0] < least < 0.99 * greatest and rate[-1] > least,
        agrees_if="a fall of more than 1 %, and a rise after it",
    )
    yield Statement(
        place,
        "the greatest value is at about gamma = 40, chatter begins above 100",
        f"at gamma = {peak:.0f}; chatter from {onset:.0f} on",
        abs(peak - 40.0) < NEAR_PEAK and onset > CHATTER_SHARE * PAPER_CHATTER,
        "chatter sets in the earlier, the sharper the front of the impact: K_C of the text, "
        "fifteen times softer than that of Table II, blunts it and gives the paper's figures; "
        "a rigid contact does not (docs/data/paper.md)",
        agrees_if=f"{_PEAK}, and chatter from {CHATTER_SHARE * PAPER_CHATTER:g} on or later",
    )
    on_the_way = maxima(x, rate)
    on_the_way = on_the_way[on_the_way < peak]
    yield Statement(
        place,
        "local maxima on the way to it",
        f"at gamma = {', '.join(f'{value:.1f}' for value in on_the_way) or 'none'}",
        len(on_the_way) > 0,
    )


def _about_feed(found: Study) -> Iterator[Statement]:
    x, rate, periodic = along(found)
    above = x >= PAPER_LEAST_FEED
    slope, intercept, explained = straight_line(x[above], rate[above])
    errors = line_errors(x[above], rate[above])
    yield Statement(
        "4.4 c",
        "the rate is linear in the feed above 350 N, c2 F_S + c3",
        f"c2 = {fit_text(1e6 * slope, 1e6 * errors[0])} mm/s per kN, "
        f"c3 = {fit_text(1e3 * intercept, 1e3 * errors[1])} mm/s; "
        f"the line explains {100 * explained:.1f} % of the scatter",
        explained > STRAIGHT,
        agrees_if=f"the line explains more than {100 * STRAIGHT:g} % of the scatter of the rates, "
        "however far lines through its halves are apart",
    )
    first = float(x[periodic].min()) if periodic.any() else float("nan")
    yield Statement(
        "4.4 c",
        "no stationary motion below 350 N",
        f"period 1 to 8 first at {first:.0f} N; aperiodic share below 350 N "
        f"{_share(~periodic[~above])}, above {_share(~periodic[above])}",
        bool((~periodic[~above]).all()),
        "with the rock law as printed the rock pulls the bit in standstill, which holds it "
        'between blows; with effects.standstill_tension = "release" motion is aperiodic at '
        "350 and 500 N, as in the paper",
    )
    yield Statement(
        "4.4 c",
        "no best feed around the reference",
        f"rate at 1, 2.5 and 5 kN {_at(found, (1e3, 2.5e3, 5e3))} mm/s",
        bool(np.interp(5e3, x, rate) > np.interp(2.5e3, x, rate) > np.interp(1e3, x, rate)),
    )


def _about_distance(found: Study) -> Iterator[Statement]:
    x, rate, periodic = along(found)
    above = x >= PAPER_LEAST_DISTANCE
    exponent, error = exponent_and_error(x[above], rate[above])
    yield Statement(
        "4.4 d",
        "rate ~ D_1^c4 at constant power with c4 = -0.36",
        f"c4 = {fit_text(exponent, error)} from 3 mm on",
        abs(exponent + 0.36) <= SAME_EXPONENT,
        agrees_if=_exponent_near(-0.36),
    )
    below = ~above
    yield Statement(
        "4.4 d",
        "no stationary motion below 3 mm",
        f"aperiodic share below 3 mm {_share(~periodic[below])}, above {_share(~periodic[above])}",
        bool((~periodic[below]).all()),
    )
    half = int(np.sum(below)) // 2
    near, far = _mean_rate(found, slice(0, half)), _mean_rate(found, slice(half, 2 * half))
    yield Statement(
        "4.4 d",
        "below, the rate still increases on average as D_1 falls",
        f"mean rate {_with_known_error(*near)} mm/s over the lower half of the points below 3 mm, "
        f"{_with_known_error(*far)} over the upper",
        near[0] - far[0] > np.hypot(near[1], far[1]),
        agrees_if="by more than the errors of the means",
    )


def _mean_rate(found: Study, points: slice) -> tuple[float, float]:
    """Mean rate of some points and its error by theirs [mm/s]; those that failed are left out."""
    rate, error = (found.rows[f"rate_of_penetration{end}"][points] for end in ("", "_error"))
    known = np.isfinite(rate) & np.isfinite(error)
    if not known.any():
        return float("nan"), float("nan")
    off = float(np.sqrt(np.sum(error[known] ** 2))) / int(np.sum(known))
    return 1e3 * float(np.mean(rate[known])), 1e3 * off


def _about_scaling(found: Study) -> Iterator[Statement]:
    """Go through the exponents of eqs 15 and 59, over the stationary motions."""
    x, rate, periodic = along(found)
    chosen = periodic & (x >= PAPER_LEAST_DISTANCE)
    columns = {"D_1": x, "R": rate}
    columns |= {"T": found.rows["blow_period"], "v": found.rows["impact_velocity"]}
    far = x >= np.median(x[chosen]) if chosen.any() else chosen
    unrounded = "; its c4 = -0.36 not rounded to -1/3 makes it"
    for equation, what, by, words, expected in (
        ("eq. 15", "T", "D_1", "2/3", PERIOD_EXPONENT),
        ("eq. 15", "v", "D_1", "1/3", VELOCITY_EXPONENT),
        ("eq. 59", "R", "T", "-1/2", RATE_EXPONENT / PERIOD_EXPONENT),
        ("eq. 59", "R", "v", "-1", RATE_EXPONENT / VELOCITY_EXPONENT),
    ):
        exponent, error = exponent_and_error(columns[by][chosen], columns[what][chosen])
        upper, upper_error = exponent_and_error(
            columns[by][chosen & far], columns[what][chosen & far]
        )
        yield Statement(
            f"4.4 d, {equation}",
            f"{_WORDS[what]} ~ {_WORDS[by]}^({words}) at constant power"
            + (f"{unrounded} {expected:.2f}" if what == "R" else ""),
            f"{fit_text(exponent, error)} over the {np.sum(chosen)} periodic motions, "
            f"{fit_text(upper, upper_error)} in their upper half",
            abs(exponent - expected) <= SAME_EXPONENT,
            agrees_if=_exponent_near(expected),
        )


def _exponent_near(expected: float) -> str:
    """What is asked of an exponent: the paper has two digits, and its law is not exact."""
    return f"within {SAME_EXPONENT:g} of {expected:.2f}, whatever the error of the fit"


_WORDS = {"D_1": "D_1", "R": "rate", "T": "period", "v": "impact velocity"}


def chatter_onset(x: np.ndarray, rate: np.ndarray) -> float:
    """Where the rate is least before its last long rise, that of chatter."""
    steepest = int(np.argmax(np.diff(rate) * (x[1:] > CHATTER_FROM)))
    start = steepest
    while start > 0 and rate[start - 1] < rate[start]:
        start -= 1
    return float(x[start])


def standstill_from(samples: Mapping[str, np.ndarray], origin: float) -> float:
    """Time after the impact from which the rock law stays in standstill [s]."""
    moving = samples["time"][samples["drilling_mode"] != Mode.SS]
    return float(moving[-1]) - origin


def time_to_rest(samples: Mapping[str, np.ndarray], origin: float) -> float:
    """Time after the impact at which the bit's kinetic energy stays small [s]."""
    energy = samples["bit_kinetic_energy"]
    moving = np.flatnonzero(energy > AT_REST * energy.max())
    return float(samples["time"][moving[-1]] - origin)


def _flights(samples: Mapping[str, np.ndarray], origin: float) -> list[float]:
    """Durations of the free flights of a blow [s]; those of a sample or two do not count."""
    time = samples["time"]
    flying = (samples["drilling_mode"] == Mode.FF) & (time >= origin)
    durations = [float(time[b - 1] - time[a]) for a, b in _spans(flying)]
    return [duration for duration in durations if duration > SHORTEST_FLIGHT]


def _spans(flags: np.ndarray) -> list[tuple[int, int]]:
    """First place of each run of set flags, and the place after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(int), [0]))))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _share(flags: np.ndarray) -> str:
    return f"{np.sum(flags)} of {len(flags)}"


def _list(values: tuple[float, ...], unit: str) -> str:
    return f"{', '.join(f'{value:g}' for value in values)} {unit}"


def _at(found: Study, places: tuple[float, ...]) -> str:
    """Rates between points [mm/s], with the errors of the points beside them where these show."""
    x, rate, _periodic = along(found)
    error = found.rows["rate_of_penetration_error"]
    pairs = ((1e3 * float(np.interp(place, x, y)) for y in (rate, error)) for place in places)
    return ", ".join(_with_known_error(*pair) for pair in pairs)


def _with_known_error(value: float, error: float) -> str:
    """Write a number with its error where that shows; what the grid adds is not known."""
    return with_error(value, error) if error > LEAST_ERROR * abs(value) else in_digits(value)
