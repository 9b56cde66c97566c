"""Write docs/effects.md and its figure from the reference scene: `python -m docs.make_effects`.

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
REFERENCE = HERE.parent / "scenarios" / "reference.toml"

HEAD = """# Effects

Which effects does a scene need, and what does each cost? `percussion effects SCENE` turns each of
them off, or on where it is off, one at a time, runs the scene, and puts cost and change side by
side. This page shows what it says of the reference scene; it is written by
`python -m docs.make_effects`.

![Cost and change of each effect](images/effects.png)

"""

READING = """
- *step*: processor time of one time step in free flight, without leaps: the least of many short
  stretches, all scenes in turn. *run*, *blow*: wall time of the whole run with leaps, and by its
  blows. *events*: closures, openings and changes of mode in the whole run. The rest are changes
  against the scene as it is, in rate of penetration, blow period and peak bit force.
- **No step gets dearer by turning an effect off**; one that does by more than 5 % has an asterisk.
  A whole run may well get dearer, since an effect that is off can leave more to happen. Without
  loss or barrier the bit runs through many more events; without feed, drive or rock there is little
  of the standstill that leaps cross at once. That is why events stand beside the time.
- *Leaps* are no effect but a way to compute: they change the cost and nothing else.
- A dash is a number that would mean nothing, and the reason is told. *undecided* is a rate that its
  error hides or that depends on the cells, or a change within the errors of both numbers, or within
  three standard errors of their scatter;
  ± is the [numerical error](requested_accuracy.md), by the size of the cells and the scatter of the
  blows. The errors of a change are taken as independent, which makes its own rather too large. A
  change behind ≈ has no error: that of the cells is not known of one of its numbers.
"""


def table(found: EffectsStudy) -> str:
    """The table in Markdown, and the reasons of its dashes."""
    headings, rows, reasons = table_of(found)
    headings = [heading.replace("\n", ", ") for heading in headings]
    lines = ["| " + " | ".join(headings) + " |", "|---" + "|---:" * (len(headings) - 1) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    lines += ["", *(f"- *{name}*: {reason}." for name, reason in reasons.items())]
    return "\n".join(lines)


def page(found: EffectsStudy, computer: dict[str, object]) -> str:
    """Text of the page."""
    result = found.base.result
    cells = " + ".join(str(count) for count in result.cells.values())
    load = computer["load"]
    where = (
        f"Reference scene by waves, {cells} cells, {result.duration:g} s simulated; "
        f"{computer['processor']}, one thread, load {load:.1f} before.\n\n"
    )
    return HEAD + where + table(found) + "\n" + READING


def main() -> None:
    """Measure, write the page and draw the figure."""
    computer = machine()
    found = study_effects(Scene.from_toml(REFERENCE))
    (HERE / "effects.md").write_text(page(found, computer), encoding="utf-8")
    with matplotlib.rc_context(style.STYLE):
        draw_effects(found).savefig(HERE / "images" / "effects.png", dpi=110)


if __name__ == "__main__":
    main()
