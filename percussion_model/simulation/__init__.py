"""Runs of a scene and what they found."""
