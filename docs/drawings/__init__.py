"""Drawings of the documents: the model, the waves of an impact, the drilling system, the house.

Nothing is drawn by hand that the package knows: laws and waves come from runs, the system from its
file, the layers from pyproject.toml. `python -m docs.make drawings` draws all of them.
"""
