"""One blow computed by the kernels as plain Python, if wanted with a planted fault.

Run with NUMBA_DISABLE_JIT=1; prints a line of JSON. Without the compiler a
record must be `np.record` to have its fields as attributes.
"""

from __future__ import annotations

import json
import os
import sys

import numpy as np

# One blow of a coarse reference drill, its leaps off so that every step is made.
SCENES = {
    "wave": {
        "solver.name": "wave",
        "solver.cells": 20,
        "solver.leaps": False,
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


def use_attribute_records() -> None:
    """Let the fields of records be attributes, as they are in compiled kernels."""
    from percussion_model.physics import records
    from percussion_model.scene import numbers
    from percussion_model.solvers.fem import records as of_fem
    from percussion_model.solvers.modal import records as of_modes
    from percussion_model.solvers.wave import records as of_waves

    for module, names in (
        (records, ("BLOW", "EVENT", "READING")),
        (numbers, ("SCENE_NUMBERS",)),
        (of_waves, ("WAVE_PAR", "WAVE_STATE")),
        (of_modes, ("MODAL_PAR", "MODAL_STATE")),
        (of_fem, ("FEM_PAR", "FEM_STATE")),
    ):
        for name in names:
            setattr(module, name, np.dtype((np.record, getattr(module, name))))


def replace(name: str, function) -> None:
    """Put a function in the place of a kernel wherever one was imported."""
    kernels = ("percussion_model.physics.", "percussion_model.solvers.")
    modules = [m for m in sys.modules.values() if m.__name__.startswith(kernels)]
    found = [module for module in modules if hasattr(module, name)]
    assert found
    for module in found:
        setattr(module, name, function)


def weaken_reflection() -> None:
    """Let the free top end of the piston return 0.999 of each wave."""
    from percussion_model.solvers.wave.ends import outer_waves as send

    def outer_waves(par, w, c, n, r, *ends):
        send(par, w, c, n, r, *ends)
        if n == par.n_p:
            w[2 - r, 0] *= FAULT

    replace("outer_waves", outer_waves)


def weaken_contact() -> None:
    """Let piston and bit push each other with 0.999 of the force."""
    from percussion_model.solvers.wave.contact import bar_contact as contact

    def bar_contact(closed, gap, v_p, v_t, z_p, z_t, tau):
        out = list(contact(closed, gap, v_p, v_t, z_p, z_t, tau))
        if out[0] == 1:
            free = max(out[8], 0.0)
            rest = tau - free
            force = FAULT * z_p * z_t / (z_p + z_t) * (v_p - v_t)
            v, u = v_p - force / z_p, v_t + force / z_t
            out[2:6] = (
                v_p * free + v * rest,
                v_p * v_p * free + v * v * rest,
                v_t * free + u * rest,
                v_t * v_t * free + u * u * rest,
            )
            out[6:8] = force * rest, 0.5 * force * rest * rest
        return tuple(out)

    replace("bar_contact", bar_contact)


def lose_body_force(at: int = 1000) -> None:
    """Let the cells of the piston feel no body force in one step."""
    from percussion_model.solvers.wave.bar import face_velocities as faces

    count = 0

    def face_velocities(w, c, n, r, kick):
        nonlocal count
        if n == 20:
            count += 1
            if count == at:
                kick = 0.0
        faces(w, c, n, r, kick)

    replace("face_velocities", face_velocities)


def weaken_penalty() -> None:
    """Let the bit feel 0.999 of what the penalty contact does to it."""
    from percussion_model.solvers.fem.records import Trial
    from percussion_model.solvers.fem.solve import meet_at_contact as meet

    def meet_at_contact(par, s, f, at, x, h):
        meet(par, s, f, at, x, h)
        if s.closed == 1:
            x[Trial.RE, par.n_p] *= FAULT

    replace("meet_at_contact", meet_at_contact)


def lose_load(at: int = 100) -> None:
    """Let the piston feel neither gravity nor drive in one step."""
    from percussion_model.solvers.fem.records import Mesh, Trial
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
                x[Trial.RE, i] -= a * c[Mesh.SHARE, i]

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
    use_attribute_records()

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
