"""Damaged saved states of all FMUs: `python -m tests.fmu.damaged_states --count 20000`.

Each FMU runs in a process of its own, and this one watches: neither a crash of the
interpreter nor a hang goes unseen. A state is refused with a message, and then the instance
goes on as one that was never asked, or it is taken; in either case a good state restores.
What has a wrong hash is always refused. What somebody has given a right hash is refused where
it could harm, and may be nonsense where not.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import multiprocessing
import random
import struct
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from fmpy import extract
from fmpy.fmi1 import FMICallException

from fmu_src.hammer.build import build_hammer
from fmu_src.parts.build import PARTS, build_part
from fmu_src.slave.states import HEADER, PLACE, START
from percussion_model import Scene
from scenarios.harness import Instance

STEP = 1.9e-3
STEPS = 3  # after a state that was taken
# A case takes milliseconds; a hang is far beyond that, on however busy a machine [s].
PATIENCE = 120.0
# The first one may have to compile kernels [s].
PATIENCE_AT_START = 900.0

FLOATS = (
    *(math.nan, math.inf, -math.inf, 1e300, -1e300, 1e59, -1e59, 1e20, -1e20, 1e9, -1e9),
    *(1.0, -1.0, 0.0, -0.0, 5e-324, 2.0**53, 1e-30),
)
WHOLE = (0, 1, -1, 2, -2, 3, 4, 5, 7, 63, 64, 65, 255, 1000, 2**31 - 1, 2**31, 2**53, -(2**53),
         2**63 - 1, -(2**63))  # fmt: skip
LITERALS = ("NaN", "Infinity", "-1", "0", "1e59", "-1e59", "1e300", "1e999", "true", "null", "[]",
            "{}", '"x"', "[[1]]", "1e-300", "100000000000000000000", "3", "[1.0]")  # fmt: skip

# FMUs by name: parameters that an instance starts with.
KINDS: dict[str, dict[str, Any]] = {
    "PercussiveHammer": {},
    "RigidHammer": {},
    "FemHammer": {},
    "NumbaHammer": {},
    "NumbaRigidHammer": {},
    **{name: {} for name in PARTS},
    "WaveString": {"communication_step": STEP, "start.rods": 12},  # takes no other
    "DrillString/lumped": {"model": 2, "rod.automatic": True},
    "Supply/air": {"medium": "air"},
}


def build(names: Sequence[str], folder: Path) -> dict[str, str]:
    """Build FMUs; folders of the unpacked ones by name."""
    found = {}
    for name in names:
        base = name.partition("/")[0]
        path = folder / f"{base}.fmu"
        if not path.exists():
            if base in PARTS:
                build_part(PARTS[base], path)
            else:
                changes = {
                    "PercussiveHammer": {},
                    "RigidHammer": {"piston.model": "rigid", "bit.model": "rigid"},
                    "FemHammer": {"solver.name": "fem"},
                }[base.replace("NumbaHammer", "PercussiveHammer").removeprefix("Numba")]
                numba: Any = {"libraries": {}} if base.startswith("Numba") else {}
                build_hammer(Scene().replace(**changes), path, **numba)
            extract(str(path), str(folder / base))
        found[name] = str(folder / base)
    return found


def packed(state: bytes, body: bytes) -> bytes:
    """Another body behind the head of a state, which fits it."""
    magic, version, owner, _ = HEADER.unpack_from(state)
    head = HEADER.pack(magic, version, owner, len(body))
    return head + hashlib.sha256(head + body).digest() + body


class Damager:
    """Draws damaged states.

    Parameters
    ----------
    rng : Random
    good : sequence of (bytes, float)
        States of the FMU, and their times [s].
    foreign : sequence of bytes
        States that it must not take.
    """

    def __init__(
        self, rng: random.Random, good: Sequence[tuple[bytes, float]], foreign: Sequence[bytes]
    ) -> None:
        self.rng, self.good, self.foreign = rng, list(good), list(foreign)
        self.kinds = {
            "flipped": self.flipped, "word": self.word, "cut": self.cut, "longer": self.longer,
            "foreign": self.other, "made": self.made, "made, of other length": self.made_length,
            "made, few": self.made_few,
        }  # fmt: skip

    def draw(self) -> tuple[str, bytes, float]:
        """Kind of damage, the bytes, and the time of the state that was damaged [s]."""
        kind = self.rng.choice([*self.kinds, "made", "made, few", "made, few"])
        state, time = self.rng.choice(self.good)
        return kind, self.kinds[kind](bytearray(state)), time

    def flipped(self, state: bytearray) -> bytes:
        for _ in range(self.rng.choice((1, 1, 2, 8))):
            state[self.rng.randrange(len(state))] ^= 1 << self.rng.randrange(8)
        return bytes(state)

    def word(self, state: bytearray) -> bytes:
        at = self.rng.randrange(0, len(state) - 8)
        state[at : at + 8] = self._wild(bytes(state[at : at + 8]))
        return bytes(state)

    def cut(self, state: bytearray) -> bytes:
        return bytes(state[: self.rng.randrange(1, len(state))])

    def longer(self, state: bytearray) -> bytes:
        return bytes(state) + self.rng.randbytes(self.rng.choice((1, 8, 1000)))

    def other(self, state: bytearray) -> bytes:
        return self.rng.choice(self.foreign)

    def made(self, state: bytearray) -> bytes:
        """Many wild words, with a right hash."""
        return self._remade(state, self.rng.choice((2, 5, 20)))

    def made_few(self, state: bytearray) -> bytes:
        """One wild word, with a right hash."""
        return self._remade(state, 1)

    def made_length(self, state: bytearray) -> bytes:
        body = bytes(state[START:])
        if self.rng.random() < 0.5:
            body = body[: self.rng.randrange(len(body))]
        else:
            body += self.rng.randbytes(self.rng.choice((1, 8, 64)))
        return packed(state, body)

    def _remade(self, state: bytearray, count: int) -> bytes:
        body = bytearray(state[START:])
        begin = body.find(b"{", PLACE.size)
        try:  # the state of a part
            json.loads(body[begin:] if begin >= 0 else b"")
            for _ in range(count):
                if self.rng.random() < 0.2:
                    self._change(body, PLACE.size // 8 - 1, begin)
                else:
                    body = self._change_text(body, begin)
        except ValueError:
            for _ in range(count):
                # where most of the state of a hammer has its whole numbers
                record = self.rng.random() < 0.5
                self._change(body, 0, 2000 if record else len(body))
        return packed(state, bytes(body))

    def _change(self, body: bytearray, first: int, end: int) -> None:
        at = 8 * self.rng.randrange(first, max(first + 1, min(end, len(body)) // 8))
        body[at : at + 8] = self._wild(bytes(body[at : at + 8]))

    def _change_text(self, body: bytearray, begin: int) -> bytearray:
        """Put something else in the place of a number or a name."""
        text = body[begin:].decode()
        parts = []
        start = 0
        for k, letter in enumerate(text):
            if letter in "{}[]:,":
                if k > start:
                    parts.append((start, k))
                start = k + 1
        if not parts:  # nothing is left to be replaced
            return body
        start, end = self.rng.choice(parts)
        return body[:begin] + (text[:start] + self.rng.choice(LITERALS) + text[end:]).encode()

    def _wild(self, word: bytes) -> bytes:
        """Eight bytes in the place of these."""
        kind = self.rng.random()
        if kind < 0.35:
            return struct.pack("<q", self.rng.choice(WHOLE))
        if kind < 0.6:
            return struct.pack("<d", self.rng.choice(FLOATS))
        if kind < 0.7:
            return self.rng.randbytes(8)
        (number,) = struct.unpack("<d", word)
        return struct.pack("<d", -number if kind < 0.75 else self._scaled(number))

    def _scaled(self, number: float) -> float:
        try:
            return number * 10.0 ** self.rng.uniform(-20.0, 20.0)
        except OverflowError:
            return math.inf


class Case:
    """An instance that is given damaged states, and what it must answer.

    Parameters
    ----------
    name : str
        One of KINDS.
    folder : str
        Of the unpacked FMU.
    foreign : sequence of bytes
        States of other FMUs.
    seed : int
    """

    def __init__(self, name: str, folder: str, foreign: Sequence[bytes], seed: int) -> None:
        self.instance = Instance(folder)
        self.instance.set(KINDS[name])
        good = [self.instance.save()]
        self.instance.start()
        good.append(self.instance.save())
        self.places = [(good[0], 0.0), (good[1], 0.0)]
        rng = random.Random(f"{name}:{seed}")
        for _ in range(12):
            for _ in range(rng.randrange(1, 12)):
                step = rng.uniform(1e-6, 0.01)
                self.instance.step(STEP if name == "WaveString" else step)
            self.places.append((self.instance.save(), self.instance.time))
        self.running = self.places[2:]
        self.damager = Damager(rng, self.places, foreign)
        self.rng = rng
        self.wanted = [self.answer(state, time) for state, time in self.running]
        self.at = 0
        self.go_to(0)

    def go_to(self, k: int) -> None:
        """Restore a good state, and look whether it goes on as it should."""
        state, time = self.running[k]
        self.instance.restore(state, time)
        self.at = k
        self.seen = self.outputs()

    def outputs(self) -> list[Any]:
        return self.instance.values(self.instance.outputs)

    def answer(self, state: bytes, time: float) -> list[Any]:
        """Outputs after a restore, and after a step; the state is restored again."""
        self.instance.restore(state, time)
        before = self.outputs()
        self.instance.step(STEP)
        found = [before, self.outputs()]
        self.instance.restore(state, time)
        return found

    def check(self) -> str:
        """Give a damaged state; what came of it.

        Raises
        ------
        AssertionError
            If the answer is wrong.
        """
        kind, state, time = self.damager.draw()
        known = {good for good, _ in self.places}
        self.instance.messages.clear()
        present = self.instance.time
        try:
            self.instance.restore(state, time)
        except FMICallException:
            self.instance.time = present
            said = [text for text in self.instance.messages if "saved" in text or "=" in text]
            assert said, f"refused without a reason: {self.instance.messages}"
            assert not any("Error:" in text for text in said if "Fatal" not in text), said
            assert state not in known, "a good state was refused"
            assert self.outputs() == self.seen, "the instance has changed"
            if self.rng.random() < 0.3:
                self.instance.step(STEP)
                assert self.outputs() == self.wanted[self.at][1], "it goes on in another way"
            outcome = "refused"
        else:
            assert kind.startswith("made") or state in known, "a damaged state was taken"
            outcome = "taken" if self.go_on() else "taken, later refused"
            # one from before the first step may have brought other parameters
            self.instance.restore(*self.places[0])
        k = self.rng.randrange(len(self.running))
        self.go_to(k)
        assert self.seen == self.wanted[k][0], "a good state gives other outputs"
        if outcome != "refused":
            self.instance.step(STEP)
            assert self.outputs() == self.wanted[k][1], "a good state goes on in another way"
            self.go_to(k)
        return f"{kind}: {outcome}"

    def go_on(self) -> bool:
        """Use an instance with a state that it has taken; whether it goes on."""
        self.instance.messages.clear()
        try:
            now = self.instance.time
            for k in range(STEPS):
                self.instance.slave.doStep(now + k * STEP, STEP)
                self.outputs()
            return True
        except FMICallException:
            assert any(text.strip() for text in self.instance.messages), "failed without a word"
            return False


def work(pipe: Connection, name: str, folder: str, foreign: Sequence[bytes], seed: int) -> None:
    """Check as many cases as are asked for."""
    case = Case(name, folder, foreign, seed)
    pipe.send(None)
    while (count := pipe.recv()) > 0:
        found: Counter[str] = Counter()
        for _ in range(count):
            try:
                found[case.check()] += 1
            except AssertionError as error:
                pipe.send(f"{type(error).__name__}: {error}")
                return
        pipe.send(found)


def run(
    name: str, folder: str, foreign: Sequence[bytes], count: int, seed: int = 1, chunk: int = 50
) -> tuple[Counter[str], str]:
    """Check cases of one FMU in a process of its own; counts, and what went wrong."""
    context = multiprocessing.get_context("spawn")
    mine, theirs = context.Pipe()
    process = context.Process(target=work, args=(theirs, name, folder, foreign, seed), daemon=True)
    process.start()
    theirs.close()
    found: Counter[str] = Counter()
    try:
        if not mine.poll(PATIENCE_AT_START):
            return found, "hang at the start"
        mine.recv()
        while found.total() < count:
            mine.send(min(chunk, count - found.total()))
            if not mine.poll(PATIENCE):
                return found, f"hang after {found.total()} cases"
            answer = mine.recv()
            if isinstance(answer, str):
                return found, f"after {found.total()} cases: {answer}"
            found += answer
        return found, ""
    except EOFError:
        process.join()
        return found, f"crash (exit {process.exitcode}) after {found.total()} cases"
    finally:
        process.kill()
        process.join()


def first_states(folders: dict[str, str]) -> dict[str, bytes]:
    """A state of each FMU as it is instantiated, for the others to refuse."""
    found = {}
    for name, folder in folders.items():
        with Instance(folder) as instance:
            found[name] = instance.save()
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20_000, help="states in all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", choices=list(KINDS), help="FMUs; all if left out")
    options = parser.parse_args()
    names = options.only or list(KINDS)
    each, failed, total = math.ceil(options.count / len(names)), [], Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        folders = build(names, Path(folder))
        states = first_states(folders)
        for name in names:
            base = folders[name]
            foreign = [state for other, state in states.items() if folders[other] != base]
            foreign = foreign or [b"\0" * 200]
            found, fault = run(name, base, foreign, each, options.seed)
            total += found
            print(f"{name}: {found.total()}, {fault or 'all right'}", flush=True)
            failed += [name] if fault else []
    for kind, count in sorted(total.items()):
        print(f"{count:7d} {kind}")
    sys.exit(f"failed: {', '.join(failed)}" if failed else 0)


if __name__ == "__main__":
    main()
