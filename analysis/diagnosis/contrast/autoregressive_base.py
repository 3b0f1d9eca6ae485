"""Base model by autoregression: each response is predicted from the past of responses and commands (ARX; Ljung, System
Identification, 2nd ed., chapter 4.2). Used for devices that no force balance describes: voltages as responses, many
modes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.motion import low_pass_filter
from analysis.diagnosis.contrast.part import Part
from analysis.diagnosis.settings import RESPONSE_BAND_SHARE, RESPONSE_OVERSAMPLED
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class AutoregressiveBase:
    """One response. Rows are its second difference, then the past of all responses and commands, and 1.

    The past is given as the last value, its difference, and second differences: products of smooth readings are nearly
    equal, so that in double precision errors below 1e-5 of them would be lost to rounding.
    """

    channel: int
    order: int
    """Number of past samples of responses and commands that predict."""
    step: int
    """Decimation step, after a low pass."""
    responses: int
    """Number of response channels."""

    def rows(self, parts: Sequence[Part], like: tuple[FloatArray, ...] | None = None) -> tuple[FloatArray, ...]:
        """Per part (kept, 1 + columns), from the sample of index `order` on after decimation. `like` is not used."""
        return tuple(self._rows(part) for part in parts)

    def command_columns(self, width: int) -> Mask:
        """(width,): mask of the columns made from commands."""
        return (np.arange(width) > self.order * self.responses) & (np.arange(width) < width - 1)

    def valid_samples(self, parts: Sequence[Part]) -> tuple[Mask, ...]:
        """Per part, mask of its rows: those made from known samples, without the first two and the last two."""
        found = []
        for part in parts:
            known = part.known[:: self.step]
            bad = np.convolve(~known, np.ones(self.order + 3))[: len(known)] > 0
            bad[: self.order + 2] = True
            bad[len(bad) - 2 :] = True
            found.append(~bad[self.order :])
        return tuple(found)

    def _rows(self, part: Part) -> FloatArray:
        response, command = (decimate(samples, part.rate_hz, self.step) for samples in (part.response, part.command))
        count = max(len(response) - self.order, 0)
        first = np.diff(response, axis=0, prepend=response[:1])
        second = np.diff(first, axis=0, prepend=first[:1])

        def before(samples: FloatArray, lag: int) -> FloatArray:
            return samples[self.order - lag : self.order - lag + count]

        past = [before(second, lag) for lag in range(1, self.order - 1)]
        pushed = [before(command, lag) for lag in range(self.order + 1)]
        now = before(second[:, [self.channel]], 0)
        return np.hstack([now, before(response, 1), before(first, 1), *past, *pushed, np.ones((count, 1))])

    def values(self, rows: FloatArray) -> FloatArray:
        """(n,): the response itself: its second difference, the value before, and the difference before."""
        return np.asarray(rows[:, 0] + rows[:, 1 + self.channel] + rows[:, 1 + self.responses + self.channel])


def decimate(samples: FloatArray, rate_hz: float, step: int) -> FloatArray:
    """(n / step, k): every `step`-th sample, low-pass filtered to 0.4 times the new rate before."""
    return samples if step == 1 else low_pass_filter(samples, rate_hz, 0.4 * rate_hz / step)[::step]


def likely_step(parts: Sequence[Part]) -> int:
    """Decimation step that keeps the band of the fastest response: the part of its spectrum with the share
    `RESPONSE_BAND_SHARE` of the power above the noise."""
    ends = []
    for part in parts:
        moved = part.response - part.response.mean(axis=0)
        power = np.abs(np.fft.rfft(moved, axis=0)) ** 2
        for column in power.T:
            floor = float(np.median(column[3 * len(column) // 4 :]))
            cumulative = np.cumsum(np.maximum(column - floor, 0.0))
            if cumulative[-1] > 0:
                ends.append(
                    int(np.searchsorted(cumulative, RESPONSE_BAND_SHARE * cumulative[-1])) * part.rate_hz / len(moved)
                )
    fastest = max(ends, default=parts[0].rate_hz / 2)
    return max(int(parts[0].rate_hz / (RESPONSE_OVERSAMPLED * 2 * max(fastest, 1e-9))), 1)
