"""Misuse of the calls of FMI 2.0, each in a process of its own: refused in words, and no crash."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# A host that sees every status and message.
HOST = """
import ctypes, sys
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

folder = sys.argv[1]
model = read_model_description(folder)
refs = {one.name: [one.valueReference] for one in model.modelVariables}
said = []
callbacks = fmi2CallbackFunctions()
callbacks.logger = logger = fmi2CallbackLoggerTYPE(
    lambda environment, name, status, category, text: said.append(text.decode()))

def new():
    slave = FMU2Slave(guid=model.guid, unzipDirectory=folder, instanceName="one",
                      modelIdentifier=model.coSimulation.modelIdentifier)
    slave.instantiate(callbacks=callbacks, loggingOn=True)
    return fed(slave)

def fed(slave):
    given = {"interval": 1e-3, "rate_of_penetration": 0.01, "rotation_speed": 1.0,
             "supply_pressure": 1.0, "feed_force": 1.0}
    for name, value in given.items():
        slave.setReal(refs[name], [value])
    return slave

def start(slave, **times):
    slave.setupExperiment(startTime=0.0, **times)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    return slave

def refused(call, *words):
    said.clear()
    try:
        call()
    except FMICallException as error:
        assert error.status == 4, error
        assert any(all(word in text for word in words) for text in said), said
    else:
        raise AssertionError("taken without a word")

def works(slave, time=0.0):
    for k in range(3):
        slave.doStep(time + 1e-3 * k, 1e-3)
    return slave.getReal(refs["apparent_energy"])[0]

wanted = works(start(new()))
slave = new()
"""

# What is done wrong, and that the instance can be used all the same.
CASES = {
    "initialising without a start time": """
refused(slave.enterInitializationMode, "out of order", "fmi2SetupExperiment")
assert works(start(slave)) == wanted
""",
    "ending the initialisation that has not begun": """
slave.setupExperiment(startTime=0.0)
refused(slave.exitInitializationMode, "fmi2ExitInitializationMode", "initialising")
assert works(start(slave)) == wanted
""",
    "a stop before the start": """
refused(lambda: slave.setupExperiment(startTime=1.0, stopTime=0.5), "stopTime = 0.5", "1.0 s")
refused(lambda: slave.setupExperiment(startTime=0.0, stopTime=float("nan")), "stopTime = nan")
refused(lambda: slave.setupExperiment(startTime=float("inf")), "startTime = inf")
refused(slave.enterInitializationMode, "out of order")
assert works(start(slave, stopTime=0.0)) == wanted
""",
    "a second start": """
start(slave)
refused(lambda: slave.setupExperiment(startTime=1.0), "fmi2SetupExperiment")
refused(slave.enterInitializationMode, "fmi2EnterInitializationMode", "stepping")
assert works(slave) == wanted
""",
    "a step before the start": """
refused(lambda: slave.doStep(0.0, 1e-3), "fmi2DoStep", "instantiated")
assert works(start(slave)) == wanted
""",
    "an end before the start": """
refused(slave.terminate, "fmi2Terminate", "instantiated")
slave.setupExperiment(startTime=0.0)
slave.enterInitializationMode()
refused(slave.terminate, "fmi2Terminate", "initialising")
slave.exitInitializationMode()
assert works(slave) == wanted
""",
    "a second end": """
assert works(start(slave)) == wanted
slave.terminate()
refused(slave.terminate, "fmi2Terminate", "terminated")
assert slave.getReal(refs["apparent_energy"])[0] == wanted
""",
    "a step after the end": """
works(start(slave))
slave.terminate()
refused(lambda: slave.doStep(3e-3, 1e-3), "fmi2DoStep", "terminated")
""",
    "inputs after the end": """
works(start(slave))
slave.setReal(refs["blow_frequency"], [2.0])  # as often as a host does, so that its path is short
slave.setReal(refs["blow_frequency"], [0.0])
slave.terminate()
refused(lambda: slave.setReal(refs["blow_frequency"], [1.0]), "fmi2SetReal", "after fmi2Terminate")
assert slave.getReal(refs["blow_frequency"]) == [0.0]
slave.reset()
assert works(start(fed(slave))) == wanted
""",
    "states of all phases": """
def bytes_of(slave):
    state = slave.getFMUstate()
    try:
        return bytes(slave.serializeFMUstate(state))
    finally:
        slave.freeFMUstate(state)

def give(slave, saved):
    state = slave.deSerializeFMUstate(saved)
    try:
        slave.setFMUstate(state)
    finally:
        slave.freeFMUstate(state)

prior = refs["prior.apparent_energy"]
slave.setReal(prior, [2.0])
first = bytes_of(slave)
slave.setupExperiment(startTime=0.5)
set_up = bytes_of(slave)
slave.enterInitializationMode()
slave.getReal(refs["apparent_energy"])
second = bytes_of(slave)
slave.exitInitializationMode()
third = bytes_of(slave)
given = works(slave, 0.5)
assert given != wanted
fourth = bytes_of(slave)
slave.terminate()
last = bytes_of(slave)
for one in (slave, new()):
    give(one, first)
    assert one.getReal(prior) == [2.0]
    refused(one.enterInitializationMode, "fmi2SetupExperiment")
    give(one, set_up)
    one.enterInitializationMode()
    one.exitInitializationMode()
    assert works(one, 0.5) == given
    give(one, second)
    refused(lambda: one.doStep(0.5, 1e-3), "initialising")
    one.exitInitializationMode()
    assert works(one, 0.5) == given
    give(one, third)
    assert works(one, 0.5) == given
    give(one, last)
    refused(lambda: one.doStep(0.503, 1e-3), "terminated")
    give(one, fourth)
    assert one.getReal(refs["apparent_energy"])[0] == given
    one.doStep(0.503, 1e-3)
""",
    "each category of the log": """
import xml.etree.ElementTree as tree
found = tree.parse(folder + "/modelDescription.xml").getroot().iter("Category")
names = [one.get("name") for one in found]
assert "logStatusError" in names
# a host that asks for one sees what belongs to it: pythonfmu takes the names literally
assert "logAll" not in names
slave.setDebugLogging(True, names)
refused(slave.terminate, "fmi2Terminate")
slave.setDebugLogging(True, ["logStatusError"])
refused(slave.terminate, "fmi2Terminate")
""",
    "a state that is none": """
start(slave)
for wrong in (b"\\0", b"nonsense" * 30, b"PHAMMER\\0" * 30):
    state = slave.deSerializeFMUstate(wrong)
    refused(lambda: slave.setFMUstate(state), "saved state")
    slave.freeFMUstate(state)
assert works(slave) == wanted
""",
    "references that there are not": """
start(slave)
refused(lambda: slave.getReal([987654]), "987654")
refused(lambda: slave.setReal([987654], [1.0]), "987654")
refused(lambda: slave.setBoolean(refs["blow_frequency"], [True]), "Boolean")
assert works(slave) == wanted
""",
    "a hundred refusals": """
start(slave)
for k in range(100):
    refused(lambda: slave.doStep(float("nan"), 1e-3), "nan")
    refused(slave.enterInitializationMode, "stepping")
assert works(slave) == wanted
slave.freeInstance()
""",
}


@pytest.mark.parametrize("name", CASES)
def test_misuse_is_refused_and_harms_nothing(unpacked, name):
    done = subprocess.run(
        [sys.executable, "-c", f"{HOST}\n{CASES[name]}\nprint('done')", unpacked["RockFilter"]],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout.strip()) == (0, "done"), done.stderr
