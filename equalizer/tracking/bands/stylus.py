"""A separate vibration actuator at the stylus, which plays the highest frequencies in place of the motors.

A crossover divides the reference acceleration between motors and actuator; the actuator's command is the reference
share times the regularised inverse of its measured response, line by line.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.bands.high_band import DEFAULT_WEIGHT


@dataclass(frozen=True, slots=True, eq=False)
class StylusActuator:
    """Measured response and limits of the actuator. Raises ValueError for unequal shapes of response and frequencies,
    and for a crossover, transition or limit that is not a positive number."""

    frequency_hz: FloatArray
    """(lines,), rising: frequencies at which its response was measured. It gets no command outside their range."""
    response: ComplexArray
    """(lines,): acceleration of the stylus (m/s²) per unit of the command."""
    from_hz: float
    """Crossover frequency (Hz), at which both get half the amplitude; the motors play the part below."""
    limit: float
    """Largest magnitude of the command, in the command's unit."""
    transition_hz: float = 20.0
    """Width (Hz) of the crossover's transition. Default chosen."""

    def __post_init__(self) -> None:
        if np.shape(self.response) != np.shape(self.frequency_hz):
            raise ValueError(
                f"response has shape {np.shape(self.response)}, but there are {len(self.frequency_hz)} frequencies"
            )
        for name in ("from_hz", "limit", "transition_hz"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name} is {getattr(self, name)}; it must be a positive number")


@dataclass(frozen=True, slots=True, eq=False)
class StylusShare:
    """Split of a reference acceleration between motors and stylus actuator; result of `share_with_stylus`."""

    command: FloatArray
    """(N,), in the unit of the actuator's command."""
    predicted: FloatArray
    """(N,), m/s²: predicted acceleration due to the command."""
    motors: FloatArray
    """(N,), m/s²: the motors' share; the sum with `actuator_share` is the reference."""
    actuator_share: FloatArray
    """(N,), m/s²: the actuator's share."""


def share_with_stylus(reference: FloatArray, sample_rate_hz: float, stylus: StylusActuator) -> StylusShare:
    """Split reference (N,), m/s², one degree of freedom, at rest at both ends, between stylus and motors. A command
    above the actuator's limit is scaled down as a whole, and the motors play the remainder. The weight of the inverse
    is `DEFAULT_WEIGHT`, here in (m/s² per unit of the command)²."""
    n = len(reference)
    lines_hz = np.fft.rfftfreq(n, 1 / sample_rate_hz)
    crossover_position = np.clip((lines_hz - stylus.from_hz) / stylus.transition_hz + 0.5, 0, 1)
    has_response = (lines_hz >= stylus.frequency_hz[0]) & (lines_hz <= stylus.frequency_hz[-1])
    stylus_spectrum = np.fft.rfft(reference) * np.sin(np.pi / 2 * crossover_position) ** 2 * has_response
    magnitude = np.interp(lines_hz, stylus.frequency_hz, np.abs(stylus.response))
    response = magnitude * np.exp(1j * np.interp(lines_hz, stylus.frequency_hz, np.unwrap(np.angle(stylus.response))))
    command_spectrum = stylus_spectrum * response.conj() / (np.abs(response) ** 2 + DEFAULT_WEIGHT)
    command_peak = float(np.abs(np.fft.irfft(command_spectrum, n)).max(initial=0.0))
    scale = min(1.0, stylus.limit / command_peak) if command_peak > 0 else 1.0
    stylus_acceleration = scale * np.fft.irfft(stylus_spectrum, n)
    return StylusShare(
        scale * np.fft.irfft(command_spectrum, n),
        scale * np.fft.irfft(command_spectrum * response, n),
        reference - stylus_acceleration,
        stylus_acceleration,
    )
