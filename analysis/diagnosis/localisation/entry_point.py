"""Localise a fault by subspace projection: rank the components (entries) by how well they explain residual spectra.

A force at an axis, of any cause, moves all channels in the proportions of the model's frequency response; an error of
one sensor appears in its channel alone. At each line, the residual in units of the noise is projected onto the subspace
of an entry. The score is the mean over lines of the logarithm of 1 plus the power outside that subspace: a sum of power
over lines would be dominated by lines at which the device moves as a rigid body, where the responses to different
entries are nearly parallel.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import stdtr

from analysis.diagnosis.limits import (
    ENTRY_DIRECTION_SINE,
    ENTRY_LINE_POWER_RATIO,
    ENTRY_PER_DIMENSION,
    ENTRY_SENSOR_PENALTY,
    SENSOR_ABSENT_SHARE,
    SENSOR_CHANGE_POWER_RATIO,
    SENSOR_LEAST_LINES,
    SENSOR_LINE_POWER_RATIO,
    SENSOR_PRESENT_SHARE,
)
from analysis.diagnosis.localisation.residual_spectra import ResidualSpectra
from equalizer.plant.effect_vocabulary import Place
from equalizer.signals.signal import ComplexArray, FloatArray

_BLOCK_LINES = 8
"""Number of neighbouring (correlated) lines that count as one when two entries are compared. Chosen."""
_FEWEST_BLOCKS = 3
"""Fewest blocks of such lines for a test. Chosen."""
_TINY = np.finfo(np.float64).tiny
"""Smallest positive normal number: lower limit of divisors."""


@dataclass(frozen=True, slots=True)
class SensorComparison:
    """Result of comparing the position's residual with the motion that the response's residual implies by integration.
    A force would cause both, so that a residual of the response alone is an error of its sensor."""

    verdict: Literal["response sensor", "motion", "undecided"]
    expected: float
    """Power of the position, over its noise power, that the response's residual implies if it is real motion; mean over
    the lines where it exceeds the noise (`SENSOR_CHANGE_POWER_RATIO`, `SENSOR_LINE_POWER_RATIO`). 0 on fewer than
    `SENSOR_LEAST_LINES` such lines."""
    observed: float
    """Power of the position's residual on these lines, over its noise power, noise subtracted; 0 on fewer than
    `SENSOR_LEAST_LINES` lines."""


def compare_sensors(spectra: ResidualSpectra, derivative: int) -> SensorComparison | None:
    """Test whether the response's residual is real motion or an error of the response sensor. derivative: order of the
    time derivative of the position that the response is. None unless the spectra have one position channel per
    response channel."""
    response_count = spectra.responses
    if spectra.residual.shape[2] != 2 * response_count:
        return None
    derivative_power_gain = (2 * np.pi * spectra.frequency_hz) ** (2 * derivative)
    residual_power = np.abs(spectra.residual) ** 2
    response_power, position_power = residual_power[:, :, :response_count], residual_power[:, :, response_count:]
    response_noise, position_noise = spectra.noise[:, :, :response_count], spectra.noise[:, :, response_count:]
    motion_power = np.maximum(response_power - response_noise, 0.0) / derivative_power_gain[:, None]
    is_informative = (motion_power > SENSOR_CHANGE_POWER_RATIO * position_noise) & (
        response_power > SENSOR_LINE_POWER_RATIO * response_noise
    )
    if is_informative.sum() < SENSOR_LEAST_LINES:
        return SensorComparison("undecided", 0.0, 0.0)
    expected = float(np.mean((motion_power / position_noise)[is_informative]))
    observed = float(np.mean(((position_power - position_noise) / position_noise)[is_informative]))
    # Median over lines, so that a few strong lines do not dominate; ratios are limited to 0 .. 2, about the expected 1.
    motion_share = float(
        np.median(np.clip((position_power - position_noise)[is_informative] / motion_power[is_informative], 0, 2))
    )
    if motion_share < SENSOR_ABSENT_SHARE:
        return SensorComparison("response sensor", expected, observed)
    return SensorComparison("motion" if motion_share > SENSOR_PRESENT_SHARE else "undecided", expected, observed)


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """A component through which a mismatch may enter the model, and the response of the channels to an input there."""

    name: str
    place: Place
    axis: str | None
    directions: ComplexArray
    """(lines, channels, k): frequency response of the channels to k independent inputs at the component; (1, channels,
    k) where it is the same at all lines."""
    is_position_error: bool = False
    """Whether this is an error of the position sensor."""


@dataclass(frozen=True, slots=True)
class EntryScore:
    """Score of an entry, and its significance test against the best entry. Lines: those above the noise."""

    name: str
    place: Place
    axis: str | None
    score: float
    """Mean over lines of log(1 + unexplained power over noise power, per dimension outside the subspace); lower is
    better."""
    share: float
    """Median over lines of the share of the residual's power that the entry explains, noise included."""
    p_value: float
    """p-value of the hypothesis that the entry explains as much as the best; 1 for the best, for entries equivalent to
    it, and where there are too few lines for a test."""
    equivalents: tuple[str, ...]
    """Names of the entries whose subspaces nearly coincide with this one in these channels."""
    is_position_error: bool = False
    """As that of `Entry`."""


