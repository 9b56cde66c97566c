"""Every hammer with some numbers of rods, and a report on one string; takes a minute."""

from __future__ import annotations

from docs.blocks import Made
from percussion_model import Result, simulate
from percussion_model.analysis.drill_string import StringReport, string_report
from percussion_model.interface.plotting.drill_string import bar_title, draw_string
from percussion_model.scene.hammers import hammer, hammers
from percussion_model.simulation.markdown import table

DURATION, SETTLE = 4.0, 1.0  # [s]
RODS = (1, 2, 4, 6, 8)
# The string that the figures show, and its gauges: middle of the first, second and last rod.
SHOWN, SHOWN_RODS = "t38", 4
GAUGES = (("rod 2", 1.8), ("rod 3", 1.8), ("rod 5", 1.8))
# Changes of that scene, to see what a number is worth.
CHANGES: tuple[tuple[str, dict[str, object]], ...] = (
    ("as it is", {}),
    ("damper without dashpot", {"damper.damping": 0.0}),
    ("no damper, feed on the shank", {"effects.damper": False}),
    ("joints perfect", {"effects.joints": False}),
    ("a tenth of the structural loss", {"loss.time": 5e-9}),
    ("softer rock, 0.3 GN/m", {"rock.loading_stiffness": 3e8}),
)


def run(name: str, rods: int | None, **changes: object) -> Result:
    """Run a hammer."""
    scene = hammer(name, rods).replace(**changes)
    return simulate(scene, DURATION, settle=SETTLE, record_events=False)


def drills_down_the_hole(name: str) -> bool:
    """Whether a hammer has no rods."""
    return not hammer(name).effects.string


def presets() -> str:
    """What the hammers do."""
    rows = []
    for name in sorted(hammers(), key=lambda name: (drills_down_the_hole(name), name)):
        for rods in (None,) if drills_down_the_hole(name) else RODS:
            found = run(name, rods).summary()
            rate, error = (
                1e3 * found[key]
                for key in ("rate_of_penetration", "rate_of_penetration_standard_error")
            )
            rows.append(
                [
                    name,
                    "–" if rods is None else str(rods),
                    f"{found['blow_frequency']:.1f}",
                    f"{found['impact_velocity']:.2f}",
                    f"{found['blow_energy']:.0f}",
                    f"{100 * found['transfer_efficiency']:.0f}",
                    f"{rate:.1f} ± {error:.1f}" if error > 0.05 else f"{rate:.1f}",
                    f"{1e-3 * found['peak_bit_force']:.0f}",
                    f"{found['real_time_factor']:.0f}",
                ]
            )
    head = ["hammer", "rods", "frequency, Hz", "impact, m/s", "blow, J", "efficiency, %"]
    head += ["rate, mm/s", "peak bit force, kN", "speed"]
    return table(head, rows, left=head[:1])


def shares() -> str:
    """Where the energy goes that was put in, without what friction takes of the rotation."""
    rows = []
    for rods in RODS:
        energy = run(SHOWN, rods).summary()["energy"]
        rock = energy["crushing"] + energy["barrier"] + energy["standstill"]
        taken = (rock, energy["loss"], energy["joints"], energy["numerical"])
        given = energy["input"] - energy["friction"]
        rows.append([str(rods), *(f"{100 * part / given:.1f}" for part in taken)])
    head = ["rods", "rock, %", "structural loss, %", "damper, %", "numerical, %"]
    return table(head, rows, left=head[:1])


def changes() -> str:
    """What single numbers are worth."""
    rows = []
    for label, change in CHANGES:
        found = run(SHOWN, SHOWN_RODS, **change).summary()
        rows.append(
            [
                label,
                f"{found['blow_energy']:.0f}",
                f"{100 * found['transfer_efficiency']:.0f}",
                f"{1e3 * found['rate_of_penetration']:.0f}",
            ]
        )
    return table(["", "blow, J", "efficiency, %", "rate, mm/s"], rows, left=("",))


def joints(report: StringReport) -> str:
    """What each joint does."""
    rows = [
        [
            name,
            f"{one.came:.0f}",
            f"{one.passed:.0f}",
            f"{one.returned:.0f}",
            f"{one.net:.0f}",
            f"{100 * one.efficiency:.0f}",
            f"{-1e-3 * one.least_force:.0f}",
        ]
        for name, one in report.joints.items()
    ]
    head = ["joint", "came, J", "passed, J", "returned, J", "net, J", "of the first wave, %"]
    return table([*head, "greatest tension, kN"], rows, left=head[:1])


def stresses(report: StringReport) -> str:
    """Greatest stress in each bar."""
    rows = []
    for name, one in report.bars.items():
        cells = [bar_title(name)]
        for extreme, sign in ((one.compression, 1), (one.tension, -1)):
            cells += [f"{sign * 1e-6 * extreme.value:.0f}", f"{extreme.place:.2f}"]
        rows.append(cells)
    head = ["bar", "compression, MPa", "at, m", "tension, MPa", "at, m"]
    return table(head, rows, left=head[:1])


def at_the_rock(report: StringReport) -> str:
    """Sentences on what reaches the rock."""
    rock = report.rock
    return (
        f"In a blow of {report.blow_energy:.0f} J waves of {rock.incident:.0f} J come down to the "
        f"rock, and {rock.reflected:.0f} J go back.\nThe rest, {rock.work:.0f} J, is work on the "
        f"rock. The hole advances by {1e3 * rock.penetration:.2f} mm,\n"
        f"{100 * rock.first_share:.0f} % of it by the first incident wave. "
        f"These are means of {report.blows} blows."
    )


def made() -> Made:
    """The figures and the tables."""
    report = string_report(hammer(SHOWN, SHOWN_RODS), DURATION, SETTLE, GAUGES)
    contents = {
        "rock": at_the_rock(report),
        "joints": joints(report),
        "shares": shares(),
        "changes": changes(),
        "presets": presets(),
        "stresses": stresses(report),
    }
    return Made(
        ("top_hammer.md", "data/top_hammer.md"), contents, dpi=100,
        figures=lambda: (
            (name.replace("string", "top_hammer"), fig) for name, fig in draw_string(report)
        ),
    )  # fmt: skip
