"""Base model that predicts one sensor from another: a velocity or acceleration from the differentiated position.

The prediction is a linear regression on the differentiated position at neighbouring times (a short FIR filter) and a
constant. No physics of the device is involved, so that a difference between recordings is a fault of a sensor.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.motion import differentiate, filter_band_pass
from analysis.diagnosis.contrast.recording_part import Part
from analysis.diagnosis.limits import SENSOR_TAPS
from analysis.diagnosis.types import Mask
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SensorBase:
    """A channel of the response predicted from the same channel of the position, differentiated and filtered."""

    channel: int
    """Index of the channel in the response and in the position."""
    differentiations: int
    """Number of differentiations from the position channel's quantity to that of the response."""
    band_hz: float
    """Upper end of the band to which both signals are filtered, Hz."""
    step: int
    """Decimation after filtering: one of this many samples is kept."""

    def build_rows(
        self, parts: Sequence[Part], reusable_rows: tuple[FloatArray, ...] | None = None
    ) -> tuple[FloatArray, ...]:
        """Build the rows of each part, (rows, 1 + columns): the filtered reading; its regressors, the differentiated
        position from `SENSOR_TAPS` rows before to as many after, and 1. reusable_rows: not used."""
        return tuple(self._build_part_rows(part) for part in parts)

    def mask_valid_samples(self, parts: Sequence[Part]) -> tuple[Mask, ...]:
        """Mask the rows of each part: known samples that are more than one period of `band_hz` from the part's ends."""
        masks = []
        for part in parts:
            edge_samples = int(part.rate_hz / self.band_hz) + 1
            valid_mask = part.known.copy()
            valid_mask[:edge_samples] = False
            valid_mask[max(len(valid_mask) - edge_samples, 0) :] = False
            masks.append(valid_mask[:: self.step][SENSOR_TAPS:-SENSOR_TAPS])
        return tuple(masks)

    def _build_part_rows(self, part: Part) -> FloatArray:
        """Build the rows (rows, 1 + columns) of one part, see `build_rows`; the part must have a position."""
        assert part.position is not None
        reading = filter_band_pass(part.response[:, [self.channel]], part.rate_hz, self.band_hz, 0.0)[:: self.step]
        differentiated = differentiate(
            part.position[:, [self.channel]], part.rate_hz, self.band_hz, self.differentiations
        )[:: self.step]
        row_count = len(reading) - 2 * SENSOR_TAPS
        neighbours = [differentiated[shift : shift + row_count] for shift in range(2 * SENSOR_TAPS + 1)]
        return np.hstack([reading[SENSOR_TAPS : SENSOR_TAPS + row_count], *neighbours, np.ones((row_count, 1))])


def build_sensor_bases(parts: Sequence[Part], band_hz: float, step: int) -> tuple[SensorBase, ...]:
    """Build a base for each response channel whose quantity is a time derivative of the position channel's quantity.
    Empty without a position, without a time axis (infinite band), or where the numbers of channels differ."""
    recording = parts[0].recording
    if recording.position is None or parts[0].position is None or not np.isfinite(band_hz):
        return ()
    if parts[0].position.shape[1] != parts[0].response.shape[1]:
        return ()
    # An unknown quantity counts as a low order in the response and a high one in the position: no base is built.
    orders = [
        (DERIVATIVE_OF_QUANTITY.get(response_quantity, -1), DERIVATIVE_OF_QUANTITY.get(position_quantity, 9))
        for response_quantity, position_quantity in zip(
            recording.response.quantities, recording.position.quantities, strict=True
        )
    ]
    return tuple(
        SensorBase(channel, response_order - position_order, band_hz, step)
        for channel, (response_order, position_order) in enumerate(orders)
        if response_order > position_order
    )
