"""Data class of a device's frequency response over its whole range, with its resonances and coupling onset.

It is compared with figures 1 and 4 of Wilson, Chan, Salisbury and Niemeyer, Multi-DOF Equalization of Haptic Devices.
"""

from dataclasses import dataclass

from equalizer.identification.frequency_response.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.resonances import Resonance


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredDevice:
    """Measured frequency response of a device, with the resonances and the coupling onset computed from it."""

    response: FrequencyResponse
    """Transfer functions from each force (N) to each acceleration (m/s²)."""
    resonances: tuple[Resonance, ...]
    """Resonances of the response, with frequencies in Hz (see `Resonance`)."""
    onset: CouplingOnset
    """Onset of coupling: the frequency (Hz) from which a force along one axis also moves others."""
