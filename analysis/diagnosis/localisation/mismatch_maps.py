"""Mismatch maps of the given, the re-tuned and the completed model, by channel, band and level."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc, stdtr

from analysis.diagnosis.document import Mismatch
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.errors.output_error import Fitted
from analysis.diagnosis.localisation.clean_floor import CleanFloor
from analysis.diagnosis.localisation.mismatch_cells import Margin, MismatchCell, Prediction, mismatch_cells
from analysis.diagnosis.localisation.model_error import adjust_for_model_error, model_error
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.types import Mapper

Cells = tuple[MismatchCell, ...]
STRETCHES = 16
"""Stretches of a record over which error powers are compared with noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    """Mismatch cells of the given, the re-tuned and the completed model."""

    cells: Mapping[str, Cells]
    """The map of each stage; keys "before", "retuned", "after"."""

    @property
    def rows(self) -> tuple[Mismatch, ...]:
        """Rows of all cells of the model as given."""
        return tuple(
            Mismatch(
                c.output, c.input, c.band_hz, c.amplitude or None, None, min(c.share, 1.0), min(c.adjusted_p_value, 1.0)
            )
            for c in self.cells["before"]
        )


def mismatch_maps(
    measure: ErrorMeasure,
    stages: Mapping[str, Fitted],
    floors: tuple[NoiseFloor, ...],
    learned: CleanFloor | None = None,
    map_: Mapper = map,
) -> Maps:
    """Maps of all stages. stages: fits by name ("before", "retuned", "after"). learned: the mismatch of clean
    recordings, which does not count; nor does the error of the last stage on held-out samples."""
    # Stages with the same fit are tested once.
    fits = list({id(fitted): fitted for fitted in stages.values()}.values())

    def make_map(number: int) -> Cells:
        if number == len(fits):
            return cells_of(measure, stages["after"], floors, held_out=True)
        return cells_of(measure, fits[number], floors, learned)

    found: list[Cells] = list(map_(make_map, range(len(fits) + 1)))  # type: ignore[arg-type]
    error, cells = model_error(found[-1]), {id(fitted): own for fitted, own in zip(fits, found, strict=False)}
    return Maps({stage: adjust_for_model_error(cells[id(fitted)], error) for stage, fitted in stages.items()})


def whole_mismatch(measure: ErrorMeasure, score: FitScore, fitted: Fitted) -> tuple[Mismatch, ...]:
    """One row for the worst channel over the whole band, where no cell is significant. Its p-value is that of an error
    above the noise, in the mean over stretches (one-sided t test) or in their sum."""
    record = measure.records[0].recording
    errors = np.fmax(np.maximum(score.fit, score.choose), score.test)
    worst = int(np.argmax(errors))
    names = (*record.response.channels, *(() if record.position is None else record.position.channels))
    signal = np.sqrt(np.nanmean(measure.records[0].measured[:, worst] ** 2))
    left = float(errors[worst] * measure.noise[worst])
    share = min(left / signal, 1.0) if signal > 0 else 1.0
    inputs, p_value = "+".join(record.command.channels), _p_value_of_noise(measure, fitted, worst)
    return (Mismatch(names[worst], inputs, (0.0, record.sample_rate_hz / 2), None, None, share, p_value),)


def _p_value_of_noise(measure: ErrorMeasure, fitted: Fitted, channel: int) -> float:
    """p-value of an error power above that of noise, over stretches of time, within which errors are correlated.

    Either by the mean over stretches (t test), or by their sum with each stretch as a single sample of noise
    (chi-squared test): where a few stretches have large errors, their scatter hides from the first what the second
    detects. Twice the smaller p-value of the two (Bonferroni).
    """
    powers = []
    for record, residuals in zip(measure.records, fitted.residuals, strict=True):
        left = residuals[record.fit | record.choose | record.test, channel]
        powers += [float(np.mean(part**2)) for part in np.array_split(left, STRETCHES) if len(part)]
    over = np.array(powers) * (measure.unit[channel] / measure.noise[channel]) ** 2
    known = over[np.isfinite(over)]
    if len(known) < len(over) or len(known) < 2 or np.ptp(known) == 0:
        return 0.0 if not known.size or known.mean() > 1 else 1.0
    score = (known.mean() - 1.0) / (known.std(ddof=1) / np.sqrt(len(known)))
    p_of_mean, p_of_sum = float(stdtr(len(known) - 1, -score)), float(chdtrc(len(known), known.sum()))
    return min(2 * min(p_of_mean, p_of_sum), 1.0)


def cells_of(
    measure: ErrorMeasure,
    fitted: Fitted,
    floors: tuple[NoiseFloor, ...],
    learned: CleanFloor | None = None,
    held_out: bool = False,
) -> Cells:
    """Cells of all records for one fit. held_out: only the samples that nothing was fitted to."""
    margin = Margin(learned=learned or CleanFloor())
    cells: list[MismatchCell] = []
    for part, (record, residuals, floor) in enumerate(zip(measure.records, fitted.residuals, floors, strict=True)):
        p = record.recording.response.samples.shape[1]
        predicted = record.measured - residuals * measure.unit
        position = predicted[:, p:] if predicted.shape[1] > p else None
        used = record.choose | record.test if held_out else None
        found = mismatch_cells(record.recording, Prediction(predicted[:, :p], position), floor, used, margin)
        cells += [replace(cell, part=part) for cell in found]
    return tuple(cells)
