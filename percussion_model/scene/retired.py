"""Names that users typed once: for one more version they are told what took their place.

Standard library only: every FMU takes this module along.
"""

from __future__ import annotations

BLOW_MAP = (
    "the blow map is retired: omit it, and the default solver takes its place, with an hour "
    "of drilling in about a minute or less (docs/data/fidelity.md)"
)
CHAIN = 'bars between piston and bit are computed by "wave" as well now'
# The table of a scene that held its ranges; old files of `percussion new` have it empty.
BLOW_MAP_TABLE = "blow_map"


def remark(key: str, value: object = None) -> str:
    """What follows the refusal of a value, where it is retired or may be; else nothing."""
    if key == "solver.fidelity" or value == "blow-map":
        return f"; {BLOW_MAP}"
    return f"; {CHAIN}" if value == "chain" else ""
