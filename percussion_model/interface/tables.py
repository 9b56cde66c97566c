"""Tables that keep to the width of the terminal without cutting a number or a name."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from copy import copy
from itertools import islice
from typing import Any, NamedTuple

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table
from rich.text import Text

from percussion_model.interface.messages import wrapped

# More characters than any table has.
ENDLESS = 10_000


class Size(NamedTuple):
    """Characters that a column needs: with lines broken between words, and in whole lines."""

    least: int
    most: int


def named_table(rows: Iterable[tuple[str, str]], title: str = "") -> Table:
    """A table of names and of texts that may be broken, without headings."""
    table = Table(title=escape(title) or None, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column()
    for name, text in rows:
        table.add_row(name, text)
    return table


def airy_table(
    headings: Iterable[str], left: Collection[str], words: Collection[str] = (), **look: Any
) -> Table:
    """A table without a frame, whose columns stand at the right.

    Parameters
    ----------
    headings : iterable of str
    left : collection of str
        Headings of columns that stand at the left.
    words : collection of str
        Headings of columns whose lines may be broken.
    **look
        More for `Table`.
    """
    table = Table(box=SIMPLE_HEAD, show_edge=False, **look)
    for one in headings:
        table.add_column(one, justify="left" if one in left else "right", no_wrap=one not in words)
    return table


def print_notes(notes: Iterable[str]) -> None:
    """Print texts in lines that fit."""
    for note in notes:
        Console().print(wrapped(note), highlight=False)


def print_table(
    table: Table, console: Console | None = None, keys: int = 1, groups: Sequence[int] = ()
) -> None:
    """Print a table; one that is too wide in blocks of columns, one below the other.

    Parameters
    ----------
    table : Table
        Columns with `no_wrap` hold numbers and names, which stay whole; the others hold
        words, between which lines may be broken.
    console : Console, optional
    keys : int
        So many columns at the left name a row: each block begins with them.
    groups : sequence of int
        So many of the other columns belong together, one group after the other, and stay in one
        block where that is wide enough; those that are left are each by themselves.
    """
    console = console or Console()
    wide = Console(width=ENDLESS)
    sizes = [_size(column, wide) for column in table.columns]
    for places in _blocks(table, sizes, console.width, keys, groups):
        block = _fitted(table, sizes, places, console.width)
        if console.is_terminal:
            console.print(block)
            continue
        with console.capture() as caught:
            console.print(block)
        # lines are padded to the width, which files and pipes have no use for
        lines = "\n".join(line.rstrip() for line in caught.get().splitlines())
        console.print(Text(lines), soft_wrap=True)


def print_stored(
    headings: Sequence[str], left: Collection[str], rows: Iterable[Sequence[str]], note: str
) -> None:
    """Print the table of all that is stored of a kind, and what its words mean."""
    table = airy_table(headings, left, pad_edge=False)
    for row in rows:
        table.add_row(*row)
    print_table(table)
    print_notes(["", note])


def _size(column: Column, wide: Console) -> Size:
    found = [wide.measure(cell) for cell in (column.header, *column.cells)]
    most = max(one.maximum for one in found)
    return Size(most if column.no_wrap else max(one.minimum for one in found), most)


def _blocks(
    table: Table, sizes: list[Size], width: int, keys: int, groups: Sequence[int]
) -> list[list[int]]:
    """Places of the columns of each block: as many as the width allows, but at least one."""
    names = list(range(keys))
    rest = iter(range(keys, len(sizes)))
    parts = [list(islice(rest, count)) for count in groups] + [[place] for place in rest]
    blocks = [names]
    for part in parts:
        wider = [*blocks[-1], *part]
        if _room(table, sizes, wider, width) >= 0:
            blocks[-1] = wider
            continue
        # a group that is too wide by itself is broken
        alone = _room(table, sizes, [*names, *part], width) < 0
        for piece in [[place] for place in part] if alone else [part]:
            if len(blocks[-1]) > keys:
                blocks.append([*names, *piece])
            else:
                blocks[-1] = [*names, *piece]
    return blocks


def _room(table: Table, sizes: list[Size], places: list[int], width: int) -> int:
    """Characters that are left where these columns are as narrow as they can be."""
    narrow = _part(table, places, [sizes[place].least for place in places])
    return width - Console(width=ENDLESS).measure(narrow).maximum


def _part(table: Table, places: list[int], widths: list[int]) -> Table:
    """The table with these columns alone; its title stands above the first block."""
    part = copy(table)
    part.columns = []
    for place, width in zip(places, widths, strict=True):
        column = copy(table.columns[place])
        column.width = width
        column._index = len(part.columns)  # the last one has no room at its right
        part.columns.append(column)
    if places != list(range(len(places))):
        part.title = None
    return part


def _fitted(table: Table, sizes: list[Size], places: list[int], width: int) -> Table:
    """Give what room there is to the columns of words, by what each of them lacks."""
    chosen = [sizes[place] for place in places]
    lacking = sum(size.most - size.least for size in chosen)
    room = min(max(_room(table, sizes, places, width), 0), lacking)
    share = room / lacking if lacking else 0.0
    widths = [size.least + int(share * (size.most - size.least)) for size in chosen]
    return _part(table, places, widths)
