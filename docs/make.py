"""Generated pages and figures: `python -m docs.make NAME [WORD ...]`; without a name, all names.

Each name is a module of docs/pages, whose `made`, called with the words, returns a `Made`.
"""

from __future__ import annotations

import sys
from importlib import import_module

from docs.blocks import DOCS, IMAGES
from percussion_model.interface.plotting.style import save_figures
from percussion_model.scene.text import write_text


def names() -> list[str]:
    """What can be made."""
    return sorted(path.stem for path in (DOCS / "pages").glob("[a-z]*.py"))


def main(words: list[str]) -> None:
    """Make what is named, or tell what can be."""
    if not words or words[0] not in names():
        modules = {name: import_module(f"docs.pages.{name}") for name in names()}
        known = [f"{name}: {module.__doc__.splitlines()[0]}" for name, module in modules.items()]
        sys.exit("\n".join(known))
    made = import_module(f"docs.pages.{words[0]}").made(*words[1:])
    if made.figures is not None:
        save_figures(made.figures, IMAGES, made.kinds, dpi=made.dpi)
    for path, text in made.files().items():
        write_text(path, text)


if __name__ == "__main__":
    main(sys.argv[1:])
