"""Where the given, the re-tuned and the completed model disagree with what was recorded, by channel, band and level."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.document import Mismatch
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.errors.output_error import Fitted
from analysis.diagnosis.localisation.clean_floor import CleanFloor
from analysis.diagnosis.localisation.mismatch_cells import Margin, MismatchCell, Prediction, mismatch_cells
from analysis.diagnosis.noise.noise_floor import NoiseFloor

Cells = tuple[MismatchCell, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    cells: Mapping[str, Cells]
    """By "before", "retuned", "after"."""

    @property
    def rows(self) -> tuple[Mismatch, ...]:
        """Of the model as given: all that was looked at."""
        return tuple(
            Mismatch(c.output, c.input, c.band_hz, c.amplitude, None, min(c.share, 1.0), min(c.adjusted_p_value, 1.0))
            for c in self.cells["before"]
        )


def maps_of(
    measure: ErrorMeasure,
    stages: Mapping[str, Fitted],
    floors: tuple[NoiseFloor, ...],
    learned: CleanFloor | None = None,
) -> Maps:
    """stages: see `Explanation.stages`. learned: what is no mismatch, from clean recordings."""
    return Maps({stage: cells_of(measure, fitted, floors, learned) for stage, fitted in stages.items()})


def whole_mismatch(measure: ErrorMeasure, stands: FitScore) -> tuple[Mismatch, ...]:
    """One row for the worst channel over the whole band, where no cell can be told apart from its neighbours."""
    record = measure.records[0].recording
    errors = np.fmax(np.maximum(stands.fit, stands.choose), stands.test)
    worst = int(np.argmax(errors))
    names = (*record.response.channels, *(() if record.position is None else record.position.channels))
    signal = np.sqrt(np.nanmean(measure.records[0].measured[:, worst] ** 2))
    left = float(errors[worst] * measure.noise[worst])
    share = min(left / signal, 1.0) if signal > 0 else 1.0
    inputs = "+".join(record.command.channels)
    return (Mismatch(names[worst], inputs, (0.0, record.sample_rate_hz / 2), None, None, share, 0.0),)


def cells_of(
    measure: ErrorMeasure, fitted: Fitted, floors: tuple[NoiseFloor, ...], learned: CleanFloor | None = None
) -> Cells:
    margin = Margin(learned=learned or CleanFloor())
    cells: list[MismatchCell] = []
    for record, residuals, floor in zip(measure.records, fitted.residuals, floors, strict=True):
        p = record.recording.response.samples.shape[1]
        predicted = record.measured - residuals * measure.unit
        position = predicted[:, p:] if predicted.shape[1] > p else None
        cells += mismatch_cells(record.recording, Prediction(predicted[:, :p], position), floor, margin=margin)
    return tuple(cells)
