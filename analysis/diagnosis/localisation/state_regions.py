"""Dependence of a residual on a state variable: where it is large, and whether its mean follows the state.

State variables are position, velocity, command, response and time. Samples are sorted into bins of the state; tested
are the power per bin (size) and the mean per bin (sign) against permutations of blocks of samples within a segment
(`block_permutation`), because neighbouring samples are correlated. Called by `state_dependence`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.diagnosis.localisation.block_permutation import (
    IntArray,
    compute_block_length,
    compute_permutation_p_values,
)
from analysis.wording import typeset
from equalizer.signals.signal import FloatArray

StateKind = Literal["position", "velocity", "command", "response", "time"]
_BINS = 12
"""Number of bins of a state, with equally many samples each."""
PERMUTATIONS = 60
"""Number of permutations of blocks."""
_LEAST_CONCENTRATION = 1.5
"""Least ratio of a bin's mean square to the expected one, for the bin to belong to a region."""
_LEAST_SHARE = 0.05
"""Least share of the power that bin means must explain."""
_TINY = np.finfo(np.float64).tiny
_LEAST_EXPECTED = 1e-9
"""Least expected power of a bin, relative to the mean; bins below it, such as those at rest, are not tested."""
MIDDLE_PHRASE = "at middling"
"""First words of the text for a region with neither small nor large values of a state."""
_READABLE = {"m": ("mm", 1e3), "rad": ("deg", 180 / np.pi)}


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A state variable over all samples, such as speed or position, on which a residual may depend."""

    kind: StateKind
    symbol: str
    """Symbol in the result: "v", "x", "fx", "ax", "t"."""
    unit: str
    values: FloatArray
    """(n,)"""


@dataclass(frozen=True, slots=True, eq=False)
class Disturbance:
    """A residual, or the force that would explain it."""

    values: FloatArray
    """(n,)"""
    strata: IntArray
    """(n,): number of the condition or segment; -1 = not used. Conditions differ in what is driven and at which level,
    so samples are compared within them only."""
    signal: FloatArray | None = None
    """(n,): the signal that contains the disturbance. Needed for the state "time", for which the test is whether the
    disturbance's share of the signal's power changes."""


@dataclass(frozen=True, slots=True)
class StateRegion:
    """A region of a state variable in which the residual is large, or whose sign it follows, with the p-value."""

    kind: StateKind
    symbol: str
    criterion: Literal["size", "sign"]
    """size: the mismatch is larger in the region; sign: its mean follows the state."""
    share: float
    """Share of the mismatch's power: inside the region (size), or explained by the bin means (sign)."""
    occupied: float
    """Share of the samples in the region; 1 for sign."""
    p_value: float
    words: str
    """Text for `Mismatch.state`: "near v = 0"."""


def find_state_regions(
    disturbance: Disturbance, states: Sequence[State], seed: int, permutations: int = PERMUTATIONS
) -> tuple[StateRegion, ...]:
    """Regions with a concentration of at least `_LEAST_CONCENTRATION`, or with bin means that explain `_LEAST_SHARE` of
    the power: the smallest p-value first, then the largest share. p-values are of single tests, by block permutation
    within segments, and not compared with a limit here; they depend on the seed in their third digit.

    The size is tested for every state (over the magnitude of velocity, command and response), the sign for position and
    velocity only.

    Raises ValueError where a state has another length than the disturbance.
    """
    for state in states:
        if state.values.shape != disturbance.values.shape:
            raise ValueError(f"{state.symbol} has shape {state.values.shape}, not {disturbance.values.shape}")
    is_used = (disturbance.strata >= 0) & np.isfinite(disturbance.values)
    if is_used.sum() < 10 * _BINS or not disturbance.values[is_used].any():
        return ()
    used = np.flatnonzero(is_used)[np.argsort(disturbance.strata[is_used], kind="stable")]
    values, strata = disturbance.values[used], disturbance.strata[used]
    random = np.random.default_rng(seed)
    block = compute_block_length(values)
    regions: list[StateRegion] = []
    motion_states = [(state, state.values[used]) for state in states if state.kind != "time"]
    if motion_states:
        expected = _mean_square_by_stratum(values, strata)
        regions += _test_states(
            _Sample(values, expected, strata, block, is_constant=True), motion_states, permutations, random
        )
    times = [(state, _locate_in_stratum(strata)) for state in states if state.kind == "time"]
    if times and disturbance.signal is not None:
        signal = disturbance.signal[used] ** 2
        share = _mean_square_by_stratum(values, strata) / np.maximum(
            _mean_square_by_stratum(disturbance.signal[used], strata), _TINY
        )
        driven = _Sample(values, share * signal, strata, block, is_constant=False)
        regions += _test_states(driven, times, permutations, random)
    return tuple(sorted(regions, key=lambda region: (region.p_value, -region.share)))


