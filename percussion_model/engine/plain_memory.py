"""Views of plain memory where nothing is compiled (NUMBA_DISABLE_JIT)."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from typing import Any

import numpy as np

LINE = 64
_made: dict[int, Any] = {}  # memory by its address


def viewing(function: Callable) -> Callable:
    """Leave a function as it is."""
    return function


merging = viewing


def literal_unroll(arrays: Any) -> Any:
    """Arrays of a tuple, one after the other."""
    return arrays


def allocate(size: int) -> int:
    """Memory of zeros, which begins at a line; its address."""
    whole = (ctypes.c_char * (size + LINE))()
    begin = (ctypes.addressof(whole) + LINE - 1) // LINE * LINE
    _made[begin] = whole
    return begin


def free(address: int) -> None:
    """Give memory back."""
    del _made[address]


def _array(address: int, dtype: Any, shape: Any) -> np.ndarray:
    size = math.prod(map(int, shape)) * np.dtype(dtype).itemsize
    return np.ndarray(shape, dtype, (ctypes.c_char * size).from_address(int(address)))


def records_at(dtype: np.dtype) -> Callable[[int, int], np.ndarray]:
    """Function that sees so many records of a type, with attributes, at an address."""
    record = np.dtype((np.record, dtype))
    return lambda address, count: _array(address, record, (count,))


def new_record(dtype: np.dtype) -> Callable[[], np.ndarray]:
    """Function that makes an array of one record of zeros, with attributes."""
    record = np.dtype((np.record, dtype))
    return lambda: np.zeros(1, record)


def words_in(address: int, shape: Any) -> np.ndarray:
    """Whole numbers at an address as an array."""
    return _array(address, np.int64, shape)


def floats_in(address: int, shape: Any) -> np.ndarray:
    """Numbers at an address as an array."""
    return _array(address, np.float64, shape)


def copy_to(address: int, array: np.ndarray) -> None:
    """Copy an array to an address."""
    _array(address, array.dtype, array.shape)[...] = array
