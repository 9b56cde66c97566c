"""Runs of a scene and their results."""
