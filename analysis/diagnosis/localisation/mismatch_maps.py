"""Mismatch maps of the given, the re-tuned and the completed model, by channel, band and level.

A mismatch is significant only beyond the model's typical error on held-out data. No model is exact, and its error does
not follow from the noise. The residual in a cell is therefore modelled as noise plus model error, both random, with the
error's power a share of the signal's that varies slowly with frequency. The share is estimated on the held-out cells of
the most complete model, of the same channel, in the same and the neighbouring octaves: other levels, other axes, other
recordings. Its robust estimate is the median, so that a mismatch at one level or in one octave does not raise its own
reference. Called by `assemble_findings`.
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
from analysis.diagnosis.localisation.mismatch_cells import (
    Margin,
    MismatchCell,
    Prediction,
    adjust_cell_p_values,
    compute_mismatch_cells,
)
from analysis.diagnosis.localisation.model_error_floor import ModelErrorFloor
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


def build_mismatch_maps(
    measure: ErrorMeasure,
    stages: Mapping[str, Fitted],
    floors: tuple[NoiseFloor, ...],
    learned: ModelErrorFloor | None = None,
    map_: Mapper = map,
) -> Maps:
    """Maps of all stages, tested against noise, the mismatch of clean recordings (learned), and the error of the stage
    "after" on held-out samples. stages: fits by name ("before", "retuned", "after"). floors: noise per record."""
    # Stages with the same fit are tested once.
    fits = list({id(fitted): fitted for fitted in stages.values()}.values())

    def make_map(number: int) -> Cells:
        if number == len(fits):
            return compute_cells(measure, stages["after"], floors, held_out=True)
        return compute_cells(measure, fits[number], floors, learned)

    cells_by_fit: list[Cells] = list(map_(make_map, range(len(fits) + 1)))  # type: ignore[arg-type]
    error, cells = (
        collect_model_error(cells_by_fit[-1]),
        {id(fitted): fit_cells for fitted, fit_cells in zip(fits, cells_by_fit, strict=False)},
    )
    return Maps({stage: adjust_for_model_error(cells[id(fitted)], error) for stage, fitted in stages.items()})


def summarise_worst_channel(measure: ErrorMeasure, score: FitScore, fitted: Fitted) -> tuple[Mismatch, ...]:
    """One row for the worst channel over the whole band, where no cell is significant. Its p-value is that of an error
    above the noise, in the mean over stretches (one-sided t test) or in their sum."""
    record = measure.records[0].recording
    errors = np.fmax(np.maximum(score.fit, score.choose), score.test)
    worst = int(np.argmax(errors))
    names = (*record.response.channels, *(() if record.position is None else record.position.channels))
    signal = np.sqrt(np.nanmean(measure.records[0].measured[:, worst] ** 2))
    error_rms = float(errors[worst] * measure.noise[worst])
    share = min(error_rms / signal, 1.0) if signal > 0 else 1.0
    inputs, p_value = "+".join(record.command.channels), _test_against_noise(measure, fitted, worst)
    return (Mismatch(names[worst], inputs, (0.0, record.sample_rate_hz / 2), None, None, share, p_value),)


def _test_against_noise(measure: ErrorMeasure, fitted: Fitted, channel: int) -> float:
    """p-value of an error power above that of noise, over stretches of time, within which errors are correlated.

    Twice the smaller p-value (Bonferroni) of two tests: a t test of the mean over stretches, and a chi-squared test of
    their sum with each stretch as a single sample of noise. Large errors in a few stretches raise the standard error of
    the t test, but not the limit of the chi-squared test.
    """
    powers = []
    for record, residuals in zip(measure.records, fitted.residuals, strict=True):
        channel_residuals = residuals[record.fit | record.choose | record.test, channel]
        powers += [float(np.mean(part**2)) for part in np.array_split(channel_residuals, STRETCHES) if len(part)]
    power_ratios = np.array(powers) * (measure.unit[channel] / measure.noise[channel]) ** 2
    finite_ratios = power_ratios[np.isfinite(power_ratios)]
    if len(finite_ratios) < len(power_ratios) or len(finite_ratios) < 2 or np.ptp(finite_ratios) == 0:
        return 0.0 if not finite_ratios.size or finite_ratios.mean() > 1 else 1.0
    score = (finite_ratios.mean() - 1.0) / (finite_ratios.std(ddof=1) / np.sqrt(len(finite_ratios)))
    p_of_mean, p_of_sum = (
        float(stdtr(len(finite_ratios) - 1, -score)),
        float(chdtrc(len(finite_ratios), finite_ratios.sum())),
    )
    return min(2 * min(p_of_mean, p_of_sum), 1.0)


def compute_cells(
    measure: ErrorMeasure,
    fitted: Fitted,
    floors: tuple[NoiseFloor, ...],
    learned: ModelErrorFloor | None = None,
    held_out: bool = False,
) -> Cells:
    """Cells of all records for one fit. held_out: only the samples that nothing was fitted to."""
    margin = Margin(learned=learned or ModelErrorFloor())
    cells: list[MismatchCell] = []
    for part, (record, residuals, floor) in enumerate(zip(measure.records, fitted.residuals, floors, strict=True)):
        p = record.recording.response.samples.shape[1]
        predicted = record.measured - residuals * measure.unit
        position = predicted[:, p:] if predicted.shape[1] > p else None
        used = record.choose | record.test if held_out else None
        record_cells = compute_mismatch_cells(
            record.recording, Prediction(predicted[:, :p], position), floor, used, margin
        )
        cells += [replace(cell, part=part) for cell in record_cells]
    return tuple(cells)


NEIGHBOUR_RATIO = 2.1
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

    held_out_shares: Mapping[tuple[str, str], tuple[_HeldOutShare, ...]]
    """Held-out shares by (channel, quantity)."""

    def estimate_square(self, cell: MismatchCell) -> tuple[float, int]:
        """Expected square of the cell's share, from other cells near it, and their number; 0 and 0 without any."""
        neighbour_squares = [
            reference.share**2
            for reference in self.held_out_shares.get((cell.output, cell.quantity), ())
            if 1 / NEIGHBOUR_RATIO < reference.band_hz[0] / cell.band_hz[0] < NEIGHBOUR_RATIO
            and (reference.fold, reference.band_hz) != (_identify_fold(cell), cell.band_hz)
        ]
        # The power of one line is exponentially distributed, with a median of ln 2 times its mean.
        return (
            (float(np.median(neighbour_squares) / np.log(2)), len(neighbour_squares)) if neighbour_squares else (0.0, 0)
        )


