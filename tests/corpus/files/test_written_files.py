"""Damaged results and studies, and targets that are no regular file: the corpus of files."""

from __future__ import annotations

import errno
import os
import re
import shutil
import threading
import tomllib
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from fmu_src.archive import write_archive
from percussion_model import Result, Scene, simulate
from percussion_model.analysis.study import grid, study
from percussion_model.interface.plotting.style import save_png
from percussion_model.scene.text import write_text
from percussion_model.scene.writing import write_whole
from percussion_model.simulation.files import ResultError, staged, staged_file
from tests.commands import percussion

CASES = tomllib.loads(Path(__file__).with_name("cases.toml").read_text(encoding="utf-8"))
RIGID = Scene().computed_by("rigid", **{"run.duration": 0.3, "run.settle": 0.1})
SCENE = str(Path(__file__).parents[3] / "scenarios" / "rigid.toml")
FORCES = {"feed.force": [1500.0, 2500.0, 4000.0]}

needs_devices = pytest.mark.skipif(os.name == "nt", reason="no devices and pipes as on POSIX")


def named(kind):
    return [pytest.param(case, id=case["id"]) for case in CASES[kind]]


def damage(path, case):
    """Damage a file as a case says."""
    content = path.read_bytes()
    if case.get("gone"):
        path.unlink()
    elif "text" in case:
        path.write_text(case["text"], encoding="utf-8")
    elif "lines" in case:
        path.write_bytes(b"".join(content.splitlines(keepends=True)[: case["lines"]]))
    elif "old" in case:
        assert case["old"].encode() in content
        path.write_bytes(content.replace(case["old"].encode(), case["new"].encode(), 1))
    else:
        path.write_bytes(content[: case["cut"]])


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """A result of rigid bodies in a folder."""
    folder = tmp_path_factory.mktemp("result")
    simulate(RIGID, trace=1e-2).save(folder)
    return folder


@pytest.mark.parametrize("case", named("result"))
def test_a_damaged_result_is_one_error_that_names_the_file(case, result, tmp_path):
    folder = tmp_path / "result"
    shutil.copytree(result, folder)
    assert len(Result.load(folder).blows) > 2
    damage(folder / case["file"], case)
    with pytest.raises(ValueError, match=case["right"]) as caught:
        Result.load(folder)
    assert "\n" not in str(caught.value)
    assert str(folder) in str(caught.value)


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    """A study of three points, a part each."""
    folder = tmp_path_factory.mktemp("study") / "out"
    return folder, study(RIGID, grid(FORCES), folder, processes=1)


@pytest.mark.parametrize("case", named("study"))
def test_a_damaged_study_keeps_its_points(case, studied, tmp_path):
    source, whole = studied
    folder = tmp_path / "out"
    shutil.copytree(source, folder)
    plan, parts = folder / "study.json", sorted((folder / "parts").iterdir())
    if case.get("plan", 1000) < 0:
        plan.unlink()
    elif "plan" in case:
        plan.write_bytes(plan.read_bytes()[: case["plan"]])
    for number, left in case["parts"]:
        parts[number].write_bytes(parts[number].read_bytes()[:left])
    times = [path.stat().st_mtime_ns for path in parts]
    if "right" in case:
        with pytest.raises(ResultError, match=case["right"]) as caught:
            study(RIGID, grid(FORCES), folder, processes=1)
        assert "--force" not in str(caught.value)
    else:
        again = study(RIGID, grid(FORCES), folder, processes=1)
        assert again.rows.tobytes() == whole.rows.tobytes()
        assert plan.read_bytes() == (source / "study.json").read_bytes()
    assert [path.stat().st_mtime_ns for path in parts] == times  # nothing ran again, or was lost


