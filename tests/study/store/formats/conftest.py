"""A recording with every optional part, and its file."""

import numpy as np
import pytest

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from study.store.formats.recording_file import write_recording


@pytest.fixture
def recording():
    rng = np.random.default_rng(7)

    def signal(quantity: str, unit: str, channels: tuple[str, ...]) -> Signal:
        return Signal(rng.normal(size=(200, len(channels))), 1000.0, quantity, unit, channels)

    force = signal("force", "N", ("fx", "fy"))
    return Recording(
        "bench",
        force,
        signal("acceleration", "m/s^2", ("ax", "ay")),
        signal("position", "m", ("x", "y")),
        force,
        np.arange(200) * 1e-3,
        segments=(Segment(0, 100, "multisine", 1.5, 50, "fit"), Segment(120, 200, "sweep", 1.0, 0, "test")),
        meta={"place_m": [0.0, 0.1, 0.0], "sensor": {"name": "ADXL335"}},
        condition=signal("temperature", "K", ("motor",)),
    )


@pytest.fixture
def written(tmp_path, recording):
    path = tmp_path / "a.h5"
    write_recording(path, recording)
    return path
