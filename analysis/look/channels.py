"""The channels of a recording as a flat list, for checks of each channel; format and rms about the mean of its values.

A recording groups its channels by signal (command, response, position and so on); here each channel is one item with
its role, name, quantity and unit.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.wording import typeset
from equalizer.signals.recording import Recording
from equalizer.signals.recording_checks import collect_signals
from equalizer.signals.signal import FloatArray

Stretch = tuple[int, int]
"""Range of samples without a gap in time: index of the first sample, and of the sample after the last."""


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """The samples of a channel with its role, name, quantity and unit."""

    role: str
    """command, response, position, excitation or condition."""
    name: str
    """Name in the recording, such as ax."""
    quantity: str
    """Physical quantity, such as acceleration."""
    unit: str
    """Unit of the samples, such as m/s^2; "1" for a number without a unit."""
    samples: FloatArray
    """(n,), in the channel's unit; NaN where a sample is missing."""

    @property
    def label(self) -> str:
        """Role and name, such as: response 'ax'."""
        return f"{self.role} '{self.name}'"

    @property
    def finite_samples(self) -> FloatArray:
        """The samples that are not missing, in order; infinite ones count as missing."""
        return self.samples[np.isfinite(self.samples)]

    @property
    def is_varying(self) -> bool:
        """Whether the channel takes more than one value."""
        return bool(self.finite_samples.size and np.ptp(self.finite_samples) > 0)

    def format(self, value: float) -> str:
        """Format a value of this channel as text with its unit."""
        return format_value(value, self.unit)


def is_driven(channels: Sequence[Channel]) -> bool:
    """Whether a command changes."""
    return any(channel.role == "command" and channel.is_varying for channel in channels)


def list_channels(recording: Recording) -> tuple[Channel, ...]:
    """List the channels of all signals of a recording."""
    return tuple(
        Channel(role, name, quantity, unit, np.ascontiguousarray(samples))
        for role, signal in collect_signals(recording).items()
        for name, quantity, unit, samples in zip(
            signal.channels, signal.quantities, signal.units, signal.samples.T, strict=True
        )
    )


def format_value(value: float, unit: str, digits: int = 3) -> str:
    """Format a value as text, with its unit and `digits` significant digits; the unit "1" is not written."""
    return f"{typeset(f'{value:.{digits}g}')}{'' if unit == '1' else f' {unit}'}"


def compute_rms(samples: FloatArray) -> float:
    """Compute the root mean square about the mean; 0 without samples. samples: finite."""
    return float(np.std(samples)) if samples.size else 0.0
