"""The documentation page inside an FMU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from html import escape

from fmu_src.description import About
from fmu_src.flat_names import flat_names
from fmu_src.variables import Variable
from percussion_model.scene.scene import Scene

STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse}td,th{padding:.2em .8em .2em 0;text-align:left;"
    "vertical-align:top;border-bottom:1px solid #ddd}code{white-space:nowrap}"
)
INTRODUCTION = """
<p>A drive throws a piston against a bit; stress waves run through both, and the bit crushes rock.
SI units; positions and velocities point down, forces on rock and contact are positive in
compression. The solver takes its own steps: communication steps of any size, equal or not, give
the same blows. Inputs are held over a communication step and must be finite and within their
bounds. Outputs belong to the step just finished; none depends on an input at once.</p>
"""
NEEDS_PYTHON = """\
<p>Needs a Python 3.11 or newer in the process of the host. <code>resources/native</code> has
libraries that compute; on a platform without one Python needs numpy and numba too, and compiles
when kernels are used for the first time (about a minute). They are kept in the user's cache
folder; the environment variable <code>PERCUSSION_FMU_CACHE</code> names another one.</p>
"""
NEEDS_NOTHING = """<p>Needs nothing but the C library of the system. There are libraries for
{platforms}; the numbers of the scene lie in <code>resources/model.bin</code>.</p>
"""
ERRORS = """
<p>No output carries an error. {grid} Errors of the rock's parameters and of the model itself come
on top.</p>
<p><code>rate_of_penetration</code>, <code>penetration_per_blow</code> and the other numbers of a
blow are those of one blow. Where all blows are alike that is the mean. Where they differ
(aperiodic motion) it is one draw, which may be off the mean by more than the mean itself: take
the rise of <code>hole_depth</code> over many blows, from one rise of <code>blow_count</code> to
another, and its scatter from stretch to stretch as the error.</p>
<p>The command <code>percussion run</code> with the scene below shows the mean rate ± its error, of
discretisation and scatter, for constant inputs.</p>
"""


def write_page(
    about: About,
    variables: Sequence[Variable],
    scene: Scene | None = None,
    needs: str = NEEDS_PYTHON,
) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    scene : Scene, optional
        The scene that is baked in, for its text.
    needs : str
        What the FMU needs of its host, HTML; said where there is a scene.
    """
    parts = [
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{escape(about.model)}</title><style>{STYLE}</style></head><body>",
        f"<h1>{escape(about.model)}</h1><p>{escape(about.description)}. "
        f"Version {escape(about.version)}, licence {escape(about.license)}.</p>",
        INTRODUCTION + needs if scene is not None else "",
    ]
    if about.flat:
        known = flat_names(one.name for one in variables)
        variables = [replace(one, name=known[one.name]) for one in variables]
    for causality in ("input", "output", "parameter"):
        rows = [variable for variable in variables if variable.causality == causality]
        if rows:
            parts.append(f"<h2>{causality.capitalize()}s</h2>{_table(rows)}")
    if scene is not None:
        parts.append(f"<h2>How sure the outputs are</h2>{_errors(scene)}")
        parts.append(f"<h2>Scene</h2><pre>{escape(scene.to_toml())}</pre>")
    return "\n".join(parts) + "\n</body></html>\n"


def _errors(scene: Scene) -> str:
    """What is known of the errors of the outputs."""
    name = scene.solver_name
    if scene.has_waves or name == "fem":
        what = "elements" if name == "fem" else "cells"
        count = scene.fem.elements if name == "fem" else scene.solver.cells
        grid = (
            f"The solver is {name}, with {'its own number of' if count is None else count} {what}"
        )
        grid += (
            " in the piston, or in the bit alone: rates have the discretisation error of so many."
        )
        if name != "fem" and scene.solver.accuracy is not None:
            grid += f" solver.accuracy = {scene.solver.accuracy:g} asks for a relative error."
    else:
        grid = (
            "Rigid bodies go from event to event in closed form: there is no discretisation error."
        )
    return ERRORS.format(grid=escape(grid))


def _table(variables: Sequence[Variable]) -> str:
    head = "<tr><th>name</th><th>unit</th><th>start</th><th>range</th><th>meaning</th></tr>"
    lines = [head]
    for one in variables:
        start = "" if one.start is None else f"{one.start}"
        span = "" if one.lower is None else f"{one.lower:g} … {one.upper:g}"
        if one.items:
            span = ", ".join(f"{value}: {name}" for name, value, _ in one.items)
        lines.append(
            f"<tr><td><code>{escape(one.name)}</code></td><td>{escape(one.unit or '')}</td>"
            f"<td>{escape(start)}</td><td>{escape(span)}</td><td>{escape(one.description)}</td></tr>"
        )
    return f"<table>{''.join(lines)}</table>"