@dataclass(frozen=True, slots=True)
class EntryPoint:
    """All entries ranked by unexplained power, and the comparison of position and response."""

    ranking: tuple[EntryScore, ...]
    """Entries by rising score plus penalty, the best first; empty without entries or lines above the noise."""
    sensor_comparison: SensorComparison | None
    """Result of comparing position and response; None where they could not be compared (`compare_sensors`)."""
    lines: int
    """Number of lines above the noise, over all experiments."""


def rank_entries(
    spectra: ResidualSpectra, entries: Sequence[Entry], derivative: Literal[0, 1, 2] | None = 2
) -> EntryPoint:
    """Rank the components through which a mismatch may enter. derivative: order of the time derivative of the position
    that every response is (2 = acceleration); None where the responses are no such derivative.

    Raises ValueError where there are lines above the noise and an entry's directions have the wrong shape.
    """
    whitened_residual = spectra.residual / np.sqrt(np.maximum(spectra.noise, _TINY))
    total_power = np.sum(np.abs(whitened_residual) ** 2, axis=2)
    channel_count = whitened_residual.shape[2]
    is_above_noise = total_power / channel_count > ENTRY_LINE_POWER_RATIO
    sensor_comparison = None if derivative is None else compare_sensors(spectra, derivative)
    if not is_above_noise.any() or not entries:
        return EntryPoint((), sensor_comparison, int(is_above_noise.sum()))
    weights = 1 / np.sqrt(np.maximum(spectra.noise.mean(axis=0), _TINY))
    bases = [_compute_basis(entry, weights) for entry in entries]
    unexplained_powers = [_compute_unexplained_power(whitened_residual, total_power, basis) for basis in bases]
    log_powers = [
        np.log1p(power / max(channel_count - basis.shape[2], 1))
        for power, basis in zip(unexplained_powers, bases, strict=True)
    ]
    scores = [float(np.mean(log_power[is_above_noise])) for log_power in log_powers]
    ranked = sorted(
        range(len(entries)),
        key=lambda index: scores[index] + _compute_penalty(sensor_comparison, entries[index], bases[index].shape[2]),
    )
    best_index = ranked[0]
    ranking = []
    for index in ranked:
        equivalents = tuple(
            entries[rival_index].name
            for rival_index in ranked
            if rival_index != index and _compute_mean_sine(bases[rival_index], bases[index]) < ENTRY_DIRECTION_SINE
        )
        is_best = index == best_index or entries[best_index].name in equivalents
        p_value = 1.0 if is_best else _test_against_best(log_powers[index], log_powers[best_index], is_above_noise)
        explained_shares = 1 - unexplained_powers[index][is_above_noise] / total_power[is_above_noise]
        entry = entries[index]
        share = float(np.median(explained_shares))
        place = entry.name, entry.place, entry.axis
        ranking.append(
            EntryScore(*place, scores[index], share, p_value, equivalents, is_position_error=entry.is_position_error)
        )
    return EntryPoint(tuple(ranking), sensor_comparison, int(is_above_noise.sum()))


