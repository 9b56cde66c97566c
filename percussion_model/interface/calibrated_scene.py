"""Comments at the head of a calibrated scene: what was fitted, how well, and what was kept."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING

from percussion_model.scene.parameters import rows_by_key

if TYPE_CHECKING:
    from percussion_model.analysis.fitting import Fit

# Characters a line of comments.
WIDTH = 98


def commented_fit(found: Fit, written: Mapping[str, float], scene: str) -> str:
    """Write a fit as comments of TOML.

    Parameters
    ----------
    found : Fit
    written : mapping
        Parameters that the scene has from the fit, by their key.
    scene : str
        Name of the file that all others are from.

    Returns
    -------
    str
        Lines that begin with #, the last one empty.
    """
    from percussion_model.analysis.fitting.found import LAWS, NAMES

    lines = [f"Calibrated by `percussion calibrate {scene}`, from:"]
    for one in found.explained:
        kind = "given" if one.noise_is_given else "estimated"
        data = "1 number" if len(one.data) == 1 else f"{len(one.data)} data"
        lines.append(f"  {one.name}: {data}, noise {one.noise_text()} {one.unit} ({kind})")
        for it in one.sensor:
            value, error, width = it.texts()
            lines.append(f"    {it.name} of the sensor {value} ± {error}, prior ± {width}")
    kind = "widened" if found.is_widened else f"{100 * found.confidence:g} %"
    lines += ["", f"Parameters and their {kind} intervals, all together:"]
    for key in LAWS[found.law]:
        symbol, estimate, unit = NAMES[key], found.estimates.get(key), rows_by_key()[key].unit
        if estimate is None:
            lines.append(f"  {key} ({symbol}): not fitted, kept as in {scene}")
            continue
        value, low, high = estimate.texts()
        at = f"{value} in {low} to {high} {unit}"
        at = f"{at.removesuffix('-').rstrip()}, {estimate.verdict}"
        kept = "" if key in written else f"; kept as in {scene}"
        lines.append(f"  {key} ({symbol}): {at}{kept}")
    if found.warnings:
        lines += ["", "What to know before using them:"]
        for text in found.warnings:
            lines += textwrap.wrap(text, WIDTH, initial_indent="  ", subsequent_indent="    ")
    return "".join(f"# {line}".rstrip() + "\n" for line in lines) + "\n"
