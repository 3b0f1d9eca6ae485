"""Measured frequency response, per frequency line, with noise variance and coherence. `transfer_estimate` estimates it;
state-space and mechanical models are fitted to it."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import ComplexArray, FloatArray

BoolArray = npt.NDArray[np.bool_]


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
    output_channels: tuple[str, ...]
    input_unit: str = "N"
    output_unit: str = "m/s^2"
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        lines, p, m = len(self.frequency_hz), len(self.output_channels), len(self.input_channels)
        shapes = {
            "response": (lines, p, m),
            "noise_variance": (lines, p, m),
            "coherence": (lines, p),
            "reliable": (lines,),
        }
        for name, shape in shapes.items():
            if np.shape(getattr(self, name)) != shape:
                raise ValueError(f"{name} has shape {np.shape(getattr(self, name))}, not {shape}")
        if lines and not (np.diff(self.frequency_hz) > 0).all():
            raise ValueError("frequency_hz must rise from line to line")

    def __len__(self) -> int:
        return len(self.frequency_hz)

    def select_band(self, low_hz: float, high_hz: float) -> "FrequencyResponse":
        """Select the lines of a band (Hz), limits included."""
        return self.select_lines((self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz))

    def select_lines(self, mask: BoolArray) -> "FrequencyResponse":
        """Select the lines where `mask` (lines,) is true."""
        return FrequencyResponse(
            self.frequency_hz[mask],
            self.response[mask],
            self.noise_variance[mask],
            self.coherence[mask],
            self.reliable[mask],
            self.sample_rate_hz,
            self.input_channels,
            self.output_channels,
            self.input_unit,
            self.output_unit,
            self.remarks,
        )
