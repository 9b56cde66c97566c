"""Leaps over quiet phases of the travelling waves."""
