"""The frequency bands of a diagnosis: octaves that begin at powers of two, the same for all recordings, so that results
for a band of different recordings can be compared."""

import numpy as np

from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

Band = tuple[float, float]


def octaves_between(from_hz: float, to_hz: float) -> tuple[Band, ...]:
    """All octaves that overlap the interval; a last line on an edge opens its own octave. Both must be positive."""
    first = int(np.floor(np.log2(from_hz) + 1e-9))
    last = int(np.floor(np.log2(to_hz) + 1e-9))
    return tuple((2.0**power, 2.0 ** (power + 1)) for power in range(first, last + 1))


def lines_in_band(frequency_hz: FloatArray, band_hz: Band) -> Mask:
    """(lines,): lower edge included, upper edge excluded."""
    return np.asarray((frequency_hz >= band_hz[0] * (1 - 1e-9)) & (frequency_hz < band_hz[1] * (1 - 1e-9)))


def find_driven_inputs(power: FloatArray, channels: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the inputs that were driven in a segment. power: (inputs,). An input that only reacts, by feedback,
    stays below a hundredth of the strongest where the excitation was recorded."""
    if power.max(initial=0.0) == 0:
        return ()
    return tuple(name for name, strength in zip(channels, power, strict=True) if strength > _DRIVEN * power.max())


_DRIVEN = 0.01
"""Least power of a driven command, relative to the strongest."""
