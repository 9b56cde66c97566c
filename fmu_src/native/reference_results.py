"""Experiments with their results inside an FMU, as FMI-LS-REF has them.

The layered standard (github.com/modelica/fmi-ls-ref, 1.0.0-beta.1) lists the files in a
manifest; the experiments follow the Modelica Association's format for them
(github.com/modelica/ma-hs-experiments, schema of 2026). Both are drafts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, register_namespace

import numpy as np

from fmu_src.description import to_bytes
from fmu_src.hammer.inputs import NAMES_OUTSIDE
from fmu_src.hammer.variables import hammer_variables
from fmu_src.native.archive import add_files
from fmu_src.variables import Variable, closed_bounds
from percussion_model.scene.inputs import INPUTS, no_effect_reason
from percussion_model.scene.scene import Scene

NAME = "org.fmi-standard.fmi-ls-ref"
# The drafts up to 1.0.0-beta.1 all ask for this number in the manifest.
VERSION = "1.0.0-alpha.1"
DESCRIPTION = "Layered Standard providing information on related files included in an FMU."
FOLDER = f"extra/{NAME}"
MANIFEST = "http://fmi-standard.org/fmi-ls-manifest"
EXPERIMENTS = "experiments.exp"
SCENE = "scene.toml"
PAGE = "documentation/fmi-ls-ref.txt"

# Times that are exact in binary: all hosts meet the same communication points [s].
STEP_SIZE = 2.0**-10
DURATION = 0.5
# Times [s] and shares of the start values between which an input goes straight.
COURSES = {
    "feed_force": ((0.125, 1.0), (0.1875, 1.2)),
    "supply_pressure": ((0.1875, 1.0), (0.25, 0.9)),
    "rock.loading_stiffness": ((0.375, 1.0), (0.4375, 0.75)),
}
PERCUSSION_OFF = (0.25, 0.3125)  # [s]
# Beyond these the numbers of two processors differ.
DIGITS = 12
# What is left over of sums that cancel: no other machine repeats it.
NOISE = ("energy_residual",)

TEXT = """Experiments and reference results (FMI-LS-REF)

