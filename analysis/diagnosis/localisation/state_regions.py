"""Test the dependence of a residual on a state variable: where it is large, and whether its mean follows the state.

State variables are position, velocity, command, response and time. Samples are sorted into bins of the state; tested
are the power per bin (size) and the mean per bin (sign) against permutations of blocks of samples within a segment
(`block_permutation`), because neighbouring samples are correlated.
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
_BIN_COUNT = 12
"""Number of bins of a state, with equally many samples each as far as equal values allow. Chosen."""
PERMUTATIONS = 60
"""Number of permutations of blocks. Chosen: p-values below about ten over it are those of a fitted tail."""
_LEAST_SAMPLES_PER_BIN = 10
"""Least number of samples per bin, on average, for a test. Chosen."""
_LEAST_CONCENTRATION = 1.5
"""Least ratio of a bin's mean square to the expected one, for the bin to belong to a region. Chosen."""
_LEAST_SHARE = 0.05
"""Share of the power that bin means must explain at least. Chosen."""
_SMALLEST_NORMAL = np.finfo(np.float64).tiny
"""Smallest normal number, against divisions by zero."""
_LEAST_EXPECTED = 1e-9
"""Least expected power of a bin, relative to the mean; bins below it, such as those at rest, are not tested. Chosen."""
_LEAST_OPPOSITE_SHARE = 1 / 3
"""Least ratio of the smaller to the larger of two opposite half means, for a dependence by the sign. Chosen."""
MIDDLE_REGION_PHRASE = "at middling"
"""First words of the text for a region with neither small nor large magnitudes of velocity, command or response."""
_DISPLAY_UNITS = {"m": ("mm", 1e3), "rad": ("deg", 180 / np.pi)}
"""Units in which positions are written, with the factor from SI."""


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """A state variable over all samples, such as speed or position, on which a residual may depend."""

    kind: StateKind
    symbol: str
    """Symbol in the result, such as "v" or "fx"."""
    unit: str
    values: FloatArray
    """(n,), in `unit`."""


@dataclass(frozen=True, slots=True, eq=False)
class Disturbance:
    """A residual, or the force that would explain it."""

    values: FloatArray
    """(n,), NaN where missing."""
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
    sample_share: float
    """Share of the samples in the region; 1 for sign."""
    p_value: float
    description: str
    """Text for `Mismatch.state`, such as "near v = 0"."""


def find_state_regions(
    disturbance: Disturbance, states: Sequence[State], seed: int, permutations: int = PERMUTATIONS
) -> tuple[StateRegion, ...]:
    """Find regions with a concentration of at least `_LEAST_CONCENTRATION`, or with bin means that explain
    `_LEAST_SHARE` of the power, ordered by p-value, then by falling share. Empty with fewer than
    `_LEAST_SAMPLES_PER_BIN`, or for a disturbance of zeros. p-values are of single tests, by block permutation within
    segments, and not compared with a limit here; they depend on the seed.

    The size is tested for every state (over the magnitude of velocity, command and response), the sign for position and
    velocity only. Time is tested only with `Disturbance.signal`.

    Raises ValueError where a state has another length than the disturbance.
    """
    for state in states:
        if state.values.shape != disturbance.values.shape:
            raise ValueError(f"{state.symbol} has shape {state.values.shape}, not {disturbance.values.shape}")
    is_used = (disturbance.strata >= 0) & np.isfinite(disturbance.values)
    if is_used.sum() < _LEAST_SAMPLES_PER_BIN * _BIN_COUNT or not disturbance.values[is_used].any():
        return ()
    used_indices = np.flatnonzero(is_used)[np.argsort(disturbance.strata[is_used], kind="stable")]
    values, strata = disturbance.values[used_indices], disturbance.strata[used_indices]
    generator = np.random.default_rng(seed)
    block_samples = compute_block_length(values)
    regions: list[StateRegion] = []
    motion_states = [(state, state.values[used_indices]) for state in states if state.kind != "time"]
    if motion_states:
        expected_power = _compute_stratum_mean_square(values, strata)
        regions += _test_states(
            _Sample(values, expected_power, strata, block_samples, is_constant=True),
            motion_states,
            permutations,
            generator,
        )
    time_states = [(state, _locate_in_stratum(strata)) for state in states if state.kind == "time"]
    if time_states and disturbance.signal is not None:
        signal_power = disturbance.signal[used_indices] ** 2
        power_share = _compute_stratum_mean_square(values, strata) / np.maximum(
            _compute_stratum_mean_square(disturbance.signal[used_indices], strata), _SMALLEST_NORMAL
        )
        time_sample = _Sample(values, power_share * signal_power, strata, block_samples, is_constant=False)
        regions += _test_states(time_sample, time_states, permutations, generator)
    return tuple(sorted(regions, key=lambda region: (region.p_value, -region.share)))


