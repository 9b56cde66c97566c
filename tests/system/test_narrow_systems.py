"""What `couple` and `bench-controller` print fits 80 columns, and says on a pipe that they run."""

from __future__ import annotations

import builtins
import time
from types import SimpleNamespace

import pytest
from narrow import Printed, faults

from percussion_model.coupling.master import Coupling
from percussion_model.interface import progress
from percussion_model.interface.bench_text import COLUMNS
from percussion_model.interface.cli import INTERRUPTED, _guarded, app

COMMANDS = {
    "couple": ["--duration", "0.2", "--no-figures", "--out", "out"],
    "bench-controller": ["--trial", "rod", "--out", "out"],
}


def called(name, archive):
    system = [str(archive)] if name == "couple" else ["--system", str(archive)]
    return _guarded(lambda: app([name, *system, *COMMANDS[name]], standalone_mode=False))


@pytest.mark.parametrize("name", COMMANDS)
def test_commands_fit(name, feed_control, brief, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    printed = Printed(monkeypatch)
    called(name, feed_control)
    said = capsys.readouterr()
    assert "depth" in (said.out + said.err).lower()
    assert faults(said.out) == []
    assert faults(said.err) == []
    assert printed.broken(said.out + said.err) == set()


def test_a_table_of_a_bench_is_whole_and_its_runs_are_told_elsewhere(
    feed_control, brief, tmp_path, monkeypatch, capsys
):
    """Lines of progress come by the hundred; none of them stands in the table."""
    monkeypatch.chdir(tmp_path)
    lines = []
    pipe = SimpleNamespace(write=lines.append, flush=lambda: None, isatty=lambda: False)
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stderr=pipe))
    monkeypatch.setattr(progress, "EVERY", 5e-3)
    words = ["--trial", "rod", "--trial", "soft", "--out", "out"]
    _guarded(lambda: app(["bench-controller", "--system", str(feed_control), *words],
                         standalone_mode=False))  # fmt: skip
    told = "".join(lines)
    assert "run 1 of 2, soft, " in told
    assert "run 2 of 2, rod, " in told
    rows = [row.split() for row in capsys.readouterr().out.splitlines()]
    # one block of columns below the other
    begins = [k for k, row in enumerate(rows) if row[0] == "run"]
    assert len(begins) == 2
    for k in begins:
        assert [row[0] for row in rows[k + 2 : k + 4]] == ["soft", "rod"]  # below a rule
    assert rows[begins[-1] + 4][:4] == ["mean", "of", "the", "points:"]
    units = [word for row in rows for word in row if word.startswith("[")]
    assert units == ["[mm]", "[MJ/m]", "[%]", "[%]", "[%]", "[s]", "[kN]", "[s]"]
    said = " ".join(word for row in rows for word in row)
    assert "Runs: soft, rock a third as stiff; rod, a rod is added." in said
    for meaning in ("points, 100 less", *(text for *_, text in COLUMNS)):
        assert meaning in said


@pytest.mark.parametrize("name", COMMANDS)
def test_they_say_on_a_pipe_that_they_run(name, feed_control, tmp_path, monkeypatch):
    """Runs of the system do not come back before two lines have been printed."""
    monkeypatch.chdir(tmp_path)
    lines = []
    pipe = SimpleNamespace(write=lines.append, flush=lambda: None, isatty=lambda: False)
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stderr=pipe))
    monkeypatch.setattr(progress, "EVERY", 5e-3)

    def run(*words, **options):
        end = time.monotonic() + 20.0
        while sum(" s: " in line for line in lines) < 2 and time.monotonic() < end:
            time.sleep(1e-3)
        raise KeyboardInterrupt

    monkeypatch.setattr(Coupling, "run", run)
    assert called(name, feed_control) == INTERRUPTED
    assert sum(" s: " in line for line in lines) >= 2


@pytest.mark.parametrize(
    ("words", "module"),
    [
        (["couple", "{}", "--duration", "0.02"],
         "percussion_model.interface.plotting.coupled_signals"),
        (["bench-controller", "--system", "{}", "--trial", "rod", "--no-step-check"],
         "percussion_model.interface.bench_page"),
    ],
)  # fmt: skip
def test_loading_what_draws_is_told_as_drawing(
    words, module, feed_control, brief, tmp_path, monkeypatch
):
    """It takes seconds, of which a line said "still running"."""
    monkeypatch.chdir(tmp_path)
    pipe = SimpleNamespace(write=lambda text: None, flush=lambda: None, isatty=lambda: False)
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stderr=pipe))
    told, load = [], builtins.__import__

    def loading(name, *others):
        if name == module:
            told.append(progress._running[0].told[0])
        return load(name, *others)

    monkeypatch.setattr(builtins, "__import__", loading)
    given = [word.format(feed_control) for word in words]
    assert _guarded(lambda: app([*given, "--out", "out"], standalone_mode=False)) == 0
    assert told
    assert all(text.startswith("drawing the figure") for text in told)
