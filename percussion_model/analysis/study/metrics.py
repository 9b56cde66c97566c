"""Numbers that functions of users make of a point, as further columns of a study."""

from __future__ import annotations

import hashlib
import inspect
import pickle
import sys
from collections.abc import Mapping

from percussion_model.analysis.study.response import ROW, Metric
from percussion_model.scene.rows import shortened
from percussion_model.scene.scene import SceneError

# Columns of the tables that stand beside those of `ROW`.
TAKEN = {"undecided", "failure", "point", *(ROW.names or ())}


def read_metrics(given: Metric | Mapping[str, Metric] | None) -> dict[str, Metric]:
    """Functions by the names of their columns; one alone has its own name.

    Raises
    ------
    SceneError
        If a name can be no column, or something cannot be called.
    """
    if given is None:
        return {}
    found = dict(given) if isinstance(given, Mapping) else {getattr(given, "__name__", ""): given}
    for name, function in found.items():
        if not str(name).isidentifier() or name in TAKEN:
            raise SceneError(
                f"metric {shortened(repr(name))}: must have a name of letters, digits and "
                f'underlines that no other column has: metric={{"my_name": function}} gives one'
            )
        if not callable(function):
            raise SceneError(f"metric {name}: must be a function of a `Settled`")
    return found


def text_of(function: Metric) -> str:
    """Hash of a function's text and of the plain values that it closes over.

    What it calls is not in it.
    """
    code = getattr(function, "__code__", None)
    try:
        words = [inspect.getsource(function if code else type(function))]
    except (OSError, TypeError):  # typed at a prompt
        words = [repr((code.co_code, code.co_consts, code.co_names)) if code else ""]
    held = [cell.cell_contents for cell in getattr(function, "__closure__", None) or ()]
    held += getattr(function, "__defaults__", None) or ()
    words += [repr(one) for one in held if isinstance(one, (int, float, str, tuple))]
    return hashlib.sha256("\0".join(words).encode()).hexdigest()[:32]


def why_not_elsewhere(metrics: Mapping[str, Metric]) -> str:
    """Why other processes cannot have the functions; empty where they can."""
    for name, function in metrics.items():
        home = getattr(function, "__module__", None) or type(function).__module__
        is_typed = home == "__main__" and not hasattr(sys.modules["__main__"], "__file__")
        try:
            pickle.dumps(function)
        except Exception as error:
            return f"metric {name}: {error}"
        if is_typed:
            return f"metric {name}: is in no file that other processes can import"
    return ""
