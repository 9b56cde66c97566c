"""terminalsAndIcons.xml of FMI 3.0: which variables are connected together."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement

from fmu_src.description import to_bytes
from fmu_src.flat_names import flat_name
from fmu_src.native.description3 import FMI_VERSION

FOLDER = "terminalsAndIcons"
# Coordinates of FMI, unless a file says others: the icon fills them.
EXTENT = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
MILLIMETRE = "0.1"  # mm on paper for a unit of these


@dataclass(frozen=True)
class Terminal:
    """Variables that are connected to one other part of a drilling system.

    `members` maps names within the terminal to variables: the names that the other parts of
    the system have for them, so that hosts can match them. A host may leave any of them out.
    """

    name: str
    description: str
    members: dict[str, str]


TERMINALS = (
    Terminal(
        "feed",
        "drill string or rig that pushes the hammer, and carries its reaction",
        {
            "feed_force": "feed_force",
            "bit_position": "bit.position",
            "bit_velocity": "bit.velocity",
            "casing_force": "casing_force",
            "casing_impulse": "casing.impulse",
        },
    ),
    Terminal(
        "rod",
        "drill string that exchanges waves with the casing, for effects.shoulder",
        {
            **{f"wave_{k}": f"shoulder.wave_{k}" for k in range(1, 9)},
            **{f"returned_{k}": f"shoulder.returned_{k}" for k in range(1, 9)},
            **{
                name: f"shoulder.{name}"
                for name in (
                    *("impedance", "wave_begin", "wave_span"),
                    *("returned_begin", "returned_until", "push"),
                )
            },
        },
    ),
    Terminal(
        "supply",
        "supply of the drive with compressed air or oil",
        {
            "supply_pressure": "supply_pressure",
            "percussion_on": "percussion_on",
            "blow_frequency": "blow_frequency",
        },
    ),
    Terminal(
        "drive",
        "a drive outside of the FMU, for effects.drive = external",
        {
            "piston_force": "piston_force",
            "piston_position": "piston.position",
            "piston_velocity": "piston.velocity",
            "bit_position": "bit.position",
            "bit_velocity": "bit.velocity",
        },
    ),
    Terminal(
        "air",
        "supply of chambers with air, and the hole, for effects.drive = pneumatic",
        {
            "supply_pressure": "supply_pressure",
            "percussion_on": "percussion_on",
            "supply_flow": "pneumatic.supply_flow",
            "air_used": "pneumatic.consumed",
            "back_pressure": "pneumatic.back_pressure",
        },
    ),
    Terminal(
        "oil",
        "pump of chambers with oil, for effects.drive = hydraulic",
        {
            "flow": "hydraulic.flow",
        },
    ),
    Terminal(
        "rock",
        "rock under the bit, where its properties change with depth",
        {
            "loading_stiffness": "rock.loading_stiffness",
            "unloading_ratio": "rock.unloading_ratio",
            "barrier_damping": "rock.barrier_damping",
            "barrier_energy": "rock.barrier_energy",
            "crushing_energy": "breaking.crushing_energy",
            "bit_position": "bit.position",
            "bit_force": "bit.force",
            "hole_depth": "hole_depth",
        },
    ),
    Terminal(
        "rotation",
        "motor that turns the bit",
        {
            "rotation_speed": "rotation.speed",
            "turning_speed": "rotation.turning_speed",
            "rotation_torque": "rotation.torque",
        },
    ),
    Terminal(
        "control",
        "what a controller of the hole measures",
        {
            "rate_of_penetration": "rate_of_penetration",
            "blow_frequency": "blow_frequency",
            "blow_energy": "blow_energy",
            "blow_count": "blow_count",
            "off_bottom": "off_bottom",
        },
    ),
)


def write_terminals(flat: bool = False) -> bytes:
    """Text of the file; with flat names of the variables, if they are so in the FMU."""
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": FMI_VERSION})
    graphics = SubElement(root, "GraphicalRepresentation")
    scale = {"suggestedScalingFactorTo_mm": MILLIMETRE}
    SubElement(graphics, "CoordinateSystem", EXTENT | scale)
    SubElement(graphics, "Icon", EXTENT)
    terminals = SubElement(root, "Terminals")
    for terminal in TERMINALS:
        told = {
            "name": terminal.name,
            "matchingRule": "bus",
            "description": terminal.description,
        }
        node = SubElement(terminals, "Terminal", told)
        for member, variable in terminal.members.items():
            shown = flat_name(variable) if flat else variable
            names = {"variableName": shown, "memberName": member, "variableKind": "signal"}
            SubElement(node, "TerminalMemberVariable", names)
    return to_bytes(root)
