"""Isolated samples that no motion can have, such as spikes of a sensor or lost samples, and their interpolation.

A sample is isolated if the readings around it follow a cubic polynomial without it: its studentised residual (Belsley,
Kuh and Welsch 1980, Regression Diagnostics, ch. 2) is significant among all samples (Bonferroni), and neither a step
nor a kink, as impacts and dry friction cause, fits as well. Up to `MOST_IN_WINDOW` samples of a window are tested
together. Not changed are readings that repeat their predecessor, because a logger repeats for lost samples and a
diagnosis names that, steps of a quantised reading, and neighbours that deviate to the same side, as in a short slip.

Only positions and velocities are changed: inertia keeps them from such samples. An acceleration or a force may have
them, at an impact. At a low sample rate, a motion may have them soon after a jump of a command; without a time axis,
samples need not follow each other. Neither is changed.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import BoolArray, FloatArray, Signal

HALF_WINDOW = 8
"""Number of samples on either side of a tested sample; near an end the window is shifted. Chosen, like the degree, the
block and the numbers below."""
DEGREE = 3
MOST_IN_WINDOW = 3
"""Largest number of isolated samples in a window."""
MOST_PASSES = 4
"""Largest number of passes: samples close to those of the last pass are found in the next."""
BLOCK_SAMPLES = 64
"""Number of samples whose median residual gives the usual size of residuals; the largest of three blocks counts."""
ROUNDING = 1e-9
"""Step between readings over the largest reading, up to which it counts as a rounding error."""
JUMP_RATIO = 20.0
"""Ratio of a command's change to the mean change around it, above which it counts as a jump: fewer than a tenth of the
samples, or much larger than the others."""
SIGNIFICANCE = 0.01
"""Probability, over all samples of a channel with Gaussian noise, that any sample is changed."""
CHANGED_QUANTITIES = frozenset(
    ["position", "displacement", "angle", "velocity", "speed", "angular velocity", "angular speed"]
)
"""Quantities in which isolated samples are replaced."""

_WINDOW = np.arange(-HALF_WINDOW, HALF_WINDOW + 1)
_POLYNOMIAL = np.linalg.qr(np.polynomial.legendre.legvander(_WINDOW / HALF_WINDOW, DEGREE))[0]
_IDENTITY = np.eye(len(_WINDOW))
_DELETED_RESIDUALS = (_IDENTITY - _POLYNOMIAL @ _POLYNOMIAL.T) / (1 - np.sum(_POLYNOMIAL**2, axis=1))[:, None]
"""Matrix from the samples of a window to the residual of each from the polynomial through the others."""


def interpolate_isolated_samples(recording: Recording) -> tuple[Recording, str]:
    """Interpolate isolated samples in the responses and positions of a recording; returns it, and a sentence on what
    was changed or "". Commands are not changed."""
    if not recording.is_timed or len(recording) < 2 * BLOCK_SAMPLES:
        return recording, ""
    texts: list[str] = []
    is_kept = _mark_after_jumps(recording)
    response = _interpolate_signal(recording.response, is_kept, texts)
    position = None if recording.position is None else _interpolate_signal(recording.position, is_kept, texts)
    if not texts:
        return recording, ""
    remark = (
        f"Isolated samples that no motion can have, such as spikes of a sensor or lost samples, were replaced by "
        f"interpolated values: {', '.join(texts)}."
    )
    return replace(recording, response=response, position=position), remark


def interpolate_all(
    recordings: Sequence[Recording], names: Sequence[str] = ()
) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """Interpolate the isolated samples of several recordings; returns them, and a sentence for each that was changed,
    with its name where there are several. names: empty = recording 1, recording 2 and so on."""
    names = names or [f"recording {number}" for number in range(1, len(recordings) + 1)]
    changes = [interpolate_isolated_samples(recording) for recording in recordings]
    return tuple(recording for recording, _ in changes), tuple(
        text if len(recordings) == 1 else f"{name}: {text}"
        for name, (_, text) in zip(names, changes, strict=True)
        if text
    )


def _mark_after_jumps(recording: Recording) -> BoolArray:
    """Mark the samples (n,) that may be the immediate response to a jump of a command: up to `HALF_WINDOW` after it,
    with the jump itself where the command is not held."""
    width = min(3 * BLOCK_SAMPLES, len(recording))
    reach = np.ones(HALF_WINDOW + 1)
    reach[0] = recording.hold is not Hold.ZERO_ORDER
    is_marked = np.zeros(len(recording), dtype=np.bool_)
    for command in recording.command.samples.T:
        changes = np.nan_to_num(np.abs(np.diff(command, prepend=command[:1])))
        is_jump = changes > JUMP_RATIO * np.convolve(changes, np.full(width, 1 / width), "same")
        is_marked |= np.convolve(is_jump, reach)[: len(recording)] > 0
    return is_marked


def _interpolate_signal(signal: Signal, is_kept: BoolArray, texts: list[str]) -> Signal:
    """Interpolate the isolated samples of each channel but those in the mask `is_kept` (n,); appends a text for each
    channel that was changed to `texts`."""
    samples, is_changed = np.array(signal.samples), False
    for index, (channel, quantity) in enumerate(zip(signal.channels, signal.quantities, strict=True)):
        if quantity not in CHANGED_QUANTITIES:
            continue
        values = np.where(is_kept, samples[:, index], replace_isolated_samples(samples[:, index]))
        count = int(np.sum(np.isfinite(values) & (values != samples[:, index])))
        if count:
            texts.append(f"{count} of {channel} ({100 * count / len(samples):.2g} %)")
            samples[:, index] = values
            is_changed = True
    return replace(signal, samples=samples) if is_changed else signal


def replace_isolated_samples(samples: FloatArray) -> FloatArray:
    """Replace the isolated samples of one channel (n,) by the polynomial through their neighbours. NaN is a missing
    sample; samples less than `HALF_WINDOW` from one are not tested."""
    # Imported on demand, to shorten the start of the program.
    from scipy.special import stdtrit

    values = np.array(samples, dtype=np.float64)
    if np.isfinite(values).sum() < 2 * BLOCK_SAMPLES:
        return values
    freedom = len(_WINDOW) - DEGREE - 1 - MOST_IN_WINDOW
    limit = -float(stdtrit(freedom, SIGNIFICANCE / 2 / len(values)))  # quantile of Student's distribution
    for _ in range(MOST_PASSES):
        deviations = _find_deviations(values, limit)
        if not deviations.any():
            break
        values -= deviations
    return values


def _find_deviations(values: FloatArray, limit: float) -> FloatArray:
    """Find the deviations (n,) of isolated samples, zero at all others. limit: of studentised residuals."""
    residuals, deviations = _compute_residuals(values), np.zeros(len(values))
    usual_sizes = _compute_usual_sizes(values, residuals)
    sizes = np.nan_to_num(np.abs(residuals))
    neighbour_sizes = np.lib.stride_tricks.sliding_window_view(np.pad(sizes, 1), 3).max(axis=1)
    for index in np.flatnonzero((sizes > limit * usual_sizes) & (sizes == neighbour_sizes)).tolist():
        start = min(max(index - HALF_WINDOW, 0), len(values) - len(_WINDOW))
        window = slice(start, start + len(_WINDOW))
        window_deviations = _fit_isolated(values[window], index - start, float(usual_sizes[index]), limit)
        deviations[window] = np.where(window_deviations != 0, window_deviations, deviations[window])
    return deviations


def _compute_residuals(values: FloatArray) -> FloatArray:
    """Compute each sample's residual from the polynomial through the others of its window, (n,); NaN where a sample of
    the window is missing."""
    residuals = np.empty(len(values))
    residuals[HALF_WINDOW:-HALF_WINDOW] = np.correlate(values, _DELETED_RESIDUALS[HALF_WINDOW], "valid")
    residuals[:HALF_WINDOW] = _DELETED_RESIDUALS[:HALF_WINDOW] @ values[: len(_WINDOW)]
    residuals[-HALF_WINDOW:] = _DELETED_RESIDUALS[-HALF_WINDOW:] @ values[-len(_WINDOW) :]
    return residuals


def _compute_usual_sizes(values: FloatArray, residuals: FloatArray) -> FloatArray:
    """Compute the usual size of residuals around each sample, (n,): 1.4826 times the median magnitude (the standard
    deviation of Gaussian ones), and at least the smallest step between readings. Among readings that mostly repeat,
    as those of an encoder at low speed, it is at least the median step there: computed from several encoders, or
    rounded, readings have steps that are much smaller than most."""
    step_blocks = _split_into_blocks(np.abs(np.diff(values, prepend=values[:1])))
    is_step = step_blocks > ROUNDING * np.nanmax(np.abs(values))
    smallest_step = float(np.min(step_blocks, where=is_step, initial=np.inf))
    repeats = is_step.sum(axis=1) < np.isfinite(step_blocks).sum(axis=1) / 2
    steps_between_repeats = step_blocks[repeats][is_step[repeats]]
    blocks = _split_into_blocks(np.abs(residuals))
    known = np.isfinite(blocks).any(axis=1)
    sizes = np.full(len(blocks), smallest_step)
    sizes[known] = np.fmax(smallest_step, 1.4826 * np.nanmedian(blocks[known], axis=1))
    if len(steps_between_repeats):
        sizes[repeats] = np.maximum(sizes[repeats], np.median(steps_between_repeats))
    largest = np.lib.stride_tricks.sliding_window_view(np.pad(sizes, 1), 3).max(axis=1)
    return np.repeat(largest, BLOCK_SAMPLES)[: len(residuals)]


def _split_into_blocks(values: FloatArray) -> FloatArray:
    """Split values (n,) into blocks (blocks, `BLOCK_SAMPLES`), the last filled with NaN."""
    padded = np.pad(values, (0, -len(values) % BLOCK_SAMPLES), constant_values=np.nan)
    return padded.reshape(-1, BLOCK_SAMPLES)


def _fit_isolated(samples: FloatArray, place: int, usual_size: float, limit: float) -> FloatArray:
    """Fit the sample at a place of a window, and up to `MOST_IN_WINDOW` - 1 others, as isolated. Returns their
    deviations, (window,), zero at all other samples, and everywhere if these samples are not isolated."""
    chosen, is_isolated, all_deviations = [place], False, np.zeros(len(samples))
    while samples[place] != samples[max(place - 1, 0)] and not is_isolated and len(chosen) <= MOST_IN_WINDOW:
        columns = np.column_stack([_POLYNOMIAL, _IDENTITY[:, chosen]])
        inverse_gram = np.linalg.inv(columns.T @ columns)
        solution = inverse_gram @ columns.T @ samples
        residual, deviations = samples - columns @ solution, solution[DEGREE + 1 :]
        size = max(float(np.linalg.norm(residual)) / np.sqrt(len(samples) - columns.shape[1]), usual_size)
        least_deviations = limit * size * np.sqrt(np.diag(inverse_gram)[DEGREE + 1 :])
        is_isolated = bool(np.all(np.abs(deviations) > least_deviations))
        all_deviations = np.asarray(deviations @ _IDENTITY[chosen])
        is_isolated = is_isolated and not np.any(all_deviations[1:] * all_deviations[:-1] > 0)
        is_isolated = is_isolated and not _fits_discontinuity(samples, chosen, float(np.linalg.norm(residual)))
        if not is_isolated:
            freedom = np.maximum(1 - np.sum((columns @ inverse_gram) * columns, axis=1), 1e-9)
            freedom[chosen] = np.inf
            chosen.append(int(np.argmax(np.abs(residual) / np.sqrt(freedom))))
    return all_deviations if is_isolated else np.zeros(len(samples))


def _fits_discontinuity(samples: FloatArray, chosen: Sequence[int], error: float) -> bool:
    """Whether a step or a kink at or beside the first of the samples `chosen` fits a window as well as that sample as
    an isolated one, but for rounding. error: norm of the residual of the latter fit, with all samples `chosen`."""
    positions = np.arange(len(samples)) - chosen[0]
    steps = [np.heaviside(positions - place, 1.0) for place in (-0.5, 0.5)]
    kinks = [np.maximum(positions - place, 0.0) for place in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    others = np.column_stack([_POLYNOMIAL, _IDENTITY[:, chosen[1:]]])
    largest_error = error + ROUNDING * float(np.abs(samples).max())
    for shape in (*steps, *kinks):
        columns = np.column_stack([others, shape])
        residual = samples - columns @ np.linalg.lstsq(columns, samples, rcond=None)[0]
        if float(np.linalg.norm(residual)) <= largest_error:
            return True
    return False