@dataclass(frozen=True, slots=True, eq=False)
class _Sample:
    """The used samples of a disturbance, sorted by stratum, as (n,) arrays."""

    values: FloatArray
    expected: FloatArray
    """Expected mean square of each sample if it did not depend on the state."""
    strata: IntArray
    block_samples: int
    """Length of a block of permuted samples, in samples."""
    is_constant: bool
    """Whether `expected` is constant within each stratum, so that permutation does not change it."""


def _test_states(
    sample: _Sample, states: Sequence[tuple[State, FloatArray]], permutations: int, generator: np.random.Generator
) -> list[StateRegion]:
    """Find the regions of all states, from one set of permutations. states: with their values at the used samples."""
    size_bins = [_assign_equal_bins(np.abs(values) if _uses_magnitude(state) else values) for state, values in states]
    sign_bins = [_assign_equal_bins(values) for state, values in states if _has_sign(state)]
    total_power, counts = float(np.sum(sample.values**2)), [np.bincount(labels) for labels in sign_bins]
    constant_expected = [_sum_by_bin(labels, sample.expected) for labels in size_bins] if sample.is_constant else []

    def compute_statistics(order: IntArray) -> FloatArray:
        permuted_values = sample.values[order]
        power = permuted_values**2
        expected_sums = constant_expected or [_sum_by_bin(labels, sample.expected[order]) for labels in size_bins]
        size_statistics = [
            _compute_unevenness(_sum_by_bin(labels, power), expected)
            for labels, expected in zip(size_bins, expected_sums, strict=True)
        ]
        sign_statistics = [
            float(np.sum(_sum_by_bin(labels, permuted_values) ** 2 / count)) / total_power
            for labels, count in zip(sign_bins, counts, strict=True)
        ]
        return np.array(size_statistics + sign_statistics)

    p_values = compute_permutation_p_values(
        compute_statistics, sample.strata, sample.block_samples, permutations, generator
    )
    regions = []
    for (state, values), bins, p_value in zip(states, size_bins, p_values, strict=False):
        region = _find_region(state, values, bins, sample)
        if region is not None:
            share, coverage, description = region
            regions.append(StateRegion(state.kind, state.symbol, "size", share, coverage, float(p_value), description))
    sign_states = [state for state, _ in states if _has_sign(state)]
    for state, bins, p_value in zip(sign_states, sign_bins, p_values[len(states) :], strict=True):
        means = _sum_by_bin(bins, sample.values) / np.bincount(bins)
        share = float(np.sum(np.bincount(bins) * means**2)) / total_power
        if share >= _LEAST_SHARE:
            description = describe_dependence(state.symbol, means)
            regions.append(StateRegion(state.kind, state.symbol, "sign", share, 1.0, float(p_value), description))
    return regions


def _find_region(state: State, values: FloatArray, bins: IntArray, sample: _Sample) -> tuple[float, float, str] | None:
    """Find `share`, `sample_share` and `description` of a `StateRegion`: the adjacent bins of at least
    `_LEAST_CONCENTRATION` that contain the largest; None where no bin reaches it."""
    power = sample.values**2
    is_one_stratum = bool((sample.strata == sample.strata[0]).all())
    expected_power = _sum_by_bin(bins, sample.expected)
    power_ratio = _sum_by_bin(bins, power) / np.maximum(
        expected_power, max(_LEAST_EXPECTED * float(expected_power.mean()), _SMALLEST_NORMAL)
    )
    peak_bin = int(np.argmax(power_ratio))
    if power_ratio[peak_bin] < _LEAST_CONCENTRATION:
        return None
    first_bin = last_bin = peak_bin
    while first_bin > 0 and power_ratio[first_bin - 1] >= _LEAST_CONCENTRATION:
        first_bin -= 1
    while last_bin < len(power_ratio) - 1 and power_ratio[last_bin + 1] >= _LEAST_CONCENTRATION:
        last_bin += 1
    is_in_region = (bins >= first_bin) & (bins <= last_bin)
    share = float(power[is_in_region].sum() / max(float(power.sum()), _SMALLEST_NORMAL))
    centre = float(np.average(values[is_in_region], weights=power[is_in_region]))
    description = describe_region(
        state.kind, state.symbol, state.unit, (first_bin, last_bin, len(power_ratio)), centre, is_one_stratum
    )
    return share, float(np.mean(is_in_region)), description


