"""Sample rate of time stamps that are uniform apart from skipped rows and the rounding of their last decimal.

A logger writes each stamp rounded to a decimal place, and may skip a row now and then. `fit_uniform_rate` finds the
rate f and the integers k_i with t_i - t_0 = k_i / f up to a tolerance; where there are none, stamps are not uniform.
"""

import numpy as np
import numpy.typing as npt

from study.importing.expressions.functions import Value

IntArray = npt.NDArray[np.int64]
"""Array of 64-bit integers."""

GRID_TOLERANCE = 0.02
"""Tolerance for uniform stamps: largest deviation from the grid, as a fraction of a step. Chosen."""
MAX_SKIPPED_SHARE = 0.02
"""Largest fraction of rows that a uniform logger skips; if more steps are long, stamps were rounded instead.
Chosen."""
_MAX_DECIMALS = 6
"""Largest number of decimals of a time stamp that are looked for, in the unit of the file: a microsecond where that is
the second. Chosen."""
_BINARY_TOLERANCE = 1e-3
"""Tolerance, in units of the last decimal, for the rounding of binary numbers: a small difference of large stamps is
not an exact decimal. Chosen."""
_MAX_INDEX = 2**62
"""Largest sample index, far above the samples of any recording: a wrong stamp may lie beyond the 64-bit integers."""
_ROUNDED_DIGITS = (4, 5, 6)
"""Significant digits to which a rate is rounded before it is tried as the exact one, the fewest first. Chosen."""


def fit_uniform_rate(stamps_s: Value, unit_s: float) -> tuple[float, IntArray | None]:
    """Fit the rate (Hz) and the sample index of each stamp (n,); 0 and None for stamps that are not uniform. There must
    be two stamps or more, and they must increase.

    Two estimates are tried: the mean rate, which is right where no row is missing, and the rate of the median step,
    which is right where some are. Each is first rounded to a few digits (1000 for 1000.0003). unit_s: unit of the last
    decimal place of the stamps (s); 0 where it is unknown.
    """
    elapsed_s = stamps_s - stamps_s[0]
    mean_hz = (len(stamps_s) - 1) / float(elapsed_s[-1])
    median_hz = 1 / float(np.median(np.diff(stamps_s)))
    for estimate_hz in (mean_hz, median_hz):
        for rate_hz in (*(float(f"{estimate_hz:.{digits}g}") for digits in _ROUNDED_DIGITS), estimate_hz):
            sample_index = np.round(elapsed_s * rate_hz)
            deviation = np.max(np.abs(elapsed_s * rate_hz - sample_index))
            index_steps = np.diff(sample_index)
            if (
                deviation <= GRID_TOLERANCE
                and (index_steps >= 1).all()
                and np.mean(index_steps > 1) <= MAX_SKIPPED_SHARE
            ):
                return rate_hz, np.minimum(sample_index, _MAX_INDEX).astype(np.int64)
    rate_hz = _estimate_rounded_rate(elapsed_s, unit_s)
    return rate_hz, np.arange(len(stamps_s)) if rate_hz else None


def _estimate_rounded_rate(elapsed_s: Value, unit_s: float) -> float:
    """Estimate the rate (Hz) of stamps without a gap that are uniform apart from rounding to their last decimal place;
    else 0. elapsed_s: (n,), time since the first stamp.

    Rounding moves a stamp by at most half a unit of that place, so deviations from the grid must lie within one unit.
    Among rates whose deviations are nearly as small as those of the mean rate, that with the fewest digits is taken.
    Otherwise the rate of the median step is taken where stamps wander slowly: single steps differ from it by one unit
    of a fine decimal, and no stamp deviates by half a step.
    """
    decimal_steps = np.round(np.diff(elapsed_s) / unit_s) if unit_s else np.zeros(1)
    if decimal_steps.min() < 1 or _has_skipped_rows(decimal_steps):
        return 0.0
    sample_index = np.arange(len(elapsed_s))
    mean_hz = (len(elapsed_s) - 1) / float(elapsed_s[-1])
    max_spread = float(np.ptp(elapsed_s * mean_hz - sample_index)) + GRID_TOLERANCE
    for rate_hz in (*(float(f"{mean_hz:.{digits}g}") for digits in range(1, max(_ROUNDED_DIGITS) + 1)), mean_hz):
        if np.ptp(elapsed_s * rate_hz - sample_index) <= min(unit_s * rate_hz * (1 + _BINARY_TOLERANCE), max_spread):
            return rate_hz
    median_hz = 1 / float(np.sort(decimal_steps)[len(decimal_steps) // 2] * unit_s)
    deviation, unit_samples = elapsed_s * median_hz - sample_index, unit_s * median_hz * (1 + _BINARY_TOLERANCE)
    is_wandering = (
        unit_samples <= GRID_TOLERANCE * (1 + _BINARY_TOLERANCE) and np.max(np.abs(np.diff(deviation))) <= unit_samples
    )
    is_wandering = is_wandering and np.max(np.abs(deviation)) < 0.5
    return median_hz if is_wandering else 0.0


def _has_skipped_rows(decimal_steps: Value) -> bool:
    """Whether rows may have been skipped: all steps are multiples of the shortest (or equal), and no more are longer
    than `MAX_SKIPPED_SHARE` allows, plus three standard deviations of a Poisson count and one. decimal_steps: (n - 1,),
    steps in units of the last decimal."""
    expected_count = MAX_SKIPPED_SHARE * len(decimal_steps)
    skipped_count = np.count_nonzero(decimal_steps > decimal_steps.min())
    return not (decimal_steps % decimal_steps.min()).any() and bool(
        skipped_count <= expected_count + 3 * np.sqrt(expected_count) + 1
    )


def find_decimal_unit(stamps: Value) -> float:
    """Find the unit of the last decimal place of the stamps, such as 0.001, in their unit; 0 with more than
    `_MAX_DECIMALS` decimals."""
    for digits in range(_MAX_DECIMALS + 1):
        scaled_stamps = stamps * 10**digits
        if (np.abs(scaled_stamps - np.round(scaled_stamps)) <= _BINARY_TOLERANCE).all():
            return float(10**-digits)
    return 0.0
