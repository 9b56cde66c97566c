"""Python callables that begin each run afresh, with nothing left of the run before."""

from __future__ import annotations

import copy
import functools
import inspect
import pickle
import types
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from percussion_model.coupling.component import CouplingError
from percussion_model.scene.rows import said_among

REMEDY = "give its class, a factory without arguments, or an object with reset()"


class CopiedPart(UserWarning):
    """An object that keeps values is copied for each run."""


def fresh(name: str, given: Callable[..., Any], is_new: bool = False) -> Callable[..., Any]:
    """Return what works in one run.

    A class is called, and so is a factory: what needs no arguments. Of an object with `reset`
    that is called; any other object that keeps values is copied, with a warning. A function is
    taken as it is.

    Parameters
    ----------
    name : str
        Of the component, for messages.
    given : callable
        Takes inputs, time and step [s], or makes what does.
    is_new : bool
        Whether it was made for this run already, so that nothing has to be copied.

    Raises
    ------
    CouplingError
        If it makes nothing that can be called, or takes other arguments.
    """
    if inspect.isclass(given) or _is_factory(given):
        made = _make(name, given)
        if not callable(made) or inspect.isclass(made) or _is_factory(made):
            raise CouplingError(
                f"{name}: {_title(given)} gives {_kind(made)}, which cannot be "
                "called with inputs, time and step"
            )
        _reset(made)
        work: Callable[..., Any] = made
        _check_arguments(f"{name}: what {_title(given)} gives", work)
        return work
    _check_arguments(f"{name}: {_title(given)}", given)
    if inspect.isroutine(given) and not inspect.ismethod(given):
        return given
    if _reset(given) or is_new or not _keeps_values(given):
        return given
    warnings.warn(
        f"{name}: {_title(given)} keeps values and has no reset(): each run has a copy of it",
        CopiedPart,
        stacklevel=2,
    )
    try:
        return copy.deepcopy(given)
    except Exception as error:
        raise CouplingError(
            f"{name}: {_title(given)} keeps values and cannot be copied for each run "
            f"({type(error).__name__}: {error}): {REMEDY}"
        ) from error


def with_values(given: Callable[..., Any], values: Mapping[str, Any]) -> Callable[..., Any]:
    """What a class or a factory makes with values of its arguments, by name.

    Raises
    ------
    CouplingError
        If it is neither, or has no such argument.
    """
    if not (inspect.isclass(given) or _is_factory(given)):
        raise CouplingError(
            f"{_title(given)} is a function, which has no variables to set: {REMEDY}"
        )
    known = list(inspect.signature(given).parameters)
    for name in values:
        if name not in known:
            raise CouplingError(
                f"{_title(given)} has no argument {name}: {said_among(name, known)}"
            )
    return functools.partial(given, **values)


def kept_values(given: object) -> dict[str, bytes]:
    """Values that a function finds outside of its arguments, as bytes to be compared.

    Those of its closure, its defaults, its attributes, the globals that it names, and of the
    functions among these; what cannot be pickled is left out.
    """
    found: dict[str, bytes] = {}
    if isinstance(given, types.FunctionType):
        for name, value in _outside(given, set()):
            try:
                found[name] = pickle.dumps(value)
            except Exception:  # no plain data
                continue
    return found


def _outside(function: types.FunctionType, seen: set[int]) -> Iterator[tuple[str, Any]]:
    seen.add(id(function))
    names = inspect.getclosurevars(function)
    values = {**names.globals, **names.nonlocals, **(function.__kwdefaults__ or {})}
    values |= {f"{function.__name__}.{name}": value for name, value in vars(function).items()}
    values |= {f"default {k + 1}": one for k, one in enumerate(function.__defaults__ or ())}
    for name, value in values.items():
        if isinstance(value, types.FunctionType):
            if id(value) not in seen:
                yield from _outside(value, seen)
        elif not isinstance(value, types.ModuleType):
            yield name, value


def _check_arguments(what: str, work: Callable[..., Any]) -> None:
    """Refuse what takes other arguments than a part of a system gets."""
    try:
        inspect.signature(work).bind({}, 0.0, 0.0)
    except TypeError as error:
        raise CouplingError(
            f"{what} cannot be called with inputs, time and step ({error}): these three are what "
            "it gets, each time"
        ) from None
    except ValueError:
        pass  # has no signature, as some callables in C


def _is_factory(given: Callable[..., Any]) -> bool:
    """Whether it can be called without arguments, and does not take any number of them."""
    try:
        parameters = inspect.signature(given).parameters.values()
    except (TypeError, ValueError):
        return False
    return all(one.default is not one.empty or one.kind is one.VAR_KEYWORD for one in parameters)


def _make(name: str, given: Callable[..., Any]) -> Any:
    try:
        inspect.signature(given).bind()
    except TypeError as error:
        raise CouplingError(
            f"{name}: {_title(given)} cannot be made without arguments ({error}): give a factory, "
            f"as lambda: {_title(given)}(...)"
        ) from None
    except ValueError:
        pass  # has no signature, as some classes in C
    return given()


def _reset(given: object) -> bool:
    """Call the `reset` of an object, or of that of a method; whether there is one."""
    reset = getattr(getattr(given, "__self__", given), "reset", None)
    if callable(reset):
        reset()
        return True
    return False


def _keeps_values(given: object) -> bool:
    owner = getattr(given, "__self__", given)
    slots = (getattr(kind, "__slots__", ()) for kind in type(owner).__mro__)
    return bool(getattr(owner, "__dict__", None)) or any(slots) or hasattr(owner, "func")


def _title(given: object) -> str:
    return getattr(given, "__name__", None) or f"an object of {type(given).__name__}"


def _kind(value: object) -> str:
    return f"the class {value.__name__}" if inspect.isclass(value) else type(value).__name__
