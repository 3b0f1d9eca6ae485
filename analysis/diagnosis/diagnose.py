"""From recordings and a model to findings: the whole diagnosis, without files, clocks or screens."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.assemble_findings import assembled
from analysis.diagnosis.explain import Progress, explain
from analysis.diagnosis.findings import Findings
from analysis.diagnosis.free_simulation import FreeSimulation
from analysis.diagnosis.noise_floor import NoiseFloor, noise_floor
from analysis.diagnosis.observed import Observed, noise_in_units, observed
from analysis.diagnosis.rivalry import Arena
from analysis.diagnosis.screening import Mapper
from analysis.diagnosis.tuning import tuning_of
from analysis.diagnosis.verdict import judge
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

UNKNOWN_NOISE = 1e-3
"""Share of the signal that is taken for noise where a recording cannot tell."""


@dataclass(frozen=True, slots=True)
class DiagnosisSettings:
    without: tuple[str, ...] = ()
    """Effects that are not to be considered."""
    names: tuple[str, ...] = ()
    """Of the recordings, for the reader."""


def diagnose(
    recordings: Sequence[Recording],
    model: MechanicalModel,
    settings: DiagnosisSettings,
    map_: Mapper,
    progress: Progress,
) -> Findings:
    """recordings: of one device, alike in channels, units and rate; see `belonging` for what is refused."""
    progress("measuring the noise", 0.0)
    floors = tuple(noise_floor(one) for one in recordings)
    records = tuple(observed(one, model.outputs) for one in recordings)
    noise = _noise(floors, records)
    unit = noise_in_units(np.vstack([record.measured for record in records]), noise)
    measure = FreeSimulation(records, unit, noise)
    arena = Arena(measure.shortened(), measure, tuning_of(model, recordings[0].command.channels), map_)
    found = explain(arena, [one for one in CATALOGUE if one.name not in settings.without], progress)
    progress("writing down what was found", 0.95)
    judged = judge(found)
    named = found if judged.named else replace(found, after=found.retuned)
    return assembled(arena, named, judged, floors, settings.names)


def _noise(floors: Sequence[NoiseFloor], records: Sequence[Observed]) -> FloatArray:
    """(c,): the quietest recording's, rms."""
    count = records[0].measured.shape[1]
    rows = [
        np.concatenate([f.response_rms, f.position_rms if f.position_rms is not None else []])[:count] for f in floors
    ]
    signal = np.sqrt(np.nanmean(np.vstack([record.measured for record in records]) ** 2, axis=0))
    quietest = np.fmin.reduce(rows)
    return np.asarray(np.where(np.isfinite(quietest) & (quietest > 0), quietest, UNKNOWN_NOISE * signal))
