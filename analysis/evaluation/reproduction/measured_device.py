"""Results of sweeps over the whole frequency range: transfer functions, resonances, coupling onset."""

from dataclasses import dataclass

from equalizer.identification.frequency_response.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.resonances import Resonance


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredDevice:
    """Measured frequency response of a device, with the resonances and the coupling onset found in it."""

    response: FrequencyResponse
    resonances: tuple[Resonance, ...]
    onset: CouplingOnset
