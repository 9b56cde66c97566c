"""Pages of HTML from the templates."""

from __future__ import annotations

from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined


def filled(template: str, **values: Any) -> str:
    """Fill a template; texts are escaped, those marked as `Markup` are not."""
    environment = Environment(
        loader=PackageLoader("percussion_model.interface", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.get_template(template).render(**values)
