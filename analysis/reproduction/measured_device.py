"""What sweeps over the whole range show of a device."""

from dataclasses import dataclass

from equalizer.identification.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response import FrequencyResponse
from equalizer.identification.resonances import Resonance


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredDevice:
    response: FrequencyResponse
    resonances: tuple[Resonance, ...]
    onset: CouplingOnset