def _compute_basis(entry: Entry, weights: FloatArray) -> ComplexArray:
    """Compute (lines, channels, k): orthonormal basis of the entry's directions at each line, in units of the noise.
    weights: (lines, channels), 1 / rms noise. Raises ValueError where the directions have another shape."""
    line_count, channel_count = weights.shape
    shape = entry.directions.shape
    if entry.directions.ndim != 3 or shape[0] not in (1, line_count) or shape[1] != channel_count:
        raise ValueError(
            f"the directions of '{entry.name}' must have shape ({line_count}, {channel_count}, k), not {shape}"
        )
    directions = np.broadcast_to(entry.directions, (line_count, *shape[1:])) * weights[:, :, None]
    norms = np.linalg.norm(directions, axis=1, keepdims=True)
    return np.asarray(np.linalg.qr(directions / np.maximum(norms, _TINY))[0], dtype=np.complex128)


def _compute_unexplained_power(
    whitened_residual: ComplexArray, total_power: FloatArray, basis: ComplexArray
) -> FloatArray:
    """Compute (experiments, lines): power of the whitened residual outside the subspace of the basis."""
    projections = np.einsum("lck,elc->elk", basis.conj(), whitened_residual)
    return np.asarray(np.maximum(total_power - np.sum(np.abs(projections) ** 2, axis=2), 0.0))


def _compute_penalty(comparison: SensorComparison | None, entry: Entry, dimension_count: int) -> float:
    """Compute the penalty of an entry's score: for each dimension beyond the first, and for a contradiction to the
    comparison of position and response."""
    dimension_penalty = ENTRY_PER_DIMENSION * (dimension_count - 1)
    if comparison is None or comparison.verdict == "undecided":
        return dimension_penalty
    is_response_sensor = entry.place == "sensor" and not entry.is_position_error
    is_consistent = is_response_sensor if comparison.verdict == "response sensor" else not is_response_sensor
    return dimension_penalty if is_consistent else dimension_penalty + ENTRY_SENSOR_PENALTY


def _compute_mean_sine(basis: ComplexArray, rival_basis: ComplexArray) -> float:
    """Compute the mean over lines of the sine of the largest principal angle between two subspaces; 1 where they have
    different dimensions."""
    if basis.shape[2] != rival_basis.shape[2]:
        return 1.0
    cosines = np.linalg.svd(np.einsum("lck,lcj->lkj", basis.conj(), rival_basis), compute_uv=False)[:, -1]
    return float(np.mean(np.sqrt(np.maximum(1 - cosines**2, 0.0))))


def _test_against_best(
    log_power: FloatArray, best_log_power: FloatArray, is_above_noise: np.ndarray[tuple[int, int], np.dtype[np.bool_]]
) -> float:
    """Compute the p-value of a one-sided paired t-test against the best entry, over blocks of neighbouring lines above
    the noise; 1 for fewer than `_FEWEST_BLOCKS`."""
    difference = (log_power - best_log_power)[is_above_noise]
    block_count = len(difference) // _BLOCK_LINES
    if block_count < _FEWEST_BLOCKS:
        return 1.0
    block_means = difference[: block_count * _BLOCK_LINES].reshape(block_count, _BLOCK_LINES).mean(axis=1)
    standard_error = float(block_means.std(ddof=1)) / np.sqrt(block_count)
    return float(stdtr(block_count - 1, -block_means.mean() / max(standard_error, _TINY)))
