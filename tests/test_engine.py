"""Entries of the solvers: their form, their sources, threads, and what of numba is relied on."""

import copy
import ctypes
import inspect
import os
import pickle
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from percussion_model import Scene, Simulation
from percussion_model.engine import compiler, library
from percussion_model.engine import solver as solver_module
from percussion_model.engine.entries import ENTRIES, SOLVERS
from percussion_model.engine.fault_texts import fault_text
from percussion_model.engine.faults import Fault
from percussion_model.engine.library import _exports, module_of
from percussion_model.engine.platforms import this_platform
from percussion_model.physics.kernel import DISABLED, kernel
from percussion_model.physics.records import SAMPLE_FIELDS

THREADS = 6


@pytest.mark.parametrize("solver", SOLVERS)
def test_each_solver_has_every_entry_with_its_arguments(solver):
    module = import_module(module_of(solver))
    for name, form in ENTRIES.items():
        taken = inspect.signature(getattr(module, name).py_func).parameters
        assert len(taken) == len(form.partition(":")[2]), name


def test_an_edit_concerns_the_solvers_that_import_what_was_edited():
    def made_of(solver):
        return {file.relative_to(compiler.PACKAGE).as_posix()
                for file in compiler.sources_of(module_of(solver))}  # fmt: skip

    found = {solver: made_of(solver) for solver in SOLVERS}
    shared = ("physics/rock.py", "physics/kernel.py", "engine/layout.py", "scene/bars.py",
              "components/__init__.py")  # fmt: skip
    for solver in SOLVERS:
        assert found[solver] >= {*shared, f"solvers/{solver}/advance.py"}
        others = {f"solvers/{one}/advance.py" for one in SOLVERS if one != solver}
        assert not found[solver] & others
        assert not any(name.startswith(("interface/", "analysis/")) for name in found[solver])


@pytest.mark.skipif(DISABLED, reason="nothing is compiled")
@pytest.mark.parametrize("narrower", [1, 2])
def test_narrower_vectors_have_the_same_bits(narrower, monkeypatch):
    scene = Scene().computed_by("modal")

    def state():
        simulation = Simulation(scene)
        simulation.advance(0.2)
        return simulation.save().state.words.tolist(), simulation.blows.tobytes()

    wanted = state()
    file = library._library_file("modal")
    entries = library._of_library("modal", file, narrower)
    monkeypatch.setattr(solver_module, "entries_of", lambda name: entries)
    monkeypatch.setattr(solver_module, "_kept", {})
    assert state() == wanted


@pytest.mark.parametrize("solver", SOLVERS)
def test_threads_do_not_disturb_each_other(solver):
    """Each with a simulation of its own, all with one solver, and so with one room to work in."""
    scene = Scene().computed_by(solver)
    one = Simulation(scene)
    times = np.linspace(0.01, 0.05, 200)
    wanted, found = one.sample_rows(times), {}

    def work(k):
        found[k] = Simulation(scene, solver=one.solver).sample_rows(times)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == THREADS
    for rows in found.values():
        np.testing.assert_array_equal(rows, wanted)


def test_threads_may_make_solvers_of_many_rocks_at_once():
    """More than tables are kept for: none is taken away from one that is being made."""
    scenes = [Scene().replace(**{"rock.loading_stiffness": 5e8 + 1e6 * k}) for k in range(12)]
    wanted = [Simulation(scene).observe() for scene in scenes]
    with ThreadPoolExecutor(THREADS) as pool:
        found = list(pool.map(lambda scene: Simulation(scene).observe(), scenes * 2))
    assert found == wanted * 2


@pytest.mark.parametrize("solver", SOLVERS)
def test_samples_are_what_readings_tell(solver):
    scene, times = Scene().computed_by(solver), np.linspace(0.0, 0.04, 90)
    rows, read = Simulation(scene).sample_rows(times), Simulation(scene)
    for row, t in zip(rows, times, strict=True):
        read.advance(float(t))
        seen = read.observe()
        np.testing.assert_array_equal(row, [seen[name] for name in SAMPLE_FIELDS])


@pytest.mark.parametrize("solver", SOLVERS)
def test_copies_of_a_simulation_go_on_alone(solver):
    one = Simulation(Scene().computed_by(solver))
    one.advance(0.01)
    copies = copy.deepcopy(one), pickle.loads(pickle.dumps(one))
    one.advance(0.05)
    for other in copies:
        assert other.time == 0.01
        other.advance(0.05)
        assert other.observe() == one.observe()


