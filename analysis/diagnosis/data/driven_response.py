"""Test by coherence whether the responses of a recording depend on its commands at all.

The statistic is the multiple coherence at the lines that the commands drive (Bendat and Piersol, Random Data, 4th ed.,
7.3), averaged over K stretches (the segments of Welch's method). For responses of noise and r independent commands it
follows a beta distribution with the parameters r and K - r. Stretches of a short recording may be shorter than the
device's memory, so that a response also counts as driven if the past commands predict it on held-out samples, or if it
predicts its command: with dry friction or under control, a slow force that follows the motion may be hidden below the
command's own noise.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from analysis.diagnosis.settings import ANSWER_COHERENCE, ANSWER_DEVIATIONS
from equalizer.signals.recording import Recording
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.signals.spectral_density import hann

STRETCHES = 12
"""Number of stretches per command. Chosen heuristically, like all constants here."""
LEAST_LINE_POWER = 0.01
"""Least power of a driven line, relative to the strongest line."""
SHARED_BY_WINDOW = 2.0
"""Number of neighbouring lines that count as one independent line, because the Hann window correlates them."""
RANK_TOLERANCE = 1e-6
"""Least singular value of the commands at a line, relative to the largest, that adds to their rank."""
MEMORY, MOST_TAPS, RIDGE = 0.1, 100, 1e-3
"""Share of a recording that the predicting filter spans, most coefficients per command, and ridge parameter."""


def compute_response_significance(recordings: Sequence[Recording]) -> float | None:
    """Excess coherence of the best response channel over that of noise, in standard deviations. None where the
    recordings are too short for a verdict, or where the coherence is not significant but a filter predicts the response
    or its command. recordings: with the same channels and rate; commands without gaps."""
    inputs, outputs = _compute_spectra(recordings)
    if not len(inputs):
        return None
    power = (np.abs(inputs) ** 2).sum(axis=(0, 2))
    lines = np.flatnonzero(power > LEAST_LINE_POWER * power.max(initial=0.0))
    lines = lines[lines > 0]
    coherences = [
        value for line in lines if (value := _compute_coherence(inputs[:, line], outputs[:, line])) is not None
    ]
    if not coherences:
        return None
    coherence, noise_mean, noise_variance = (np.array(column) for column in zip(*coherences, strict=True))
    mean_sd = np.sqrt(SHARED_BY_WINDOW * noise_variance.sum()) / len(coherences)
    # Too short: even the coherence of a device that clearly responds would hardly be significant.
    if (ANSWER_COHERENCE - noise_mean.mean()) / mean_sd < 2 * ANSWER_DEVIATIONS:
        return None
    deviations = float(((coherence.mean(axis=0) - noise_mean.mean()) / mean_sd).max())
    significant = deviations >= ANSWER_DEVIATIONS or not any(_is_predictable(recording) for recording in recordings)
    return deviations if significant else None


def _is_predictable(recording: Recording) -> bool:
    """Whether past commands predict a response, or the responses around a sample predict a command."""
    command, response = recording.command.samples, recording.response.samples
    return _can_predict(response, command, uses_future=False) or _can_predict(command, response, uses_future=True)


def _can_predict(y: FloatArray, signals: FloatArray, uses_future: bool) -> bool:
    """Whether a linear filter of signals (n, k), fitted to the first half, predicts a channel of y (n, c) in the
    second. uses_future: half of the filter lies in the signals' future, as that of a derivative does."""
    n = len(y)
    tap_step = max(int(MEMORY * n) // MOST_TAPS, 1)
    taps = min(int(MEMORY * n), MOST_TAPS)
    samples_before, samples_after = (
        ((taps - taps // 2) * tap_step, taps // 2 * tap_step) if uses_future else (taps * tap_step, 0)
    )
    padded = np.pad(signals, ((samples_before, samples_after), (0, 0)), mode="edge" if uses_future else "constant")
    shifted = [padded[taps * tap_step - k * tap_step :][:n] for k in range(taps)]
    rows = np.hstack([*shifted, np.ones((n, 1))])
    finite = np.isfinite(y).all(axis=1) & np.isfinite(rows).all(axis=1)
    first_half = finite & (np.arange(n) < n // 2)
    gram = rows[first_half].T @ rows[first_half]
    weights = np.linalg.solve(
        gram + RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram)), rows[first_half].T @ y[first_half]
    )
    second_half = finite & ~first_half
    residual_squares = np.sum((y[second_half] - rows[second_half] @ weights) ** 2, axis=0)
    power = np.maximum(np.sum((y[second_half] - y[first_half].mean(axis=0)) ** 2, axis=0), 1e-300)
    return bool(np.any(residual_squares < (1 - ANSWER_COHERENCE) * power))


def _compute_spectra(recordings: Sequence[Recording]) -> tuple[ComplexArray, ComplexArray]:
    """Spectra (stretches, lines, inputs) of the commands and (stretches, lines, outputs) of the responses; empty where
    stretches would have less than 16 samples."""
    inputs, outputs = len(recordings[0].command.channels), len(recordings[0].response.channels)
    length = sum(len(recording) for recording in recordings) // (STRETCHES * inputs)
    pairs = (
        [pair for recording in recordings for pair in _transform_stretches(recording, length)] if length >= 16 else []
    )
    if not pairs:
        return np.zeros((0, 0, inputs), complex), np.zeros((0, 0, outputs), complex)
    return np.array([u for u, _ in pairs]), np.array([y for _, y in pairs])


def _transform_stretches(recording: Recording, length: int) -> Iterator[tuple[ComplexArray, ComplexArray]]:
    """Spectra of commands and responses per stretch, without stretches at rest or with gaps."""
    window = hann(length)[:, None]
    for start in range(0, len(recording) - length + 1, length):
        u, y = (part.samples[start : start + length] for part in (recording.command, recording.response))
        if np.ptp(u, axis=0).any() and np.isfinite(y).all():
            yield _transform_windowed(u, window), _transform_windowed(y, window)


def _transform_windowed(samples: FloatArray, window: FloatArray) -> ComplexArray:
    """(lines, k): windowed spectrum of samples (n, k) about their mean."""
    return np.asarray(np.fft.rfft(window * (samples - samples.mean(axis=0)), axis=0))


def _compute_coherence(u: ComplexArray, y: ComplexArray) -> tuple[FloatArray, float, float] | None:
    """(p,): coherence, the share of each response's power that the commands explain; with its mean and variance for
    noise. u: (stretches, inputs), y: (stretches, outputs). None where too few stretches drive the line."""
    basis, singular_values, _ = np.linalg.svd(u, full_matrices=False)
    basis = basis[:, singular_values > RANK_TOLERANCE * singular_values.max()]
    stretches, rank = basis.shape
    power = (np.abs(y) ** 2).sum(axis=0)
    if stretches < 2 * rank + 1 or not power.all():
        return None
    share = (np.abs(basis.conj().T @ y) ** 2).sum(axis=0) / power
    mean = rank / stretches
    return share, mean, mean * (1 - mean) / (stretches + 1)
