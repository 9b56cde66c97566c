"""Hostile archives and scenes, drawn by seed: `python -m tests.properties.hostile`.

Other processes run them, in a folder that is watched, and this one watches the process: crashes
and hangs are faults, as are tracebacks, files left behind and endless messages.
What an FMU's own code does is not tried: that runs with the rights of whoever runs it.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import random
import re
import resource
import select
import stat
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

# Cases of a process: libraries of FMUs stay loaded, some hundred kB each.
CASES = 100
# A case takes some ten milliseconds; a hang is far beyond that, on however busy a machine [s].
PATIENCE, PATIENCE_AT_START = 100.0, 900.0
LONGEST_MESSAGE = 5000
# Cells that are worth a few steps, and the number from which a ceiling must refuse them.
FEW_CELLS, REFUSED_CELLS = 100, 1e6
ROOT = Path(__file__).parents[2]
SCENES = ("reference", "rigid", "top_hammer", "drop_test")
NUMBERS = ("5e-324", "-0.0", "1e308", "-1", "nan", "inf", "1e-12", "99999999999999999999", "1e6",
           "0", "1", "true", '"x"', "[]", "{}", "1000", "100000")  # fmt: skip


# --------------------------------------------------------------------- scenes


def damaged(chance: random.Random, content: bytes) -> bytes:
    """Bytes with some of them changed, lost, repeated or cut off."""
    found = bytearray(content)
    for _ in range(chance.randint(1, 4)):
        place = chance.randrange(max(len(found), 1))
        what = chance.randrange(4)
        if what == 0 and found:
            found[place] = chance.randrange(256)
        elif what == 1:
            del found[place : place + chance.randint(1, 60)]
        elif what == 2:
            found[place:place] = found[place : place + chance.randint(1, 200)] * chance.randint(
                1, 9
            )
        else:
            found = found[: place + 1]
    return bytes(found)


def other_numbers(chance: random.Random, content: bytes) -> bytes:
    """A scene some of whose values are others."""
    text = content.decode("utf-8")
    places = [one.span(1) for one in re.finditer(r"^\w+ *= *([^\n#]+)", text, re.M)]
    for start, end in sorted(chance.sample(places, min(len(places), 3)), reverse=True):
        text = text[:start] + chance.choice(NUMBERS) + text[end:]
    return text.encode("utf-8")


def _large_scene(chance: random.Random) -> bytes:
    """A scene that asks for much in few bytes, or is large itself."""
    count = chance.choice([100, 1_000, 20_000, 200_000])
    section = b"[[bit.sections]]\nlength = %s\narea = 1e-3\n"
    return chance.choice([
        b"a." * count + b"a = 1",
        b"[" + b"a." * count + b"a]",
        b"a = " + b"[" * count,
        b"rock = " + b"{a = " * count + b"1" + b"}" * count,
        section % b"1e-3" * count,
        section % chance.choice([b"1000", b"1e-300", b"1e-9"]),
        b"[solver]\ncells = %d\n" % count,
        b'[solver]\nname = "fem"\n[fem]\nelements = %d\n' % count,
        b"[solver]\naccuracy = 1e-4\n" + section % b"1000",
        b'[solver]\nfidelity = "blow-map"\n[blow_map]\ndensity = 10\nforce_to = 1e13\n',  # retired
        b'title = "%s"' % (b"t" * count),
        b'title = "a%sb"' % chance.choice([b"\\u0000", b"\\u001b[31m", b"\\uffff", b"\\n"]),
        b'"%s" = 1' % (b"k" * count),
        b"".join(b"k%d = 1\n" % k for k in range(count)),
        bytes(5 * count),
        b"a = " + b"9" * count,
        "title = 'x'".encode("utf-16"),
        b'[piston]\nmodel = "rigid"\n[bit]\nmodel = "rigid"\n[drive]\nreversal_distance = 5e-324\n',
    ])  # fmt: skip


def draw_scene(chance: random.Random) -> bytes:
    """Bytes of a scene file."""
    content = (ROOT / "scenarios" / f"{chance.choice(SCENES)}.toml").read_bytes()
    return chance.choice([
        lambda: damaged(chance, content),
        lambda: other_numbers(chance, content),
        lambda: _large_scene(chance),
    ])()  # fmt: skip


def check_scene(path: Path) -> str:
    """Read a scene and run it for a little while; what became of it."""
    from percussion_model import Scene, Simulation

    scene = Scene.from_toml(path)
    bars = [bar for bar in (scene.piston, scene.bit) if bar.model == "elastic"]
    if bars:
        first = bars[0].transit_time
        wanted = scene.solver.cells or (scene.fem.elements if scene.solver_name == "fem" else 40)
        cells = wanted * sum(bar.transit_time for bar in bars) / first
        if scene.solver.accuracy is not None or FEW_CELLS < cells < REFUSED_CELLS:
            return "read, dear"
    simulation = Simulation(scene)
    simulation.advance(5.0 * (simulation.solver.time_step or 1e-6))
    simulation.observe()
    return "runs"


# ------------------------------------------------------------------- archives


def pack(entries: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """An archive of these entries."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return out.getvalue()


