"""Write the table of docs/effects.md and its figure: `python -m docs.make_effects`.

Takes a minute; an idle machine gives the better figures.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

from percussion_model import Scene
from percussion_model.analysis.effect_study import EffectsStudy, study_effects
from percussion_model.interface.commands.effects import table_of
from percussion_model.interface.plotting import style
from percussion_model.interface.plotting.effect_bars import draw_effects
from percussion_model.verification.accuracy.timing import machine

HERE = Path(__file__).resolve().parent
PAGE = HERE / "effects.md"
REFERENCE = HERE.parent / "scenarios" / "reference.toml"

BEGIN, END = "<!-- tables: begin -->", "<!-- tables: end -->"


def table(found: EffectsStudy) -> str:
    """The table in Markdown, and the reasons of its dashes."""
    headings, rows, reasons = table_of(found)
    headings = [heading.replace("\n", ", ") for heading in headings]
    lines = ["| " + " | ".join(headings) + " |", "|---" + "|---:" * (len(headings) - 1) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    lines += ["", *(f"- *{name}*: {reason}." for name, reason in reasons.items())]
    return "\n".join(lines)


def block(found: EffectsStudy, computer: dict[str, object]) -> str:
    """What was run and where, and the table."""
    result = found.base.result
    cells = " + ".join(str(count) for count in result.cells.values())
    return (
        f"Reference scene by waves, {cells} cells, {result.duration:g} s simulated; "
        f"{computer['processor']}, one thread, load {computer['load']:.1f} before.\n\n"
        f"{table(found)}"
    )


def page(found: EffectsStudy, computer: dict[str, object]) -> str:
    """Text of the page with its table renewed."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n\n{block(found, computer)}\n\n{END}{after}"


def main() -> None:
    """Measure, write the page and draw the figure."""
    computer = machine()
    found = study_effects(Scene.from_toml(REFERENCE))
    PAGE.write_text(page(found, computer), encoding="utf-8")
    with matplotlib.rc_context(style.STYLE):
        draw_effects(found).savefig(HERE / "images" / "effects.png", dpi=110)


if __name__ == "__main__":
    main()