def test_facts_stand_in_the_texts_of_faults():
    text = fault_text(Fault.BEHIND, (0.1, 2.5, 0.0, 0.0))
    assert text == "the saved state has its time of 0.1 s, far before 2.5 s"
    assert fault_text(Fault.MODES, (1234.5, 10.0)).startswith(
        "the bars would have 1.23e+03 modes, more than 10: "
    )


def test_what_is_used_of_numba_and_llvm_is_there(tmp_path):
    """With a release of them that fails here, mend what imports numba in `engine`.

    The second time, what is kept of the first is used, but for the edited function and its caller.
    """
    from percussion_model.engine.loading import load_objects

    (tmp_path / "small_entries.py").write_text(
        "import numpy as np\n"
        "from percussion_model.engine.memory import floats_at\n"
        "from percussion_model.physics.kernel import kernel, preparing\n"
        "from small_sums import times\n"
        "EXPORTED = {'small_sum': ('add_up', 'n:ww')}\n"
        "@kernel\n"
        "def add(one, other):\n"
        "    return one + other\n"
        "@preparing\n"
        "def add_up(address, count):\n"
        "    room = np.zeros(count)\n"
        "    room[:] = floats_at(address, count)\n"
        "    return times(add(room.sum(), 0.0))\n"
    )
    # in a process of its own, as always: here numba would go on with functions without code
    path = os.pathsep.join((str(tmp_path), *sys.path))
    command = [sys.executable, "-m", "percussion_model.engine.objects", "small_entries"]
    command += [tmp_path / "translations", tmp_path, this_platform()]
    call = ctypes.PYFUNCTYPE(ctypes.c_double, ctypes.c_int64, ctypes.c_int64)
    numbers = np.arange(5.0)
    made = []
    for factor in (2, 30):
        (tmp_path / "small_sums.py").write_text(
            "from percussion_model.physics.kernel import kernel\n"
            f"FACTOR = {factor}.0\n"
            "@kernel\n"
            "def times(number):\n"
            "    return FACTOR * number\n"
        )
        subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": path})
        address_of, suffix, _ = load_objects(sorted(tmp_path.glob("*.o")))
        add_up = call(address_of(f"small_sum{suffix}"))
        assert add_up(numbers.ctypes.data, len(numbers)) == 10.0 * factor
        _, _, libraries, _ = pickle.loads((tmp_path / "translations").read_bytes())
        made.append({one.code for one in libraries if one.name in ("add", "times", "add_up")})
    assert [len(one) for one in made] == [3, 3]
    assert len(made[0] & made[1]) == 1


def test_what_a_kernel_holds_tells_when_to_translate_it_anew():
    from percussion_model.engine.compiled_memory import records_at
    from percussion_model.engine.translations import content_of

    def holding(limit, called, words=""):
        source = f"def one(x):\n    '{words}'\n    return called(min(x, limit))\n"
        names = {"called": called, "limit": limit, "__name__": "user_component"}
        exec(source, names)
        return content_of(kernel(names["one"]))

    least, other = kernel(lambda x: x + 1.0), kernel(lambda x: x + 2.0)
    assert holding(1.0, least) == holding(1.0, least, "Least of two.")
    assert len({holding(1.0, least), holding(2.0, least), holding(1.0, other)}) == 3
    kinds = [np.dtype([(name, float)]) for name in ("time", "force")]
    assert len({content_of(records_at(kind)) for kind in kinds}) == 2


@pytest.mark.parametrize("solver", SOLVERS)
def test_what_entries_hold_is_known_so_that_an_edit_compiles_little(solver):
    from percussion_model.engine.translations import content_of
    from percussion_model.physics.kernel import _compiler

    _compiler()
    for name in ENTRIES:
        content_of(getattr(import_module(module_of(solver)), name))


def test_libraries_for_windows_name_what_they_export():
    text = _exports("rigid", [Path("x86_64-windows_base.o"), Path("x86_64-windows_avx2.o")])
    assert text.count("-export:") == 2 * len(ENTRIES)
    assert " -export:rigid_create_avx2" in text
    assert text.count("\n") == 1
