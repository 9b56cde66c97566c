"""Command `paper`: the figures and statements of the paper, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from percussion_model.analysis.comparison import Comparison
    from percussion_model.analysis.study import Study
    from percussion_model.interface.plotting.window import Window
    from percussion_model.scene.scene import Scene
    from percussion_model.verification.paper.rock_law import Sinking
    from percussion_model.verification.paper.runs import Drop
    from percussion_model.verification.paper.statements import Statement


def paper(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")],
    processes: Annotated[
        int | None, typer.Option("--processes", min=1, help="For the sweeps; default: all cores.")
    ] = None,
    json_file: common.JsonFile = None,
    force: common.Force = False,
) -> None:
    """Reproduce figures 4 and 6 to 9 of the paper, and check what it says one by one."""
    from percussion_model.interface.progress import progress, progress_bar
    from percussion_model.interface.terminal import show_statements

    common.check_outputs(out, json_file)
    common.load_numba()
    try:
        from percussion_model.interface.plotting.activation import draw_activation
        from percussion_model.interface.plotting.compared_blows import draw_comparison
        from percussion_model.interface.plotting.motion import draw_motion
        from percussion_model.interface.plotting.paper import draw_drops, draw_scaling, draw_sweeps
        from percussion_model.interface.plotting.paper_rock_law import draw_force, draw_sinking
        from percussion_model.interface.plotting.style import save_figures
        from percussion_model.interface.plotting.window import last_blow_window
    except ImportError as error:
        raise common.refusal(common.needs_plot_extra(error)) from None
    from percussion_model.analysis.comparison import compare
    from percussion_model.verification.paper.rock_law import run_sinking
    from percussion_model.verification.paper.runs import SWEEPS, paper_scene, run_drops
    from percussion_model.verification.paper.statements import ERRORS

    common.tell_of_compiling("wave", "fem", "rigid")
    scene = paper_scene()
    claimed = common.claim("paper", out, None, force, scene=scene)
    part = _parts(4 + len(SWEEPS))
    with progress(f"{next(part)}, drop tests and sinking, figure 6"):
        drops, sinking = run_drops(scene), run_sinking(scene)
    sweeps = _sweeps(out, processes, part)
    with progress_bar(2 * scene.run.duration) as bar:
        bar.stage(f"{next(part)}, figures 7 and 8", bar.end)
        both = compare(scene, ("wave", "fem"), progress=bar)
    windows = {name: last_blow_window(result) for name, result in both.results.items()}

    figures: dict[str, Callable[[], Figure]] = {
        "figures4and7": lambda: draw_force(windows["wave"]),
        "sinking": lambda: draw_sinking(sinking),
        "figure6": lambda: draw_drops(drops),
        "figures7and8": lambda: draw_comparison(both),
    }
    for name, window in windows.items():
        figures[f"figure7_{name}"] = partial(draw_motion, window)
        figures[f"figure8_{name}"] = partial(draw_activation, window)
    figures |= {
        "figure9": lambda: draw_sweeps(sweeps),
        "scaling": lambda: draw_scaling(sweeps["d"]),
    }
    here = next(part)
    with progress(f"{here}, drawing") as report:
        save_figures(
            lambda: ((name, draw()) for name, draw in figures.items()), out, names=list(figures),
            report=lambda text, share: report(f"{here}, {text}", share),
        )  # fmt: skip
    with progress(f"{next(part)}, statements of the paper"):
        statements = list(_statements(scene, drops, sinking, both, windows, sweeps))
    tree = {"errors": ERRORS, "statements": [one.to_dict() for one in statements]}
    common.write_json(json_file, tree)
    common.write_json(str(out / "statements.json"), tree)
    common.list_files([claimed.sign()])
    if json_file != "-":
        show_statements(statements, ERRORS)


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


def _parts(count: int) -> Iterator[str]:
    """Names of the parts of the work, one after the other."""
    return (f"part {k} of {count}" for k in range(1, count + 1))


def _sweeps(out: Path, processes: int | None, part: Iterator[str]) -> dict[str, Study]:
    from percussion_model.interface.progress import count_bar
    from percussion_model.verification.paper.runs import SWEEPS, paper_scene, run_sweep

    found = {}
    for sweep in SWEEPS:
        name = sweep.name.replace("_", ", ")
        with count_bar(f"points of figure 9{name}, {next(part)}") as progress:
            folder = out / f"figure9{sweep.name}"
            found[sweep.name] = run_sweep(paper_scene(), sweep, folder, processes, progress)
            found[sweep.name].save(folder)
    return found
