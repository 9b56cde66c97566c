"""Write the table of docs/effects.md and its figure: `python -m docs.make_effects`.

Takes a minute; an idle machine gives the better figures.
"""

from __future__ import annotations

from docs.blocks import DOCS, publish
from percussion_model import Scene
from percussion_model.analysis.effect_study import EffectsStudy, study_effects
from percussion_model.interface.commands.effects import table_of
from percussion_model.interface.plotting.effect_bars import draw_effects
from percussion_model.simulation.markdown import table
from percussion_model.verification.accuracy.timing import machine

REFERENCE = DOCS.parent / "scenarios" / "reference.toml"


def block(found: EffectsStudy, computer: dict[str, object]) -> str:
    """What was run and where, the table, and the reasons of its dashes."""
    result = found.base.result
    cells = " + ".join(str(count) for count in result.cells.values())
    headings, rows, reasons = table_of(found)
    head = [heading.replace("\n", ", ") for heading in headings]
    shown = table(head, rows, left=head[:1])
    dashes = "\n".join(f"- *{name}*: {reason}." for name, reason in reasons.items())
    return (
        f"Reference scene by waves, {cells} cells, {result.duration:g} s simulated; "
        f"{computer['processor']}, one thread, load {computer['load']:.1f} before.\n\n"
        f"{shown}\n\n{dashes}"
    )


def main() -> None:
    """Measure, write the page and draw the figure."""
    computer = machine()
    found = study_effects(Scene.from_toml(REFERENCE))
    publish(
        {"effects": block(found, computer)}, DOCS / "effects.md", dpi=110,
        figures=lambda: [("effects", draw_effects(found))],
    )  # fmt: skip


if __name__ == "__main__":
    main()
