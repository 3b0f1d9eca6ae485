"""Ranks the components (entries) through which a mismatch may enter the device. Called by `localisation`.

A force at an axis, of any cause, moves all channels in the proportions of the model's frequency response; an error of
one sensor appears in its channel alone. The score is the mean over lines of the logarithm of the power that an entry
leaves unexplained. A share of the power summed over lines would be dominated by lines at which the device moves as a
rigid body, where the responses to different entries are nearly parallel.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import stdtr

from analysis.diagnosis.localisation.residual_spectra import ResidualSpectra
from analysis.diagnosis.settings import (
    ENTRY_ANGLE,
    ENTRY_LOUD,
    ENTRY_PER_DIMENSION,
    ENTRY_SENSOR_PENALTY,
    SENSOR_ABSENT,
    SENSOR_LEAST_LINES,
    SENSOR_LOUD,
    SENSOR_PRESENT,
    SENSOR_SHOWN,
)
from equalizer.plant.effect_vocabulary import Place
from equalizer.signals.signal import ComplexArray, FloatArray

_BLOCK_LINES = 8
"""Number of neighbouring (correlated) lines that count as one when two entries are compared."""
_TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True, slots=True)
class SensorRule:
    """Comparison of the position's residual with the motion that follows from the response's residual by integration: a
    force would cause both, so that a residual of the response alone is an error of its sensor."""

    verdict: Literal["response sensor", "motion", "undecided"]
    expected: float
    """Power of the position, in units of its noise, that corresponds to the response's residual as real motion; mean
    over the lines where it exceeds the noise enough to be measured."""
    observed: float
    """Power of the position's residual on these lines, in units of its noise, noise subtracted."""


def compare_sensors(spectra: ResidualSpectra, derivative: int) -> SensorRule | None:
    """Compare position and response: whether a sensor's own error explains their difference. derivative: order of the
    position's time derivative that the response is. None where position and response have different numbers of
    channels."""
    p = spectra.responses
    if spectra.residual.shape[2] != 2 * p:
        return None
    per_position = (2 * np.pi * spectra.frequency_hz) ** (2 * derivative)
    response, position = np.abs(spectra.residual[:, :, :p]) ** 2, np.abs(spectra.residual[:, :, p:]) ** 2
    noise = spectra.noise[:, :, p:]
    motion_power = np.maximum(response - spectra.noise[:, :, :p], 0.0) / per_position[:, None]
    is_informative = (motion_power > SENSOR_SHOWN * noise) & (response > SENSOR_LOUD * spectra.noise[:, :, :p])
    if is_informative.sum() < SENSOR_LEAST_LINES:
        return SensorRule("undecided", 0.0, 0.0)
    expected = float(np.mean((motion_power / noise)[is_informative]))
    observed = float(np.mean(((position - noise) / noise)[is_informative]))
    # Per line, so that a few strong lines do not dominate.
    share = float(np.median(np.clip((position - noise)[is_informative] / motion_power[is_informative], 0, 2)))
    if share < SENSOR_ABSENT:
        return SensorRule("response sensor", expected, observed)
    return SensorRule("motion" if share > SENSOR_PRESENT else "undecided", expected, observed)


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """A component through which a mismatch may enter, and how the channels respond to inputs there."""

    name: str
    place: Place
    axis: str | None
    directions: ComplexArray
    """(lines, channels, k): frequency response of the channels to k independent inputs there; (1, channels, k) where it
    is the same at all lines."""
    of_position: bool = False
    """Whether this is an error of the position sensor."""


@dataclass(frozen=True, slots=True)
class EntryScore:
    """An entry with its score and its test against the best entry."""

    name: str
    place: Place
    axis: str | None
    score: float
    """Mean over lines of log(1 + unexplained power per channel, in units of the noise); lower is better."""
    share: float
    """Median over lines of the explained share of the residual's power beyond noise."""
    p_value: float
    """p-value of explaining as much as the best entry; 1 for the best and for entries equivalent to it."""
    equivalents: tuple[str, ...]
    """Entries that cannot be distinguished from it by these channels."""


@dataclass(frozen=True, slots=True)
class EntryPoint:
    """All entries ranked by what they leave unexplained, and the comparison of position and response."""

    ranking: tuple[EntryScore, ...]
    """Entries, best first."""
    rule: SensorRule | None
    """Result of comparing position and response; None without position."""
    lines: int
    """Number of lines with enough power to count."""


