"""Delays and clock rates of the faulty recordings, suggested by cross-correlation, for the search of faults.

A base is a regression model that predicts a signal y from regressors x; a row is one sample (y, x) of it
(`compared_base`). With the weights of a base fitted to the clean set, errors are e = r - c, with r from the responses
and c from the commands. Where the delay spans many oscillations of the signal, the minimum of the error at the true
delay is narrower than the spacing of a grid of delays. The cross-correlation of r and c has its peak there and suggests
delays to try. Called by `rank_faults`.
"""

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from analysis.diagnosis.contrast.autoregressive_base import AutoregressiveBase
from analysis.diagnosis.contrast.compared_base import REACH, ComparedBase, apply_filter
from analysis.diagnosis.contrast.fault import ClockRate
from analysis.diagnosis.contrast.joint_products import solve_residual_weights
from analysis.diagnosis.contrast.sensor_base import SensorBase
from analysis.diagnosis.limits import CONTRAST_BLOCKS, DELAY_STEP, LARGEST_CLOCK_ERROR
from equalizer.effects.starts.response_starts import estimate_lag
from equalizer.signals.signal import FloatArray


def suggest_delays_s(compared_bases: Sequence[ComparedBase]) -> tuple[float, ...]:
    """Suggest delays in s of the faulty responses behind the commands: per base of the device, the delay by
    cross-correlation, if it is at least one row, and delays up to half a row from it."""
    delays_s = []
    for compared in _select_device_bases(compared_bases):
        delay_rows = _estimate_delay_rows(compared)
        delays_s += [float(delay_rows + offset) * compared.step_s for offset in _list_row_offsets() if delay_rows]
    return tuple(dict.fromkeys(delays_s))


def suggest_clock_rates(compared_bases: Sequence[ComparedBase]) -> tuple[ClockRate, ...]:
    """Suggest clock rates at which the delay grows over the faulty set: per base of the device, the most likely rate,
    if its delay at the end is at least one row, and rates whose delays differ from it by up to half a row there."""
    rates = []
    for compared in _select_device_bases(compared_bases):
        for from_file_start in (True, False) if any(part.start > 0 for part in compared.faulty.parts) else (True,):
            rate, last_block_time = _estimate_clock_rate(compared, from_file_start)
            if abs(rate) * last_block_time >= 1:
                rates += [
                    ClockRate(rate + offset / last_block_time, DELAY_STEP / last_block_time, from_file_start)
                    for offset in _list_row_offsets()
                ]
    return tuple(rates)


def _list_row_offsets() -> list[float]:
    """List the offsets in rows, from -0.5 to 0.5, from a likely delay to those that are tried."""
    return [float(offset) for offset in np.arange(-0.5, 0.51, DELAY_STEP)]


def _select_device_bases(compared_bases: Sequence[ComparedBase]) -> list[ComparedBase]:
    """Select the bases with commands: all but those that compare sensors only."""
    return [compared for compared in compared_bases if not isinstance(compared.base, SensorBase)]


def _split_errors(compared: ComparedBase, rows: FloatArray) -> FloatArray:
    """Compute (n, 2): whitened contributions r of the responses and c of the commands to the errors r - c of a part's
    rows, with the weights fitted to the clean set; without `REACH` rows at either end."""
    weights = solve_residual_weights(compared.clean.whitened.T @ compared.clean.whitened) / compared.column_rms
    is_command = np.arange(len(weights)) == 0
    if isinstance(compared.base, AutoregressiveBase):
        is_command = compared.base.mask_command_columns(len(weights))
    return apply_filter(compared.whitening, rows @ np.column_stack([weights * ~is_command, -weights * is_command]))[
        REACH:-REACH
    ]


def _estimate_delay_rows(compared: ComparedBase) -> float:
    """Estimate the number of rows by which the responses lag the commands in the longest part of the faulty set; 0 for
    less than one row, or a quarter of the part or more."""
    contributions = _split_errors(compared, max(compared.faulty.rows, key=len))
    max_lag = len(contributions) // 4
    if max_lag < 1:
        return 0.0
    delay = estimate_lag(contributions[:, [0]], contributions[:, [1]], max_lag)
    return delay if 1 <= delay < max_lag else 0.0


def _estimate_clock_rate(compared: ComparedBase, from_file_start: bool) -> tuple[float, float]:
    """Estimate the relative clock rate along whose delays the cross-correlations of short blocks have the largest sum
    (a Radon transform of their peaks), and the time of the last block, in rows. The rate is 0 where the largest sum is
    at either end of the range. from_file_start: whether the clock's time is counted from the beginning of the file;
    else of each part."""
    block_times, correlations = _correlate_blocks(compared, from_file_start)
    if not correlations.size:
        return 0.0, 0.0
    last_block_time, max_lag = float(block_times.max()), correlations.shape[1] // 2
    rates = np.arange(-max_lag, max_lag + DELAY_STEP, DELAY_STEP) / last_block_time
    # Readings of a clock that is fast by `rate` show at row t the value of t (1 + rate): they are early.
    lags = np.clip(max_lag - rates[:, None] * block_times, 0.0, 2 * max_lag - 1e-9)
    lower_lags = lags.astype(np.intp)
    block, lag_fractions = np.arange(len(block_times)), lags - lower_lags
    correlation_sums = np.sum(
        (1 - lag_fractions) * correlations[block, lower_lags] + lag_fractions * correlations[block, lower_lags + 1],
        axis=1,
    )
    best_index = int(np.argmax(correlation_sums))
    return (float(rates[best_index]) if 0 < best_index < len(rates) - 1 else 0.0), last_block_time


def _correlate_blocks(compared: ComparedBase, from_file_start: bool) -> tuple[FloatArray, FloatArray]:
    """Compute the times of blocks (b,) in rows, and correlation coefficients at each lag (b, 2 max_lag + 1) between the
    contribution of a block's responses and that of all commands of its part. Empty where all parts are too short.
    from_file_start: as in `ClockRate`: whether times are counted from the start of the file, else of each part."""
    past_rows = compared.base.order if isinstance(compared.base, AutoregressiveBase) else 0
    starts = [
        past_rows + (part.start / (part.rate_hz * compared.step_s) if from_file_start else 0.0)
        for part in compared.faulty.parts
    ]
    row_count = sum(len(rows) for rows in compared.faulty.rows)
    max_lag = int(
        LARGEST_CLOCK_ERROR * max(start + len(rows) for start, rows in zip(starts, compared.faulty.rows, strict=True))
    )
    block_times: list[float] = []
    coefficients: list[FloatArray] = []
    for start, rows in zip(starts, compared.faulty.rows, strict=True):
        contributions = _split_errors(compared, rows)
        if len(contributions) < CONTRAST_BLOCKS or max_lag < 1:
            continue
        fft_length = next_fast_len(len(contributions) + max_lag, True)
        command_spectrum, command_norm = (
            rfft(contributions[:, 1], fft_length).conj(),
            float(np.linalg.norm(contributions[:, 1])),
        )
        for block in np.array_split(
            np.arange(len(contributions)), max(round(CONTRAST_BLOCKS * len(rows) / row_count), 1)
        ):
            responses = np.zeros(len(contributions))
            responses[block] = contributions[block, 0]
            correlation = irfft(rfft(responses, fft_length) * command_spectrum, fft_length)
            block_times.append(start + REACH + float(block.mean()))
            coefficients.append(
                np.concatenate([correlation[fft_length - max_lag :], correlation[: max_lag + 1]])
                / max(command_norm * float(np.linalg.norm(responses)), 1e-300)
            )
    return np.array(block_times), np.array(coefficients)
