"""Results of sweeps over the whole frequency range of a device: transfer functions, resonances and coupling onset.

They are the input of the findings on the published figures 4 and 1 (`response_findings`).
"""

from dataclasses import dataclass

from equalizer.identification.frequency_response.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.resonances import Resonance


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredDevice:
    """Measured frequency response of a device, with the resonances and the coupling onset found in it."""

    response: FrequencyResponse
    """Transfer functions from each force to each acceleration."""
    resonances: tuple[Resonance, ...]
    onset: CouplingOnset
    """Frequency from which on the axes couple."""
