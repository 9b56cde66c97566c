"""Scenes (TOML), and scripted scenarios that drive the FMU through fmpy."""
