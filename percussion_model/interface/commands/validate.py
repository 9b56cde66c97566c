"""Command `validate`: published experiments computed, with criteria that were fixed before."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.simulation.origin import Claim
    from percussion_model.verification.measured import Comparison
    from percussion_model.verification.rates import Rates

# By this name the published rates are asked for, as an experiment is by its own.
RATES = "rates"


def validate(
    experiments: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[EXPERIMENT]...",
            help="Stored experiments, TOML files of your own, or rates for drilling rates. "
            "Default: all "
            "that is stored.",
        ),
    ] = None,
    out: common.Out = None,
    json_file: common.JsonFile = None,
    force: common.Force = False,
    variants: Annotated[bool, typer.Option(help="Compute other rigs and readings as well.")] = True,
    figures: Annotated[bool, typer.Option(help="Draw a figure for each experiment.")] = True,
) -> None:
    """Compare with published experiments and rates: what is fitted, predicted, and missed.

    Exit code 0 whatever is missed: that is a finding.
    """
    from percussion_model.interface.progress import count_bar
    from percussion_model.verification.measured import compare, load

    common.check_outputs(out, json_file)
    named = [one for one in experiments or () if one != RATES]
    chosen = load(named) if named or not experiments else []
    with_rates = len(named) < len(experiments or (RATES,))
    claimed = None
    if out is not None:
        claimed = common.claim(
            "validate", out, None, force, variants=variants,
            scenes={one.name: one.scene for one in chosen},
            files={name: common.digest(Path(name)) for name in named}, rates=with_rates,
        )  # fmt: skip
    common.tell_of_compiling("wave")
    with count_bar("fits") as progress:
        found = compare(chosen, variants, progress)
    rates = _rates() if with_rates else None
    tree = found.to_dict() | ({} if rates is None else {RATES: rates.to_dict()})
    common.write_json(json_file, tree)
    if json_file != "-":
        if chosen:
            show_validation(found)
        if rates is not None:
            show_rates(rates)
    if claimed is not None:
        _write(found, rates, tree, claimed, figures)
        common.list_files(common.sign(claimed))


def _rates() -> Rates:
    from percussion_model.interface.progress import count_bar
    from percussion_model.verification.rates import compare_rates

    with count_bar("rates") as progress:
        return compare_rates(progress=progress)


def _write(
    found: Comparison, rates: Rates | None, tree: dict[str, Any], claimed: Claim, figures: bool
) -> None:
    """Write the tables as CSV and JSON, and the figures, into a claimed folder."""
    from percussion_model.interface.progress import progress
    from percussion_model.simulation.files import to_json
    from percussion_model.verification.measured.table import as_csv
    from percussion_model.verification.rates.table import as_csv as rates_as_csv

    texts = {"validation.csv": as_csv(found), "validation.json": to_json(tree) + "\n"}
    if rates is not None:
        texts["rates.csv"] = rates_as_csv(rates)
    common.write_texts(claimed, texts)
    if not figures:
        return
    with common.if_drawable():
        from percussion_model.interface.plotting.rates import draw_rates
        from percussion_model.interface.plotting.style import save_figures
        from percussion_model.interface.plotting.validation import draw_all

        def figures_of() -> Iterator[tuple[str, Any]]:
            yield from draw_all(found)
            if rates is not None:
                yield RATES, draw_rates(rates)

        names = [one.name for one in found.experiments] + ([] if rates is None else [RATES])
        with progress("drawing") as report:
            drawn = save_figures(figures_of, claimed.folder, names=names, report=report)
        common.list_files(drawn)


def show_validation(found: Comparison) -> None:
    """Print the table, fit after fit, and what its errors are."""
    from rich.console import Console
    from rich.markup import escape

    from percussion_model.interface.messages import wrapped
    from percussion_model.interface.tables import airy_table, print_notes, print_table
    from percussion_model.interface.terminal import show_note
    from percussion_model.verification.measured import table as texts

    console = Console()

    def print_rows(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
        left = [heading for heading in headings if not texts.is_number(heading)]
        table = airy_table(headings, left, headings[:1], pad_edge=False, padding=0)
        for row in rows:
            table.add_row(*row)
        print_table(table)
        console.print()

    titles = {one.name: one.title for one in found.experiments}
    for fit in found.fits:
        head = f"{titles[fit.experiment]}. Law {fit.law}, fit {fit.name}:"
        console.print(f"[bold]{escape(wrapped(head))}[/bold]", highlight=False)
        print_notes([texts.parameters_text(fit)])
        print_rows(texts.HEADINGS, map(texts.cells, found.of(fit.experiment, fit.name)))
    for title, headings, rows in texts.variant_tables(found):
        console.print(f"[bold]{escape(wrapped(title))}[/bold]", highlight=False)
        print_rows(headings, rows)
    for name, why in texts.reasons_of_variants(found).items():
        show_note(name, why)
    for why, ids in texts.reasons(found).items():
        show_note(f"no criterion for {', '.join(ids)}", why)
    print_notes([*texts.NOTES, texts.count_text(found)])


def show_rates(found: Rates) -> None:
    """Print the rates, case after case, and what each criterion says."""
    from rich.console import Console

    from percussion_model.interface.tables import airy_table, print_notes, print_table
    from percussion_model.verification.rates import table as texts

    console = Console()

    def print_rows(
        title: str, headings: Sequence[str], rows: Iterable[Sequence[str]], words: Sequence[str]
    ) -> None:
        console.print(f"[bold]{title}[/bold]", highlight=False)
        left = [one for one in headings if one in texts.OF_WORDS]
        table = airy_table(headings, left, words, pad_edge=False, padding=0)
        for row in rows:
            table.add_row(*row)
        print_table(table)
        console.print()

    print_rows(texts.TITLE, texts.HEADINGS, map(texts.cells, found.rows), ("rock", "hammer"))
    print_rows(
        "Criteria of the rates", texts.OF_VERDICTS, texts.verdict_rows(found),
        ("of", "criterion", "asked"),
    )  # fmt: skip
    print_notes([*texts.NOTES, texts.summary(found)])
