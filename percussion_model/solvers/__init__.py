"""Solvers: a folder each, behind the interface of `base`."""
