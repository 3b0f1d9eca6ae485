"""Mismatch maps of the given, the re-tuned and the completed model, by channel, band and level.

A mismatch is significant only beyond the model's typical error on held-out data. No model is exact, and its error does
not follow from the noise. The residual in a cell is therefore modelled as noise plus model error, both random, with the
error's power a share of the signal's that varies slowly with frequency. The share is learned from the held-out cells of
the most complete model, of the same channel, in the same and the neighbouring octaves: other levels, other axes, other
recordings. Its robust estimate is the median, so that a mismatch at one level or in one octave does not raise its own
reference.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc, fdtrc, stdtr

from analysis.diagnosis.data.spectral_lines import Band
from analysis.diagnosis.document import Mismatch
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.errors.output_error import Fitted
from analysis.diagnosis.localisation.clean_floor import CleanFloor
from analysis.diagnosis.localisation.mismatch_cells import (
    Margin,
    MismatchCell,
    Prediction,
    adjust_for_cells,
    mismatch_cells,
)
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.types import Mapper

Cells = tuple[MismatchCell, ...]
STRETCHES = 16
"""Number of stretches of a record over which error powers are compared with noise."""


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
    """Maps of all stages, tested against noise, the mismatch of clean recordings (learned), and the error of the stage
    "after" on held-out samples. stages: fits by name ("before", "retuned", "after"). floors: noise per record."""
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


BESIDE = 2.1
"""Ratio of the lower ends of two octaves up to which these are the same or neighbours."""


@dataclass(frozen=True, slots=True)
class _HeldOutShare:
    fold: tuple[int, str, float]
    """Part, input and level of the cell."""
    band_hz: Band
    share: float


@dataclass(frozen=True, slots=True, eq=False)
class ModelError:
    """Held-out mismatch as shares of the signal, from which the expected model error near a cell is estimated."""

    held: Mapping[tuple[str, str], tuple[_HeldOutShare, ...]]
    """Held-out shares by (channel, quantity)."""

    def of(self, cell: MismatchCell) -> tuple[float, int]:
        """Expected square of the cell's share, from other cells near it, and their number; 0 and 0 without any."""
        near = [
            held.share**2
            for held in self.held.get((cell.output, cell.quantity), ())
            if 1 / BESIDE < held.band_hz[0] / cell.band_hz[0] < BESIDE
            and (held.fold, held.band_hz) != (_fold(cell), cell.band_hz)
        ]
        # The power of one line is exponentially distributed, with a median of ln 2 times its mean.
        return (float(np.median(near) / np.log(2)), len(near)) if near else (0.0, 0)


def model_error(held_out: Sequence[MismatchCell]) -> ModelError:
    """The typical error of a model, from its held-out cells. held_out: cells of samples that nothing was fitted to, of
    the most complete model."""
    found: dict[tuple[str, str], list[_HeldOutShare]] = {}
    for cell in held_out:
        found.setdefault((cell.output, cell.quantity), []).append(_HeldOutShare(_fold(cell), cell.band_hz, cell.share))
    return ModelError({channel: tuple(held) for channel, held in found.items()})


def adjust_for_model_error(cells: Sequence[MismatchCell], error: ModelError) -> tuple[MismatchCell, ...]:
    """The cells with p-values against noise and model error together; `beyond_noise` is kept."""
    return adjust_for_cells([replace(cell, p_value=_p_value(cell, error)) for cell in cells])


def _p_value(cell: MismatchCell, error: ModelError) -> float:
    """p-value of an F ratio of two sums of powers, each with the degrees of freedom of a chi-squared variable of its
    mean and variance (Satterthwaite, Biometrics Bulletin 2:110, 1946). The model error in the cell has the degrees of
    freedom of a single line."""
    share, count = error.of(cell)
    model_error_power = share * cell.signal_in_noise
    if not count or model_error_power <= 0:
        return cell.p_value
    expected = 1 + model_error_power
    freedom_of_cell = 2 * expected**2 / (1 / cell.lines + model_error_power**2)
    freedom_of_reference = 2 * expected**2 / (2 / cell.freedom + model_error_power**2 / (count * np.log(2) ** 2))
    return max(float(fdtrc(freedom_of_cell, freedom_of_reference, cell.in_noise**2 / expected)), cell.p_value)


def _fold(cell: MismatchCell) -> tuple[int, str, float]:
    return cell.part, cell.input, cell.amplitude
