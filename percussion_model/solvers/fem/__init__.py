"""Finite elements: the paper's own computational model."""
