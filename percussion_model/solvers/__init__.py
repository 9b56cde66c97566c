"""Solvers: the Python side of the kernels."""

from percussion_model.solvers.base import Solver, make_solver

__all__ = ["Solver", "make_solver"]
