"""Write the tables of docs/data/rates.md and its figure: `python -m docs.make_rates`.

Takes half a minute.
"""

from __future__ import annotations

from docs.blocks import DOCS, publish
from percussion_model.interface.plotting.rates import draw_rates
from percussion_model.interface.progress import count_bar
from percussion_model.verification.rates import Rates, compare_rates
from percussion_model.verification.rates.table import all_cases, other_rates, verdicts

PAGE = DOCS / "data" / "rates.md"
DPI = 90


def blocks(found: Rates) -> dict[str, str]:
    """Verdicts, cases, and what is no case."""
    parts = {"verdicts": verdicts(found), "cases": all_cases(found), "others": other_rates(found)}
    return {name: "\n".join(lines) for name, lines in parts.items()}


def main() -> None:
    """Compute, write the page and draw the figure."""
    with count_bar("rates") as progress:
        found = compare_rates(progress=progress)
    publish(blocks(found), PAGE, figures=lambda: [("rates", draw_rates(found))], dpi=DPI)


if __name__ == "__main__":
    main()