def collect_model_error(held_out: Sequence[MismatchCell]) -> ModelError:
    """The typical error of a model, from its held-out cells. held_out: cells of samples that nothing was fitted to, of
    the most complete model."""
    shares: dict[tuple[str, str], list[_HeldOutShare]] = {}
    for cell in held_out:
        shares.setdefault((cell.output, cell.quantity), []).append(
            _HeldOutShare(_identify_fold(cell), cell.band_hz, cell.share)
        )
    return ModelError({channel: tuple(channel_shares) for channel, channel_shares in shares.items()})


def adjust_for_model_error(cells: Sequence[MismatchCell], error: ModelError) -> tuple[MismatchCell, ...]:
    """The cells with p-values against noise and model error together; `beyond_noise` is kept."""
    return adjust_cell_p_values([replace(cell, p_value=_compute_p_value(cell, error)) for cell in cells])


def _compute_p_value(cell: MismatchCell, error: ModelError) -> float:
    """p-value of an F ratio of two sums of powers, each with the degrees of freedom of a chi-squared variable of its
    mean and variance (Satterthwaite, Biometrics Bulletin 2:110, 1946). The model error in the cell has the degrees of
    freedom of a single line."""
    share, count = error.estimate_square(cell)
    model_error_power = share * cell.signal_in_noise
    if not count or model_error_power <= 0:
        return cell.p_value
    expected = 1 + model_error_power
    freedom_of_cell = 2 * expected**2 / (1 / cell.lines + model_error_power**2)
    freedom_of_reference = 2 * expected**2 / (2 / cell.freedom + model_error_power**2 / (count * np.log(2) ** 2))
    return max(float(fdtrc(freedom_of_cell, freedom_of_reference, cell.in_noise**2 / expected)), cell.p_value)


def _identify_fold(cell: MismatchCell) -> tuple[int, str, float]:
    return cell.part, cell.input, cell.amplitude
