"""Masking noise on a scripted output: looped without a seam, silent when it must be, and missed when it is gone."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from study.devices.masking_sound import MaskingSound
from study.devices.opening import make_masking_sound
from study.errors import DeviceError

SAMPLES = np.arange(1, 101, dtype=np.int16)


class Output:
    """What PortAudio would give: it takes samples when it is asked to."""

    def __init__(self) -> None:
        self.active = self.closed = False
        self.refuses: Exception | None = None

    def open(self, rate_hz: int, fill):
        self.rate_hz, self.fill = rate_hz, fill
        return self, "Headphones"

    def start(self) -> None:
        if self.refuses is not None:
            raise self.refuses
        self.active = True

    def abort(self) -> None:
        self.active = False

    def close(self) -> None:
        self.closed = True

    def taken(self, frames: int) -> list[int]:
        out = np.zeros((frames, 1), dtype=np.int16)
        self.fill(out, frames, None, None)
        return out[:, 0].tolist()


@pytest.fixture
def output():
    return Output()


@pytest.fixture
def sound(output):
    return MaskingSound(SAMPLES, 44_100, output.open)


def test_it_loops_without_a_seam(sound, output):
    sound.start()
    assert output.taken(70) + output.taken(70) + output.taken(250) == (SAMPLES.tolist() * 4)[:390]


def test_it_is_silent_until_it_begins_and_after_it_was_stopped(sound, output):
    assert not output.active
    sound.start()
    sound.check()
    assert output.active and sound.output == "Headphones"
    assert sound.stop() is True and not output.active
    assert sound.stop() is False
    sound.start()
    assert output.taken(3) == [1, 2, 3]
    sound.close()
    assert output.closed and not output.active


def test_an_output_that_stopped_by_itself_is_missed(sound, output):
    sound.start()
    output.active = False
    with pytest.raises(DeviceError, match="has stopped") as told:
        sound.check()
    assert "Headphones plays no more" in told.value.happened


def test_noise_that_was_never_begun_or_was_stopped_is_missed(sound):
    with pytest.raises(DeviceError, match="plays nothing"):
        sound.check()
    sound.start()
    sound.stop()
    with pytest.raises(DeviceError, match="plays nothing"):
        sound.check()


def test_an_output_that_refuses_is_an_error_with_what_to_do(sound, output):
    output.refuses = RuntimeError("Invalid sample rate")
    with pytest.raises(DeviceError, match="cannot be played") as told:
        sound.start()
    assert "Invalid sample rate" in told.value.happened and "[audio]" in told.value.do_now


@pytest.mark.parametrize("library", [None, SimpleNamespace(OutputStream=lambda **named: 1 / 0)])
def test_without_a_library_or_an_output_it_is_said_before_anything_begins(monkeypatch, library):
    monkeypatch.setitem(sys.modules, "sounddevice", library)
    with pytest.raises(DeviceError, match="cannot be played"):
        make_masking_sound(SAMPLES, 44_100)


def test_the_library_is_asked_for_one_channel_of_16_bit(monkeypatch, output):
    asked = {}

    def stream(callback, **named: object):
        asked.update(named)
        output.fill = callback
        return output

    fake = SimpleNamespace(OutputStream=stream, query_devices=lambda kind: {"name": f"default {kind}"})
    monkeypatch.setitem(sys.modules, "sounddevice", fake)
    sound = make_masking_sound(SAMPLES, 44_100)
    sound.start()
    assert asked == {"samplerate": 44_100, "channels": 1, "dtype": "int16"}
    assert sound.output == "default output" and output.taken(2) == [1, 2]
