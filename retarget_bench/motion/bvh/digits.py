"""Numbers as text, a whole table at a time."""

from __future__ import annotations

import numpy as np

_DECIMALS = (6, 8)
_LARGEST = 10**9
"""Whole parts below it, and eight decimals, fit 32-bit arithmetic, which is the fast one."""
_ROWS = 256


def number_text(number: float) -> str:
    """Six decimals where they are exact, else the shortest text that gives the same number back."""
    short = f"{number:.6f}"
    return short if float(short) == number else repr(float(number))


def table_text(values: np.ndarray) -> bytes:
    """Lines of finite numbers ``(rows, columns)``, with decimals enough to give each back exactly."""
    if not values.size or np.abs(values).max() < _LARGEST:
        for decimals in _DECIMALS:
            if np.array_equal(np.round(values, decimals), values):
                parts = (values[at : at + _ROWS] for at in range(0, len(values), _ROWS))
                return b"".join(_fixed_text(part, decimals) for part in parts)
    return "".join(" ".join(map(repr, row)) + "\n" for row in values.tolist()).encode("ascii")


def _fixed_text(values: np.ndarray, decimals: int) -> bytes:
    """As ``%.6f`` would write them, ten times as fast: every digit of all numbers at once.

    Each number gets a row of characters: sign, whole part, point, decimals, separator. Signs and zeros
    that are not wanted are then left out of the text.
    """
    size = np.abs(values).ravel()
    whole = size.astype(np.uint32)
    decimal = np.rint((size - whole) * 10**decimals).astype(np.uint32)
    whole += decimal == 10**decimals  # rounded up
    decimal %= 10**decimals
    places = len(str(whole.max(initial=0)))
    text = np.empty((size.size, 1 + places + 1 + decimals + 1), dtype=np.uint8)
    kept = np.ones(text.shape, dtype=bool)
    text[:, 0] = ord("-")
    kept[:, 0] = np.signbit(values).ravel()
    for place in range(places):
        kept[:, places - place] = whole > 0 if place else True
        whole = _digit(whole, text[:, places - place])
    text[:, places + 1] = ord(".")
    for place in range(decimals):
        decimal = _digit(decimal, text[:, -2 - place])
    separators = text[:, -1].reshape(values.shape)
    separators[:, :-1] = ord(" ")
    separators[:, -1] = ord("\n")
    return text[kept].tobytes()


def _digit(numbers: np.ndarray, into: np.ndarray) -> np.ndarray:
    """Write the last digit of each number; the numbers without it."""
    rest = numbers // 10
    into[:] = numbers - 10 * rest + ord("0")
    return rest
