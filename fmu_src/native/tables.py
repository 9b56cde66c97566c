"""The tables of a native FMU: all that its library does not know by itself.

The file `model.bin` is read by `tables.c`, whose records these are: little endian, each section
at a multiple of 8 bytes, texts as places in one section, a hash of all in the head.
"""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from fmu_src.description import depends_at_start
from fmu_src.hammer.inputs import DRIVE_INPUTS, PRODUCT
from fmu_src.hammer.variables import TABLE_INPUTS, gauge_bars, hammer_variables
from fmu_src.native import messages
from fmu_src.native.variables3 import Variable3, fmi3_variables
from fmu_src.variables import Variable, closed_bounds
from percussion_model.engine.fault_texts import faults as faults_of
from percussion_model.scene.inputs import INPUTS, PRESSURES
from percussion_model.scene.numbers import (
    JOINT_KINDS,
    scene_numbers,
    section_numbers,
)
from percussion_model.scene.retired import remark
from percussion_model.scene.rows import unit_suffix
from percussion_model.scene.scene import Scene
from percussion_model.scene.values import SCENE_NUMBERS

FILE = "model.bin"
MAGIC, VERSION = b"PHTABLE\0", 3
# In this order in the file, as in `tables.c`.
SECTIONS = ("text", "head", "variables", "choices", "image", "drive", "notes", "faults",
            "entries", "members", "known")  # fmt: skip
SECTIONS_AT = 56
VARIABLE = struct.Struct("<6I4d6I")
ENTRY = struct.Struct("<8I")
DRIVE = struct.Struct("<8I2d")

TYPES = {"Real": 1, "Integer": 2, "Boolean": 4, "Enumeration": 8}
TYPES3 = {"Float64": 1, "Int32": 2, "Boolean": 4, "Enumeration": 8}
CAUSALITIES = {"input": 0, "output": 1, "parameter": 2, "independent": 3}
# How a value becomes a word of the image.
AS_NUMBER, AS_NUMBER_OR_NAN, AS_WHOLE, AS_CHOICE, NOWHERE = range(5)

# What a reading has to be asked for, by output: its flags.
NEEDS = {"bit.force_peak": 1, "contact.force_peak": 1, "gauge_stress": 2}
# Last words of the image, all numbers.
LAST = ("supply_pressure", "percussion_on", "drive.effective_area", "gauge.bar", "gauge.position")
# Behind them, no variable: whether the barrier was asked for, not left to its default.
BARRIER_GIVEN = "#barrier_given"
# Numbers of a joint that are variables, after its kind; as in `joint_numbers`.
JOINT_FIELDS = ("transmission", "relaxation", "gap", "preload", "thread_stiffness")
SECTION_FIELDS = ("length", "area", "youngs_modulus", "density")


@dataclass
class Image:
    """First words of a scene, and where each key has its word.

    Attributes
    ----------
    words : list of float or int
        Doubles and whole numbers, each in 8 bytes.
    at : dict
        Place of a word by key of the scene, or by name of a variable without one.
    whole : set of str
        Keys of words that are whole numbers.
    """

    words: list[float | int] = field(default_factory=list)
    at: dict[str, int] = field(default_factory=dict)
    whole: set[str] = field(default_factory=set)

    def add(self, key: str, value: float | int) -> None:
        """Append a word."""
        self.at[key] = len(self.words)
        self.words.append(value)
        if isinstance(value, int):
            self.whole.add(key)

    @property
    def plain_words(self) -> int:
        """Number of words that do not depend on the bars."""
        of_bars = ("#piston", "#bit", "#rod", "string.rods.")
        return sum(".sections." not in key and not key.startswith(of_bars) for key in self.at)

    def packed(self) -> bytes:
        """Words as bytes."""
        return b"".join(
            struct.pack("<q" if isinstance(word, int) else "<d", word) for word in self.words
        )


def scene_image(scene: Scene) -> Image:
    """Image of a scene, whose words of joints do not depend on `effects.joints`."""
    image = Image()
    rods = scene.string.rods
    bars = {"piston": scene.piston, "bit": scene.bit}
    bars |= {f"string.rods.{k}": rod for k, rod in enumerate(rods)}
    image.add("#piston", len(scene.piston.sections))
    image.add("#bit", len(scene.bit.sections))
    image.add("#rods", len(rods))
    for k, rod in enumerate(rods):
        image.add(f"#rod.{k}", len(rod.sections))
    for name, value in zip(SCENE_NUMBERS.names or (), scene_numbers(scene)[0].item(), strict=True):
        image.add(name, value)
    for bar, found in bars.items():
        for k, section in enumerate(section_numbers(found).tolist()):
            for name, value in zip(SECTION_FIELDS, section, strict=True):
                image.add(f"{bar}.sections.{k}.{name}", float(value))
    for k, rod in enumerate(rods):
        image.add(f"string.rods.{k}.joint", float(JOINT_KINDS.index(rod.joint)))
        for name in JOINT_FIELDS:
            image.add(f"string.rods.{k}.{name}", float(getattr(rod, name)))
    for name in LAST:
        image.add(name, 0.0)  # variables, all of them: their start values go here
    image.add(BARRIER_GIVEN, float("barrier" in scene.effects._given))
    return image


