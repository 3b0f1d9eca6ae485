"""Samples of a board before any processing: sequence numbers, times by the board's clock, counts of lost packets.

A source is a serial line or a data-acquisition device; nothing behind it knows which.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """n samples of a board with three channels."""

    sequence: npt.NDArray[np.int64]
    """(n,), counted on where the counter of the board begins anew."""
    time_us: npt.NDArray[np.int64]
    """(n,), when they were taken by the board's clock, counted on likewise."""
    raw: npt.NDArray[np.uint16] | npt.NDArray[np.float64]
    """(n, 3)."""
    restarts: npt.NDArray[np.int64]
    """(n,), how often the board had begun anew by then: the times of samples with another number do not belong
    together."""

    def __len__(self) -> int:
        return len(self.sequence)


@dataclass(frozen=True, slots=True)
class Counts:
    """Since the beginning."""

    packets: int = 0
    lost: int = 0
    """Packets lost, counted by the gaps in the sequence numbers: torn or garbled arrivals are among them."""
    spoiled_bytes: int = 0
    """That belonged to no whole packet."""
    restarts: int = 0
    """How often the board began anew."""


class Source(Protocol):
    """Read by one thread."""

    @property
    def counts(self) -> Counts:
        """Packets and lost packets since the source was opened."""
        ...

    def read(self) -> tuple[Samples, float]:
        """Samples since the last call, and the time of their arrival by `time.monotonic`. Waits some milliseconds at
        the most; none where nothing came. Raises anything for a broken line."""
        ...

    def close(self) -> None:
        """May raise; called once."""
        ...