def unpacked(content: bytes) -> dict[str, bytes]:
    """Entries of an archive."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def damaged_xml(chance: random.Random, content: bytes, outside: str) -> bytes:
    """XML with other attributes, other structure, or what makes a parser grow."""
    values = [one.span(1) for one in re.finditer(rb'\w="([^"]*)"', content)]
    start, end = chance.choice(values)
    word = chance.choice([
        f"{outside}/evil", f"../../../../../..{outside}/evil", "/dev/zero", "resources", "", ".",
        "../evil", "file:///etc/passwd", "nan", "-1", "1e999", "x" * 100_000, "&#10;", "a/b", "%00",
        "resources/RockProfile.fmu", "99999999999999999999", "true",
    ])  # fmt: skip
    laughs = b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">%s]>' % b"".join(
        b'<!ENTITY %c "%s">' % (98 + k, b"&%c;" % (97 + k) * 10) for k in range(9)
    )
    first = content.index(b"?>") + 2
    body = content.index(b">", first) + 1
    count = chance.choice([100, 20_000, 200_000])
    return chance.choice([
        lambda: content[:start] + word.encode() + content[end:],
        lambda: content[:start] + word.encode() + content[end:],
        lambda: damaged(chance, content),
        lambda: content[:first] + laughs + content[first:].replace(b'name="', b'name="&i;', 1),
        lambda: content[:first] + b'<!DOCTYPE x SYSTEM "file:///dev/zero">' + content[first:],
        lambda: content[:body] + b"<a>" * count + content[body:],
        lambda: content[:body] + b"<a/>" * count + content[body:],
        lambda: content[:body] + b" " * (50 * count) + content[body:],
        lambda: content.decode().encode("utf-16"),
        lambda: b"",
    ])()  # fmt: skip


def damaged_fmu(chance: random.Random, content: bytes, outside: str) -> bytes:
    """An FMU with another description, another library, or entries that do harm."""
    entries = unpacked(content)
    xml = "modelDescription.xml"
    library = next(name for name in entries if name.startswith("binaries/linux64"))
    what = chance.randrange(8)
    if what < 3:
        entries[xml] = damaged_xml(chance, entries[xml], outside)
    elif what == 3:
        identifier = chance.choice(["..", f"../../..{outside}/evil", "a b", "", "RigFeed", "ü"])
        entries[xml] = re.sub(
            rb'modelIdentifier="[^"]*"', f'modelIdentifier="{identifier}"'.encode(), entries[xml]
        )
    elif what == 4:
        del entries[chance.choice([library, xml])]
    elif what == 5:
        entries[library] = chance.choice([b"", b"nonsense" * 1000, entries[library][:100_000]])
    else:
        return harmful_entries(chance, entries, outside)
    return pack(entries)


def harmful_entries(chance: random.Random, entries: dict[str, bytes], outside: str) -> bytes:
    """An archive with entries that want to be elsewhere, or to be large."""
    what = chance.randrange(8)
    names = ["../evil", "a/../../evil", f"{outside}/evil", "C:\\evil", "a\\..\\evil", "x" * 300,
             "a\x1bb", "resources", "SystemStructure.ssd/x", "CON:", "a//b/./c"]  # fmt: skip
    if what < 3:
        return pack(entries | {chance.choice(names): b"evil"})
    if what == 3:
        return pack(entries | {"bomb": bytes(chance.choice([10**7, 10**8]))})
    if what == 4:
        return pack(entries | {f"many/{k}": b"" for k in range(20_000)})
    if what == 5:
        method = chance.choice([zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
        return pack(entries | {"x": bytes(10**6)}, method)
    out = io.BytesIO(pack(entries))
    with zipfile.ZipFile(out, "a") as archive:
        one = zipfile.ZipInfo("link" if what == 6 else "evil/")
        one.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(one, f"{outside}/evil")
        if what == 7:
            archive.writestr("evil/x", b"evil")
    return out.getvalue()


def draw_archive(chance: random.Random, base: dict[str, bytes], outside: str) -> bytes:
    """Bytes of an archive of a system."""
    entries = dict(base)
    what = chance.randrange(10)
    if what < 4:
        name = "SystemStructure.ssd"
        entries[name] = damaged_xml(chance, entries[name], outside)
    elif what == 4:
        name = chance.choice([name for name in entries if name.endswith(".ssv")])
        entries[name] = damaged_xml(chance, entries[name], outside)
    elif what < 8:
        name = chance.choice([name for name in entries if name.endswith(".fmu")])
        entries[name] = damaged_fmu(chance, entries[name], outside)
    elif what == 8:
        return harmful_entries(chance, entries, outside)
    else:
        return damaged(chance, pack(entries))
    return pack(entries)


def check_archive(path: Path) -> str:
    """Set a system up and run it for three steps; what became of it."""
    from percussion_model.coupling import Coupling

    run = Coupling(path, compiled=False).run(3e-3, 1e-3)
    return f"stops: {run.error}" if run.error else "runs"


# ----------------------------------------------------------------- the worker


def run_case(index: int, seed: int, base: dict[str, bytes], watched: Path) -> dict[str, str]:
    """Draw and try one case; what went wrong stands under `fault`."""
    chance = random.Random(f"{seed}/{index}")
    outside = str(watched / "outside")
    is_scene = index % 2 == 0
    path = watched / "work" / ("scene.toml" if is_scene else "system.ssp")
    path.write_bytes(draw_scene(chance) if is_scene else draw_archive(chance, base, outside))
    before = set(watched.rglob("*"))
    told: dict[str, str] = {}
    try:
        told["outcome"] = check_scene(path) if is_scene else check_archive(path)
    except Exception as error:
        told["outcome"] = f"refused: {error}"
        if not type(error).__module__.startswith("percussion_model."):
            told["fault"] = f"{type(error).__name__}: {error}"
        elif len(str(error)) > LONGEST_MESSAGE or not str(error).strip():
            told["fault"] = f"a message of {len(str(error))} characters"
    if left := set(watched.rglob("*")) - before:
        told["fault"] = f"left behind: {sorted(map(str, left))[:3]}"
    if Path.cwd() != watched / "work":
        told["fault"] = "another working folder"
        os.chdir(watched / "work")
    return {name: text[:300] for name, text in told.items()}


def warm_up(system: Path) -> None:
    """Compile the kernels in a process of its own: that takes more memory than any case."""
    from percussion_model import Scene, Simulation

    check_archive(system)
    for solver in ("wave", "fem", "rigid"):
        simulation = Simulation(Scene().computed_by(solver))
        simulation.advance(1e-5)
        simulation.observe()


def peak_memory() -> int:
    """Greatest resident size of this process [B]; `ru_maxrss` may be that of its parent."""
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def work(seed: int, first: int, last: int, system: Path, watched: Path) -> None:
    """Run the cases one after the other, with a line of JSON for each."""
    base = unpacked(system.read_bytes())
    if first == last:
        warm_up(system)
    for index in range(first, last):
        used = time.process_time()
        told = run_case(index, seed, base, watched)
        numbers = {"index": index, "time": time.process_time() - used, "memory": peak_memory()}
        print(json.dumps(told | numbers), flush=True)


def campaign(count: int, seed: int, system: Path) -> list[dict]:
    """Run cases in processes of their own; a crash or a hang is a fault and ends its case alone.

    Parameters
    ----------
    system : Path
        Archive that others are made of.
    """
    found: list[dict] = []
    with tempfile.TemporaryDirectory(prefix="hostile-") as folder:
        watched = Path(folder).resolve()
        for name in ("work", "tmp", "outside"):
            (watched / name).mkdir()
        environment = os.environ | {"TMPDIR": str(watched / "tmp"), "PYTHONPATH": str(ROOT)}
        last = 0  # the first process only compiles
        while len(found) < count:
            words = [str(seed), str(len(found)), str(last), str(system), str(watched)]
            process = subprocess.Popen(
                [sys.executable, "-m", __name__.replace("__main__", "tests.properties.hostile"),
                 "--work", *words],
                cwd=watched / "work", env=environment, stdout=subprocess.PIPE, text=True,
            )  # fmt: skip
            fault = _listen(process, found)
            last = min(count, len(found) + CASES + bool(fault))
            if fault:
                found.append({"index": len(found), "fault": fault, "time": 0.0, "memory": 0})
    return found


def _listen(process: subprocess.Popen, found: list[dict]) -> str:
    """Take what the worker tells; why it ended before its time, empty if it did not."""
    assert process.stdout is not None
    patience = PATIENCE_AT_START  # kernels may have to be compiled
    while select.select([process.stdout], [], [], patience)[0]:
        line = process.stdout.readline()
        if not line:
            code = process.wait()
            return f"crash: the process ended with {code}" if code else ""
        found.append(json.loads(line))
        patience = PATIENCE
    process.kill()
    process.wait()
    return f"hang: more than {patience:.0f} s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--system", type=Path, default=ROOT / "dist" / "FeedControlRigid.ssp")
    parser.add_argument("--work", nargs=5, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.work:
        seed, first, last, system, watched = options.work
        work(int(seed), int(first), int(last), Path(system), Path(watched))
        return
    found = campaign(options.count, options.seed, options.system.resolve())
    kinds: dict[str, int] = {}
    for one in found:
        kind = "fault" if "fault" in one else one["outcome"].partition(":")[0]
        kinds[kind] = kinds.get(kind, 0) + 1
        if "fault" in one:
            print(one)
    print(kinds, f"longest {max(one['time'] for one in found):.2f} s of one processor,",
          f"peak memory {max(one['memory'] for one in found) / 1e6:.0f} MB")  # fmt: skip


if __name__ == "__main__":
    main()
