"""Data class of a device's frequency response over its whole range, with its resonances and coupling onset.

Made by `study.evaluation.reproduction.reproduce_paper` from swept-sine recordings, for the comparison with figures 4
and 1 of Wilson, Chan, Salisbury and Niemeyer, Multi-DOF Equalization of Haptic Devices (`response_findings`), and
drawn by `reproduction_pictures`.
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
    """Onset of coupling: the frequency (Hz) above which a force along one axis also moves others."""
