"""Archives of strangers: nothing is loaded, read or written that is not theirs to name."""

import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import pytest

from percussion_model.coupling import Coupling, CouplingError
from percussion_model.coupling import unpack as limits
from percussion_model.coupling.bench import bench
from percussion_model.interface.cli import BAD_INPUT, _guarded, app, main
from tests.properties.hostile import campaign, pack, unpacked

COUNT = 500 if "PERCUSSION_LONG" in os.environ else 40
MOST_MEMORY = 500e6
STRUCTURE, DESCRIPTION = "SystemStructure.ssd", "modelDescription.xml"
ROCK = "resources/RockProfile.fmu"
SOURCE = f'source="{ROCK}"'.encode()
LIBRARY = "binaries/linux64/RockProfile.so"
LAUGHS = b'<!DOCTYPE x [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]>'


@pytest.fixture(scope="module")
def entries(feed_control):
    return unpacked(feed_control.read_bytes())


def with_source(source):
    def change(entries, tmp_path):
        text = entries[STRUCTURE]
        assert SOURCE in text
        word = source.format(tmp_path=tmp_path)
        return entries | {STRUCTURE: text.replace(SOURCE, f'source="{word}"'.encode())}

    return change


def in_structure(old, new):
    def change(entries, tmp_path):
        assert old in entries[STRUCTURE]
        return entries | {STRUCTURE: entries[STRUCTURE].replace(old, new)}

    return change


def in_fmu(change_fmu):
    def change(entries, tmp_path):
        return entries | {ROCK: pack(change_fmu(unpacked(entries[ROCK])))}

    return change


def with_identifier(word):
    def change(fmu):
        old = b'modelIdentifier="RockProfile"'
        assert old in fmu[DESCRIPTION]
        new = f'modelIdentifier="{word}"'.encode()
        return fmu | {DESCRIPTION: fmu[DESCRIPTION].replace(old, new)}

    return in_fmu(change)


def without(name):
    return in_fmu(lambda fmu: {key: fmu[key] for key in fmu if key != name})


def deep(entries, tmp_path):
    text = entries[STRUCTURE].replace(b"</ssd:System>", b"<a>" * 100 + b"</ssd:System>")
    return entries | {STRUCTURE: text}


def no_number(entries, tmp_path):
    name = "resources/rig.ssv"
    return entries | {name: re.sub(rb'value="[^"]*"', b'value="x"', entries[name])}


def two_connections(entries, tmp_path):
    one = re.search(rb"<ssd:Connection [^>]*/>", entries[STRUCTURE])[0]
    return entries | {STRUCTURE: entries[STRUCTURE].replace(one, one + one)}


def added(name, content=b"evil"):
    return lambda entries, tmp_path: entries | {name.format(tmp_path=tmp_path): content}


NASTY = {
    "absolute source": (with_source("{tmp_path}/fmu/RockProfile.fmu"), "within the archive"),
    "source above": (with_source("../../../{tmp_path}/x.fmu"), "within the archive"),
    "device as source": (with_source("/dev/zero"), "source = '/dev/zero': must be an FMU within"),
    "folder as source": (with_source("resources"), "no folder and no link"),
    "no such source": (with_source("resources/Nothing.fmu"), "component rock: source ="),
    "no FMU as source": (with_source("resources/rock.ssv"), "rock.ssv: cannot be unpacked"),
    "unknown component": (
        in_structure(b'startElement="rock"', b'startElement="rocky"'),
        "there is no component rocky, only rock, supply",
    ),
    "component twice": (
        in_structure(b'Component name="supply"', b'Component name="rock"'),
        "has two components rock",
    ),
    "two connections": (two_connections, "has two connections"),
    "document type": (in_structure(b"<ssd:System ", LAUGHS + b"<ssd:System "), "not valid XML"),
    "entities": (in_structure(b"?>\n", b"?>\n" + LAUGHS), "has a document type"),
    "deep structure": (deep, "levels deep"),
    "no number": (no_number, "System.ssp: component rig: resources/rig.ssv: line"),
    "no structure": (
        lambda entries, tmp_path: {k: entries[k] for k in entries if k != STRUCTURE},
        "System.ssp: is no SSP archive: there is no SystemStructure.ssd in it",
    ),
    "path above": (added("../evil"), "'../evil' is no path within"),
    "absolute path": (added("{tmp_path}/evil"), "is no path within"),
    "path with control characters": (added("a\x1b[31m"), "cannot be printed"),
    "bomb": (added("bomb", bytes(10**7)), "unpacks to 10000000 bytes, more than 100 times"),
    "bomb in an FMU": (
        in_fmu(lambda fmu: fmu | {"bomb": bytes(10**7)}), "rock: RockProfile.fmu: bomb unpacks"
    ),
    "many entries": (
        lambda entries, tmp_path: entries | {f"many/{k}": b"" for k in range(10_001)},
        "lists more than 10000 files",
    ),
    "identifier above": (with_identifier("../../evil"), "must be a plain name"),
    "identifier of another": (with_identifier("RigFeed"), "no library binaries/"),
    "no library": (without(LIBRARY), "its FMU has no library binaries/"),
    "no description": (without(DESCRIPTION), "rock: modelDescription.xml: is not there"),
    "broken library": (
        in_fmu(lambda fmu: fmu | {LIBRARY: b"nonsense" * 1000}), "rock: .* cannot be loaded"
    ),
    "cut library": (
        in_fmu(lambda fmu: fmu | {LIBRARY: fmu[LIBRARY][:100_000]}), "of its FMU is cut short"
    ),
}  # fmt: skip


