"""Measured frequency response, per frequency line, with noise variance and coherence. `transfer_estimate` estimates it;
state-space models are fitted to it."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import BoolArray, ComplexArray, FloatArray, list_per_channel

"""Array of truth values of any shape."""


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """Frequency response G(f) from the samples of the total command to those of the response; response sample k is
    taken just before command sample k is written. Raises ValueError where shapes are inconsistent or the frequencies do
    not increase strictly."""

    frequency_hz: FloatArray
    """(lines,): frequencies (Hz), strictly increasing."""
    response: ComplexArray
    """(lines, outputs, inputs): complex gain at each line, in output_unit per input_unit."""
    noise_variance: FloatArray
    """(lines, outputs, inputs): expected |error|² of each entry of `response`; NaN where not known."""
    coherence: FloatArray
    """(lines, outputs): multiple coherence, the share of the response's power that the commands explain linearly, 0 to
    1; NaN where not known."""
    reliable: BoolArray
    """(lines,): False where the estimate should not be used; `remarks` state the reasons."""
    sample_rate_hz: float
    """Rate (Hz) of the samples of commands and responses."""
    input_channels: tuple[str, ...]
    """Names of the command channels, in the order of the inputs."""
    output_channels: tuple[str, ...]
    """Names of the response channels, in the order of the outputs."""
    input_unit: str | tuple[str, ...] = "N"
    """Unit of all commands, or the units channel by channel; so is the next."""
    output_unit: str | tuple[str, ...] = "m/s^2"
    remarks: tuple[str, ...] = ()
    """Sentences on the estimate, such as why lines are not reliable."""

    def __post_init__(self) -> None:
        line_count, output_count, input_count = (
            len(self.frequency_hz),
            len(self.output_channels),
            len(self.input_channels),
        )
        shapes = {
            "response": (line_count, output_count, input_count),
            "noise_variance": (line_count, output_count, input_count),
            "coherence": (line_count, output_count),
            "reliable": (line_count,),
        }
        for name, shape in shapes.items():
            if np.shape(getattr(self, name)) != shape:
                raise ValueError(f"{name} has shape {np.shape(getattr(self, name))}, not {shape}")
        if line_count and not (np.diff(self.frequency_hz) > 0).all():
            raise ValueError("frequency_hz must rise from line to line")

    def __len__(self) -> int:
        return len(self.frequency_hz)

    @property
    def input_units(self) -> tuple[str, ...]:
        """The unit of each command."""
        return list_per_channel(self.input_unit, len(self.input_channels))

    @property
    def output_units(self) -> tuple[str, ...]:
        """The unit of each response."""
        return list_per_channel(self.output_unit, len(self.output_channels))

    def select_band(self, low_hz: float, high_hz: float) -> "FrequencyResponse":
        """Select the lines of a band (Hz), limits included."""
        return self.select_lines((self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz))

    def select_lines(self, is_selected: BoolArray) -> "FrequencyResponse":
        """Select the lines where `is_selected` (lines,) is true."""
        return FrequencyResponse(
            self.frequency_hz[is_selected],
            self.response[is_selected],
            self.noise_variance[is_selected],
            self.coherence[is_selected],
            self.reliable[is_selected],
            self.sample_rate_hz,
            self.input_channels,
            self.output_channels,
            self.input_unit,
            self.output_unit,
            self.remarks,
        )
