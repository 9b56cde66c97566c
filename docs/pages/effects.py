"""What each effect costs and changes; takes a minute, and better an idle machine."""

from __future__ import annotations

from docs.blocks import REFERENCE, Made
from percussion_model import Scene
from percussion_model.analysis.effect_study import EffectsStudy, study_effects
from percussion_model.interface.commands.effects import table_of
from percussion_model.interface.plotting.effect_bars import draw_effects
from percussion_model.simulation.markdown import table
from percussion_model.verification.accuracy.timing import machine


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


def made() -> Made:
    """Measure."""
    computer = machine()
    found = study_effects(Scene.from_toml(REFERENCE))
    return Made(
        ("data/effects.md",), {"effects": block(found, computer)}, dpi=110,
        figures=lambda: [("effects", draw_effects(found))],
    )  # fmt: skip
