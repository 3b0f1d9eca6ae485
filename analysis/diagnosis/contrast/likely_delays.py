"""Delays and clock rates of the faulty set that cross-correlations of responses and commands suggest.

With the weights of a base fitted to the clean set, errors are e = r - c, r from the responses and c from the commands.
Where the delay spans many oscillations of the signal, the minimum of the error at the true delay is narrower than the
spacing of a grid of delays. The cross-correlation of r and c has its peak there and suggests delays to try.
"""

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from analysis.diagnosis.contrast.autoregressive_base import AutoregressiveBase
from analysis.diagnosis.contrast.compared_base import REACH, ComparedBase, apply_filter
from analysis.diagnosis.contrast.fault import ClockRate
from analysis.diagnosis.contrast.joint_products import weights_of
from analysis.diagnosis.contrast.sensor_base import SensorBase
from analysis.diagnosis.settings import CLOCK_FASTEST, CONTRAST_BLOCKS, LATE_STEP
from equalizer.effects.starts.response_starts import lateness
from equalizer.signals.signal import FloatArray


def likely_delays_s(compared_bases: Sequence[ComparedBase]) -> tuple[float, ...]:
    """Delays in s of the faulty responses behind the commands: per base of the device, the delay by cross-correlation,
    if it is at least one row, and delays up to half a row from it."""
    found = []
    for compared in _bases_of_device(compared_bases):
        late = _rows_late(compared)
        found += [float(late + by) * compared.row_s for by in _offsets_around() if late]
    return tuple(dict.fromkeys(found))


def likely_clock_rates(compared_bases: Sequence[ComparedBase]) -> tuple[ClockRate, ...]:
    """Clock rates at which the delay grows over the faulty set: per base of the device, the most likely rate, if its
    delay at the end is at least one row, and rates whose delays differ from it by up to half a row there."""
    found = []
    for compared in _bases_of_device(compared_bases):
        for runs_on in (True, False) if any(part.start > 0 for part in compared.faulty.parts) else (True,):
            rate, end = _likeliest_rate(compared, runs_on)
            if abs(rate) * end >= 1:
                found += [ClockRate(rate + by / end, LATE_STEP / end, runs_on) for by in _offsets_around()]
    return tuple(found)


def _offsets_around() -> list[float]:
    """Offsets in rows from a likely delay to those that are tried."""
    return [float(by) for by in np.arange(-0.5, 0.51, LATE_STEP)]


def _bases_of_device(compared_bases: Sequence[ComparedBase]) -> list[ComparedBase]:
    return [compared for compared in compared_bases if not isinstance(compared.base, SensorBase)]


def _split_errors(compared: ComparedBase, rows: FloatArray) -> FloatArray:
    """(n, 2): whitened contributions r of the responses and c of the commands to the errors r - c of a part's rows,
    with the weights of the clean set; without `REACH` rows at either end."""
    weights = weights_of(compared.clean.white.T @ compared.clean.white) / compared.columns
    pushed = np.arange(len(weights)) == 0
    if isinstance(compared.base, AutoregressiveBase):
        pushed = compared.base.command_columns(len(weights))
    return apply_filter(compared.whitening, rows @ np.column_stack([weights * ~pushed, -weights * pushed]))[
        REACH:-REACH
    ]


def _rows_late(compared: ComparedBase) -> float:
    """Rows by which the responses lag the commands in the longest part of the faulty set; 0 for less than one row."""
    made = _split_errors(compared, max(compared.faulty.rows, key=len))
    longest = len(made) // 4
    if longest < 1:
        return 0.0
    late = lateness(made[:, [0]], made[:, [1]], longest)
    return late if 1 <= late < longest else 0.0


def _likeliest_rate(compared: ComparedBase, runs_on: bool) -> tuple[float, float]:
    """The relative clock rate along whose delays the cross-correlations of short blocks have the largest sum (a Radon
    transform of their peaks), and the time of the last block, in rows. The rate is 0 where the largest sum is at either
    end of the range."""
    times, correlations = _correlate_blocks(compared, runs_on)
    if not correlations.size:
        return 0.0, 0.0
    end, longest = float(times.max()), correlations.shape[1] // 2
    rates = np.arange(-longest, longest + LATE_STEP, LATE_STEP) / end
    # Readings of a clock that is fast by `rate` show at row t the value of t (1 + rate): they are early.
    at = np.clip(longest - rates[:, None] * times, 0.0, 2 * longest - 1e-9)
    whole = at.astype(np.intp)
    block, beyond = np.arange(len(times)), at - whole
    alike = np.sum((1 - beyond) * correlations[block, whole] + beyond * correlations[block, whole + 1], axis=1)
    best = int(np.argmax(alike))
    return (float(rates[best]) if 0 < best < len(rates) - 1 else 0.0), end


def _correlate_blocks(compared: ComparedBase, runs_on: bool) -> tuple[FloatArray, FloatArray]:
    """Times of blocks (b,) in rows, and correlation coefficients at each lag (b, 2 longest + 1) between the
    contribution of a block's responses and that of all commands of its part. Empty where all parts are too short."""
    before = compared.base.order if isinstance(compared.base, AutoregressiveBase) else 0
    starts = [
        before + (part.start / (part.rate_hz * compared.row_s) if runs_on else 0.0) for part in compared.faulty.parts
    ]
    whole = sum(len(rows) for rows in compared.faulty.rows)
    longest = int(
        CLOCK_FASTEST * max(start + len(rows) for start, rows in zip(starts, compared.faulty.rows, strict=True))
    )
    times: list[float] = []
    found: list[FloatArray] = []
    for start, rows in zip(starts, compared.faulty.rows, strict=True):
        made = _split_errors(compared, rows)
        if len(made) < CONTRAST_BLOCKS or longest < 1:
            continue
        room = next_fast_len(len(made) + longest, True)
        commands, size = rfft(made[:, 1], room).conj(), float(np.linalg.norm(made[:, 1]))
        for block in np.array_split(np.arange(len(made)), max(round(CONTRAST_BLOCKS * len(rows) / whole), 1)):
            responses = np.zeros(len(made))
            responses[block] = made[block, 0]
            alike = irfft(rfft(responses, room) * commands, room)
            times.append(start + REACH + float(block.mean()))
            found.append(
                np.concatenate([alike[room - longest :], alike[: longest + 1]])
                / max(size * float(np.linalg.norm(responses)), 1e-300)
            )
    return np.array(times), np.array(found)
