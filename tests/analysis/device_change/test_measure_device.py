"""What the measurement of a free device refuses."""

import numpy as np
import pytest

from analysis.device_change.measure_device import NotMeasurableError, measure_device
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal


@pytest.mark.parametrize("positions", [1, 3])
def test_a_position_that_is_not_along_every_axis_is_refused(positions):
    samples = np.random.default_rng(1).standard_normal((1000, 3))
    command = Signal(samples[:, :2], 1000.0, "force", "N", ("fx", "fy"))
    response = Signal(samples[:, :2], 1000.0, "acceleration", "m/s^2", ("ax", "ay"))
    position = Signal(samples[:, :positions], 1000.0, "position", "m", tuple("xyz"[:positions]))
    with pytest.raises(NotMeasurableError, match=f"channels of the position is {positions}, that of the command 2"):
        measure_device(Recording("bench", command, response, position))
