"""Raw samples of an accelerometer: sequence numbers, times by the sensor's clock, counts of received and lost packets.

`SampleSource` is the interface of a serial line (`serial_reader`) and of a data-acquisition device (`sources`).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """n samples of a sensor with three channels."""

    sequence: npt.NDArray[np.int64]
    """(n,), number of each sample; continued without a jump where the board's counter wraps or restarts."""
    time_us: npt.NDArray[np.int64]
    """(n,), time of each sample by the board's clock (µs); continued without a jump where its counter wraps."""
    raw: npt.NDArray[np.uint16] | npt.NDArray[np.float64]
    """(n, 3): counts of 16 bits from a board, volts from a data-acquisition device."""
    restarts: npt.NDArray[np.int64]
    """(n,), number of restarts of the board before each sample. Times are comparable only between samples with the same
    number."""

    def __len__(self) -> int:
        return len(self.sequence)


@dataclass(frozen=True, slots=True)
class PacketCounts:
    """Numbers of received and lost packets since the source was opened."""

    packets: int = 0
    """Complete packets received."""
    lost: int = 0
    """Packets lost; of a board by gaps in the sequence numbers, so that incomplete and corrupt ones are included."""
    spoiled_bytes: int = 0
    """Bytes that belonged to no complete packet."""
    restarts: int = 0
    """Number of restarts of the board."""


class SampleSource(Protocol):
    """A source of samples; `read` is called by a single thread."""

    @property
    def counts(self) -> PacketCounts:
        """Received and lost packets since the source was opened."""
        ...

    def read(self) -> tuple[Samples, float]:
        """Return the samples since the last call, and their time of arrival by `time.monotonic` (s). Waits for some
        milliseconds; no samples where none arrived. May raise any exception where the connection fails."""
        ...

    def close(self) -> None:
        """Release the source. Called once; may raise."""
        ...
