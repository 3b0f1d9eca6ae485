"""A measured frequency response, line by line, with its noise variance and coherence: the value that the estimate from
recordings returns, and that models are fitted to."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import ComplexArray, FloatArray

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """Frequency response G(f) from the samples of the total command to those of the response; response sample k is
    taken just before command sample k is written. Raises ValueError where shapes disagree or frequencies do not
    rise."""

    frequency_hz: FloatArray
    """(lines,), rising."""
    response: ComplexArray
    """(lines, outputs, inputs): complex gain at each line, in output_unit per input_unit."""
    noise_variance: FloatArray
    """(lines, outputs, inputs): expected |error|² of each entry of `response`; NaN where not known."""
    coherence: FloatArray
    """(lines, outputs): share of the response's power that the commands explain, 0 to 1; NaN where not known."""
    reliable: BoolArray
    """(lines,): False where the estimate should not be used; `remarks` state the reasons."""
    sample_rate_hz: float
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

    def within(self, low_hz: float, high_hz: float) -> "FrequencyResponse":
        """The response on the lines of a band (Hz), its ends included."""
        return self.of_lines((self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz))

    def of_lines(self, chosen: BoolArray) -> "FrequencyResponse":
        """The response on the lines where the mask `chosen` (lines,) is true."""
        return FrequencyResponse(
            self.frequency_hz[chosen],
            self.response[chosen],
            self.noise_variance[chosen],
            self.coherence[chosen],
            self.reliable[chosen],
            self.sample_rate_hz,
            self.input_channels,
            self.output_channels,
            self.input_unit,
            self.output_unit,
            self.remarks,
        )
