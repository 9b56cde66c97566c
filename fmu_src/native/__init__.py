"""The FMU of the hammer that needs no Python: one library for FMI 2.0 and 3.0."""
