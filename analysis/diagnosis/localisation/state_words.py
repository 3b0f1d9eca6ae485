"""Regions of state in words."""

import numpy as np

from analysis.wording import typeset
from equalizer.signals.signal import FloatArray

_READABLE = {"m": ("mm", 1e3), "rad": ("deg", 180 / np.pi)}


def region_in_words(
    kind: str, symbol: str, unit: str, bins: tuple[int, int, int], centre: float, one_stratum: bool
) -> str:
    """bins: first and last of the region, and how many there are. centre: mean state of the mismatch in it."""
    first, last, count = bins
    low, high = first == 0, last == count - 1
    if kind == "time":
        when = "midway through" if low == high else "late in" if high else "early in"
        return f"{when} {'the record' if one_stratum else 'each segment'}"
    if kind == "position":
        named, factor = _READABLE.get(unit, (unit, 1.0))
        return f"near {symbol} = {typeset(f'{centre * factor:.2g}')} {named}".rstrip()
    if low and not high:
        return f"near {symbol} = 0" if kind == "velocity" else f"where |{symbol}| is small"
    return f"where |{symbol}| is large" if high else f"at middling |{symbol}|"


def dependence_in_words(symbol: str, means: FloatArray) -> str:
    """means: over bins of equal filling, in the order of the state."""
    lower, upper = means[: len(means) // 2].mean(), means[len(means) // 2 :].mean()
    larger = max(abs(lower), abs(upper))
    if larger > 0 and lower * upper < 0 and min(abs(lower), abs(upper)) > larger / 3:
        return f"by the sign of {symbol}"
    return f"depending on {symbol}"