def test_rows_of_another_kind_are_no_part(studied, tmp_path):
    source, _ = studied
    shutil.copytree(source, tmp_path / "out")
    part = min((tmp_path / "out" / "parts").iterdir())
    arrays = dict(np.load(part))
    for name, wrong, why in (
        ("part", np.array([7]), "names points that are not among the 3"),
        ("part", np.array([-1]), "names points that are not among the 3"),
        ("rows", np.zeros(1), "its rows are not those of its points"),
        ("failures", np.array('["", ""]'), "its failures are not those of its points"),
        ("failures", np.array("5"), "its failures are not those of its points"),
    ):
        np.savez(part, **(arrays | {name: wrong}))
        with pytest.raises(ResultError, match=re.escape(f"{part.name}: cannot be read ({why})")):
            study(RIGID, grid(FORCES), tmp_path / "out", processes=1)


def test_a_study_on_a_full_disk_says_what_is_kept(tmp_path, monkeypatch):
    def full(path, content):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr("percussion_model.simulation.files.write_whole", full)
        with pytest.raises(ResultError, match=r"No space left.*are kept, the same command"):
            study(RIGID, grid(FORCES), tmp_path / "out", processes=1)
    assert len(study(RIGID, grid(FORCES), tmp_path / "out", processes=1).rows) == 3


# ------------------------------------------------------------------------ targets


def picture(path):
    save_png(Figure(figsize=(1.0, 1.0)), path, dpi=20)


WRITERS = {
    "scene": lambda path: write_text(path, "title = 1\n"),
    "text": lambda path: staged_file(path, "text\n"),
    "archive": lambda path: write_archive(path, {"a": b"b"}),
    "picture": picture,
}


@needs_devices
@pytest.mark.parametrize("name", WRITERS)
def test_what_is_no_regular_file_is_written_through(name, tmp_path):
    """The bug: `--json /dev/null` made it a regular file, as root; FIFOs and links likewise."""
    write = WRITERS[name]
    write(tmp_path / "plain")
    right = (tmp_path / "plain").read_bytes()
    assert right
    # a link stays, there or not what it leads to
    for target in ("there", "not_there"):
        (tmp_path / "there").write_text("old")
        link = tmp_path / f"link_to_{target}"
        link.symlink_to(target)
        write(link)
        assert link.is_symlink()
        assert (tmp_path / target).read_bytes() == right
    # a pipe gets it
    fifo, got = tmp_path / "fifo", []
    os.mkfifo(fifo)
    reader = threading.Thread(target=lambda: got.append(fifo.read_bytes()))
    reader.start()
    write(fifo)
    reader.join(20.0)
    assert got == [right]
    assert fifo.is_fifo()
    # an open file, as a shell gives for >(command)
    end, begin = os.pipe()
    write(Path(f"/dev/fd/{begin}"))
    os.close(begin)
    with open(end, "rb") as file:
        assert file.read() == right
    write(Path(os.devnull))
    assert Path(os.devnull).is_char_device()
    names = {"plain", "there", "not_there", "link_to_there", "link_to_not_there", "fifo"}
    assert set(os.listdir(tmp_path)) == names


@needs_devices
def test_what_a_device_refuses_is_said(tmp_path):
    if not Path("/dev/full").is_char_device():
        pytest.skip("no /dev/full")
    with pytest.raises(ResultError, match="/dev/full: cannot be written: No space left"):
        staged_file(Path("/dev/full"), "text")
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(ResultError, match="cannot be written: Too many levels"):
        staged_file(tmp_path / "a", "text")
    assert (tmp_path / "a").is_symlink()


@needs_devices
def test_links_in_a_result_folder_stay(result, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "summary.json").symlink_to(tmp_path / "summary.json")
    (tmp_path / "link").symlink_to("out")
    Result.load(result).save(tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "out" / "summary.json").is_symlink()
    assert len(Result.load(tmp_path / "out").blows) > 2


