"""Common base of all slaves; runs inside FMUs."""