Each experiment of extra/{name}/{experiments} has its inputs in <name>_in.csv and the
outputs at each communication point in <name>_ref.csv. Inputs are set at the start of a
communication step and held over it; between two lines of a file numbers go straight, and
flags stay as they are. Outputs have {digits} digits, of which processors and systems may give
the last ones otherwise; {noise} is omitted, for it is nothing else. {scene} is the scene that
is baked in.
"""

# Runs the FMU with the options of `fmpy.simulate_fmu`, and returns what that does.
Run = Callable[..., Any]


@dataclass(frozen=True)
class Experiment:
    """A run with given inputs: a structured array with `time` and a column for each."""

    name: str
    description: str
    signals: np.ndarray


def experiments(scene: Scene) -> list[Experiment]:
    """The experiments: one with constant inputs, one with all changes that have an effect."""
    inputs = [one for one in hammer_variables(scene) if one.causality == "input"]
    acting = {NAMES_OUTSIDE[name] for name in INPUTS if not no_effect_reason(scene, name)}
    idle = set(NAMES_OUTSIDE.values()) - acting
    courses = {name: course for name, course in COURSES.items() if name not in idle}
    flags = () if idle >= {"supply_pressure", "piston_force"} else PERCUSSION_OFF
    times = {0.0, *flags, *(time for course in courses.values() for time, _ in course)}
    constant = _held(inputs, [0.0, DURATION])
    changing = _held(inputs, [*sorted(times), DURATION])
    now = changing["time"]
    for one in inputs:
        if one.name in courses:
            moments, shares = np.array(courses[one.name]).T
            wanted = one.start * np.interp(now, moments, shares)
            changing[one.name] = np.clip(wanted, *closed_bounds(one.row))
        elif one.name == "percussion_on" and flags:
            changing[one.name] = (now < flags[0]) | (now >= flags[1])
    return [
        Experiment("constant_inputs", "the scene as it is, inputs constant", constant),
        Experiment(
            "changing_inputs",
            "feed force and stiffness of the rock change, pressure falls, percussion rests",
            changing,
        ),
    ]


def _held(inputs: Sequence[Variable], times: Sequence[float]) -> np.ndarray:
    """Table of inputs that keep their start values."""
    kinds = [(one.name, np.bool_ if one.type == "Boolean" else np.float64) for one in inputs]
    table = np.zeros(len(times), [("time", np.float64), *kinds])
    table["time"] = times
    for one in inputs:
        table[one.name] = one.start
    return table


def reference_results(
    scene: Scene, run: Run, named: Callable[[str], str] = str
) -> dict[str, bytes]:
    """Files for the archive, by their paths in it.

    Parameters
    ----------
    run : callable
        Runs the FMU: takes `stop_time`, `step_size`, `output_interval` and `input`, and
        returns a structured array with `time` and a column for each output.
    named : callable
        Gives the names that variables have in the FMU.
    """
    cases = experiments(scene)
    files = {
        EXPERIMENTS: _write_experiments(cases),
        "fmi-ls-manifest.xml": _write_manifest(cases),
        SCENE: scene.to_toml().encode(),
    }
    for case in cases:
        case.signals.dtype.names = tuple(map(named, case.signals.dtype.names or ()))
        result = run(
            stop_time=DURATION,
            step_size=STEP_SIZE,
            output_interval=STEP_SIZE,
            input=case.signals,
        )
        files[f"{case.name}_in.csv"] = _write_table(case.signals)
        files[f"{case.name}_ref.csv"] = _write_table(result)
    text = TEXT.format(
        name=NAME, experiments=EXPERIMENTS, digits=DIGITS, noise=", ".join(NOISE), scene=SCENE
    )
    return {f"{FOLDER}/{name}": content for name, content in files.items()} | {PAGE: text.encode()}


def add_reference_results(
    path: Path, scene: Scene, run: Run, named: Callable[[str], str] = str
) -> None:
    """Run an FMU and put experiments and results into its archive."""
    add_files(path, reference_results(scene, run, named))


def _write_experiments(cases: list[Experiment]) -> bytes:
    told = {"name": "Smoke tests", "description": "short runs to try a host with"}
    root = Element("Experiments", told)
    for case in cases:
        told = {"name": case.name, "description": case.description}
        node = SubElement(root, "Experiment", told)
        times = {"startTime": 0.0, "stopTime": DURATION, "stepSize": STEP_SIZE}
        texts = {name: repr(time) for name, time in times.items()}
        SubElement(node, "TransientSimulation", texts)
        SubElement(node, "Stimuli", {"source": f"{case.name}_in.csv"})
        SubElement(node, "References", {"source": f"{case.name}_ref.csv"})
    return to_bytes(root)


def _write_manifest(cases: list[Experiment]) -> bytes:
    register_namespace("fmi-ls", MANIFEST)
    told = {"name": NAME, "version": VERSION, "description": DESCRIPTION}
    root = Element(
        "fmiReferences", {f"{{{MANIFEST}}}fmi-ls-{key}": text for key, text in told.items()}
    )
    related = [
        ("application/x-ma-hs-experiments", EXPERIMENTS, "experiment/smoke-test", "experiments"),
        ("application/toml", SCENE, "model", "scene that is baked in"),
        ("text/plain", f"../../{PAGE}", "document", "about the experiments"),
    ]
    for case in cases:
        related.append(("text/csv", f"{case.name}_ref.csv", "result", f"of {case.name}"))
    for kind, source, role, text in related:
        told = {"type": kind, "source": source, "role": role, "description": text}
        SubElement(root, "Related", told)
    return to_bytes(root)


def _write_table(table: np.ndarray) -> bytes:
    """CSV as hosts of FMI read it: names in quotation marks, flags 0 or 1."""
    names = [name for name in table.dtype.names or () if name not in NOISE]
    lines = [",".join(f'"{name}"' for name in names)]
    lines += [",".join(_number(value) for value in row) for row in table[names].tolist()]
    return ("\n".join(lines) + "\n").encode()


def _number(value: bool | int | float) -> str:
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else str(int(value))
