"""Measure the stimulus that a simulated participant feels: the acceleration that the device delivers before the answer.

The accelerometer is sampled at every tick over some periods of the held stimulus; `measure_delivered` gives the
amplitudes along and across the direction and of the harmonics.
"""

import numpy as np

from equalizer.signals.lockin import covers_a_period
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from protocols.definition.apparatus import TestDirections
from study.devices.clock import Clock
from study.devices.device import Device
from study.session.state.due_trial import PresentTrial
from study.session.stimulus.delivered import DeliveredMotion, measure_delivered
from study.session.stimulus.stimulus import compute_direction_vector
from study.store.sessions.archive import SessionFolder
from study.workflows.results.fold_session import fold_session
from study.workflows.trial.display import SignOfLife

MEASURED_PERIODS = 2.0
"""Number of periods that are measured: more than one, because friction and sensor noise vary from period to period.
Chosen."""
TICKS_PER_KEEP_ALIVE = 50
"""Number of ticks between keep-alive calls: 50 ms at a sample rate of 1 kHz, half of the longest interval that
`SignOfLife` allows."""


class StimulusSampler:
    """Samples the accelerometer of a session's device, in the time of a clock. Measures nothing until
    `on_session_opened` is called."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._device: Device | None = None
        self._directions: TestDirections | None = None

    def on_session_opened(self, folder: SessionFolder, device: Device) -> None:
        """Store the device of the opened session, and the directions of its protocol."""
        self._device, self._directions = device, fold_session(folder).state.protocol.directions

    def compute_duration_s(self, stimulus: PresentTrial) -> float:
        """Compute the duration of the measurement (s)."""
        return MEASURED_PERIODS / stimulus.frequency_hz

    def measure_stimulus(self, stimulus: PresentTrial, sign_of_life: SignOfLife) -> DeliveredMotion | None:
        """Sample the held stimulus for `compute_duration_s(stimulus)` and return the amplitudes of the delivered
        acceleration. None without a device, where `sign_of_life` returns False (a fault or a request), or where less
        than a period was measured."""
        if self._device is None or self._directions is None:
            return None
        rate_hz = self._device.info.sample_rate_hz
        samples_mps2: list[tuple[float, float, float]] = []
        for tick in range(round(self.compute_duration_s(stimulus) * rate_hz)):
            self._clock.sleep(1.0 / rate_hz)
            if tick % TICKS_PER_KEEP_ALIVE == 0 and not sign_of_life():
                return None
            samples_mps2.append(self._device.look().acceleration_mps2 or (np.nan, np.nan, np.nan))
        acceleration_mps2 = np.array(samples_mps2, dtype=np.float64)
        if not covers_a_period(int(np.isfinite(acceleration_mps2).all(axis=1).sum()), rate_hz, stimulus.frequency_hz):
            return None
        unit_vector = compute_direction_vector(self._directions, stimulus.direction)
        # A recording needs a command; its values do not enter the measurement.
        zero_force = Signal(np.zeros_like(acceleration_mps2), rate_hz, "force", "N", ("fx", "fy", "fz"))
        response = Signal(acceleration_mps2, rate_hz, "acceleration", "m/s^2", ("ax", "ay", "az"))
        return measure_delivered(
            Recording(self._device.info.name, zero_force, response), unit_vector, stimulus.frequency_hz
        )
