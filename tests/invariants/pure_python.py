"""One blow computed by the kernels as plain Python, if wanted with a planted fault.

Run with NUMBA_DISABLE_JIT=1; prints a line of JSON.
"""

from __future__ import annotations

import json
import os
import sys

# One blow of a coarse reference drill, the leaps of modes off so that every step is made.
SCENES = {
    "wave": {
        "solver.name": "wave",
        "solver.cells": 20,
        "run.settle": 0.0,
    },
    "modal": {
        "solver.name": "modal",
        "solver.cells": 8,
        "solver.leaps": False,
        "run.settle": 0.0,
    },
    "fem": {"solver.name": "fem", "fem.elements": 10, "run.settle": 0.0},
}
DURATION = 0.0025
FAULT = 0.999


def replace(name: str, function) -> None:
    """Put a function in the place of a kernel wherever one was imported."""
    kernels = ("percussion_model.physics.", "percussion_model.solvers.")
    modules = [m for m in sys.modules.values() if m.__name__.startswith(kernels)]
    found = [module for module in modules if hasattr(module, name)]
    assert found
    for module in found:
        setattr(module, name, function)


def weaken_reflection() -> None:
    """Let the lower end of the bit return 0.999 of each wave."""
    from percussion_model.solvers.wave.step import UP_OUT
    from percussion_model.solvers.wave.step import meet_rock as meet

    def meet_rock(par, s, chain, waves, *rest):
        impulse = meet(par, s, chain, waves, *rest)
        waves.came[UP_OUT, par.sections - 1] *= FAULT
        return impulse

    replace("meet_rock", meet_rock)


def weaken_contact() -> None:
    """Let the bit feel 0.999 of what the piston sends into it."""
    from percussion_model.solvers.wave.step import DOWN_OUT, FIRST
    from percussion_model.solvers.wave.step import meet_piston as meet

    def meet_piston(par, s, chain, waves, *rest):
        impulse = meet(par, s, chain, waves, *rest)
        waves.came[DOWN_OUT, int(chain.bodies[par.struck, FIRST])] *= FAULT
        return impulse

    replace("meet_piston", meet_piston)


def lose_body_force(at: int = 1000) -> None:
    """Let the piston feel no body force in one step."""
    from percussion_model.solvers.wave.step import ACCELERATION
    from percussion_model.solvers.wave.step import accelerations as full

    count = 0

    def accelerations(par, s, chain, waves, push):
        nonlocal count
        damper = full(par, s, chain, waves, push)
        count += 1
        if count == at:
            waves.came[ACCELERATION, 0] = 0.0
        return damper

    replace("accelerations", accelerations)


def weaken_penalty() -> None:
    """Let the bit feel 0.999 of what the penalty contact does to it."""
    from percussion_model.solvers.fem.records import Stage
    from percussion_model.solvers.fem.solve import meet_at_contact as meet

    def meet_at_contact(par, s, f, at, x, h):
        meet(par, s, f, at, x, h)
        if s.closed == 1:
            x[Stage.RE, par.n_p] *= FAULT

    replace("meet_at_contact", meet_at_contact)


def lose_load(at: int = 100) -> None:
    """Let the piston feel neither gravity nor drive in one step."""
    from percussion_model.solvers.fem.records import Mesh, Stage
    from percussion_model.solvers.fem.scheme import drive_force
    from percussion_model.solvers.fem.scheme import load as full

    count = 0

    def load(par, s, w, c, x, h):
        nonlocal count
        full(par, s, w, c, x, h)
        count += 1
        if count == at:
            a = par.gravity + drive_force(par, s) / par.mass_p
            for i in range(par.n_p):
                x[Stage.RE, i] -= a * c[Mesh.SHARE, i]

    replace("load", load)


def shorten_path() -> None:
    """Let displacements grow by 0.999 of what velocities ask for."""
    from percussion_model.solvers.fem.records import Node
    from percussion_model.solvers.fem.scheme import try_step as whole

    def try_step(par, s, w, c, f, x, h):
        whole(par, s, w, c, f, x, h)
        for i in range(par.n_p + par.n_b):
            x[Node.U, i] = w[Node.U, i] + FAULT * (x[Node.U, i] - w[Node.U, i])

    replace("try_step", try_step)


# Each with the solver that it spoils; "none" is run with both.
FAULTS = {
    "none": ("", lambda: None),
    "reflection": ("wave", weaken_reflection),
    "contact": ("wave", weaken_contact),
    "body_force": ("wave", lose_body_force),
    "penalty": ("fem", weaken_penalty),
    "load": ("fem", lose_load),
    "path": ("fem", shorten_path),
}


def run_scene(solver):
    """Run the scene of a solver to its end; a simulation."""
    from percussion_model import Scene, Simulation

    simulation = Simulation(Scene().replace(**SCENES[solver]))
    simulation.advance(DURATION)
    return simulation


def main(solver: str, fault: str) -> None:
    """Plant a fault, run and print what came of it."""
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        raise SystemExit("set NUMBA_DISABLE_JIT=1")

    FAULTS[fault][1]()
    simulation = run_scene(solver)
    found = {
        "energy": simulation.energy(),
        "events": [list(map(float, row.item())) for row in simulation.events],
        "workspace": simulation.save().state.workspace.tolist(),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
