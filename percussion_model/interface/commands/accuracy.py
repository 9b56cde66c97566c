"""Command `accuracy`: error against computing time, scene by scene."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from percussion_model.interface.commands import common

if TYPE_CHECKING:
    from percussion_model.interface.progress import Report
    from percussion_model.scene.scene import Scene
    from percussion_model.verification.accuracy import Study


def accuracy(
    scenes: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[SCENE]...", help="Scene files. Default: the reference scene."),
    ] = None,
    full: Annotated[
        bool, typer.Option("--full", help="Finer and costlier rungs too: up to an hour.")
    ] = False,
    methods: Annotated[
        str | None,
        typer.Option(
            "--methods",
            metavar="A,B",
            help="As modal,fem,exact-flow. Default: all; for several scenes, the quick ones.",
        ),
    ] = None,
    make_references: Annotated[
        bool,
        typer.Option("--make-references", help="Make the stored references of the scenes anew."),
    ] = False,
    settings: common.Settings = None,
    rock: common.RockName = None,
    bit: common.BitName = None,
    out: common.OutOrDefault = None,
    json_file: common.JsonFile = None,
    force: common.Force = False,
    figures: Annotated[bool, typer.Option(help="Draw error against time.")] = True,
) -> None:
    """Measure error against time: the default solver, its peers, rigid bars.

    Prints tables, of several scenes one of the default solver against the best of its peers as
    well; figures, and the numbers as JSON unless --json is given, go to out/accuracy.
    """
    from percussion_model.interface.commands.accuracy_tables import (
        show_bars,
        show_contests,
        show_study,
    )
    from percussion_model.interface.progress import progress
    from percussion_model.scene.scene import Scene
    from percussion_model.simulation.files import to_json
    from percussion_model.verification.accuracy import study
    from percussion_model.verification.accuracy.ladders import (
        COMPARED,
        chosen_ladders,
        refuse_asked,
    )
    from percussion_model.verification.accuracy.problems import default_solver, refuse_unfit
    from percussion_model.verification.accuracy.study import solvers_of

    chosen = [
        (path.stem, common.load_scene(path, settings=settings, is_run=False, rock=rock, bit=bit))
        for path in scenes or ()
    ]
    if not chosen:
        title = "The reference scene"
        chosen = [("reference", Scene(title=title))]
        for option, given in (("--set", settings), ("--rock", rock)):
            if given:
                raise common.refusal(f"{option} needs a SCENE to change")
    names = [name for name, _ in chosen]
    if len(set(names)) < len(names):
        raise common.refusal(
            f"{', '.join(names)}: results take the names of the scene files, which must differ"
        )
    if make_references and methods is not None:
        raise common.refusal(
            "--make-references and --methods do not go together: a reference is made by the same "
            "methods always"
        )
    words = None if methods is None else [word.strip() for word in methods.split(",")]
    if words is None and len(chosen) > 1:
        words = [COMPARED]
    ladders = chosen_ladders(words)  # refuses before anything is computed
    for _, scene in chosen:
        refuse_unfit(scene)
        if words is not None:
            refuse_asked(scene, chosen_ladders([word for word in words if word != COMPARED]))
        default_solver(scene)
    common.check_json(json_file)
    if make_references:
        common.tell_of_compiling("modal", "wave", "fem")
        for _, scene in chosen:
            show_bars(_make_reference(scene))
        return
    common.tell_of_compiling(
        *dict.fromkeys(name for _, scene in chosen for name in solvers_of(ladders, scene))
    )
    claimed = None
    if figures or json_file is None:
        claimed = common.claim(
            "accuracy", out, Path("out") / "accuracy", force,
            scenes=dict(chosen), full=full, methods=words,
        )  # fmt: skip
    found: dict[str, dict[str, Any]] = {}
    studies: dict[str, Study] = {}
    for k, (name, scene) in enumerate(chosen):
        place = f"scene {k + 1} of {len(chosen)}, {name}" if len(chosen) > 1 else name
        with progress(place, k / len(chosen)) as report:
            result = study(scene, full, words, partial(_tell, report, place, k, len(chosen)))
        studies[name] = result
        found[name] = result.to_dict()
        if json_file != "-":
            show_study(result)
        if claimed is None:
            continue
        if json_file is None:
            texts = {f"{name}.json": to_json(found[name]) + "\n"}
            common.write_texts(claimed, texts)
        if figures:
            with common.if_drawable():
                common.list_files(_draw(result, claimed.folder / name))
        common.list_files(common.sign(claimed))
    if len(studies) > 1 and json_file != "-":
        show_contests(studies)
    common.write_json(json_file, found)


def _tell(
    report: Report, place: str, done: int, count: int, text: str, share: float | None
) -> None:
    """Tell what is done at a scene, and the share of all scenes that is done."""
    report(f"{place}: {text}", None if share is None else (done + share) / count)


def _draw(found: Study, folder: Path) -> list[Path]:
    from percussion_model.interface.plotting.error_against_time import (
        draw_accuracy,
        draw_quantities,
    )
    from percussion_model.interface.plotting.style import save_figures
    from percussion_model.interface.progress import progress

    with progress("drawing the figures"):
        return save_figures(
            lambda: [
                ("accuracy", draw_accuracy(found)),
                ("accuracy_quantities", draw_quantities(found)),
            ],
            folder,
        )


def _make_reference(scene: Scene) -> Any:
    """Make the reference of a scene and keep it with the package."""
    from percussion_model.interface.progress import progress
    from percussion_model.verification.accuracy.problems import pose
    from percussion_model.verification.accuracy.references import (
        fingerprint,
        load_references,
        make_reference,
        package_store,
        save_references,
    )

    with progress("reference") as report:
        made = make_reference(pose(scene), scene, progress=lambda text: report(text, None))
    save_references(package_store(), {**load_references(), fingerprint(scene): made})
    return made
