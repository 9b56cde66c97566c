"""Archives of strangers (SSP, FMU): checked and bounded before they are unpacked and parsed."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.parsers import expat
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile, ZipInfo

from percussion_model.coupling.component import CouplingError
from percussion_model.scene.rows import shortened
from percussion_model.scene.writing import own_prefix

# Limits of an archive that is not trusted; docs/data/trust.md has them, too.
LARGEST_FILE = 100_000_000  # as it lies on disk [bytes]
MOST_BYTES = 250_000_000  # unpacked, all its FMUs included [bytes]
MOST_ENTRIES = 10_000  # the same [files]
# Text packs to a twentieth, zeros to a thousandth; what is small may be anything [bytes].
HIGHEST_RATIO, SMALL = 100, 1_000_000
LARGEST_XML, MOST_XML = 10_000_000, 30_000_000  # a file, and all that are parsed [bytes]
MOST_ELEMENTS, DEEPEST = 100_000, 50  # of a file of XML; its levels
# Of names and paths in an archive [characters].
LONGEST_NAME = 250
# Where there is a folder of a plain name, besides that for temporary files.
ELSEWHERE = ("/tmp", "/var/tmp", "/dev/shm")
_ENTRY = b"PK\x01\x02"


class Allowance:
    """What an archive and the FMUs in it may still take.

    Parameters
    ----------
    trusted : bool
        Whether sizes and counts are not looked at.
    """

    def __init__(self, trusted: bool) -> None:
        self.trusted = trusted
        self._bytes, self._entries, self._xml = MOST_BYTES, MOST_ENTRIES, MOST_XML

    def take(self, entries: list[ZipInfo]) -> None:
        """Count the entries of an archive; `CouplingError` where they are too much."""
        if self.trusted:
            return
        for one in entries:
            if one.file_size > SMALL and one.file_size > HIGHEST_RATIO * one.compress_size:
                raise _too_much(
                    f"{shortened(one.filename)} unpacks to {one.file_size} bytes, more than "
                    f"{HIGHEST_RATIO} times what it is packed in"
                )
        self._bytes -= sum(one.file_size for one in entries)
        self._entries -= len(entries)
        if self._bytes < 0:
            raise _too_much(f"unpacks to more than {MOST_BYTES} bytes, FMUs included")
        if self._entries < 0:
            raise _too_much(f"holds more than {MOST_ENTRIES} files, FMUs included")

    def parse(self, name: str, size: int) -> None:
        """Count a file of XML that will be parsed [bytes]; `CouplingError` where it is too much."""
        self._xml -= size
        if not self.trusted and (size > LARGEST_XML or self._xml < 0):
            raise _too_much(
                f"{name}: {size} bytes of XML are more than {LARGEST_XML}, or with others than "
                f"{MOST_XML}"
            )

    def open(self, path: Path) -> None:
        """`CouplingError` where a file is so large, or lists so much, that reading it is dear."""
        if self.trusted:
            return
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise _too_much(f"has {size} bytes, more than {LARGEST_FILE}")
        if path.read_bytes().count(_ENTRY) > MOST_ENTRIES:
            raise _too_much(f"lists more than {MOST_ENTRIES} files")


def _too_much(text: str) -> CouplingError:
    return CouplingError(f"{text}: if you trust its source, say so (--trust, or trust=True)")


def unpack_zip(path: Path, folder: Path, allowance: Allowance) -> None:
    """Unpack an archive into a folder that is there; nothing is written outside of it.

    What is said of it does not name it.
    """
    try:
        allowance.open(path)
        with ZipFile(path) as archive:
            entries = archive.infolist()
            refuse_entries(entries)
            allowance.take(entries)
            archive.extractall(folder)
    except CouplingError:
        raise
    except (BadZipFile, OSError, ValueError, EOFError, RuntimeError, OverflowError) as error:
        raise CouplingError(f"cannot be unpacked: {one_line(error)}") from error
    except Exception as error:  # of zlib, struct and the decoding of names
        kind = type(error).__name__
        raise CouplingError(f"cannot be unpacked: {kind}: {one_line(error)}") from error


def refuse_entries(entries: list[ZipInfo]) -> None:
    """`CouplingError` for entries that FMI and SSP have no use for, and that do harm."""
    seen: set[str] = set()
    for one in entries:
        fault = _fault_of_path(one.filename)
        if not fault and one.filename.casefold().rstrip("/") in seen:
            fault = "stands there twice"
        elif not fault and stat.S_ISLNK(one.external_attr >> 16):
            fault = "is a link"
        elif not fault and one.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
            fault = f"is packed by method {one.compress_type}, not deflated"
        elif not fault and one.flag_bits & 1:
            fault = "is encrypted"
        if fault:
            raise CouplingError(f"{shortened(one.filename)!r} {fault}")
        seen.add(one.filename.casefold().rstrip("/"))


def _fault_of_path(path: str) -> str:
    """Say why an entry's path is refused; empty if it is not."""
    if not path or len(path) > LONGEST_NAME:
        return f"must have 1 to {LONGEST_NAME} characters"
    if not path.isprintable():
        return "has characters that cannot be printed"
    if "\\" in path or ":" in path or path.startswith("/") or ".." in path.split("/"):
        return "is no path within the archive"
    return ""


def check_xml(path: Path, name: str, allowance: Allowance) -> None:
    """Go through an XML file without keeping it; `CouplingError` if it could grow in a parser.

    Parameters
    ----------
    name : str
        Of the file in messages.
    allowance : Allowance
        One that is trusted may have any size; a document type is refused all the same.
    """
    if not path.is_file():
        raise CouplingError(f"{name}: is not there")
    allowance.parse(name, path.stat().st_size)
    level = count = 0

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal level, count
        level, count = level + 1, count + 1
        if level > DEEPEST:
            raise CouplingError(f"{name}: has elements more than {DEEPEST} levels deep")
        if count > MOST_ELEMENTS and not allowance.trusted:
            raise _too_much(f"{name}: has more than {MOST_ELEMENTS} elements")

    def end(tag: str) -> None:
        nonlocal level
        level -= 1

    def refuse(*_: Any) -> None:
        raise CouplingError(f"{name}: has a document type, which FMI and SSP do not use")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.StartDoctypeDeclHandler = refuse
    try:
        with path.open("rb") as file:
            parser.ParseFile(file)
    except (expat.ExpatError, ValueError, LookupError) as error:
        if isinstance(error, CouplingError):
            raise
        raise CouplingError(f"{name}: is not valid XML: {one_line(error)}") from None


def new_folder() -> str:
    """Make a folder for what is unpacked, with a path that all FMUs can read.

    They get it as a URI, and pythonfmu does not decode letters such as an umlaut there: it
    finds nothing and crashes.
    """
    places = [tempfile.gettempdir(), *ELSEWHERE, os.environ.get("PUBLIC", "")]
    for place in filter(None, places):
        uri = Path(place).absolute().as_uri()
        plain = uri.replace("%20", " ")
        if unquote(plain) == plain and os.path.isdir(place) and os.access(place, os.W_OK):
            return tempfile.mkdtemp(prefix=own_prefix(place), dir=Path(place).absolute())
    raise CouplingError(
        f"{places[0]}: FMUs cannot be unpacked there, since they do not understand the letters of "
        "its name: let TMPDIR name a folder of plain letters"
    )


def one_line(error: Exception) -> str:
    """What an error of others says, in one line of bearable length."""
    return shortened(" ".join(str(error).split()) or type(error).__name__)