@pytest.mark.skipif(sys.platform != "linux", reason="takes libraries of Linux apart")
@pytest.mark.parametrize("name", NASTY)
def test_a_nasty_archive_is_one_line_and_leaves_nothing(
    name, entries, tmp_path, capsys, monkeypatch
):
    change, text = NASTY[name]
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    path = tmp_path / "System.ssp"
    path.write_bytes(pack(change(entries, tmp_path)))
    here = Path.cwd()
    words = ["couple", str(path), "--duration", "0.01", "--out", str(tmp_path / "out")]
    assert _guarded(lambda: app(words, standalone_mode=False)) == BAD_INPUT
    said = capsys.readouterr().err.strip()
    assert len(said.splitlines()) == 1
    assert re.search(text, said), said
    assert Path.cwd() == here
    assert sorted(one.name for one in tmp_path.rglob("*")) == ["System.ssp", "scratch"]


def test_a_link_in_an_archive_is_refused(entries, tmp_path):
    path = tmp_path / "System.ssp"
    path.write_bytes(pack(entries))
    with zipfile.ZipFile(path, "a") as archive:
        link = zipfile.ZipInfo("link")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, "/etc")
    with pytest.raises(CouplingError, match="'link' is a link"):
        Coupling(path)


def test_only_what_unpacks_in_bounds_is_unpacked(entries, tmp_path):
    """bz2 and LZMA give a whole block at once, however large it is."""
    path = tmp_path / "System.ssp"
    path.write_bytes(pack(entries, zipfile.ZIP_BZIP2))
    with pytest.raises(CouplingError, match="packed by method 12"):
        Coupling(path)


@pytest.mark.parametrize("where", ["{folder}/RockProfile.fmu", "{uri}", "parts/R%6FckProfile.fmu"])
def test_trust_allows_fmus_elsewhere(where, entries, fmus, tmp_path):
    (tmp_path / "parts").mkdir()
    shutil.copy(fmus["rock"], tmp_path / "parts")
    path = tmp_path / "System.ssp"
    source = where.format(folder=fmus["rock"].parent, uri=fmus["rock"].as_uri())
    path.write_bytes(pack(with_source(source)(entries, tmp_path)))
    with pytest.raises(CouplingError, match="--trust"):
        Coupling(path)
    run = Coupling(path, trust=True).run(2e-3, 1e-3)
    assert (run.steps, run.error) == (2, "")


def test_trust_allows_any_size(entries, tmp_path, monkeypatch):
    path = tmp_path / "System.ssp"
    path.write_bytes(pack(entries))
    monkeypatch.setattr(limits, "MOST_BYTES", 1_000_000)
    with pytest.raises(CouplingError, match="unpacks to more than 1000000 bytes"):
        Coupling(path)
    Coupling(path, trust=True).free()


def test_the_bench_takes_trust_too(feed_control, brief, monkeypatch):
    monkeypatch.setattr(limits, "MOST_BYTES", 1_000_000)
    with pytest.raises(CouplingError, match="unpacks to more than 1000000 bytes"):
        bench(feed_control, trials=["collaring"])
    (score,) = bench(feed_control, trials=["collaring"], trust=True)
    assert score.run.error == ""


def test_what_is_refused_leaves_nothing_unpacked(feed_control, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    with pytest.raises(CouplingError, match="must be above 0 s"):
        Coupling(feed_control).run(0.01, 0.0)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "file").touch()
    words = ["percussion", "couple", str(feed_control), "--out", str(tmp_path / "mine")]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert [one.name for one in tmp_path.iterdir()] == ["mine"]


def test_fmus_run_whatever_the_folder_for_temporary_files_is_called(feed_control, tmp_path):
    """In a process of its own: where it goes wrong, pythonfmu crashes."""
    folder = tmp_path / "Bücher" / "a#b" / "a b"
    folder.mkdir(parents=True)
    shutil.copy(feed_control, folder / "System.ssp")
    words = ["couple", "System.ssp", "--duration", "0.01", "--no-figures"]
    done = subprocess.run(
        [sys.executable, "-m", "percussion_model.interface.cli", *words],
        cwd=folder, env=os.environ | {"TMPDIR": str(folder)}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (folder / "out" / "System" / "signals.csv").is_file()


def test_hostile_archives_and_scenes_end_well(feed_control):
    found = campaign(COUNT, 1, feed_control)
    assert [one for one in found if "fault" in one] == []
    assert max(one["memory"] for one in found) < MOST_MEMORY
    assert {one["outcome"].partition(":")[0] for one in found} >= {"refused", "runs"}
