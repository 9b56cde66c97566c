"""Waves in a chain of bars, moved from end to end of a section as they are."""
