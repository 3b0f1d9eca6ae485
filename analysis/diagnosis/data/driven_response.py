"""Significance test of the multiple coherence between commands and responses: are the responses driven at all?

The coherence at the lines that the commands drive (Bendat and Piersol, Random Data, 4th ed., 7.3) is estimated from K
stretches (the segments of Welch's method) and averaged over the lines. For responses of pure noise and r independent
commands, each line's value follows a beta distribution with the parameters r and K - r. In a short recording the
stretches may be shorter than the device's impulse response, and a slow force that only follows the motion (dry
friction, closed loop) may lie below the noise of the command. A response therefore also counts as driven where past and
present commands predict it in the second half, or where it predicts its command there. Called by `input_checks`.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from analysis.diagnosis.data.observed_parts import cut_part
from analysis.diagnosis.limits import DRIVEN_COHERENCE, DRIVEN_DEVIATIONS
from equalizer.signals.recording import Recording, find_parts
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.signals.spectral_density import hann, transform_windowed

STRETCHES_PER_COMMAND = 12
"""Number of stretches per command channel; K is this times the number of commands. Chosen heuristically, like all
constants here."""
LEAST_LINE_POWER = 0.01
"""Least power of a driven line, relative to the line with the largest power."""
CORRELATED_LINES = 2.0
"""Number of neighbouring lines that carry the information of one, because the Hann window correlates them."""
RANK_TOLERANCE = 1e-6
"""Least singular value of the commands at a line, relative to the largest, that counts towards their rank."""
FILTER_SPAN_SHARE, MAX_TAPS, RIDGE_SHARE = 0.1, 100, 1e-3
"""Span of the predicting filter as a share of the recording, largest number of its coefficients per signal, and ridge
parameter relative to the mean diagonal element of the normal matrix."""


def compute_response_significance(recordings: Sequence[Recording]) -> float | None:
    """Compute the excess coherence of the response channel with the largest mean coherence over that of noise, in
    standard deviations. None where the recordings are too short for a verdict, or where the coherence is not
    significant but a filter predicts a response or a command. recordings: with the same channels and rate; commands
    without gaps."""
    command_spectra, response_spectra = _compute_spectra(recordings)
    if not len(command_spectra):
        return None
    power = (np.abs(command_spectra) ** 2).sum(axis=(0, 2))
    lines = np.flatnonzero(power > LEAST_LINE_POWER * power.max(initial=0.0))
    lines = lines[lines > 0]
    line_results = [
        line_result
        for line in lines
        if (line_result := _compute_coherence(command_spectra[:, line], response_spectra[:, line])) is not None
    ]
    if not line_results:
        return None
    coherence, noise_mean, noise_variance = (np.array(column) for column in zip(*line_results, strict=True))
    mean_deviation = np.sqrt(CORRELATED_LINES * noise_variance.sum()) / len(line_results)
    # Too short: even the coherence of a device that clearly responds would hardly be significant.
    if (DRIVEN_COHERENCE - noise_mean.mean()) / mean_deviation < 2 * DRIVEN_DEVIATIONS:
        return None
    deviations = float(((coherence.mean(axis=0) - noise_mean.mean()) / mean_deviation).max())
    is_significant = deviations >= DRIVEN_DEVIATIONS or not any(_is_predictable(recording) for recording in recordings)
    return deviations if is_significant else None


def _is_predictable(recording: Recording) -> bool:
    """Whether past and present commands predict a response, or responses around a sample predict its command."""
    command, response = recording.command.samples, recording.response.samples
    return _can_predict(response, command, uses_future=False) or _can_predict(command, response, uses_future=True)


def _can_predict(targets: FloatArray, signals: FloatArray, uses_future: bool) -> bool:
    """Whether an FIR filter of signals (n, k), fitted to the first half by ridge regression, explains at least the
    share `DRIVEN_COHERENCE` of the power of a channel of targets (n, c) in the second half. uses_future: half of the
    taps are non-causal, as a derivative needs. False where a half has no complete sample."""
    sample_count = len(targets)
    tap_step = max(int(FILTER_SPAN_SHARE * sample_count) // MAX_TAPS, 1)
    tap_count = min(int(FILTER_SPAN_SHARE * sample_count), MAX_TAPS)
    samples_before, samples_after = (
        ((tap_count - tap_count // 2) * tap_step, tap_count // 2 * tap_step)
        if uses_future
        else (tap_count * tap_step, 0)
    )
    padded = np.pad(signals, ((samples_before, samples_after), (0, 0)), mode="edge" if uses_future else "constant")
    shifted_signals = [padded[tap_count * tap_step - k * tap_step :][:sample_count] for k in range(tap_count)]
    regressors = np.hstack([*shifted_signals, np.ones((sample_count, 1))])
    is_finite = np.isfinite(targets).all(axis=1) & np.isfinite(regressors).all(axis=1)
    first_half = is_finite & (np.arange(sample_count) < sample_count // 2)
    second_half = is_finite & ~first_half
    if not (first_half.any() and second_half.any()):
        return False
    gram = regressors[first_half].T @ regressors[first_half]
    weights = np.linalg.solve(
        gram + RIDGE_SHARE * np.trace(gram) / len(gram) * np.eye(len(gram)),
        regressors[first_half].T @ targets[first_half],
    )
    residual_squares = np.sum((targets[second_half] - regressors[second_half] @ weights) ** 2, axis=0)
    target_power = np.maximum(np.sum((targets[second_half] - targets[first_half].mean(axis=0)) ** 2, axis=0), 1e-300)
    return bool(np.any(residual_squares < (1 - DRIVEN_COHERENCE) * target_power))


def _compute_spectra(recordings: Sequence[Recording]) -> tuple[ComplexArray, ComplexArray]:
    """Compute the spectra (stretches, lines, commands) of the commands and (stretches, lines, responses) of the
    responses; no stretches where each would have fewer than 16 samples, too few lines for a mean. Stretches are as long
    as K of them permit, and none reaches from one part of a recording, where its signals jump, into the next."""
    command_count, response_count = len(recordings[0].command.channels), len(recordings[0].response.channels)
    parts = [cut_part(recording, *span) for recording in recordings for span in find_parts(recording)]
    length = _choose_stretch_length([len(part) for part in parts], STRETCHES_PER_COMMAND * command_count)
    pairs = [pair for part in parts for pair in _transform_stretches(part, length)] if length >= 16 else []
    if not pairs:
        return np.zeros((0, 0, command_count), complex), np.zeros((0, 0, response_count), complex)
    return np.array([u for u, _ in pairs]), np.array([y for _, y in pairs])


def _choose_stretch_length(part_lengths: Sequence[int], stretch_count: int) -> int:
    """Choose the largest length in samples of which the parts contain at least `stretch_count` stretches; 0 where there
    is none."""
    lengths = {part_length // count for part_length in part_lengths for count in range(1, stretch_count + 1)} - {0}
    return max(
        (length for length in lengths if sum(part_length // length for part_length in part_lengths) >= stretch_count),
        default=0,
    )


def _transform_stretches(recording: Recording, length: int) -> Iterator[tuple[ComplexArray, ComplexArray]]:
    """Compute the spectra (lines, channels) of commands and responses per stretch of `length` samples; stretches with
    constant commands or missing responses are left out."""
    window = hann(length)[:, None]
    for start in range(0, len(recording) - length + 1, length):
        commands, responses = (part.samples[start : start + length] for part in (recording.command, recording.response))
        if np.ptp(commands, axis=0).any() and np.isfinite(responses).all():
            yield transform_windowed(commands, window), transform_windowed(responses, window)


def _compute_coherence(commands: ComplexArray, responses: ComplexArray) -> tuple[FloatArray, float, float] | None:
    """Compute the multiple coherence at a line, (p,): share of each response's power that the commands explain; with
    its mean and variance for noise. commands: (stretches, inputs), responses: (stretches, outputs). None where the
    stretches are fewer than one more than twice the rank of the commands, or where a response has no power."""
    basis, singular_values, _ = np.linalg.svd(commands, full_matrices=False)
    basis = basis[:, singular_values > RANK_TOLERANCE * singular_values.max()]
    stretches, rank = basis.shape
    power = (np.abs(responses) ** 2).sum(axis=0)
    if stretches < 2 * rank + 1 or not power.all():
        return None
    coherence = (np.abs(basis.conj().T @ responses) ** 2).sum(axis=0) / power
    noise_mean = rank / stretches
    return coherence, noise_mean, noise_mean * (1 - noise_mean) / (stretches + 1)
