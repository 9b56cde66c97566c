"""What the pages of runs and studies share: scene, versions, figures."""

from __future__ import annotations

import platform
import re
from dataclasses import asdict, dataclass
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from percussion_model.scene.parameters import find_row, parameter_table
from percussion_model.scene.scene import Scene
from percussion_model.simulation.files import REPORT, staged

PACKAGES = ("percussion_model", "numpy", "numba", "scipy", "matplotlib", "bokeh")


@dataclass(frozen=True)
class FigureBlock:
    """A figure as HTML and what it shows."""

    html: Markup
    caption: str


def without_zoom() -> str:
    """Say why figures of a page cannot be zoomed, nothing if they can."""
    try:
        import_module("percussion_model.interface.plotting.zoom")
    except ImportError as error:
        name = error.name or str(error)
        return (
            f"figures cannot be zoomed, since {name} is missing: "
            "pip install 'percussion_model[report]'"
        )
    return ""


def write_page(folder: Path, page: str) -> Path:
    """Write a page as the report of a folder."""
    with staged(folder) as draft:
        (draft / REPORT).write_text(page, encoding="utf-8")
    return folder / REPORT


def render(template: str, scene: Scene, changed: dict[str, Any], **values: Any) -> str:
    """Fill a template that shows a scene, with values of it that were not computed with."""
    environment = Environment(
        loader=PackageLoader("percussion_model.interface", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.get_template(template).render(
        title=scene.title or "Percussive drilling",
        parameters=parameter_rows(scene, changed),
        effects_on=scene.effects_on,
        effects_off=scene.effects_off,
        unused=scene.unused,
        versions=versions(),
        **values,
    )


def parameter_rows(scene: Scene, changed: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Key, value, unit and description of each parameter that has an influence."""
    rows = []
    for row in parameter_table():
        if "*" in row.key or not scene.matters(row.key):
            continue
        if row.kind == "sections":
            rows += _section_rows(scene, row.key, changed)
            continue
        value = changed.get(row.key, scene[row.key])
        rows.append((row.key, written(value), shown_unit(row.unit), row.description))
    return rows


def _section_rows(
    scene: Scene, sections: str, changed: dict[str, Any]
) -> list[tuple[str, str, str, str]]:
    rows = []
    for k, section in enumerate(scene[sections]):
        for name, value in asdict(section).items():
            key = f"{sections}.{k}.{name}"
            row = find_row(key)
            assert row is not None
            shown = written(changed.get(key, value))
            rows.append((key, shown, shown_unit(row.unit), row.description))
    return rows


def written(value: Any) -> str:
    """A value as a page shows it."""
    if value is None:
        return "by default"
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def shown_unit(unit: str) -> str:
    """A unit as a page shows it."""
    return {"-": "–"}.get(unit, unit).replace("^2", "²").replace("^3", "³")


def versions() -> list[tuple[str, str]]:
    """Versions of what the numbers were made with."""
    found = [("Python", platform.python_version())]
    for name in PACKAGES:
        try:
            found.append((name, version(name)))
        except PackageNotFoundError:
            continue
    return found


def inline_svg(path: Path, caption: str) -> Markup:
    """Read an SVG file for use inside a page.

    The page knows the name spaces; names of parts get the file's name in
    front, since several drawings share the page.
    """
    text = path.read_text(encoding="utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", text)
    text = re.sub(r'\sid="', f' id="{path.stem}-', text)
    text = re.sub(r'href="#', f'href="#{path.stem}-', text)
    text = text.replace("*{stroke", "svg *{stroke")  # its style sheet is for drawings only
    text = text.replace("url(#", f"url(#{path.stem}-")
    name = caption.split(".")[0]
    # Only the page decides how wide a drawing is.
    text = re.sub(r'(<svg\b[^>]*?)\swidth="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg\b[^>]*?)\sheight="[^"]*"', r"\1", text, count=1)
    label = Markup.escape(name)
    return Markup(text.replace("<svg", f'<svg role="img" aria-label="{label}"', 1))
