"""Commands of `percussion` that make FMUs; `fmu_src.command_line` adds them to it.

What they need is loaded when they run: `percussion run` starts as if they were not there.
"""
