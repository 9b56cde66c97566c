"""Command `paper`: the figures and statements of the paper, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from percussion_model.interface.commands import common
from percussion_model.simulation.interruption import interruptible

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from percussion_model.analysis.comparison import Comparison
    from percussion_model.analysis.study import Study
    from percussion_model.interface.plotting.window import Window
    from percussion_model.scene.scene import Scene
    from percussion_model.simulation.origin import Claim
    from percussion_model.verification.paper.rock_law import Sinking
    from percussion_model.verification.paper.runs import Drop
    from percussion_model.verification.paper.statements import Statement


# Files of each figure, in the order of what has to be computed for them.
FILES = {
    "figure6": ("figure6",),
    "sinking": ("sinking",),
    "figure9": ("figure9",),
    "scaling": ("scaling",),
    "figure4": ("figures4and7",),
    "figure7": ("figures4and7", "figures7and8", "figure7_wave", "figure7_fem"),
    "figure8": ("figures7and8", "figure8_wave", "figure8_fem"),
}
DROPS, SWEPT, COMPARED = ("figure6", "sinking"), ("figure9", "scaling"), ("figure4", "figure7",
                                                                          "figure8")  # fmt: skip
Name = Literal["figure4", "figure6", "figure7", "figure8", "figure9", "sinking", "scaling"]


def paper(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")],
    processes: Annotated[
        int | None, typer.Option("--processes", min=1, help="For the sweeps; default: all cores.")
    ] = None,
    only: Annotated[
        Name | None,
        typer.Option(
            "--only",
            help="One figure, without the statements. A later run of all goes on with its points.",
        ),
    ] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Write figures as PDF too.")] = False,
    json_file: common.JsonFile = None,
    force: common.Force = False,
) -> None:
    """Reproduce figures 4 and 6 to 9 of the paper, and check what it says one by one."""
    common.check_outputs(out, json_file)
    if only and json_file is not None:
        raise common.refusal("--json: holds the statements, which --only omits")
    try:
        from percussion_model.interface.plotting import paper as _plotting  # noqa: F401
    except ImportError as error:
        raise common.refusal(common.needs_plot_extra(error)) from None
    from percussion_model.interface.terminal import show_statements
    from percussion_model.verification.paper.runs import paper_scene
    from percussion_model.verification.paper.statements import ERRORS

    common.tell_of_compiling("wave", "fem", "rigid")
    scene = paper_scene()
    kinds = ("png", "svg", "pdf") if pdf else ("png", "svg")
    chosen = [name for name in FILES if only in (None, name)]
    claimed = common.claim("paper", out, None, force, scene=scene)
    written = _Written(claimed, kinds, {file for name in chosen for file in FILES[name]})
    try:
        with interruptible():
            statements = _compute(scene, processes, written, chosen)
    except KeyboardInterrupt:
        if not written.names:
            raise
        words = (
            f"interrupted; complete in {out}: {', '.join(written.names)}; the same command "
            "continues with the points that are kept there"
        )
        raise typer.Exit(common.print_message(words, common.INTERRUPTED)) from None
    if only:
        common.list_files([*written.files, *common.sign(claimed)])
        return
    tree = {"errors": ERRORS, "statements": [one.to_dict() for one in statements]}
    common.write_json(json_file, tree)
    common.write_json(str(out / "statements.json"), tree)
    common.list_files(common.sign(written.claimed))
    if json_file != "-":
        show_statements(statements, ERRORS)


class _Written:
    """Figures and points that are complete: each is written as soon as what it shows is known.

    Parameters
    ----------
    claimed : Claim
    kinds : sequence of str
        Endings of the files of a figure.
    wanted : set of str
        Names of the figures that are drawn.
    """

    def __init__(self, claimed: Claim, kinds: Sequence[str], wanted: set[str]) -> None:
        self.claimed, self.folder = claimed, claimed.folder
        self.kinds, self.wanted = kinds, wanted
        self.names: list[str] = []
        self.files: list[Path] = []

    def draw(self, part: str, figures: dict[str, Callable[[], Figure]]) -> None:
        """Write those figures that are wanted, by their names."""
        from percussion_model.interface.plotting.style import save_figures
        from percussion_model.interface.progress import progress

        figures = {name: draw for name, draw in figures.items() if name in self.wanted}
        with progress(f"{part}, drawing") as report:
            self.files += save_figures(
                lambda: ((name, draw()) for name, draw in figures.items()),
                self.folder, self.kinds, names=list(figures),
                report=lambda text, share: report(f"{part}, {text}", share),
            )  # fmt: skip
        self.names += figures
        self.claimed.sign()


def _compute(
    scene: Scene, processes: int | None, written: _Written, chosen: Sequence[str]
) -> list[Statement]:
    """Compute what the chosen figures show and draw them; check the statements if all are."""
    from percussion_model.interface.progress import progress
    from percussion_model.verification.paper.runs import SWEEPS

    parts = {DROPS: 1, SWEPT: len(SWEEPS) + 1, COMPARED: 1, (): len(chosen) == len(FILES)}
    count = sum(number for names, number in parts.items() if not names or set(names) & set(chosen))
    part = (f"part {k} of {count}" for k in range(1, count + 1))
    drops, sinking = _drops(scene, written, part) if set(DROPS) & set(chosen) else ([], {})
    sweeps = {}
    if set(SWEPT) & set(chosen):
        sweeps = _sweeps(written, processes, part)
        _draw_sweeps(sweeps, written, part)
    if not set(COMPARED) & set(chosen):
        return []
    both, windows = _compared(scene, written, part)
    if len(chosen) < len(FILES):
        return []
    with progress(f"{next(part)}, statements of the paper"):
        return list(_statements(scene, drops, sinking, both, windows, sweeps))


def _drops(
    scene: Scene, written: _Written, part: Iterator[str]
) -> tuple[list[Drop], dict[str, Sinking]]:
    from percussion_model.interface.plotting.paper import draw_drops
    from percussion_model.interface.plotting.paper_rock_law import draw_sinking
    from percussion_model.interface.progress import progress
    from percussion_model.verification.paper.rock_law import run_sinking
    from percussion_model.verification.paper.runs import run_drops

    here = next(part)
    with progress(f"{here}, drop tests and sinking, figure 6"):
        drops, sinking = run_drops(scene), run_sinking(scene)
    written.draw(
        here, {"sinking": lambda: draw_sinking(sinking), "figure6": lambda: draw_drops(drops)}
    )
    return drops, sinking


def _draw_sweeps(sweeps: dict[str, Study], written: _Written, part: Iterator[str]) -> None:
    from percussion_model.interface.plotting.paper import draw_scaling, draw_sweeps

    scaled = {"figure9": lambda: draw_sweeps(sweeps), "scaling": lambda: draw_scaling(sweeps["d"])}
    written.draw(next(part), scaled)


def _compared(
    scene: Scene, written: _Written, part: Iterator[str]
) -> tuple[Comparison, dict[str, Window]]:
    from percussion_model.analysis.comparison import compare
    from percussion_model.interface.plotting.activation import draw_activation
    from percussion_model.interface.plotting.compared_blows import draw_comparison
    from percussion_model.interface.plotting.motion import draw_motion
    from percussion_model.interface.plotting.paper_rock_law import draw_force
    from percussion_model.interface.plotting.window import last_blow_window
    from percussion_model.interface.progress import progress_bar

    here = next(part)
    with progress_bar(2 * scene.run.duration) as bar:
        bar.stage(f"{here}, figures 7 and 8", bar.end)
        both = compare(scene, ("wave", "fem"), progress=bar)
    windows = {name: last_blow_window(result) for name, result in both.results.items()}
    figures: dict[str, Callable[[], Figure]] = {
        "figures4and7": lambda: draw_force(windows["wave"]),
        "figures7and8": lambda: draw_comparison(both),
    }
    for name, window in windows.items():
        figures[f"figure7_{name}"] = partial(draw_motion, window)
        figures[f"figure8_{name}"] = partial(draw_activation, window)
    written.draw(here, figures)
    return both, windows


def _statements(
    scene: Scene,
    drops: list[Drop],
    sinking: dict[str, Sinking],
    both: Comparison,
    windows: dict[str, Window],
    sweeps: dict[str, Study],
) -> Iterator[Statement]:
    """Go through the paper from section 2.3 on."""
    from percussion_model.verification.paper import rock_law
    from percussion_model.verification.paper import statements as section_4

    waves = windows["wave"]
    jumps = rock_law.datum_jumps(waves.scene, waves.restart, waves.origin + waves.length)
    advance = float(both.results["wave"].blows["penetration"][-1])
    yield from rock_law.about_datum(jumps, advance)
    yield from rock_law.about_sinking(scene, sinking)
    yield from section_4.about_scales(scene)
    yield from section_4.about_drops(drops)
    for name, window in windows.items():
        result = both.results[name]
        yield from section_4.about_cycle(result, window.samples, window.origin)
        yield from section_4.about_double_impact(drops, result, window.samples, window.origin)
    yield from section_4.about_sweeps(sweeps)


def _sweeps(written: _Written, processes: int | None, part: Iterator[str]) -> dict[str, Study]:
    from percussion_model.interface.progress import count_bar
    from percussion_model.verification.paper.runs import SWEEPS, paper_scene, run_sweep

    found = {}
    for sweep in SWEEPS:
        name = sweep.name.replace("_", ", ")
        with count_bar(f"points of figure 9{name}, {next(part)}") as progress:
            folder = written.folder / f"figure9{sweep.name}"
            found[sweep.name] = run_sweep(paper_scene(), sweep, folder, processes, progress)
            found[sweep.name].save(folder)
            written.names.append(folder.name)
    return found