def _compute_unevenness(observed: FloatArray, expected: FloatArray) -> float:
    """Compute the chi-squared statistic of bin powers against the expected ones, over the total power; 0 without
    power."""
    total_power = float(expected.sum())
    is_populated = expected > _LEAST_EXPECTED * total_power / len(expected)
    return (
        float(np.sum((observed - expected)[is_populated] ** 2 / expected[is_populated])) / total_power
        if total_power > _SMALLEST_NORMAL
        else 0.0
    )


def _locate_in_stratum(strata: IntArray) -> FloatArray:
    """Compute (n,): relative position of each sample in its stratum, from 0 to below 1. strata: (n,), sorted."""
    _, first, stratum_index, length = np.unique(strata, return_index=True, return_inverse=True, return_counts=True)
    return np.asarray((np.arange(len(strata)) - first[stratum_index]) / length[stratum_index], dtype=np.float64)


def _sum_by_bin(bins: IntArray, weights: FloatArray) -> FloatArray:
    """Compute (bins,): sum of the weights in each bin."""
    return np.asarray(np.bincount(bins, weights), dtype=np.float64)


def _compute_stratum_mean_square(values: FloatArray, strata: IntArray) -> FloatArray:
    """Compute (n,): mean square of the values in the stratum of each sample."""
    _, stratum_indices = np.unique(strata, return_inverse=True)
    mean = _sum_by_bin(stratum_indices, values**2) / np.bincount(stratum_indices)
    return np.asarray(mean[stratum_indices], dtype=np.float64)


def _assign_equal_bins(values: FloatArray) -> IntArray:
    """Assign bin numbers (n,) to values (n,), in bins of equal count as far as equal values allow."""
    edges = np.unique(np.quantile(values, np.linspace(0, 1, _BIN_COUNT + 1)[1:-1]))
    return np.unique(np.searchsorted(edges, values, side="right"), return_inverse=True)[1].astype(np.int64)


def _uses_magnitude(state: State) -> bool:
    """Whether the size is tested over the state's magnitude, because zero has a meaning (rest, no command)."""
    return state.kind in ("velocity", "command", "response")


def _has_sign(state: State) -> bool:
    """Whether the mean of the disturbance per bin is tested, too: whether its sign follows the state."""
    return state.kind in ("position", "velocity")


def describe_region(
    kind: str, symbol: str, unit: str, bins: tuple[int, int, int], centre: float, is_one_stratum: bool
) -> str:
    """Describe a region of the state, such as "near x = 12 mm". bins: its first and last bin, and the number of all
    bins. centre: mean of the state in the region, weighted by the mismatch's power, in `unit`. is_one_stratum: whether
    all samples are of one segment."""
    first_bin, last_bin, bin_count = bins
    is_lowest, is_highest = first_bin == 0, last_bin == bin_count - 1
    if kind == "time":
        phrase = "midway through" if is_lowest == is_highest else "late in" if is_highest else "early in"
        return f"{phrase} {'the record' if is_one_stratum else 'each segment'}"
    if kind == "position":
        display_unit, display_factor = _DISPLAY_UNITS.get(unit, (unit, 1.0))
        return f"near {symbol} = {typeset(f'{centre * display_factor:.2g}')} {display_unit}".rstrip()
    if is_lowest and not is_highest:
        return f"near {symbol} = 0" if kind == "velocity" else f"where |{symbol}| is small"
    return f"where |{symbol}| is large" if is_highest else f"{MIDDLE_REGION_PHRASE} |{symbol}|"


def describe_dependence(symbol: str, means: FloatArray) -> str:
    """Describe the trend of the bin means: by the sign of the state where the means of the lower and the upper half
    have opposite signs and similar magnitudes (`_LEAST_OPPOSITE_SHARE`), else depending on it. means: over bins of
    equal count, in the order of the state."""
    lower_mean, upper_mean = means[: len(means) // 2].mean(), means[len(means) // 2 :].mean()
    largest_magnitude = max(abs(lower_mean), abs(upper_mean))
    if (
        largest_magnitude > 0
        and lower_mean * upper_mean < 0
        and min(abs(lower_mean), abs(upper_mean)) > _LEAST_OPPOSITE_SHARE * largest_magnitude
    ):
        return f"by the sign of {symbol}"
    return f"depending on {symbol}"
