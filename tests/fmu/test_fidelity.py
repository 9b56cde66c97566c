"""One FMU that runs waves or rigid bodies, by a parameter."""

from __future__ import annotations

import pytest

from percussion_model import Scene, Simulation

FIDELITIES = {"wave": 1, "rigid": 2}  # of the enumeration
RETIRED = 3  # the blow map


def test_every_fidelity_answers_in_one_fmu(make):
    rates = {}
    for name, fidelity in FIDELITIES.items():
        instance = make("PercussiveHammer", solver__fidelity=fidelity)
        instance.step(0.6)
        library = Simulation(Scene().replace(**{"solver.fidelity": name}))
        library.advance(0.6)
        assert instance.get("blow_time") == library.blows["time"][-1]
        rates[name] = instance.get("rate_of_penetration")
    assert rates["rigid"] != pytest.approx(rates["wave"], rel=0.02)


@pytest.mark.parametrize("name", ["PercussiveHammer", "NumbaHammer"])
def test_the_blow_map_is_retired(make, name):
    instance = make(name, start=False)
    with pytest.raises(Exception, match="Initialization"):
        instance.start(solver__fidelity=RETIRED)
    said = 'solver.fidelity = 3: must be one of "wave", "rigid"; the blow map is retired'
    assert any(said in text for text in instance.messages)
