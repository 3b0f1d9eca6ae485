"""Base model by autoregression (ARX; Ljung, System Identification, 2nd ed., section 4.2): each response is predicted
from the past of all responses y and of all commands u,

    y_i(t) = sum over k = 1..n of a_k' y(t - k) + sum over k = 0..n of b_k' u(t - k) + c + e(t).

It also describes devices that no force balance does: voltages as responses, many modes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.motion import filter_band_pass
from analysis.diagnosis.contrast.recording_part import Part
from analysis.diagnosis.limits import RESPONSE_BAND_SHARE, RESPONSE_OVERSAMPLED
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class AutoregressiveBase:
    """The model of a single response. Rows: its second difference, then the past of all responses and commands, and 1.

    The past of the responses is given as y(t - 1), its first difference, and second differences up to lag n - 2, which
    span the same space as y(t - 1) to y(t - n): products of successive smooth readings are nearly equal, so that small
    errors would be lost to rounding.
    """

    channel: int
    """The response that is predicted."""
    order: int
    """n: number of past samples of responses and commands that predict, in decimated samples; at least 2."""
    step: int
    """Decimation step, after a low pass."""
    response_count: int
    """Number of response channels."""

    def build_rows(
        self, parts: Sequence[Part], reusable_rows: tuple[FloatArray, ...] | None = None
    ) -> tuple[FloatArray, ...]:
        """Build the rows of each part, (n, 1 + columns): predicted value and regressors of each decimated sample from
        index `order` on. reusable_rows: not used."""
        return tuple(self._build_part_rows(part) for part in parts)

    def mask_command_columns(self, width: int) -> Mask:
        """Mask (width,) of the columns of rows that are made from commands. width: 1 + number of regressors."""
        return (np.arange(width) > self.order * self.response_count) & (np.arange(width) < width - 1)

    def mask_valid_samples(self, parts: Sequence[Part]) -> tuple[Mask, ...]:
        """Per part (n,): mask of the rows whose own and past samples are known, without the first two and last two. A
        sample that was lost between those that decimation keeps is interpolated and low-passed with its neighbours, and
        does not count as lost."""
        masks = []
        for part in parts:
            is_known = part.known[:: self.step]
            # A row reaches back over `order` samples; two more are a margin next to gaps and ends.
            invalid = np.convolve(~is_known, np.ones(self.order + 3))[: len(is_known)] > 0
            invalid[: self.order + 2] = True
            invalid[len(invalid) - 2 :] = True
            masks.append(~invalid[self.order :])
        return tuple(masks)

    def _build_part_rows(self, part: Part) -> FloatArray:
        """Build the rows of one part, as `build_rows`."""
        response, command = (decimate(samples, part.rate_hz, self.step) for samples in (part.response, part.command))
        row_count = max(len(response) - self.order, 0)
        first_difference = np.diff(response, axis=0, prepend=response[:1])
        second_difference = np.diff(first_difference, axis=0, prepend=first_difference[:1])

        def select_lag(samples: FloatArray, lag: int) -> FloatArray:
            return samples[self.order - lag : self.order - lag + row_count]

        response_columns = [select_lag(second_difference, lag) for lag in range(1, self.order - 1)]
        command_columns = [select_lag(command, lag) for lag in range(self.order + 1)]
        predicted = select_lag(second_difference[:, [self.channel]], 0)
        return np.hstack(
            [
                predicted,
                select_lag(response, 1),
                select_lag(first_difference, 1),
                *response_columns,
                *command_columns,
                np.ones((row_count, 1)),
            ]
        )

    def reconstruct_response(self, rows: FloatArray) -> FloatArray:
        """Recover the response (n,) from rows: second difference + previous value + previous difference."""
        return np.asarray(rows[:, 0] + rows[:, 1 + self.channel] + rows[:, 1 + self.response_count + self.channel])


def decimate(samples: FloatArray, rate_hz: float, step: int) -> FloatArray:
    """Low-pass filter samples (n, k) to 0.4 times the new rate, below its half (anti-aliasing), then keep every
    `step`-th one."""
    return samples if step == 1 else filter_band_pass(samples, rate_hz, 0.4 * rate_hz / step, 0.0)[::step]


def choose_decimation_step(parts: Sequence[Part]) -> int:
    """Choose the decimation step that keeps the band of the fastest response. This band ends where the cumulative power
    above the noise floor reaches the share `RESPONSE_BAND_SHARE`; the floor is the median power of the upper quarter of
    the spectrum."""
    band_ends_hz = []
    for part in parts:
        line_hz = part.rate_hz / len(part.response)
        power = np.abs(np.fft.rfft(part.response - part.response.mean(axis=0), axis=0)) ** 2
        for column in power.T:
            noise_floor = float(np.median(column[3 * len(column) // 4 :]))
            cumulative_power = np.cumsum(np.maximum(column - noise_floor, 0.0))
            if cumulative_power[-1] > 0:
                band_ends_hz.append(
                    int(np.searchsorted(cumulative_power, RESPONSE_BAND_SHARE * cumulative_power[-1])) * line_hz
                )
    fastest_hz = max(band_ends_hz, default=parts[0].rate_hz / 2)
    return max(int(parts[0].rate_hz / (RESPONSE_OVERSAMPLED * 2 * max(fastest_hz, 1e-9))), 1)
