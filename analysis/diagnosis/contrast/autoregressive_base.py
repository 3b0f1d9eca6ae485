"""Base model by autoregression: each response from its past and the commands (ARX; Ljung, System Identification, 2nd
ed., chapter 4.2). For devices that no force balance describes: voltages as responses, many modes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.motion import low_pass_filter
from analysis.diagnosis.contrast.part import Part
from analysis.diagnosis.settings import RESPONSE_BAND_SHARE, RESPONSE_OVERSAMPLED
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class AutoregressiveBase:
    """One response. Rows are its next value, then the past of all responses and commands, and 1."""

    channel: int
    order: int
    step: int
    """Decimation step, after a low pass."""

    def rows(self, parts: Sequence[Part], like: tuple[FloatArray, ...] | None = None) -> tuple[FloatArray, ...]:
        return tuple(self._rows(part) for part in parts)

    def command_columns(self, part: Part) -> Mask:
        """(1 + columns,): which columns commands make."""
        past, pushed = self.order * part.response.shape[1], (self.order + 1) * part.command.shape[1]
        return np.array([False] * (1 + past) + [True] * pushed + [False])

    def valid_samples(self, parts: Sequence[Part]) -> tuple[Mask, ...]:
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
        count = len(response) - self.order
        past = [course[self.order - lag : self.order - lag + count] for lag, course in self._past(response)]
        pushed = [command[self.order - lag : self.order - lag + count] for lag in range(self.order + 1)]
        now = response[self.order :, [self.channel]]
        return np.hstack([now, *past, *pushed, np.ones((count, 1))])

    def _past(self, response: FloatArray) -> Iterator[tuple[int, FloatArray]]:
        """The last `order` values as a value, its change, and the changes of that change, each with its lag. Of smooth
        readings the values themselves are so alike that products of them leave errors below 1e-5 to rounding."""
        change = np.diff(response, axis=0, prepend=response[:1])
        again = np.diff(change, axis=0, prepend=change[:1])
        yield from [(1, response), (1, change)][: self.order]
        yield from ((lag, again) for lag in range(1, self.order - 1))


def decimate(samples: FloatArray, rate_hz: float, step: int) -> FloatArray:
    return samples if step == 1 else low_pass_filter(samples, rate_hz, 0.4 * rate_hz / step)[::step]


def likely_step(parts: Sequence[Part]) -> int:
    ends = []
    for part in parts:
        moved = part.response - part.response.mean(axis=0)
        power = np.abs(np.fft.rfft(moved, axis=0)) ** 2
        for column in power.T:
            floor = float(np.median(column[3 * len(column) // 4 :]))
            course = np.cumsum(np.maximum(column - floor, 0.0))
            if course[-1] > 0:
                ends.append(int(np.searchsorted(course, RESPONSE_BAND_SHARE * course[-1])) * part.rate_hz / len(moved))
    fastest = max(ends, default=parts[0].rate_hz / 2)
    return max(int(parts[0].rate_hz / (RESPONSE_OVERSAMPLED * 2 * max(fastest, 1e-9))), 1)
