"""Write WAV audio files: mono, 16-bit PCM."""

import io
import wave
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from study.store.disk.atomic_write import write_atomically


def write_wav(path: Path, samples: NDArray[np.int16], sample_rate_hz: int) -> None:
    """Write samples, (n,), as a WAV file, atomically. Raises AlreadyExistsError where the file exists,
    CannotWriteError where it cannot be written."""
    content = io.BytesIO()
    with wave.open(content, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(sample_rate_hz)
        file.writeframes(samples.astype("<i2").tobytes())
    write_atomically(path, content.getvalue())
