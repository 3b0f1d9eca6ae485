"""Base model of one sensor by another: a measured velocity or acceleration from the differentiated position.

No physics of the device is involved, so that a difference is a fault of one of the sensors.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.motion import differentiate, low_pass_filter
from analysis.diagnosis.contrast.part import Part
from analysis.diagnosis.settings import SENSOR_TAPS
from analysis.diagnosis.types import Mask
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SensorBase:
    """A channel of the response predicted from the same channel of the position, differentiated and filtered."""

    channel: int
    times: int
    """Derivatives between the two."""
    band_hz: float
    step: int

    def rows(self, parts: Sequence[Part], like: tuple[FloatArray, ...] | None = None) -> tuple[FloatArray, ...]:
        """Per part (kept, 1 + columns): a filtered reading; then the differentiated position at the same time and up to
        `SENSOR_TAPS` rows before and after, and 1. `like` is not used."""
        return tuple(self._rows(part) for part in parts)

    def valid_samples(self, parts: Sequence[Part]) -> tuple[Mask, ...]:
        """Per part, mask of its rows: known samples more than a period of `band_hz` from the part's ends."""
        found = []
        for part in parts:
            edge = int(part.rate_hz / self.band_hz) + 1
            inside = part.known.copy()
            inside[:edge] = False
            inside[max(len(inside) - edge, 0) :] = False
            found.append(inside[:: self.step][SENSOR_TAPS:-SENSOR_TAPS])
        return tuple(found)

    def _rows(self, part: Part) -> FloatArray:
        assert part.position is not None
        read = low_pass_filter(part.response[:, [self.channel]], part.rate_hz, self.band_hz)[:: self.step]
        moved = differentiate(part.position[:, [self.channel]], part.rate_hz, self.band_hz, self.times)[:: self.step]
        count = len(read) - 2 * SENSOR_TAPS
        near = [moved[shift : shift + count] for shift in range(2 * SENSOR_TAPS + 1)]
        return np.hstack([read[SENSOR_TAPS : SENSOR_TAPS + count], *near, np.ones((count, 1))])


def sensor_bases(parts: Sequence[Part], band_hz: float, step: int) -> tuple[SensorBase, ...]:
    """One base per response whose position is measured, too."""
    recording = parts[0].recording
    if recording.position is None or parts[0].position is None or not np.isfinite(band_hz):
        return ()
    if parts[0].position.shape[1] != parts[0].response.shape[1]:
        return ()
    orders = [
        (DERIVATIVE_OF_QUANTITY.get(read, -1), DERIVATIVE_OF_QUANTITY.get(moved, 9))
        for read, moved in zip(recording.response.quantities, recording.position.quantities, strict=True)
    ]
    return tuple(
        SensorBase(channel, read - moved, band_hz, step) for channel, (read, moved) in enumerate(orders) if read > moved
    )
