"""A host of nothing but Python itself: runs an FMU of FMI 2.0 and writes outputs as JSON.

Arguments: the FMU, a folder for it, number of steps, their size, outputs. It is run by another
Python than that of the tests, and imports nothing of the project.
"""

import ctypes
import importlib.util
import json
import sys
import time
import zipfile
from ctypes import c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path
from xml.etree import ElementTree

LOGGER = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)
messages = []


@LOGGER
def log(environment, name, status, category, text):
    messages.append(text.decode())


class Callbacks(ctypes.Structure):
    _fields_ = (
        ("logger", LOGGER),
        ("allocate", c_void_p),
        ("release", c_void_p),
        ("finished", c_void_p),
        ("environment", c_void_p),
    )


def now():
    """Time of the clock, and of this process on processors [s]."""
    return time.perf_counter(), time.process_time()


def main(path, folder, steps, size, *names):
    folder = Path(folder).resolve()
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    root = ElementTree.parse(Path(folder, "modelDescription.xml")).getroot()
    identifier = root.find("CoSimulation").get("modelIdentifier")
    references = {v.get("name"): int(v.get("valueReference")) for v in root.iter("ScalarVariable")}
    (library,) = Path(folder, "binaries", "linux64").glob(f"{identifier}.so")
    shell = ctypes.CDLL(str(library))
    shell.fmi2Instantiate.restype = c_void_p
    callbacks = Callbacks(log, None, None, None, None)
    place = Path(folder, "resources").as_uri().encode()
    began = now()
    one = c_void_p(
        shell.fmi2Instantiate(
            b"one", 1, root.get("guid").encode(), place, ctypes.byref(callbacks), 0, 1
        )
    )
    done = [
        shell.fmi2SetupExperiment(one, 0, c_double(0.0), c_double(0.0), 0, c_double(0.0)),
        shell.fmi2EnterInitializationMode(one),
        shell.fmi2ExitInitializationMode(one),
    ]
    started = [after - before for after, before in zip(now(), began, strict=True)]
    which = (c_uint * len(names))(*(references[name] for name in names))
    values = (c_double * len(names))()
    step, get, pause = shell.fmi2DoStep, shell.fmi2GetReal, c_double(size)
    count = c_size_t(len(names))
    rows = []
    began = now()
    for k in range(steps):
        done.append(step(one, c_double(k * size), pause, 1))
        done.append(get(one, which, count, values))
        rows.append(tuple(values))
    took = [after - before for after, before in zip(now(), began, strict=True)]
    shell.fmi2Terminate(one)
    shell.fmi2FreeInstance(one)
    json.dump(
        {
            "refused": sum(status != 0 for status in done),
            "messages": messages,
            "found": [name for name in ("numpy", "numba") if importlib.util.find_spec(name)],
            "prefix": sys.prefix,
            "started": started,
            "took": took,
            "rows": [[value.hex() for value in row] for row in rows],
        },
        sys.stdout,
    )


if __name__ == "__main__":
    main(*sys.argv[1:3], int(sys.argv[3]), float(sys.argv[4]), *sys.argv[5:])