def model_tables(
    scene: Scene,
    guid: str,
    faults: Sequence[str] | None = None,
    notes: Sequence[str] | None = None,
) -> bytes:
    """Contents of `model.bin`.

    Parameters
    ----------
    scene : Scene
    guid : str
        Of the model description, FMI 2.0 or 3.0; saved states belong to it too.
    faults, notes : sequence of str, optional
        Templates of messages, the first unused; those of `fmu_src.native.messages` if left out.
    """
    if faults is None or notes is None:
        faults, notes = faults_of(gauge_bars(scene)), messages.notes()
    writer = TableWriter(hammer_variables(scene), scene_image(scene))
    return writer.write(guid, faults, notes, _drives(writer, scene))


class TableWriter:
    """Collects the sections of the tables.

    Parameters
    ----------
    variables : sequence of Variable
        Of FMI 2.0.
    image : Image
        With a word for each of them but outputs.
    """

    def __init__(self, variables: Sequence[Variable], image: Image) -> None:
        order = ("input", "output", "parameter")
        self.variables = sorted(
            variables, key=lambda one: order.index(one.causality)
        )  # as they are: `tables.c` relies on it
        self.arranged = fmi3_variables(variables)
        self.index = {one.name: k for k, one in enumerate(self.variables)}
        self.image = image
        self.text = bytearray(b"\0")
        self.places: dict[str, int] = {"": 0}
        self.choices: list[int] = []

    def write(
        self,
        guid: str,
        faults: Sequence[str],
        notes: Sequence[str] = ("",),
        drives: Iterable[bytes] = (),
    ) -> bytes:
        """All sections behind their head."""
        packed = list(drives)
        counts = [
            sum(one.causality == kind for one in self.variables) for kind in ("input", "output")
        ]
        outputs = iter(range(counts[1]))
        records = [self._variable(one, outputs) for one in self.variables]
        entries, members, known = self._entries()
        sections = {
            "head": _whole([self.place(guid), *counts, self.image.plain_words]),
            "variables": (b"".join(records), len(records)),
            "choices": (struct.pack(f"<{len(self.choices)}q", *self.choices), len(self.choices)),
            "image": (self.image.packed(), len(self.image.words)),
            "drive": (b"".join(packed), len(packed)),
            "notes": _whole([self.place(one) for one in notes]),
            "faults": _whole([self.place(one) for one in faults]),
            "entries": (b"".join(entries), len(entries)),
            "members": _whole(members),
            "known": _whole(known),
        }
        sections["text"] = bytes(self.text), len(self.text)  # when all have their places
        return _file(sections)

    def place(self, text: str) -> int:
        """Where a text stands."""
        if "\0" in text:
            raise ValueError(f"a zero in a text of the tables: {text!r}")
        if text not in self.places:
            self.places[text] = len(self.text)
            self.text += text.encode() + b"\0"
        return self.places[text]

    def _variable(self, one: Variable, outputs: Iterator[int]) -> bytes:
        """Record of a variable; its start value goes into the image."""
        row, is_output = one.row, one.causality == "output"
        lower, upper = _bounds(one)
        choices = _numbers(one)
        first, self.choices = len(self.choices), [*self.choices, *choices]
        conversion, place = (NOWHERE, next(outputs)) if is_output else self._word(one)
        return VARIABLE.pack(
            one.reference, self.place(one.name), TYPES[one.type], CAUSALITIES[one.causality],
            conversion, place,
            0.0 if is_output else float(one.start), lower, upper,
            math.nan if one.left_out is None else float(one.left_out),
            one.left_out is not None, NEEDS.get(one.name, 0),
            self.place("" if row is None else row.allowed + remark(row.key)),
            self.place("" if row is None else unit_suffix(row.unit)),
            first, len(choices),
        )  # fmt: skip

    def _word(self, one: Variable) -> tuple[int, int]:
        """How a value becomes a word of the image, and of which."""
        key = _key(one)
        place = self.image.at[key]
        if one.name in LAST:
            self.image.words[place] = float(one.start)
            return AS_NUMBER, place
        if one.type == "Enumeration":
            conversion = AS_CHOICE
        elif key in self.image.whole:
            conversion = AS_WHOLE
        else:
            conversion = AS_NUMBER if one.left_out is None else AS_NUMBER_OR_NAN
        started = _started(one, conversion)
        held = self.image.words[place]
        if one.name == "piston_force":  # acts while percussion_on, which it is at the start
            held = started
            self.image.words[place] = started
        if not (held == started or (held != held and started != started)):
            raise ValueError(f"{one.name} starts with {started!r}, but the scene has {held!r}")
        return conversion, place

    def _known_at_start(self, one: Variable3, found: Sequence[Variable3]) -> list[int]:
        """Indices of the variables of FMI 3.0 on which one depends at the start."""
        if one.causality != "output":
            return []
        output = self._first(one)
        return [
            k
            for k, other in enumerate(found)
            if other.members and depends_at_start(output, self._first(other))
        ]

    def _first(self, one: Variable3) -> Variable:
        """What is said of the first member is true of all."""
        return self.variables[self.index[one.members[0]]]

    def _entries(self) -> tuple[list[bytes], list[int], list[int]]:
        """Variables of FMI 3.0, indices of their members, and what outputs depend on."""
        found = self.arranged
        records: list[bytes] = []
        members: list[int] = []
        known: list[int] = []
        for one in found:
            mine = [self.index[name] for name in one.members]
            needed = self._known_at_start(one, found)
            records.append(
                ENTRY.pack(
                    one.reference, self.place(one.name), TYPES3[one.type],
                    CAUSALITIES[one.causality], len(members), len(mine), len(known), len(needed),
                )
            )  # fmt: skip
            members += mine
            known += needed
        return records, members, known