@needs_devices
def test_json_goes_to_a_pipe_and_a_link(tmp_path):
    (tmp_path / "link").symlink_to("there.json")
    end, begin = os.pipe()
    words = ["run", SCENE, "--duration", "0.05", "--no-error-estimate", "--json"]
    assert percussion(*words, f"/dev/fd/{begin}") == 0
    os.close(begin)
    with open(end, "rb") as file:
        assert b'"solver": "rigid"' in file.read()
    assert percussion(*words, tmp_path / "link") == 0
    assert (tmp_path / "link").is_symlink()
    assert sorted(os.listdir(tmp_path)) == ["link", "there.json"]


@pytest.mark.parametrize(
    "words",
    [
        ["run", SCENE, "--json"],
        ["settled", SCENE, "--json"],
        ["calibrate", SCENE, "--measured", "penetration=1+-0.1 mm @5", "--out"],
        ["calibrate", SCENE, "--measured", "penetration=1+-0.1 mm @5", "--figure"],
        ["new"],
        ["fmu", SCENE, "-o"],
    ],
    ids=lambda words: f"{words[0]} {words[-1]}",
)
def test_a_folder_that_was_not_asked_for_is_not_made(words, tmp_path, capsys):
    missing = tmp_path / "no" / "such"
    assert percussion(*words, missing / "file.fmu") == 2
    said = capsys.readouterr().err.strip()
    assert f"cannot be written: there is no folder {missing}" in said
    assert "\n" not in said
    assert os.listdir(tmp_path) == []


def test_no_writer_makes_a_folder(tmp_path):
    for write in (WRITERS["scene"], WRITERS["text"]):
        with pytest.raises(ValueError, match="there is no folder"):
            write(tmp_path / "no" / "file")
    assert os.listdir(tmp_path) == []


def test_what_was_computed_goes_elsewhere_where_it_cannot_be_written(tmp_path, monkeypatch, capsys):
    """A disk that is full by the end of the run."""
    save = Result.save

    def full(result, folder):
        if Path(folder).name == "wanted":
            raise ResultError(f"{folder}: cannot be written: {os.strerror(errno.ENOSPC)}")
        return save(result, folder)

    monkeypatch.setattr(Result, "save", full)
    monkeypatch.chdir(tmp_path)
    words = ["run", SCENE, "--duration", "0.2", "--no-error-estimate", "--no-figures"]
    assert percussion(*words, "--out", "wanted") == 1
    (kept,) = os.listdir(tmp_path)
    assert kept.startswith("wanted-kept-")
    assert len(Result.load(tmp_path / kept).blows) > 2
    out, err = capsys.readouterr()
    assert f"what was computed is kept in {tmp_path / kept}" in " ".join(err.split())
    assert "Rate of penetration" in out
    assert percussion(*words, "--out", "there") == 0  # said once, not of the next command


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")
def test_numbers_go_elsewhere_where_they_cannot_be_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["run", SCENE, "--duration", "0.05", "--no-error-estimate"]
    assert percussion(*words, "--json", "/dev/full") == 1
    (kept,) = os.listdir(tmp_path)
    assert '"solver": "rigid"' in (tmp_path / kept).read_text()


def test_no_half_of_a_file_is_seen_and_no_draft_stays(tmp_path):
    """Four writers of one file, and of one folder, at once."""
    path, folder = tmp_path / "file", tmp_path / "folder"
    contents = [bytes([65 + k]) * 200_000 for k in range(4)]
    path.write_bytes(contents[0])

    def write(k):
        for _ in range(10):
            write_whole(path, contents[k])
            with staged(folder) as draft:
                (draft / "a").write_bytes(contents[k])

    writers = [threading.Thread(target=write, args=(k,)) for k in range(4)]
    for one in writers:
        one.start()
    while any(one.is_alive() for one in writers):
        assert path.read_bytes() in contents
    assert (folder / "a").read_bytes() in contents
    assert sorted(os.listdir(tmp_path)) == ["file", "folder"]
    assert os.listdir(folder) == ["a"]
