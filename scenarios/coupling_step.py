"""Error of a coupled run against the communication step: `python -m scenarios.coupling_step`.

The feed-controlled system in its first rock. The reference is the shortest step; what is
compared is the rate over whole blows, and the energy that the coupling makes in the
shoulder, by the energy of the blows.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from percussion_model.coupling import Coupling
from percussion_model.coupling.balance import known_signals, summary
from scenarios.harness import FIGURES, ROOT

DURATION = 0.4  # [s]: eight blows
STEPS = (1e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2)  # [s]
ORDERS = ("jacobi", "gauss-seidel")
SHORTEST_OF_BOTH = 1e-4  # [s]: shorter steps take long, and serve as the reference alone

Row = tuple[str, float, float, float, float]


def simulate(
    system: Path, steps: Sequence[float] = STEPS, orders: Sequence[str] = ORDERS
) -> list[Row]:
    """Run the system at all steps.

    Returns
    -------
    list of tuple
        Order, step [s], rate [m/s], mean feed [N] and energy taken by the shoulder by the
        energy of the blows [1].
    """
    rows = []
    for order in orders:
        for step in steps:
            if order != orders[0] and step < SHORTEST_OF_BOTH:
                continue
            coupling = Coupling(system, order=order)
            signals = [*known_signals(coupling.outputs), "hammer.blow_position", "hammer.blow_time"]
            run = coupling.run(DURATION, step, signals, interval=max(step, 1e-2))
            if run.error:
                raise RuntimeError(run.error)
            rate = float(run["hammer.blow_position"][-1] / run["hammer.blow_time"][-1])
            feed = float(run["string.bit_impulse"][-1]) / DURATION
            rows.append((order, step, rate, feed, summary(run)["shoulder_by_blows"]))
    return rows


def errors(rows: Sequence[Row]) -> list[tuple[Row, float]]:
    """Error of the rate against the shortest step."""
    exact = min(rows, key=lambda row: row[1])[2]
    return [(row, row[2] / exact - 1.0) for row in rows]


def table(rows: Sequence[Row]) -> str:
    """Markdown."""
    lines = [
        "| order | step [ms] | rate [mm/s] | error | mean feed [N] | shoulder / blows |",
        "|---|---|---|---|---|---|",
    ]
    for (order, step, rate, feed, share), error in errors(rows):
        lines.append(
            f"| {order} | {1e3 * step:g} | {1e3 * rate:.3f} | {100 * error:+.2f} % "
            f"| {feed:.0f} | {100 * share:+.3f} % |"
        )
    return "\n".join(lines)


def draw(rows: Sequence[Row], path: Path) -> Path:
    """Draw errors over the step."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7.0, 6.0))
    for order in sorted({row[0] for row in rows}):
        chosen = [(row, error) for row, error in errors(rows) if row[0] == order]
        steps = [1e3 * row[1] for row, _ in chosen]
        axes[0].plot(steps, [100.0 * abs(error) for _, error in chosen], "o-", label=order)
        axes[1].plot(steps, [100.0 * row[4] for row, _ in chosen], "o-", label=order)
    axes[0].set_ylabel("error of the rate [%]")
    axes[0].set_yscale("log")
    axes[0].legend(fontsize="small")
    axes[1].set_ylabel("energy taken by the shoulder\nby that of the blows [%]")
    axes[1].axhline(0.0, color="k", linewidth=0.6)
    axes[1].set_xlabel("communication step [ms]")
    for ax in axes:
        ax.set_xscale("log")
        ax.grid(alpha=0.3)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path


if __name__ == "__main__":
    archive = Path(sys.argv[1]) if sys.argv[1:] else ROOT / "dist" / "FeedControlRigid.ssp"
    found = simulate(archive)
    print(table(found))
    print(draw(found, FIGURES / "coupling_step.png"))
