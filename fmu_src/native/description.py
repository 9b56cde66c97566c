"""modelDescription.xml of the FMI 2.0 FMU that needs no Python."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from fmu_src.description import OPTIONS, About, Described, write_description
from fmu_src.variables import Variable

GENERATION_TOOL = f"percussion_model {version('percussion_model')}"
# What the shell sends; hosts choose by these names.
LOG_CATEGORIES = {
    "logStatusWarning": "Warnings: where the motion leaves the model, inputs without effect.",
    "logStatusError": "Errors: why a call was refused.",
}
NATIVE_OPTIONS = OPTIONS | {
    "needsExecutionTool": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
}


class NativeDescribed(Described):
    """A slave that only describes itself, of a library that needs no Python."""

    log_categories: ClassVar[dict[str, str]] = LOG_CATEGORIES

    def to_xml(self, model_options: Any = NATIVE_OPTIONS) -> Element:
        """Model description; its GUID is still empty."""
        root = super().to_xml(model_options)
        root.set("generationTool", GENERATION_TOOL)
        return root


def write_native_description(
    about: About, variables: Sequence[Variable], contents: bytes
) -> tuple[str, bytes]:
    """Return GUID and text of the model description.

    Parameters
    ----------
    contents : bytes
        Hash of what else is in the FMU, for the GUID.
    """
    return write_description(about, variables, contents, NativeDescribed)