def _drives(writer: TableWriter, scene: Scene) -> Iterator[bytes]:
    """Bounds of the drive force, which is a product, and of pressures of drives by choice."""
    choices = scene.row_of("effects.drive").choices
    names = [(PRODUCT, "drive_force", 0)]
    names += [("supply_pressure", name, 1 + choices.index(drive))
              for drive, name in PRESSURES.items()]  # fmt: skip
    at = [writer.index[name] for name in (*DRIVE_INPUTS[:3], "effects.drive")]
    for shown, name, choice in names:
        row = scene.row_of(INPUTS[name].key)
        texts = map(writer.place, (shown, row.allowed, unit_suffix(row.unit)))
        yield DRIVE.pack(*at, choice, *texts, *closed_bounds(row))


def _key(one: Variable) -> str:
    """Key of the word in the image that a variable stands for."""
    if one.name in LAST:
        return one.name
    key = TABLE_INPUTS[one.name].key if one.name in TABLE_INPUTS else one.key
    if key is None:
        raise ValueError(f"{one.name} has no place in the image")
    is_listed = any(part.isdecimal() for part in key.split("."))
    return key if is_listed else key.replace(".", "_")


def _bounds(one: Variable) -> tuple[float, float]:
    """Bounds that are allowed themselves; an enumeration has its choices instead."""
    row = one.row
    if row is None or row.choices or row.kind not in ("number", "whole number"):
        return math.inf, -math.inf
    return closed_bounds(replace(row, kind="number"))


def _numbers(one: Variable) -> list[int]:
    """Numbers of an enumeration in the order of the choices."""
    if one.row is None or one.type != "Enumeration":
        return []
    choices = one.row.choices
    return list(choices) if isinstance(choices[0], int) else list(range(1, len(choices) + 1))


def _started(one: Variable, conversion: int) -> float | int:
    """Word of the start value."""
    if conversion == AS_CHOICE:
        return _numbers(one).index(one.start)
    if conversion == AS_NUMBER_OR_NAN and one.start == one.left_out:
        return math.nan
    return int(one.start) if conversion == AS_WHOLE else float(one.start)


def _whole(numbers: Sequence[int]) -> tuple[bytes, int]:
    """Section of whole numbers, and their count."""
    return struct.pack(f"<{len(numbers)}I", *numbers), len(numbers)


def _file(sections: dict[str, tuple[bytes, int]]) -> bytes:
    """Head and sections, with the hash of all else in the head."""
    begin = SECTIONS_AT + 16 * len(SECTIONS)
    table, body = b"", b""
    for name in SECTIONS:
        contents, count = sections[name]
        table += struct.pack("<QQ", begin + len(body), count)
        body += contents + bytes(-len(contents) % 8)
    head = MAGIC + struct.pack("<IIQ", VERSION, len(SECTIONS), begin + len(body))
    return head + hashlib.sha256(head + table + body).digest() + table + body