def rank_entries(
    spectra: ResidualSpectra, entries: Sequence[Entry], derivative: Literal[0, 1, 2] | None = 2
) -> EntryPoint:
    """Rank the components through which a mismatch may enter. derivative: order of the position's time derivative that
    the response is, channel by channel (2 = acceleration); None where it is none.

    Raises ValueError where an entry's directions do not fit the lines and channels.
    """
    whitened = spectra.residual / np.sqrt(np.maximum(spectra.noise, _TINY))
    total = np.sum(np.abs(whitened) ** 2, axis=2)
    channels = whitened.shape[2]
    above_noise = total / channels > ENTRY_LOUD
    rule = None if derivative is None else compare_sensors(spectra, derivative)
    if not above_noise.any() or not entries:
        return EntryPoint((), rule, int(above_noise.sum()))
    weights = 1 / np.sqrt(np.maximum(spectra.noise.mean(axis=0), _TINY))
    bases = [_compute_basis(entry, weights) for entry in entries]
    unexplained = [_compute_unexplained_power(whitened, total, basis) for basis in bases]
    log_powers = [
        np.log1p(power / max(channels - basis.shape[2], 1)) for power, basis in zip(unexplained, bases, strict=True)
    ]
    scores = [float(np.mean(log_power[above_noise])) for log_power in log_powers]
    ranked = sorted(
        range(len(entries)), key=lambda k: scores[k] + _compute_penalty(rule, entries[k], bases[k].shape[2])
    )
    best = ranked[0]
    ranking = []
    for k in ranked:
        indistinguishable = tuple(
            entries[j].name for j in ranked if j != k and _compute_mean_sine(bases[j], bases[k]) < ENTRY_ANGLE
        )
        is_best = k == best or entries[best].name in indistinguishable
        p_value = 1.0 if is_best else _test_against_best(log_powers[k], log_powers[best], above_noise)
        explained_shares = 1 - unexplained[k][above_noise] / total[above_noise]
        entry = entries[k]
        share = float(np.median(explained_shares))
        ranking.append(EntryScore(entry.name, entry.place, entry.axis, scores[k], share, p_value, indistinguishable))
    return EntryPoint(tuple(ranking), rule, int(above_noise.sum()))


def _compute_basis(entry: Entry, weights: FloatArray) -> ComplexArray:
    """(lines, channels, k): orthonormal basis of the entry's directions at each line, in units of the noise."""
    lines, channels = weights.shape
    shape = entry.directions.shape
    if entry.directions.ndim != 3 or shape[0] not in (1, lines) or shape[1] != channels:
        raise ValueError(f"the directions of '{entry.name}' must have shape ({lines}, {channels}, k), not {shape}")
    directions = np.broadcast_to(entry.directions, (lines, *shape[1:])) * weights[:, :, None]
    size = np.linalg.norm(directions, axis=1, keepdims=True)
    return np.asarray(np.linalg.qr(directions / np.maximum(size, _TINY))[0], dtype=np.complex128)


def _compute_unexplained_power(whitened: ComplexArray, total: FloatArray, basis: ComplexArray) -> FloatArray:
    """(experiments, lines): power of the whitened residual outside the subspace of the basis."""
    projections = np.einsum("lck,elc->elk", basis.conj(), whitened)
    return np.asarray(np.maximum(total - np.sum(np.abs(projections) ** 2, axis=2), 0.0))


def _compute_penalty(rule: SensorRule | None, entry: Entry, dimensions: int) -> float:
    """Penalty on a score: for more dimensions, and where the comparison of position and response contradicts the
    entry."""
    parsimony = ENTRY_PER_DIMENSION * (dimensions - 1)
    if rule is None or rule.verdict == "undecided":
        return parsimony
    of_response_sensor = entry.place == "sensor" and not entry.of_position
    allowed = of_response_sensor if rule.verdict == "response sensor" else not of_response_sensor
    return parsimony if allowed else parsimony + ENTRY_SENSOR_PENALTY


def _compute_mean_sine(basis: ComplexArray, rival_basis: ComplexArray) -> float:
    """Mean sine of the largest angle between two subspaces; 1 where they have different dimensions."""
    if basis.shape[2] != rival_basis.shape[2]:
        return 1.0
    cosines = np.linalg.svd(np.einsum("lck,lcj->lkj", basis.conj(), rival_basis), compute_uv=False)[:, -1]
    return float(np.mean(np.sqrt(np.maximum(1 - cosines**2, 0.0))))


def _test_against_best(
    log: FloatArray, best: FloatArray, above_noise: np.ndarray[tuple[int, int], np.dtype[np.bool_]]
) -> float:
    """p-value of a one-sided paired t-test against the best entry, over blocks of neighbouring lines above noise."""
    difference = (log - best)[above_noise]
    blocks = len(difference) // _BLOCK_LINES
    if blocks < 3:
        return 1.0
    means = difference[: blocks * _BLOCK_LINES].reshape(blocks, _BLOCK_LINES).mean(axis=1)
    error = float(means.std(ddof=1)) / np.sqrt(blocks)
    return float(stdtr(blocks - 1, -means.mean() / max(error, _TINY)))
