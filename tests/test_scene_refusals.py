"""Every way to get a scene wrong, and what is said of it."""

import pytest

from percussion_model.scene.scene import Scene, SceneError

# ------------------------------------------------------------------- bad input

BAD = {
    "syntax": ("[rock\nunloading_ratio = 5", ("not valid TOML", "line 1")),
    "syntax on a later line": ('title = "x"\n[rock]\na = = 5', ("not valid TOML", "line 3")),
    "a result": ('{"scene": {}}', ("JSON", "must be a scene in TOML")),
    "unknown key": (
        "[rock]\nunloading_rato = 5",
        ("rock.unloading_rato", "did you mean rock.unloading_ratio?"),
    ),
    "key of another table": (
        "[drive]\nunloading_ratio = 5",
        ("drive.unloading_ratio", "did you mean rock.unloading_ratio?"),
    ),
    "rock of the library": ('[rock]\nname = "kuru-granite"', ("rock.name: --rock NAME takes",)),
    "shortened key": ("[rock]\nloading = 5", ("did you mean rock.loading_stiffness?",)),
    "unknown key like no other": ("[rock]\nxyzzy = 5", ("rock.xyzzy", "loading_stiffness")),
    "unknown table": ("[rok]\na = 1", ("rok", "did you mean rock?")),
    "unknown key in a section": (
        "[[bit.sections]]\nlenth = 1.0\nlength = 1.0\narea = 1e-3",
        ("bit.sections.0.lenth", "did you mean bit.sections.0.length?"),
    ),
    "text for a number": ('[feed]\nforce = "ten kN"', ('feed.force = "ten kN"', "a number", " N")),
    "flag for a number": ("[feed]\nforce = true", ("feed.force = true", "a number")),
    "number for a flag": ("[effects]\nfeed = 1", ("effects.feed = 1", "true or false")),
    "number for a table": ("rock = 5", ("rock = 5", "[rock]")),
    "number for a title": ("title = 5", ("title = 5", "text")),
    "control character in a title": (
        'title = "a\\u0001b"',
        ("title: has the control character", "'\\x01'", "printable"),
    ),
    "line in a title": ('title = "a\\nb"', ("title: has the control character", "'\\n'")),
    "title that XML cannot hold": ('title = "a\\uffff"', ("title: has the control character",)),
    "endless title": (f'title = "{"t" * 1001}"', ("title = ", "up to 1000 characters")),
    "too many sections": (
        "[[bit.sections]]\nlength = 1e-3\narea = 1e-3\n" * 1001,
        ("bit.sections: 1001 sections: must be at most 1000",),
    ),
    "key of many parts": ("a." * 10 + "a = 1", ("a key has more than 10 parts",)),
    "quoted key of many parts": ("'a' . " * 50_000 + "a = 1", ("a key has more than 10 parts",)),
    "table of many parts": ("[" + "a." * 10 + "a]", ("a key has more than 10 parts",)),
    "file of zeros": ("\0" * 1_000_001, ("is larger than 1000000 bytes",)),
    "fraction for a whole number": ("[solver]\ncells = 2.5", ("cells = 2.5", "a whole number")),
    "unknown word": ('[effects]\nrock = "soft"', ('effects.rock = "soft"', '"bilinear", "spring"')),
    "negative length": (
        "[[bit.sections]]\nlength = -0.2\narea = 1e-3",
        ("bit.sections.0.length = -0.2 m:", "above 0", " m"),
    ),
    "zero area": (
        "[[piston.sections]]\nlength = 0.2\narea = 0",
        ("piston.sections.0.area = 0 m^2:", "above 0"),
    ),
    "missing area": ("[[bit.sections]]\nlength = 0.2", ("bit.sections.0.area is missing", "m^2")),
    "no sections": ("[bit]\nsections = []", ("bit.sections = []", "at least one section")),
    "sections of the wrong type": ("[bit]\nsections = [5]", ("bit.sections.0 = 5", "a table")),
    "gamma of one": (
        "[rock]\nunloading_ratio = 1.0",
        ("rock.unloading_ratio = 1.0:", "above 1"),
    ),
    "not a number": ("[rock]\nunloading_ratio = nan", ("rock.unloading_ratio = nan", "a number")),
    "infinite": ("[feed]\nforce = inf", ("feed.force = inf", "a number from")),
    "negative gap": ("[start]\ngap = -1e-5", ("start.gap = -1e-05 m:", "from 0")),
    "duration zero": ("[run]\nduration = 0", ("run.duration = 0 s:", "above 0")),
    "settling for ever": (
        "[run]\nduration = 2.0\nsettle = 2.0",
        ("run.settle = 2.0 s", "run.duration = 2.0 s"),
    ),
    "drive without piston": (
        '[piston]\nmodel = "absent"',
        ("effects.drive", "piston.model", 'set effects.drive = "none"'),
    ),
    "rigid bit under an elastic piston": (
        '[bit]\nmodel = "rigid"',
        ("piston.model", "bit.model", "set "),
    ),
    "absent bit": ('[bit]\nmodel = "absent"', ('bit.model = "absent"', '"elastic", "rigid"')),
    "waves in rigid bars": (
        '[piston]\nmodel = "rigid"\n[bit]\nmodel = "rigid"\n[solver]\nname = "wave"',
        ('solver.name = "wave"', "bit.model"),
    ),
    "rigid solver for elastic bars": (
        '[solver]\nname = "rigid"',
        ('solver.name = "rigid"', "elastic"),
    ),
    "barrier without the bilinear law": (
        '[effects]\nrock = "spring"\nbarrier = true',
        ("effects.barrier", 'not "spring"', "set effects.barrier = false"),
    ),
}


