"""Coupled runs of systems of FMUs that an SSP archive describes, with fmpy."""

from percussion_model.coupling.component import CouplingError
from percussion_model.coupling.coupled_run import CoupledRun
from percussion_model.coupling.master import Coupling
from percussion_model.coupling.python_part import Work
from percussion_model.coupling.verdict import Finding, Verdict

__all__ = ["CoupledRun", "Coupling", "CouplingError", "Finding", "Verdict", "Work"]
