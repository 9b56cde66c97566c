"""Words, tables and files of rock from a log."""

from __future__ import annotations

import math
from base64 import b64encode
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from percussion_model.analysis.identify.drill import Drill
from percussion_model.analysis.identify.observation import SIGNALS, UNKNOWNS
from percussion_model.analysis.identify.part import to_numbers
from percussion_model.analysis.identify.plan import Change
from percussion_model.analysis.identify.profile import Profile, part_filter
from percussion_model.simulation.files import staged

MEGA = 1e-6
RPM = 30.0 / math.pi
WORDS = {
    "apparent_energy": ("energy / efficiency", "MJ/m³", MEGA),
    "unloading_ratio": ("ratio of unloading", "–", 1.0),
    "loading_stiffness": ("loading stiffness", "kN/mm", 1e-6),
    "renewal_length": ("renewal length", "mm", 1e3),
    "threshold": ("threshold of a button", "J", 1.0),
    "friction": ("friction", "–", 1.0),
}
SETTING = {"pressure": ("pressure", "bar", 1e-5), "feed": ("feed", "kN", 1e-3),
           "speed": ("rotation", "rpm", RPM)}  # fmt: skip
LAYER_HEADS = ("layer,\nm", "energy / efficiency,\nMJ/m³", "\n95 %", "strength,\nMPa", "\n95 %")
DETERMINED, HELD = "determined", "not determined: its prior"

Table = tuple[str, Sequence[str], list[tuple[str, ...]]]


def layer_rows(found: Profile) -> list[tuple[str, ...]]:
    """Rows of the layers that were found, each as it is known at its end."""
    return [
        (
            f"{one['top']:.1f} to {one['bottom']:.1f}", f"{MEGA * one['apparent_energy']:.3g}",
            f"{MEGA * one['low']:.3g} to {MEGA * one['high']:.3g}",
            f"{MEGA * one['strength']:.0f}",
            f"{MEGA * one['strength_low']:.0f} to {MEGA * one['strength_high']:.0f}",
        )
        for one in found.summary()["layers"]
    ]  # fmt: skip


def unknown_rows(found: Profile) -> list[tuple[str, ...]]:
    """Rows of the unknowns behind the last sample, and whether the log determines them."""
    known = found.determined()
    rows: list[tuple[str, ...]] = []
    for k, name in enumerate(UNKNOWNS):
        words, unit, factor = WORDS[name]
        low, value, high = (factor * one[-1] for one in found.interval(k))
        said = DETERMINED if known[name] else HELD
        rows.append((f"{words}, {unit}", f"{value:.3g}", f"{low:.3g} to {high:.3g}", said))
    return rows


def count_rows(found: Profile) -> list[tuple[str, ...]]:
    """Rows of the log by the rule that left them out."""
    rows = [(rule, f"{count}") for rule, count in found.samples.dropped.items()]
    return [("in the log", f"{found.samples.total}"), ("used", f"{len(found.depth)}"), *rows]


def rows_said(found: Profile) -> str:
    """Say how many rows of the log are used, and which are not."""
    dropped = "; ".join(f"{count} {rule}" for rule, count in found.samples.dropped.items())
    used = f"{len(found.depth)} of {found.samples.total} rows are used"
    return f"{used}. Dropped: {dropped or 'none'}."


def notes(found: Profile) -> list[str]:
    """What was decided, and how far the numbers hold."""
    noise, table = found.noise.values(), found.table.errors
    shown = ", ".join(
        f"{name} {100 * a:.2g} and {100 * b:.2g} %"
        for name, a, b in zip(SIGNALS, noise, table, strict=True)
        if np.isfinite(found.samples.signals[:, SIGNALS.index(name)]).any()
    )
    said = [
        *found.samples.notes,
        f"Noise of a sample, and error of the table: {shown}.",
        "A rate shows the crushing energy divided by the efficiency of the bit; the strength has "
        "the interval of the efficiency and of the relation as well. A bit that wears seems to "
        "meet harder rock.",
    ]
    if not found.determined()["renewal_length"]:
        said.append(
            "Rotation was too even to part the crushing energy from the share of fresh rock: the "
            "interval holds both. Steps of rotation would show (--plan)."
        )
    return said