@dataclass(frozen=True, slots=True, eq=False)
class _Sample:
    """The used samples of a disturbance, sorted by stratum, as (n,) arrays."""

    values: FloatArray
    expected: FloatArray
    """Expected mean square of each sample if it did not depend on the state."""
    strata: IntArray
    block: int
    """Length of a block of permuted samples."""
    is_constant: bool
    """Whether `expected` is constant within each stratum, so that permutation does not change it."""


def _test_states(
    sample: _Sample, states: Sequence[tuple[State, FloatArray]], permutations: int, random: np.random.Generator
) -> list[StateRegion]:
    """Regions of all states, from one set of permutations. states: with their values at the used samples."""
    by_size = [_assign_equal_bins(np.abs(values) if _uses_magnitude(state) else values) for state, values in states]
    by_sign = [_assign_equal_bins(values) for state, values in states if _has_sign(state)]
    total, counts = float(np.sum(sample.values**2)), [np.bincount(labels) for labels in by_sign]
    constant_expected = [_sum_by_bin(labels, sample.expected) for labels in by_size] if sample.is_constant else []

    def statistics(order: IntArray) -> FloatArray:
        permuted = sample.values[order]
        power = permuted**2
        expected_sums = constant_expected or [_sum_by_bin(labels, sample.expected[order]) for labels in by_size]
        sizes = [
            _compute_unevenness(_sum_by_bin(labels, power), expected)
            for labels, expected in zip(by_size, expected_sums, strict=True)
        ]
        signs = [
            float(np.sum(_sum_by_bin(labels, permuted) ** 2 / count)) / total
            for labels, count in zip(by_sign, counts, strict=True)
        ]
        return np.array(sizes + signs)

    p_values = compute_permutation_p_values(statistics, sample.strata, sample.block, permutations, random)
    regions = []
    for (state, values), bins, p_value in zip(states, by_size, p_values, strict=False):
        region = _find_region(state, values, bins, sample)
        if region is not None:
            share, occupied, words = region
            regions.append(StateRegion(state.kind, state.symbol, "size", share, occupied, float(p_value), words))
    signed = [state for state, _ in states if _has_sign(state)]
    for state, bins, p_value in zip(signed, by_sign, p_values[len(states) :], strict=True):
        means = _sum_by_bin(bins, sample.values) / np.bincount(bins)
        share = float(np.sum(np.bincount(bins) * means**2)) / total
        if share >= _LEAST_SHARE:
            words = describe_dependence(state.symbol, means)
            regions.append(StateRegion(state.kind, state.symbol, "sign", share, 1.0, float(p_value), words))
    return regions


def _find_region(state: State, values: FloatArray, bins: IntArray, sample: _Sample) -> tuple[float, float, str] | None:
    """`share`, `occupied` and `words` of a `StateRegion`: the adjacent bins of at least `_LEAST_CONCENTRATION` that
    contain the largest; None where no bin reaches it."""
    power = sample.values**2
    one_stratum = bool((sample.strata == sample.strata[0]).all())
    expected = _sum_by_bin(bins, sample.expected)
    ratio = _sum_by_bin(bins, power) / np.maximum(expected, max(_LEAST_EXPECTED * float(expected.mean()), _TINY))
    top = int(np.argmax(ratio))
    if ratio[top] < _LEAST_CONCENTRATION:
        return None
    first = last = top
    while first > 0 and ratio[first - 1] >= _LEAST_CONCENTRATION:
        first -= 1
    while last < len(ratio) - 1 and ratio[last + 1] >= _LEAST_CONCENTRATION:
        last += 1
    in_region = (bins >= first) & (bins <= last)
    share = float(power[in_region].sum() / max(float(power.sum()), _TINY))
    centre = float(np.average(values[in_region], weights=power[in_region]))
    words = describe_region(state.kind, state.symbol, state.unit, (first, last, len(ratio)), centre, one_stratum)
    return share, float(np.mean(in_region)), words


