"""Verdict on a coupled run: whether its energies balance, or the communication step is too long."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from percussion_model.coupling.component import kind_of
from percussion_model.coupling.port import Port
from percussion_model.simulation.uncertain import in_digits

# Greatest change of a force in a step, root mean square by the greatest force: 1 ms has 2 %
# in the shipped systems, loops that swing up for the step alone have 20 % or more.
LARGEST_JUMP = 0.05
# Greatest residual of the string by the energy put in: up to 0.9 % in the shipped systems at any
# step that is short enough, for the cells of the string.
LARGEST_STRING_RESIDUAL = 0.02
# Of a hammer's own ledger, which closes to rounding.
LARGEST_HAMMER_RESIDUAL = 1e-9
# Energy that the shoulder may make, and take, by that of the blows: right is 1 %, and the
# sampled one has -0.2 to 1 % (docs/system.md, section 4).
MADE_BY_SHOULDER, TAKEN_BY_SHOULDER = 0.01, 0.1
# The least share of its stiffness that a step may leave to the shoulder.
STIFF_ENOUGH = 0.9
# Below so many steps there is nothing to judge by.
FEWEST_STEPS = 10
# A loop that swings up does not tell by its size how much too long the step is.
SATURATED, MUCH_SHORTER = 0.2, 0.1

STIFFNESS = "string.shoulder_stiffness"
# Flags of values that are held at a limit, and what they say.
LIMITS = {
    "rig.limited": "the valve of the rig gave its full flow",
    "supply.relief_open": "the relief valve of the supply was open",
}


class Jumps:
    """Changes of what parts exchange within a communication step.

    A part sees what another one gave at the begin of a step till its end: so this is what it
    does not see. Forces are taken; all real numbers where parts exchange no forces.

    Parameters
    ----------
    ports : sequence of Port
    every : mapping
        Steps that a part does as one, by component.
    idle : collection, optional
        Component and name of outputs that do not act where they go.
    """

    def __init__(
        self,
        ports: Sequence[Port],
        every: Mapping[str, int],
        idle: Collection[tuple[str, str]] = (),
    ) -> None:
        units = [_units(port) for port in ports]
        is_force = any("N" in of_port.values() for of_port in units)
        self._names: list[str] = []
        self._places: list[int] = []
        pace = []
        for port, of_port in zip(ports, units, strict=True):
            for k, name in enumerate(port.taken):
                unit = of_port.get(name)
                if (port.name, name) in idle:
                    continue
                if (unit == "N") if is_force else unit is not None:
                    self._names.append(f"{port.name}.{name}")
                    self._places.append(port.begin + k)
                    pace.append(every.get(port.name, 1))
        self._is_force, self._pace = is_force, np.array(pace, dtype=float)
        self._squares = np.zeros(len(pace))
        self._greatest = np.zeros(len(pace))
        self._count = 0

    def add(self, before: Sequence[Any], after: Sequence[Any]) -> None:
        """Take the values before and after a step."""
        old = np.array([before[place] for place in self._places], dtype=float)
        new = np.array([after[place] for place in self._places], dtype=float)
        self._squares += (new - old) ** 2
        np.maximum(self._greatest, np.maximum(np.abs(old), np.abs(new)), out=self._greatest)
        self._count += 1

    def by_size(self) -> dict[str, float]:
        """Root mean square of the change of each signal, by the greatest force or its own size."""
        if not self._count or not self._names:
            return {}
        sizes = self._greatest
        if self._is_force:
            sizes = np.full(len(sizes), sizes.max())
        # a slow part gives a new value once in so many steps
        changes = np.sqrt(self._pace * self._squares / self._count)
        shares = np.divide(changes, sizes, out=np.zeros_like(changes), where=sizes > 0.0)
        return dict(zip(self._names, shares.tolist(), strict=True))


def _units(port: Port) -> dict[str, str]:
    """Unit of each real output that others take; those of a Python part are not known."""
    variables = getattr(port.part, "variables", {})
    found = {name: variables[name] for name in port.taken if name in variables}
    return {name: one.unit or "" for name, one in found.items() if kind_of(one) == "Real"}


@dataclass(frozen=True)
class Finding:
    """Something wrong with a coupled run.

    Attributes
    ----------
    signal : str
        Where it shows; empty where that is the whole run.
    text : str
        What it is.
    value, limit : float
        What was found, and what it may be, in the unit of the text.
    step : float or None
        Communication step that would do [s]; None where a step does not mend it.
    """

    signal: str
    text: str
    value: float
    limit: float
    step: float | None = None


@dataclass(frozen=True)
class Verdict:
    """Verdict on a coupled run.

    Attributes
    ----------
    word : str
        "balanced"; "step too long"; "not balanced" where another step does not mend it; "ended
        early"; "undecided" where there are too few steps to tell.
    text : str
        The same in a sentence or two.
    step : float or None
        Longest communication step that would do, as far as can be told [s].
    findings : list of Finding
        What is wrong, in the order of importance.
    remarks : list of str
        What is to be known, and may be right.
    numbers : dict of float
        What it was judged by.
    """

    word: str
    text: str
    step: float | None = None
    findings: list[Finding] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    numbers: dict[str, float] = field(default_factory=dict)

    @property
    def is_bad(self) -> bool:
        """Whether the numbers of the run are not to be relied on."""
        return self.word not in ("balanced", "undecided")

    def to_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return asdict(self)


def judge_run(
    columns: Mapping[str, np.ndarray],
    balances: Mapping[str, Any],
    jumps: Mapping[str, float],
    step: float,
    steps: int,
    error: str,
    controlled: bool,
) -> Verdict:
    """Verdict on a run.

    Parameters
    ----------
    columns : mapping
        Signals over time.
    balances : mapping
        What `summary` says of the energies.
    jumps : mapping
        Change of what parts exchange in a step, by its size, by signal (`Jumps`).
    step, steps : float, int
        Communication step [s], and how many were done.
    error : str
        Why the run ended early.
    controlled : bool
        Whether steps were shortened by their error.
    """
    numbers = {key: float(balances[key]) for key in _BALANCES if key in balances}
    findings = [*_not_numbers(columns), *_softening(columns, step)]
    if jumps and not controlled:
        signal, value = max(jumps.items(), key=lambda one: one[1])
        numbers["largest_jump"] = value
        findings += _jump(signal, value, step)
    findings += _imbalance(numbers, findings, step)
    remarks = _limits(columns)
    steps_that_do = [one.step for one in findings if one.step is not None]
    shorter = _round_down(min(steps_that_do)) if steps_that_do else None
    said = "; ".join(one.text for one in findings)
    if error:
        word = "ended early"
        text = f"the run ended early, {error}" + (f"; {said}" if said else "")
    elif shorter is not None:
        word = "step too long"
        text = f"the communication step of {_ms(step)} is too long: {said}"
        text += f". At most {_ms(shorter)} will do"
    elif findings:
        word, text = "not balanced", said
    elif steps < FEWEST_STEPS:
        word = "undecided"
        text = f"{steps} steps are too few to judge by: at least {FEWEST_STEPS} are needed"
    elif not numbers:
        word = "undecided"
        text = (
            "no part keeps a balance and none exchange real numbers, so nothing can be determined"
        )
    else:
        word = "balanced"
        size = f"steps of at most {_ms(step)} are" if controlled else f"step of {_ms(step)} is"
        text = f"the communication {size} short enough: {_praise(numbers)}"
    return Verdict(word, text, shorter, findings, remarks, numbers)


_BALANCES = ("string_energy_residual", "hammer_energy_residual", "shoulder_by_blows")


def _not_numbers(columns: Mapping[str, np.ndarray]) -> list[Finding]:
    """Signals that are not finite somewhere."""
    found = []
    for name, column in columns.items():
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            at = float(columns["time"][bad[0]])
            text = f"{name} is no number in {len(bad)} rows, from {at:.6g} s on"
            found.append(Finding(name, text, float(len(bad)), 0.0))
    return found


def _softening(columns: Mapping[str, np.ndarray], step: float) -> list[Finding]:
    """A shoulder that a step cannot bear with all of its stiffness (docs/system.md, section 4)."""
    if STIFFNESS not in columns or not len(columns[STIFFNESS]):
        return []
    given, least = float(columns[STIFFNESS][0]), float(np.min(columns[STIFFNESS]))
    share = least / given if given > 0.0 else math.nan
    if not share < STIFF_ENOUGH:
        return []
    text = (
        f"it leaves the shoulder {_percent(share)} of its stiffness ({STIFFNESS} "
        f"{in_digits(1e-3 * least)} in place of {in_digits(1e-3 * given)} kN/m)"
    )
    # what a step can bear goes by the inverse square of the step
    shorter = step * (math.sqrt(share) if share > 0.0 else MUCH_SHORTER)
    return [Finding(STIFFNESS, text, share, STIFF_ENOUGH, shorter)]


def _jump(signal: str, value: float, step: float) -> list[Finding]:
    """A signal that changes too much while a part does not see it."""
    if not value > LARGEST_JUMP:
        return []
    text = f"{signal} changes by {_percent(value)} of the greatest value in each step"
    # held values have an error of first order
    share = MUCH_SHORTER if value > SATURATED else LARGEST_JUMP / value
    return [Finding(signal, text, value, LARGEST_JUMP, step * share)]


def _imbalance(
    numbers: Mapping[str, float], known: Sequence[Finding], step: float
) -> list[Finding]:
    """Balances that do not close; what is known already says from where, and which step."""
    by_step = [one for one in known if one.step is not None]
    first = by_step[0] if by_step else None
    shorter = None if first is None else first.step
    found = []
    residual = numbers.get("string_energy_residual", 0.0)
    if not residual <= LARGEST_STRING_RESIDUAL:
        text = f"the string's energies miss {_share_of(residual, 'what is put in')}"
        if first is None:
            text += ", which no shorter step mends: its cells are too long (string.rod.cells)"
        place = "string.rod.cells" if first is None else first.signal
        found.append(Finding(place, text, residual, LARGEST_STRING_RESIDUAL, shorter))
    shoulder = numbers.get("shoulder_by_blows", 0.0)
    if not -MADE_BY_SHOULDER <= shoulder <= TAKEN_BY_SHOULDER:
        made = shoulder < 0.0
        share = _share_of(abs(shoulder), "the energy of the blows")
        text = (
            "the coupling of string.feed_force and hammer.bit.position "
            f"{'makes' if made else 'takes'} {share}"
        )
        limit = -MADE_BY_SHOULDER if made else TAKEN_BY_SHOULDER
        mended = shorter or step * max(MUCH_SHORTER, limit / shoulder)
        found.append(Finding("string.energy.shoulder", text, shoulder, limit, mended))
    own = numbers.get("hammer_energy_residual", 0.0)
    if not own <= LARGEST_HAMMER_RESIDUAL:
        text = f"the hammer's own ledger misses {own:.2g} of its energy, whatever the step"
        found.append(Finding("hammer.energy_residual", text, own, LARGEST_HAMMER_RESIDUAL))
    return found


def _limits(columns: Mapping[str, np.ndarray]) -> list[str]:
    """Values that were held at a limit."""
    return [
        f"{text} in {_percent(share)} of the rows ({name})"
        for name, text in LIMITS.items()
        if len(columns.get(name, ())) > 1
        and (share := float(np.mean(columns[name][1:] > 0.0))) > 0.0
    ]


def _praise(numbers: Mapping[str, float]) -> str:
    """What holds, with its numbers."""
    said = []
    if "string_energy_residual" in numbers:
        said.append(f"the string's energies to {_percent(numbers['string_energy_residual'])}")
    if "hammer_energy_residual" in numbers:
        said.append(f"the hammer's ledger to {numbers['hammer_energy_residual']:.1g}")
    closed = f"energies balance ({', '.join(said)})" if said else "no part keeps an energy balance"
    if "largest_jump" not in numbers:
        return closed
    return f"{closed}; what parts exchange changes by {_percent(numbers['largest_jump'])} in a step"


def _percent(share: float) -> str:
    return f"{in_digits(100.0 * share, 2)} %"


def _share_of(share: float, what: str) -> str:
    return f"{_percent(share)} of {what}" if share < 1.0 else f"{in_digits(share)} times {what}"


def _ms(time: float) -> str:
    return f"{1e3 * time:g} ms"


def _round_down(step: float) -> float:
    """The next shorter step of 1, 2 or 5 times a power of ten [s]."""
    power = 10.0 ** math.floor(math.log10(step))
    lead = max(digit for digit in (1, 2, 5) if digit * power <= step * (1.0 + 1e-9))
    return float(f"{lead * power:.1g}")
