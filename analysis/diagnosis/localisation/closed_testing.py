"""Many tests at once: false discoveries are controlled family by family, and only below what was found.

Families nest (channel, then band, then cell). A family's own p-value is Simes' of its members. Members of a family are
looked at only where the family was found, at a level lowered by the share of families that were
(Benjamini and Bogomolov 2014).
"""

from collections.abc import Hashable, Sequence

import numpy as np
from statsmodels.stats.multitest import multipletests

from equalizer.signals.signal import FloatArray


def closed_adjusted(p_values: FloatArray, families: Sequence[tuple[Hashable, ...]], level: float) -> FloatArray:
    """Adjusted p-values (tests,): found are those up to `level`.

    families: one path per test, widest family first; paths of equal length. The test is the last, innermost member.
    """
    if len(p_values) == 0:
        return p_values.copy()
    adjusted = np.zeros(len(p_values))
    _descend(np.asarray(p_values), families, np.arange(len(p_values)), (0, 1.0, level), adjusted)
    return np.minimum(adjusted, 1.0)


def _descend(
    p_values: FloatArray,
    families: Sequence[tuple[Hashable, ...]],
    members: np.ndarray[tuple[int], np.dtype[np.intp]],
    at: tuple[int, float, float],
    adjusted: FloatArray,
) -> None:
    """at: depth, factor that the level was lowered by, level. Writes the largest p-value along each path."""
    depth, factor, level = at
    if depth == len(families[int(members[0])]):
        adjusted[members] = np.maximum(adjusted[members], factor * _benjamini_hochberg(p_values[members]))
        return
    groups: dict[Hashable, list[int]] = {}
    for member in members:
        groups.setdefault(families[int(member)][depth], []).append(int(member))
    within = [np.array(group) for group in groups.values()]
    simes = np.array([_benjamini_hochberg(p_values[group]).min() for group in within])
    own = factor * _benjamini_hochberg(simes)
    found = int(np.sum(own <= level))
    for group, p_value in zip(within, own, strict=True):
        adjusted[group] = np.maximum(adjusted[group], p_value)
        if p_value <= level:
            _descend(p_values, families, group, (depth + 1, factor * len(within) / found, level), adjusted)
        else:
            adjusted[group] = np.maximum(adjusted[group], p_values[group])


def _benjamini_hochberg(p_values: FloatArray) -> FloatArray:
    return np.asarray(multipletests(p_values, method="fdr_bh")[1], dtype=np.float64)
