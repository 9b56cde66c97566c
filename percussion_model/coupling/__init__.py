"""Runs systems of FMUs that an SSP archive describes, with fmpy."""

from percussion_model.coupling.component import CouplingError
from percussion_model.coupling.master import CoupledRun, Coupling
from percussion_model.coupling.python_part import Work

__all__ = ["CoupledRun", "Coupling", "CouplingError", "Work"]