@pytest.mark.parametrize(("text", "words"), BAD.values(), ids=BAD)
def test_bad_scenes_get_one_clear_error(scene_from_text, text, words):
    with pytest.raises(SceneError) as caught:
        scene_from_text(text)
    message = str(caught.value)
    assert "scene.toml: " in message
    assert len(message.splitlines()) == 1
    for word in words:
        assert word in message


def test_a_device_without_end_is_no_scene():
    with pytest.raises(SceneError, match="is larger than 1000000 bytes"):
        Scene.from_toml("/dev/zero")


def test_points_between_numbers_and_words_are_no_key(scene_from_text):
    numbers = ", ".join("0.1" for _ in range(20))
    title = "on feed, i.e. 0.1 to 0.9 kN; see a.b.c.d and fig. 3.1.2"
    assert scene_from_text(f'# {numbers}\ntitle = "{title}"').title == title


def test_every_fault_has_its_line(scene_from_text):
    with pytest.raises(SceneError) as caught:
        scene_from_text("[[bit.sections]]\nlength = -1.0\narea = 0.0\n[feed]\nforce = nan")
    assert len(str(caught.value).splitlines()) == 3


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(SceneError, match="there is no such scene file"):
        Scene.from_toml(tmp_path / "missing.toml")
    with pytest.raises(SceneError, match="is a folder"):
        Scene.from_toml(tmp_path)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="UTF-8"):
        Scene.from_toml(tmp_path / "binary.toml")


def test_a_file_that_cannot_be_written_leaves_nothing(tmp_path):
    target = tmp_path / "scene.toml"
    target.mkdir()
    with pytest.raises(SceneError, match="cannot be written"):
        Scene().to_toml(target)
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]
    (tmp_path / "file").write_text("")
    with pytest.raises(SceneError, match="cannot be written"):
        Scene().to_toml(tmp_path / "file" / "scene.toml")


def test_a_key_with_an_underline_for_its_point_is_understood():
    with pytest.raises(SceneError, match=r"feed_force: did you mean feed\.force\?"):
        Scene().replace(feed_force=3.0)


@pytest.mark.parametrize(
    ("section", "lines"),
    [
        ({"lenght": 0.1, "area": 5e-3}, ["unknown key piston.sections.0.lenght: did you mean "
                                         "piston.sections.0.length?"]),
        ({"lenght": 0.1}, ["piston.sections.0.area is missing", "unknown key"]),
        ({"xyzzy": 0.1, "area": 5e-3}, ["piston.sections.0.length is missing", "unknown key"]),
        ({1: 2, "length": 0.1, "area": 5e-3}, ["unknown key piston.sections.0.1"]),
    ],
)  # fmt: skip
def test_a_misspelt_key_of_a_list_is_not_missing_as_well(section, lines):
    with pytest.raises(SceneError) as caught:
        Scene(piston={"sections": [section]})
    told = str(caught.value).splitlines()
    assert len(told) == len(lines)
    for line, begin in zip(told, lines, strict=True):
        assert line.startswith(begin)


def test_a_folder_that_is_missing_is_not_made(tmp_path):
    with pytest.raises(SceneError, match="cannot be written: there is no folder"):
        Scene().to_toml(tmp_path / "missing" / "scene.toml")
    assert list(tmp_path.iterdir()) == []


def test_bad_arguments_get_the_same_errors():
    with pytest.raises(SceneError, match=r"rock\.unloading_ratio = 0\.5: must be a number above 1"):
        Scene(rock={"unloading_ratio": 0.5})
    with pytest.raises(SceneError, match=r"unknown key rocks: did you mean rock\?"):
        Scene(rocks={})
