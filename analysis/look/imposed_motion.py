"""Tell whether a motion was imposed and a force measured, or a force given and a motion measured: what was commanded
follows a law of its own.

Testing machines, shakers and drives move by ramps and sines. Of both the speed squared is a quadratic in the position:
v^2 = p + q x + r x^2, with r = q = 0 for ramps of either direction and r = -w^2 for a sine. It is fitted in stretches
of a few half cycles, so that amplitudes and rates may change. A random command, and the answer of a device that has
mass, friction or a nonlinear force, does not follow it. Pure computation on samples.
"""

import numpy as np

from equalizer.signals.signal import FloatArray

_BLOCKS = 32
"""Means per half cycle: noise is averaged, corners stay sharp."""
_HALF_CYCLES = 4
"""Length, in half cycles, of the stretches in which the motion is compared with ramps or sinusoids."""
_REVERSAL = 0.1
"""A turn counts as the end of a half cycle from this fraction of the range on."""
_KEPT = 0.7
"""Fraction of the samples between the corners of ramps and trapezoids."""
_RESTS = 0.1
"""Share of the usual speed squared below which it rests, as between the ramps of a trapezoid."""
FOLLOWS = 0.1
"""Misfit below which a signal follows a law; a random one leaves about a quarter."""
CLEARLY = 3.0
"""Ratio of misfits from which one of two signals is the command."""


def is_imposed(motion: FloatArray, force: FloatArray) -> bool:
    """Whether the motion (n,), not the force (n,), follows a law of ramps or sines."""
    for ramps in (True, False):
        of_motion, of_force = law_misfit(motion, ramps=ramps), law_misfit(force, ramps=ramps)
        if of_motion < FOLLOWS and of_force > max(FOLLOWS / 2, CLEARLY * of_motion):
            return True
    return False


def law_misfit(values: FloatArray, *, ramps: bool = False) -> float:
    """Median share of the speed squared that ramps and sines leave, or ramps alone; 0 for steps, 1 where nothing can be
    told."""
    known = np.isfinite(values)
    if known.sum() < 2 * _BLOCKS or not np.ptp(values[known]) > 0:
        return 1.0
    filled = np.interp(np.arange(len(values)), np.flatnonzero(known), values[known])
    filled = (filled - filled.mean()) / np.ptp(filled)
    if np.mean(np.diff(filled) == 0) > _KEPT and len(np.unique(filled)) < len(filled) / _BLOCKS:
        return 0.0
    half_cycles = _half_cycles(filled)
    size = max(len(filled) // (half_cycles * _BLOCKS), 1)
    means = filled[: len(filled) // size * size].reshape(-1, size).mean(axis=1)
    length = _HALF_CYCLES * _BLOCKS
    starts = range(0, max(len(means) - length // 2, 1), length)
    return float(np.median([_misfit(means[start : start + length], 1 if ramps else 3) for start in starts]))


def _half_cycles(values: FloatArray) -> int:
    """Number of turns by more than a fraction of the range, and one."""
    count, rising, extreme = 1, bool(values[len(values) // 2] > values[0]), float(values[0])
    for value in values.tolist():
        if (value > extreme) == rising:
            extreme = value
        elif abs(value - extreme) > _REVERSAL:
            count, rising, extreme = count + 1, not rising, value
    return count


def _misfit(values: FloatArray, count: int) -> float:
    """Error of a fit of one stretch (m,) by a number of terms; the samples that fit worst, at corners, are left out."""
    if len(values) < _BLOCKS // 2:
        return 1.0
    squared = ((values[4:] - values[:-4]) / 4) ** 2
    moves = squared > _RESTS * np.quantile(squared, 0.9)
    at, squared = values[2:-2][moves], squared[moves]
    if len(at) < _BLOCKS // 4:
        return 1.0
    terms = np.stack([np.ones_like(at), at, at**2], axis=1)[:, :count]
    kept = np.full(len(at), True)
    for _ in range(3):
        found = np.linalg.lstsq(terms[kept], squared[kept], rcond=None)[0]
        residual = np.abs(squared - terms @ found)
        kept = residual <= np.quantile(residual, _KEPT)
    scale = float(np.mean(squared))
    return float(np.mean(residual[kept])) / scale if scale > 0 else 0.0
