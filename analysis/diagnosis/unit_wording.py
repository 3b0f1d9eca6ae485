"""Formats physical values for people: SI prefixes, raised exponents, and as many digits as the confidence interval
allows.
"""

import re
from dataclasses import dataclass

import numpy as np

from analysis.wording import typeset

_PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"), (1e9, "G"))
"""SI prefixes with their factors."""
_RANGE_WITHOUT_PREFIX = (0.01, 1e4)
"""Values within this range are shown in the unit itself."""
_ALWAYS_PREFIXED = ("m", "s", "m/s", "N m")
"""Units for which a prefix is usual within that range too: 54 mm, not 0.054 m."""
_NEVER_PREFIXED = ("1", "deg", "ppm", "kg", "kg m^2")
"""Units without a prefix; `scale_of` treats kg and kg m^2 separately."""
_NO_PREFIX = re.compile(r"1/|[A-Za-z]+\^")
"""Units that begin with a reciprocal or a power: a prefix would be raised to it as well."""
_RAISED = {"^2": "²", "^3": "³"}
_SYMBOLS = {"deg": "°"}
_MOST_DIGITS, _DIGITS = 5, 3
"""Most significant digits of a number, and the usual ones."""


@dataclass(frozen=True, slots=True)
class Scale:
    """How a unit is shown: a value in SI, times `factor`, is in `unit`."""

    factor: float
    unit: str


_INERTIAS = (Scale(1.0, "kg m²"), Scale(1e4, "kg cm²"), Scale(1e7, "g cm²"))
_LEAST_INERTIA = 0.1
"""Smallest value shown in a unit of inertia; below it the next smaller unit is used."""


def scale_of(unit: str, magnitude: float) -> Scale:
    """The displayed unit, and the factor from SI to it, for values of about this magnitude (SI). unit: SI in ASCII,
    such as "m/s^2"."""
    size = abs(magnitude) if np.isfinite(magnitude) else 0.0
    if unit == "kg":
        return Scale(1.0, "kg") if size >= 1 or size == 0 else Scale(1e3, "g")
    if unit == "kg m^2":
        return next((scale for scale in _INERTIAS if size * scale.factor >= _LEAST_INERTIA or size == 0), _INERTIAS[-1])
    in_range = _RANGE_WITHOUT_PREFIX[0] <= size < _RANGE_WITHOUT_PREFIX[1] and unit not in _ALWAYS_PREFIXED
    if in_range or size == 0 or unit in _NEVER_PREFIXED or _NO_PREFIX.match(unit):
        return Scale(1.0, typeset_unit(unit))
    factor, prefix = max((prefixed for prefixed in _PREFIXES if prefixed[0] <= size * (1 + 1e-9)), default=_PREFIXES[0])
    return Scale(1 / factor, prefix + typeset_unit(unit))


def typeset_unit(unit: str) -> str:
    """The unit with raised exponents: "m/s^2" gives "m/s²", "1/m" gives "per m", and "1" gives an empty string."""
    text = "" if unit == "1" else f"per {unit[2:]}" if unit.startswith("1/") else unit
    for power, raised in _RAISED.items():
        text = text.replace(power, raised)
    return _SYMBOLS.get(text, text)


def value_text(value: float, unit: str, ci95: tuple[float, float] | None = None) -> str:
    """A value with its 95 % interval, such as "54 µm [49, 60]"; three significant digits without an interval. value,
    ci95: in `unit`, SI."""
    scale = scale_of(unit, value)
    scaled = value * scale.factor
    interval = None if ci95 is None else (ci95[0] * scale.factor, ci95[1] * scale.factor)
    decimals = _decimals(scaled, interval)
    space = "" if scale.unit in ("", "°") else " "
    text = f"{_number(scaled, decimals)}{space}{scale.unit}"
    if interval is None:
        return text
    return f"{text} [{_number(interval[0], decimals)}, {_number(interval[1], decimals)}]"


def percent_text(share: float, ci95: tuple[float, float] | None = None) -> str:
    """A share (0 to 1) as per cent, with its 95 % interval."""
    text = value_text(100 * share, "1", None if ci95 is None else (100 * ci95[0], 100 * ci95[1]))
    value, bracket, interval = text.partition(" [")
    return f"{value} %{bracket}{interval}"


def error_text(error: float | None) -> str:
    """An error relative to the signal: "14 %", from 1000 % on "12 times", and "unknown" for None."""
    if error is None:
        return "unknown"
    return f"{100 * error:.3g} %" if 100 * error < 1000 else f"{error:.3g} times"


def error_of_signal(error: float | None) -> str:
    """An error in words: "14 % of the signal", "12 times the signal"."""
    return f"{error_text(error)} {'the' if error is not None and 100 * error >= 1000 else 'of the'} signal"


def probability_text(probability: float) -> str:
    """A probability with two decimals, or "< 0.01" or "> 0.99" outside that range."""
    return f"{probability:.2f}" if 0.01 <= probability <= 0.99 else ("< 0.01", "> 0.99")[probability > 0.5]


def share_text(share: float) -> str:
    """A share as per cent with two digits, or all digits from 100 % on."""
    return f"{100 * share:.2g} %" if 100 * share < 99.5 else f"{100 * share:.0f} %"


def _decimals(value: float, interval: tuple[float, float] | None) -> int:
    """Number of decimals: as many as give half the interval's width one significant digit, but at most `_MOST_DIGITS`
    significant digits of the value; without an interval, `_DIGITS` significant digits."""
    size = np.floor(np.log10(abs(value))) if value else 0.0
    if interval is None or not interval[1] > interval[0]:
        return int(max(0, _DIGITS - 1 - size))
    half_width = (interval[1] - interval[0]) / 2
    decimals = -int(np.floor(np.log10(half_width * 1.0001)))
    return int(np.clip(decimals, 0, max(0, _MOST_DIGITS - 1 - size)))


def _number(value: float, decimals: int) -> str:
    """The value with this number of decimals; in exponent notation from 1e6 on, or with more than five decimals."""
    if value and (abs(value) >= 1e6 or decimals > 5):
        return typeset(f"{value:.3g}")
    return typeset(f"{value:.{decimals}f}")
