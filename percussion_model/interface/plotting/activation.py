"""Piston and bit just after percussive activation (figure 8 of the paper)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.style import KN, MM, MS
from percussion_model.interface.plotting.window import Window

# The zoom near zero shows what happens up to this multiple of the last early contact.
ZOOM_AFTER_CONTACT = 1.4
# More contacts than this are shaded but not lettered.
MOST_LETTERED = 4


def draw_activation(window: Window) -> Figure:
    """Draw forces and velocities over the early contacts, and the relative motion."""
    fig = Figure(figsize=(10.5, 7.6), layout="constrained")
    left, right = np.asarray(fig.subfigures(1, 2, width_ratios=(1.25, 1.0)))
    contact_force = np.nan_to_num(window.samples["contact_force"])
    drawn = [_bit_force, _velocities]
    if contact_force.any():
        drawn.insert(1, _contact_force)
    axes = np.atleast_1d(left.subplots(len(drawn), 1, sharex=True))
    end = window.activation_until
    early = [contact for contact in window.contacts if contact[0] < end]
    for ax, draw in zip(axes, drawn, strict=True):
        style.shade_contacts(ax, early, MS)
        draw(ax, window, window.time <= end)
        ax.set_xlim(window.time[0] * MS if window.time[0] < 0 else 0.0, end * MS)
    for ax in axes[:-1]:
        ax.set_xlabel("")
    if len(drawn) == 3:
        _letter_edges(axes[1], early)
    over, near = right.subplots(2, 1)
    _relative_motion(over, window)
    _near_zero(near, window, early)
    handles: list[object] = list(style.mode_handles(window.samples["drilling_mode"]))
    touching = Line2D(
        [], [], color=style.CONTACT_COLOUR, linewidth=3.0, label="piston on bit, at right"
    )
    style.head(
        fig,
        f"Piston and bit after percussive activation — {window.name}",
        [*handles, style.contact_handle(), touching],
    )
    return fig


def _bit_force(ax: Axes, window: Window, shown: np.ndarray) -> None:
    style.draw_by_mode(
        ax,
        window.time[shown] * MS,
        window.samples["bit_force"][shown] / KN,
        window.samples["drilling_mode"][shown],
    )
    style.label(ax, "time [ms]", "bit force [kN]", "Force of the bit on the rock")


def _contact_force(ax: Axes, window: Window, shown: np.ndarray) -> None:
    force = window.samples["contact_force"][shown] / KN
    ax.plot(window.time[shown] * MS, force, color="black", linewidth=1.1)
    style.label(ax, "time [ms]", "contact force [kN]", "Force of the piston on the bit")


def _velocities(ax: Axes, window: Window, shown: np.ndarray) -> None:
    time = window.time[shown] * MS
    for bar, colour, dashes in (
        ("piston", style.PISTON_COLOUR, "--"),
        ("bit", style.BIT_COLOUR, "-"),
    ):
        velocity = window.samples[f"{bar}_velocity"][shown]
        ax.plot(time, velocity, dashes, color=colour, label=bar)
    ax.axhline(0.0, color=style.RULE_COLOUR, linewidth=0.6)
    ax.legend(loc="upper right", ncols=2)
    style.label(ax, "time [ms]", "mean velocity [m/s]", "Mean velocities, down positive")


def _edges(contacts: list[tuple[float, float]]) -> list[tuple[str, float]]:
    """Letters for the starts and ends of contacts, as in the paper."""
    if len(contacts) > MOST_LETTERED:
        return []
    times = [time for contact in contacts for time in contact]
    return [(chr(ord("A") + k), time) for k, time in enumerate(times)]


def _letter_edges(ax: Axes, contacts: list[tuple[float, float]]) -> None:
    style.room_above(ax, 0.22)
    for k, (letter, time) in enumerate(_edges(contacts)):
        ax.annotate(
            letter,
            # two rows, since a contact may end as the next one begins
            (time * MS, 0.92 if k // 2 % 2 == 0 else 0.82),
            (-2 if k % 2 == 0 else 2, 0),
            xycoords=ax.get_xaxis_transform(),
            textcoords="offset points",
            ha="right" if k % 2 == 0 else "left",
            fontweight="bold",
        )


def _around(window: Window, contact: tuple[float, float]) -> tuple[int, int]:
    """Samples just before and just after a contact, which may have no length."""
    first = int(np.searchsorted(window.time, contact[0], side="left")) - 1
    last = int(np.searchsorted(window.time, contact[1], side="right"))
    return max(first, 0), min(last, len(window.time) - 1)


def _relative_motion(ax: Axes, window: Window) -> None:
    title = "Relative mean motion over the whole blow" if window.is_blow else "Relative mean motion"
    _draw_relative(ax, window, np.ones(len(window.time), bool), title)
    if window.scene.effects.drive == "pressure":
        turn = -window.scene.drive.reversal_distance * MM
        ax.axvline(turn, color=style.RULE_COLOUR, linestyle=":", linewidth=1.2)
        ax.annotate(
            "−D₁: drive turns down", (turn, 0.97), (-5, 0), xycoords=ax.get_xaxis_transform(),
            textcoords="offset points", ha="right", va="top",
        )  # fmt: skip


def _near_zero(ax: Axes, window: Window, contacts: list[tuple[float, float]]) -> None:
    """Zoom on the contacts: from the approach to just after the last one."""
    last = max((end for _, end in contacts), default=window.activation_until)
    shown = window.time <= max(ZOOM_AFTER_CONTACT * last, window.time[1])
    title = "The same near zero" + (": A, C closing, B, D parting" if len(contacts) == 2 else "")
    u, v = _draw_relative(ax, window, shown, title)
    samples = [k for contact in contacts for k in _around(window, contact)]
    for (letter, _), k in zip(_edges(contacts), samples, strict=False):
        x, y = u[k] * MM, v[k]
        ax.plot([x], [y], "o", color="black", markersize=3.5, zorder=5)
        # above where the line comes, below where it parts; later contacts to the left, as they
        # may begin where one has ended
        above, left = letter in "ACEG", letter in "EFGH"
        ax.annotate(
            letter, (x, y), (-5 if left else 5, 3 if above else -4), textcoords="offset points",
            ha="right" if left else "left", va="bottom" if above else "top", fontweight="bold",
        )  # fmt: skip
    ax.axvline(0.0, color=style.RULE_COLOUR, linewidth=0.6)
    ax.margins(0.08)


def _draw_relative(
    ax: Axes, window: Window, shown: np.ndarray, title: str
) -> tuple[np.ndarray, np.ndarray]:
    """Draw mean piston motion relative to the bit, thick where the piston is on it.

    Returns
    -------
    u_r : ndarray
        Displacement [m].
    v_r : ndarray
        Velocity [m/s].
    """
    u = window.samples["relative_displacement"]
    v = window.samples["piston_velocity"] - window.samples["bit_velocity"]
    ax.plot(u[shown] * MM, v[shown], color="black", linewidth=1.0)
    for contact in window.contacts:
        first, last = _around(window, contact)
        if not shown[last]:
            break
        inside = slice(first, last + 1)
        ax.plot(u[inside] * MM, v[inside], color=style.CONTACT_COLOUR, linewidth=3.0, zorder=3)
    style.label(ax, "piston relative to bit, $u_r$ [mm]", "relative velocity, $v_r$ [m/s]", title)
    return u, v