def plan_rows(changes: Sequence[Change]) -> list[tuple[str, ...]]:
    """Rows of changes, the best first."""
    rows: list[tuple[str, ...]] = []
    for one in changes:
        words = "go on as now"
        if one.setting:
            name, unit, factor = SETTING[one.setting]
            words = f"{name} to {factor * one.value:.3g} {unit}, {100 * one.share:.0f} % of now"
        also = ", ".join(WORDS[name][0] for name in one.narrowed) or "–"
        rows.append((words, f"± {100 * one.interval:.1f} %", also))
    return rows


def plan_words(changes: Sequence[Change]) -> str:
    """Say which change of the next metre would show most."""
    now = next(one for one in changes if not one.setting)
    best = changes[0]
    if not best.setting or best.spread > 0.97 * now.spread:
        return (
            "No change of the next metre shows more of the crushing energy than going on as now: "
            f"± {100 * now.interval:.2g} %."
        )
    name, unit, factor = SETTING[best.setting]
    also = [WORDS[one][0] for one in best.narrowed]
    tells = f" It shows {' and '.join(also)} too." if also else ""
    return (
        f"Drill half of the next metre with {name} at {factor * best.value:.3g} {unit}, "
        f"{100 * best.share:.0f} % of now: the crushing energy / efficiency is then known to "
        f"± {100 * best.interval:.2g} %, in place of ± {100 * now.interval:.2g} %.{tells}"
    )


def csv_text(found: Profile, every: float) -> str:
    """Return rows along depth, SI; in a step of depth the last sample counts."""
    rows = found.every(every)
    columns = {"row": found.samples.rows.astype(float), "depth": found.depth}
    for name, three in (
        ("apparent_energy", found.interval()), ("strength", found.strength()),
        *((name, found.interval(k)) for k, name in enumerate(UNKNOWNS) if k),
    ):  # fmt: skip
        columns |= {f"{name}_low": three[0], name: three[1], f"{name}_high": three[2]}
    tops = np.array(found.layers)
    columns["layer"] = 1.0 + np.searchsorted(tops, found.depth, side="right")
    lines = [",".join(columns)]
    lines += [",".join(f"{values[k]:.6g}" for values in columns.values()) for k in rows]
    return "\n".join(lines) + "\n"


def part_text(found: Profile, drill: Drill) -> str:
    """Return parameters of the part RockFilter, as a system's file has them."""
    numbers = to_numbers(part_filter(found, drill))
    return "[parameters.filter]\n" + "".join(f'"{k}" = {v:.9g}\n' for k, v in numbers.items())


def write_pages(
    found: Profile, folder: Path, name: str, tool: str, every: float, changes: Sequence[Change]
) -> list[Path]:
    """Write table, figure and report into a folder, all or none."""
    from matplotlib import rc_context

    from percussion_model.interface.pages import filled
    from percussion_model.interface.plotting import style
    from percussion_model.interface.plotting.rock_profile import draw_profile

    tables: list[Table] = [
        ("Layers", LAYER_HEADS, layer_rows(found)),
        (
            "What the log shows",
            ("behind the last sample", "value", "95 %", ""),
            unknown_rows(found),
        ),
        ("Rows", ("", "rows"), count_rows(found)),
    ]
    if changes:
        heads = ("half of the next metre", "energy / efficiency", "shows too")
        tables.insert(0, ("The next metre", heads, plan_rows(changes)))
    with staged(folder) as draft:
        (draft / "rock.csv").write_text(csv_text(found, every), encoding="utf-8")
        with rc_context(style.STYLE):
            figure = draw_profile(found, f"Rock of {name}")
            picture = style.save_png(figure, draft / "rock.png", 110)
        page = filled(
            "identify.html.j2", name=name, tool=tool, depth=float(found.depth[-1]),
            picture=b64encode(picture.read_bytes()).decode(), tables=tables, notes=notes(found),
        )  # fmt: skip
        (draft / "report.html").write_text(page, encoding="utf-8")
    return [folder / one for one in ("rock.csv", "rock.png", "report.html")]
