"""Published drilling rates beside predicted ones; takes half a minute."""

from __future__ import annotations

from docs.blocks import Made
from percussion_model.interface.plotting.rates import draw_rates
from percussion_model.interface.progress import count_bar
from percussion_model.verification.rates import compare_rates
from percussion_model.verification.rates.table import all_cases, other_rates, verdicts


def made() -> Made:
    """Verdicts, cases, and what is no case."""
    with count_bar("rates") as progress:
        found = compare_rates(progress=progress)
    parts = {"verdicts": verdicts(found), "cases": all_cases(found), "others": other_rates(found)}
    blocks = {name: "\n".join(lines) for name, lines in parts.items()}
    return Made(("data/rates.md",), blocks, figures=lambda: [("rates", draw_rates(found))], dpi=90)
