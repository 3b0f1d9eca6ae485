"""Results of sweeps over the whole frequency range: transfer functions, resonances, coupling onset."""

from dataclasses import dataclass

from equalizer.identification.frequency_response.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.resonances import Resonance


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredDevice:
    response: FrequencyResponse
    resonances: tuple[Resonance, ...]
    onset: CouplingOnset
