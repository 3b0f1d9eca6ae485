"""Format physical values, errors, shares and probabilities for reports: SI prefixes, superscript exponents, and digits
limited by the confidence interval."""

import re
from dataclasses import dataclass

import numpy as np

from analysis.wording import typeset

_PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"), (1e9, "G"))
_RANGE_WITHOUT_PREFIX = (0.01, 1e4)
"""Values from the first to below the second are shown in the unit itself. Chosen by hand."""
_ALWAYS_PREFIXED = ("m", "s", "m/s", "N m")
"""Units for which a prefix is usual within that range too: 54 mm, not 0.054 m."""
_NEVER_PREFIXED = ("1", "deg", "ppm", "kg", "kg m^2")
"""Units without a prefix; `choose_scale` treats kg and kg m^2 separately."""
_NO_PREFIX = re.compile(r"1/|[A-Za-z]+\^")
"""Units that are a reciprocal or begin with a power: the power would apply to a prefix as well."""
_SUPERSCRIPTS = {"^2": "²", "^3": "³"}
_SYMBOLS = {"deg": "°"}
"""Symbols of units that are not shown by their ASCII name."""
_MOST_DIGITS, _USUAL_DIGITS = 5, 3
"""Most significant digits of a number, and the usual number of them. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class Scale:
    """Displayed unit: a value in SI, times `factor`, is in `unit`."""

    factor: float
    unit: str


_INERTIA_SCALES = (Scale(1.0, "kg m²"), Scale(1e4, "kg cm²"), Scale(1e7, "g cm²"))
"""Displayed units of inertia, from the largest to the smallest."""
_LEAST_INERTIA = 0.1
"""Value in a unit of inertia below which the next smaller unit, if any, is used. Chosen by hand."""


def choose_scale(unit: str, magnitude: float) -> Scale:
    """Choose the displayed unit, and the factor from SI to it, for values of about this magnitude (SI; of any sign; NaN
    and infinity count as 0, which has no prefix). unit: SI in ASCII, such as "m/s^2"."""
    absolute_value = abs(magnitude) if np.isfinite(magnitude) else 0.0
    if unit == "kg":
        return Scale(1.0, "kg") if absolute_value >= 1 or absolute_value == 0 else Scale(1e3, "g")
    if unit == "kg m^2":
        return next(
            (
                scale
                for scale in _INERTIA_SCALES
                if absolute_value * scale.factor >= _LEAST_INERTIA or absolute_value == 0
            ),
            _INERTIA_SCALES[-1],
        )
    is_in_plain_range = (
        _RANGE_WITHOUT_PREFIX[0] <= absolute_value < _RANGE_WITHOUT_PREFIX[1] and unit not in _ALWAYS_PREFIXED
    )
    if is_in_plain_range or absolute_value == 0 or unit in _NEVER_PREFIXED or _NO_PREFIX.match(unit):
        return Scale(1.0, typeset_unit(unit))
    # The tolerance is for values that rounding leaves just below a power of 1000.
    factor, prefix = max(
        (factor_and_prefix for factor_and_prefix in _PREFIXES if factor_and_prefix[0] <= absolute_value * (1 + 1e-9)),
        default=_PREFIXES[0],
    )
    return Scale(1 / factor, prefix + typeset_unit(unit))


def typeset_unit(unit: str) -> str:
    """Typeset the unit with superscript exponents: "m/s^2" gives "m/s²", "1/m" gives "per m", and "1" gives an empty
    string."""
    unit_text = "" if unit == "1" else f"per {unit[2:]}" if unit.startswith("1/") else unit
    for power, superscript in _SUPERSCRIPTS.items():
        unit_text = unit_text.replace(power, superscript)
    return _SYMBOLS.get(unit_text, unit_text)


def format_value(value: float, unit: str, ci95: tuple[float, float] | None = None) -> str:
    """Format a value with its 95 % interval, such as "54 µm [49, 60]". value, ci95: in `unit`, SI."""
    scale = choose_scale(unit, value)
    scaled_value = value * scale.factor
    interval = None if ci95 is None else (ci95[0] * scale.factor, ci95[1] * scale.factor)
    decimals = _choose_decimals(scaled_value, interval)
    space = "" if scale.unit in ("", "°") else " "
    value_text = f"{_format_number(scaled_value, decimals)}{space}{scale.unit}"
    if interval is None:
        return value_text
    return f"{value_text} [{_format_number(interval[0], decimals)}, {_format_number(interval[1], decimals)}]"


def format_percent(share: float, ci95: tuple[float, float] | None = None) -> str:
    """Format a share (0 to 1) as per cent, with its 95 % interval."""
    formatted_share = format_value(100 * share, "1", None if ci95 is None else (100 * ci95[0], 100 * ci95[1]))
    value_text, bracket, interval_text = formatted_share.partition(" [")
    return f"{value_text} %{bracket}{interval_text}"


def format_error(error: float | None) -> str:
    """Format an error relative to the signal: "14 %", from 1000 % on "12 times", and "unknown" for None."""
    if error is None:
        return "unknown"
    return f"{100 * error:.3g} %" if 100 * error < 1000 else f"{float(f'{error:.3g}'):g} times"


def format_error_of_signal(error: float) -> str:
    """Format an error in words: "14 % of the signal", "12 times the signal"."""
    return f"{format_error(error)} {'the' if 100 * error >= 1000 else 'of the'} signal"


def format_probability(probability: float) -> str:
    """Format a probability with two decimals, or "< 0.01" or "> 0.99" outside that range."""
    if probability < 0.01:
        return "< 0.01"
    return "> 0.99" if probability > 0.99 else f"{probability:.2f}"


def format_share(share: float) -> str:
    """Format a share as per cent with two significant digits; as a whole number from 99.5 % on."""
    return f"{100 * share:.2g} %" if 100 * share < 99.5 else f"{100 * share:.0f} %"


def _choose_decimals(value: float, interval: tuple[float, float] | None) -> int:
    """Choose the number of decimals, at least 0: as many as give half the interval's width one significant digit and
    the value at most `_MOST_DIGITS`; without an interval, or with an empty one, `_USUAL_DIGITS` of the value."""
    order_of_magnitude = np.floor(np.log10(abs(value))) if value else 0.0
    if interval is None or not interval[1] > interval[0]:
        return int(max(0, _USUAL_DIGITS - 1 - order_of_magnitude))
    half_width = (interval[1] - interval[0]) / 2
    # Slightly widened, so that rounding below a power of ten adds no digit.
    decimals = -int(np.floor(np.log10(half_width * 1.0001)))
    return int(np.clip(decimals, 0, max(0, _MOST_DIGITS - 1 - order_of_magnitude)))


def _format_number(value: float, decimals: int) -> str:
    """Format the value with this number of decimals; with up to three significant digits (format "g") for a magnitude
    from 1e6 on or more than five decimals (limits chosen)."""
    if value and (abs(value) >= 1e6 or decimals > 5):
        return typeset(f"{value:.3g}")
    return typeset(f"{value:.{decimals}f}")