def _compute_unevenness(observed: FloatArray, expected: FloatArray) -> float:
    """Chi-squared statistic of bin powers against the expected ones, over the total power."""
    total = float(expected.sum())
    populated = expected > _LEAST_EXPECTED * total / len(expected)
    return float(np.sum((observed - expected)[populated] ** 2 / expected[populated])) / total if total > _TINY else 0.0


def _locate_in_stratum(strata: IntArray) -> FloatArray:
    """(n,): relative position of each sample in its stratum, 0 to 1. strata: (n,), sorted."""
    _, first, number, length = np.unique(strata, return_index=True, return_inverse=True, return_counts=True)
    return np.asarray((np.arange(len(strata)) - first[number]) / length[number], dtype=np.float64)


def _sum_by_bin(bins: IntArray, weights: FloatArray) -> FloatArray:
    """(bins,): sum of the weights in each bin."""
    return np.asarray(np.bincount(bins, weights), dtype=np.float64)


def _mean_square_by_stratum(values: FloatArray, strata: IntArray) -> FloatArray:
    """(n,): mean square of the values in the stratum of each sample."""
    _, numbers = np.unique(strata, return_inverse=True)
    mean = _sum_by_bin(numbers, values**2) / np.bincount(numbers)
    return np.asarray(mean[numbers], dtype=np.float64)


def _assign_equal_bins(values: FloatArray) -> IntArray:
    """(n,): bin numbers of values (n,), in bins of equal count as far as equal values allow."""
    edges = np.unique(np.quantile(values, np.linspace(0, 1, _BINS + 1)[1:-1]))
    return np.unique(np.searchsorted(edges, values, side="right"), return_inverse=True)[1].astype(np.int64)


def _uses_magnitude(state: State) -> bool:
    """Whether the size is tested over the state's magnitude, because zero has a meaning (rest, no command)."""
    return state.kind in ("velocity", "command", "response")


def _has_sign(state: State) -> bool:
    """Whether the mean of the disturbance per bin is tested, too."""
    return state.kind in ("position", "velocity")


def describe_region(
    kind: str, symbol: str, unit: str, bins: tuple[int, int, int], centre: float, one_stratum: bool
) -> str:
    """Words for a region of the state, such as "near x = 12 mm". bins: first and last of it, and the number of all.
    centre: mean state of the mismatch in it."""
    first, last, count = bins
    is_lowest, is_highest = first == 0, last == count - 1
    if kind == "time":
        phrase = "midway through" if is_lowest == is_highest else "late in" if is_highest else "early in"
        return f"{phrase} {'the record' if one_stratum else 'each segment'}"
    if kind == "position":
        display_unit, factor = _READABLE.get(unit, (unit, 1.0))
        return f"near {symbol} = {typeset(f'{centre * factor:.2g}')} {display_unit}".rstrip()
    if is_lowest and not is_highest:
        return f"near {symbol} = 0" if kind == "velocity" else f"where |{symbol}| is small"
    return f"where |{symbol}| is large" if is_highest else f"{MIDDLE_PHRASE} |{symbol}|"


def describe_dependence(symbol: str, means: FloatArray) -> str:
    """Words for the trend of the bin means: by the sign of the state where their sign changes, else depending on it.
    means: over bins of equal count, in the order of the state."""
    lower, upper = means[: len(means) // 2].mean(), means[len(means) // 2 :].mean()
    largest = max(abs(lower), abs(upper))
    if largest > 0 and lower * upper < 0 and min(abs(lower), abs(upper)) > largest / 3:
        return f"by the sign of {symbol}"
    return f"depending on {symbol}"
