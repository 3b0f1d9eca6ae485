"""Masking noise from the computer's sound output, in a seamless loop, so that participants do not hear the device.

The library sounddevice (PortAudio) is imported only when an output is opened. It requests the samples through a
callback, in its own thread.
"""

import contextlib
from collections.abc import Callable, Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from study.errors import DeviceError

Samples = NDArray[np.int16]
"""Samples of the noise, (n,), 16-bit PCM, a single channel."""
FillCallback = Callable[[Any, int, Any, Any], None]
"""Callback of the output stream, fill(out, frames, time, status): writes the next samples into out (frames, 1)."""

OUTPUT_ADVICE = (
    "Install the extra (pip install '.[audio]'; on Linux also the package libportaudio2), connect a sound output and "
    "choose it as the system's default. To play the noise otherwise, say play = false in [masking] of the protocol."
)
"""Remedy of every `DeviceError` of this module."""


class Stream(Protocol):
    """An output stream of the library."""

    @property
    def active(self) -> bool:
        """Whether the output takes samples."""
        ...

    def start(self) -> None:
        """Begin to request samples."""
        ...

    def abort(self) -> None:
        """End at once and drop the buffered samples."""
        ...

    def close(self) -> None:
        """Release the output."""
        ...


class MaskingSound:
    """Masking noise on an opened output.

    samples: (n,), repeated without a gap. rate_hz: their sample rate. open_stream(rate_hz, fill): opens the output and
    returns it and its name; any exception of the library becomes a `DeviceError`. `output`: name of the output.
    """

    def __init__(
        self, samples: Samples, rate_hz: int, open_stream: Callable[[int, FillCallback], tuple[Stream, str]]
    ) -> None:
        self._samples, self._next_sample = samples, 0
        self._playing = False
        with _convert_to_device_error("cannot be played"):
            self._stream, self.output = open_stream(rate_hz, self._fill_buffer)

    def start(self) -> None:
        """Play from the beginning. Raises `DeviceError`."""
        self._next_sample = 0
        with _convert_to_device_error("cannot be played"):
            self._stream.start()
            self._playing = True
        self.check()

    def check(self) -> None:
        """Raise `DeviceError` where no noise is played: not started, stopped, or the output was unplugged."""
        with _convert_to_device_error("has stopped"):
            if not self._playing or not self._stream.active:
                raise OSError(f"{self.output} plays no more" if self._playing else f"{self.output} plays nothing")

    def stop(self) -> bool:
        """Stop at once and drop the buffered samples. Returns whether the noise was started and not stopped before.
        Never raises."""
        was_playing, self._playing = self._playing, False
        if was_playing:
            with contextlib.suppress(Exception):
                self._stream.abort()
        return was_playing

    def close(self) -> None:
        """Stop and release the output. Never raises."""
        self.stop()
        with contextlib.suppress(Exception):
            self._stream.close()

    def _fill_buffer(self, buffer: Any, frames: int, time: Any, status: Any) -> None:
        """Write the next samples, continuing at the beginning after the last one."""
        sample_indices = (self._next_sample + np.arange(frames)) % len(self._samples)
        buffer[:, 0] = self._samples[sample_indices]
        self._next_sample = (self._next_sample + frames) % len(self._samples)


def open_stream(rate_hz: int, fill: FillCallback) -> tuple[Stream, str]:
    """Open the system's default output: the stream and its name. Raises ImportError without the library, and what the
    library raises."""
    import sounddevice

    stream: Stream = sounddevice.OutputStream(samplerate=rate_hz, channels=1, dtype="int16", callback=fill)
    return stream, str(sounddevice.query_devices(kind="output")["name"])


@contextlib.contextmanager
def _convert_to_device_error(symptom: str) -> Iterator[None]:
    """Context manager that converts any exception to a `DeviceError`, because the library's errors have no common
    class. symptom: predicate of the message, such as "has stopped"."""
    try:
        yield
    except Exception as error:
        reason = str(error) or type(error).__name__
        raise DeviceError(f"The masking noise {symptom}", f"{reason}.", OUTPUT_ADVICE) from error
