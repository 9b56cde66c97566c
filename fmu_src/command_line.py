"""The command `percussion` with all its tasks: those of the model, and those that make FMUs.

The console script is this one, above both packages, since the model knows nothing of FMUs.
"""

from __future__ import annotations

from fmu_src.commands.controller import controller
from fmu_src.commands.fmu import fmu
from fmu_src.commands.native import native
from fmu_src.commands.scenario import SETTINGS, scenario
from fmu_src.commands.system import system
from percussion_model.interface import cli

app = cli.app
for _command in (fmu, native, controller, system):
    cli.add(_command)
cli.add(scenario, settings=SETTINGS)


def main() -> None:
    """Run the command line; errors are one message and an exit code."""
    cli.main()


if __name__ == "__main__":
    main()
