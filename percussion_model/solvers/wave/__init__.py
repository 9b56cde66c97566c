"""Travelling waves in two bars or a drill string: each section is a pair of delay lines."""
