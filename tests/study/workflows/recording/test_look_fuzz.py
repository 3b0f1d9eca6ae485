"""Recordings of odd rates, lengths, gaps, levels and channel counts: each is looked at, or refused in words."""

import numpy as np
import pytest

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from study.errors import StudyError
from study.store.formats.recording_file import write_recording
from study.workflows.recording.look_at_recordings import inspect_recordings

QUANTITIES = (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s^2"), ("voltage", "V"), ("unknown", "1"))


def drawn(seed: int) -> Recording:
    random = np.random.default_rng(seed)
    rate_hz = float(random.choice([1.0, 9.7, 50.0, 333.3, 1000.0, 44100.0]))
    samples, commands, responses = (int(random.integers(*ends)) for ends in ((1, 900), (1, 4), (1, 4)))
    command = 10.0 ** random.uniform(-6, 4) * random.standard_normal((samples, commands))
    command = np.repeat(command[:: int(random.integers(1, 60))], 60, axis=0)[:samples]
    response = 10.0 ** random.uniform(-6, 4) * np.cumsum(random.standard_normal((len(command), responses)), axis=0)
    for signal in (command, response):
        if random.random() < 0.3:
            signal[:, 0] = 0.0
        if random.random() < 0.4:
            begin = int(random.integers(0, len(signal)))
            signal[begin : begin + int(random.integers(1, 200)), -1] = np.nan
    quantity, unit = QUANTITIES[int(random.integers(len(QUANTITIES)))]
    return Recording(
        "fuzz", Signal(command, rate_hz, "force", "N", tuple(f"f{k}" for k in range(commands))),
        Signal(response, rate_hz, quantity, unit, tuple(f"r{k}" for k in range(responses))),
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(24))
def test_any_recording_is_looked_at_or_refused(seed, tmp_path):
    path = tmp_path / "fuzz.h5"
    write_recording(path, drawn(seed))
    try:
        (found,) = inspect_recordings([path])
    except StudyError as refusal:
        assert refusal.happened
    else:
        assert found.checks
