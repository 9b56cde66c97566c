"""XML of an SSP archive: structure, values and mappings, checked against the schemas of SSP 1.0.

A file of SSP 2.0 is read as far as it says nothing that 1.0 does not know.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import fmpy
from lxml import etree

from percussion_model.coupling.component import KINDS, CouplingError
from percussion_model.coupling.unpack import Allowance, check_xml, one_line
from percussion_model.scene.rows import shortened, unprintable

SPACES = {
    f"ss{letter}": f"http://ssp-standard.org/SSP1/SystemStructure{name}"
    for letter, name in (
        ("c", "Common"), ("d", "Description"), ("v", "ParameterValues"), ("m", "ParameterMapping")
    )
}  # fmt: skip
# Files besides the structure.
MOST_FILES = 100
# What 2.0 adds without changing a system, and what its names of types are in 1.0.
_REMARKS = ("MetaData", "Signature")
_SAME = KINDS
_TRUE = ("true", "1")
# What messages repeat.
_TOLD = (
    *("name", "source", "target", "prefix", "unit", "type", "value"),
    *("startElement", "startConnector", "endElement", "endConnector"),
)


class Reader:
    """Reads XML of an unpacked archive, each file once.

    Parameters
    ----------
    folder : Path
    allowance : Allowance
        What the archive may take.
    """

    def __init__(self, folder: Path, allowance: Allowance) -> None:
        self.folder, self.allowance = folder, allowance
        self._read: dict[tuple[Path, str], Any] = {}

    def structure(self, name: str) -> Any:
        """Root of the structure of the system, which stands at the top of the archive."""
        return self._root(self.folder / name, name, "ssd")

    def file(self, source: str, space: str) -> Any:
        """Root of a file that the structure names by its URI."""
        place, name = within(self.folder, source), shortened(source)
        if place is None:
            raise CouplingError(f"{name}: is no file within the archive")
        if (place, space) not in self._read:
            if len(self._read) == MOST_FILES:
                raise CouplingError(f"names more than {MOST_FILES} files of values")
            self._read[place, space] = self._root(place, name, space)
        return self._read[place, space]

    def _root(self, place: Path, name: str, space: str) -> Any:
        check_xml(place, name, self.allowance)
        parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True)
        try:
            root = etree.parse(str(place), parser).getroot()
        except etree.XMLSyntaxError as error:  # what expat let pass
            raise CouplingError(f"{name}: is not valid XML: {one_line(error)}") from None
        return validated(root, name, space)


def within(folder: Path, source: str) -> Path | None:
    """File within a folder that a URI names, None if it is none."""
    try:
        place = folder / unquote(source, errors="strict")
        inside = place.resolve().is_relative_to(folder.resolve())
        return place if inside and place.is_file() and not place.is_symlink() else None
    except (OSError, ValueError):  # a name that no file can have
        return None


def validated(root: Any, name: str, space: str) -> Any:
    """An element after its schema has seen it; `CouplingError` with the first fault."""
    version = root.get("version", "")
    if version.startswith("2."):
        _as_of_1(root)
    schema = _schema(space)
    if not schema.validate(root):
        (fault, *_) = schema.error_log
        text = " ".join(fault.message.split())
        for prefix, address in SPACES.items():
            text = text.replace(f"{{{address}}}", f"{prefix}:")
        above = "; of SSP 2.0 that is read which 1.0 has" if version.startswith("2.") else ""
        raise CouplingError(f"{name}: line {fault.line}: {shortened(text)}{above}")
    for node in root.iter(etree.Element):
        for key in _TOLD:
            if unprintable(value := node.get(key, "")):
                raise CouplingError(
                    f"{name}: line {node.sourceline}: {key} = {shortened(value)!r}: must be "
                    "printable"
                )
    return root


def _as_of_1(root: Any) -> None:
    """Write what 2.0 says by other words than 1.0 by those of 1.0."""
    root.set("version", "1.0")
    for node in list(root.iterdescendants(etree.Element)):
        space, _, word = node.tag.rpartition("}")
        if word in _REMARKS and space == f"{{{SPACES['ssc']}":
            node.getparent().remove(node)
        elif word in _SAME and space[1:] in SPACES.values():
            node.tag = f"{space}}}{_SAME[word]}"


@cache
def _schema(space: str) -> Any:
    folder = Path(fmpy.__file__).parent / "ssp" / "schema"
    return etree.XMLSchema(file=str(folder / f"{SPACES[space].rpartition('/')[2]}.xsd"))


def tag(space: str, word: str) -> str:
    """Name of an element with its namespace."""
    return f"{{{SPACES[space]}}}{word}"


def elements(node: Any, path: str) -> list[Any]:
    """Elements at a path, as `ssd:Connectors/ssd:Connector`."""
    found: list[Any] = node.findall(path, namespaces=SPACES)
    return found


def word_of(node: Any) -> str:
    """Name of an element without its namespace."""
    return str(node.tag).rpartition("}")[2]


def is_true(text: str | None) -> bool:
    """Whether a text is true; missing text is not."""
    return text is not None and text.strip() in _TRUE
