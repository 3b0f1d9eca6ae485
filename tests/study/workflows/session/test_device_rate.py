"""A device whose rate is too low for the stimuli: refused before the sitting, not played as something else."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from protocols.document.dumping import dump_protocol
from study.errors import DeviceError
from study.store.formats.recording_file import write_recording
from study.store.sessions.archive import list_session_folders
from study.workflows.session.conduct_session import conduct_new, conduct_resumed


@pytest.fixture
def device_at(tmp_path):
    """Name of a device of this rate (Hz): a replay of a handle at rest."""

    def make(rate_hz: float) -> str:
        rest = np.zeros((round(2 * rate_hz), 3))
        recording = Recording(
            "slow",
            Signal(rest, rate_hz, "force", "N", ("fx", "fy", "fz")),
            Signal(rest, rate_hz, "acceleration", "m/s^2", ("ax", "ay", "az")),
            Signal(rest, rate_hz, "position", "m", ("x", "y", "z")),
        )
        write_recording(tmp_path / f"{rate_hz:g}.h5", recording)
        return f"replay:{tmp_path / f'{rate_hz:g}.h5'}"

    return make


@pytest.mark.parametrize("rate_hz", [100.0, 139.0])
def test_a_device_that_is_too_slow_for_the_highest_frequency_begins_no_sitting(sitter, device_at, rate_hz):
    with pytest.raises(DeviceError, match=rf"runs at {rate_hz:g} Hz, and 35 Hz need at least 140\..*Nothing moved"):
        conduct_new(sitter.plan(), device_at(rate_hz), sitter.participant())
    assert list_session_folders(sitter.data) == ()


def test_nor_is_a_session_resumed_on_it(sitter, device_at):
    folder = sitter.interrupted(3).folder
    with pytest.raises(DeviceError, match="35 Hz need at least 140"):
        conduct_resumed(folder, device_at(100.0), sitter.participant())


def test_a_fade_that_is_no_tick_of_the_device_begins_no_sitting(sitter, device_at):
    sitter.protocol = replace(sitter.protocol, stimulus=replace(sitter.protocol.stimulus, fade_out_s=0.003))
    with pytest.raises(DeviceError, match=r"0.003 s .* no more than half a tick.*Nothing moved.*at least 0.00625 s"):
        conduct_new(sitter.plan(), device_at(160.0), sitter.participant())


def test_nor_is_a_session_resumed_whose_fade_is_no_tick_of_the_device(sitter, device_at):
    sitter.protocol = replace(sitter.protocol, stimulus=replace(sitter.protocol.stimulus, fade_out_s=0.003))
    sitter.text = dump_protocol(sitter.protocol)
    folder = sitter.interrupted(3).folder
    lines = folder.log.read_bytes()
    with pytest.raises(DeviceError, match=r"0.003 s .* no more than half a tick.*Nothing moved"):
        conduct_resumed(folder, device_at(160.0), sitter.participant())
    assert folder.log.read_bytes() == lines
