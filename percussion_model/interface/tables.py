"""Tables that keep to the width of the terminal without cutting a number or a name."""

from __future__ import annotations

from copy import copy

from rich.console import Console
from rich.table import Column, Table

# More characters than any table has.
ENDLESS = 10_000


def print_table(table: Table, console: Console | None = None, keys: int = 1) -> None:
    """Print a table; one that is too wide in blocks of columns, one below the other.

    Parameters
    ----------
    table : Table
        Columns with `no_wrap` hold numbers and names, which stay whole; the others hold
        words, between which lines may be broken.
    console : Console, optional
    keys : int
        So many columns at the left name a row: each block begins with them.
    """
    console = console or Console()
    for places in _blocks(table, console.width, keys):
        console.print(_fitted(_part(table, places), console.width))


def _blocks(table: Table, width: int, keys: int) -> list[list[int]]:
    """Places of the columns of each block: as many as the width allows, but at least one."""
    names = list(range(keys))
    blocks = [names]
    for place in range(keys, len(table.columns)):
        wider = [*blocks[-1], place]
        if len(wider) > keys + 1 and _least_width(_part(table, wider)) > width:
            blocks.append([*names, place])
        else:
            blocks[-1] = wider
    return blocks


def _part(table: Table, places: list[int]) -> Table:
    """The table with these columns alone; its title stands above the first block."""
    part = copy(table)
    part.columns = [table.columns[place] for place in places]
    if places != list(range(len(places))):
        part.title = None
    return part


def _widths(column: Column) -> tuple[int, int]:
    """Characters that a column needs where lines are broken between words, and where not."""
    wide = Console(width=ENDLESS)
    found = [wide.measure(cell) for cell in (column.header, *column.cells)]
    most = max(one.maximum for one in found)
    return (most if column.no_wrap else max(one.minimum for one in found)), most


def _least_width(table: Table) -> int:
    """Characters that the whole table needs at the least."""
    slack = sum(most - least for least, most in map(_widths, table.columns))
    return Console(width=ENDLESS).measure(table).maximum - slack


def _fitted(table: Table, width: int) -> Table:
    """Give what room there is to the columns of words, by what each of them lacks."""
    columns = [(column, *_widths(column)) for column in table.columns]
    lacking = sum(most - least for _, least, most in columns)
    room = width - _least_width(table)
    if room >= lacking:
        return table
    table = copy(table)
    table.columns = []
    for column, least, most in columns:
        narrow = copy(column)
        narrow.width = least + max(room, 0) * (most - least) // lacking if lacking else least
        table.columns.append(narrow)
    return table
