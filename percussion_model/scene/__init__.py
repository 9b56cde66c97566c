"""Scenes: the one table of parameters, and what follows from it."""
