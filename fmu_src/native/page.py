"""The documentation page inside an FMU that needs no Python."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from fmu_src.description import About
from fmu_src.page import write_page
from fmu_src.variables import Variable
from percussion_model.scene.scene import Scene

NEEDS_NOTHING = """<p>Needs nothing but the C library of the system. There are libraries for
{platforms}; the numbers of the scene lie in <code>resources/model.bin</code>.</p>
"""


def write_native_page(
    about: About, variables: Sequence[Variable], scene: Scene, platforms: Iterable[str]
) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    platforms : iterable of str
        Those that the FMU has a library for.
    """
    text = NEEDS_NOTHING.format(platforms=escape(", ".join(sorted(platforms))))
    return write_page(about, variables, scene, text)
