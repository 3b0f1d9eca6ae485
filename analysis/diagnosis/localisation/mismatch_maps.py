"""Mismatch maps of the given, the re-tuned and the completed model, by channel, frequency band and excitation level.

A mismatch is significant only beyond the model's typical error on held-out data, where that is known. No model is
exact, and its error does not follow from the noise. The residual in a cell is therefore modelled as noise plus model
error, both random, with the error's power a share of the signal's that varies slowly with frequency. The share is
estimated on the other held-out cells of the most complete model, of the same channel, in the same and the neighbouring
octaves. Its robust estimate is the median, so that a mismatch at one level or in one octave hardly raises its own
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
from analysis.diagnosis.forces.predicted_force import PredictedForce
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
"""The mismatch map of one model: cells of all records."""
STRETCH_COUNT = 16
"""Number of equal stretches of a record over which error powers are compared with noise. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class MismatchMaps:
    """Mismatch cells of the given, the re-tuned and the completed model."""

    cells: Mapping[str, Cells]
    """The map of each stage; keys "before" (model as given), "retuned", "after" (completed with the effects)."""

    @property
    def rows(self) -> tuple[Mismatch, ...]:
        """Rows of all cells of the model as given, with shares and p-values of at most 1."""
        return tuple(
            Mismatch(
                cell.output,
                cell.input,
                cell.band_hz,
                cell.amplitude or None,
                None,
                min(cell.share, 1.0),
                min(cell.adjusted_p_value, 1.0),
            )
            for cell in self.cells["before"]
        )


def build_mismatch_maps(
    measure: ErrorMeasure,
    stages: Mapping[str, Fitted],
    floors: tuple[NoiseFloor, ...],
    learned: ModelErrorFloor | None = None,
    map_: Mapper = map,
) -> MismatchMaps:
    """Build the maps of all stages, tested against noise, the mismatch of clean recordings (learned; None: none), and
    the error of the stage "after" on held-out samples. stages: fits by name ("before", "retuned", "after"; the last is
    required). floors: noise of each record. map_: a possibly parallel `map`."""
    # Stages that share a fit are computed once; the last item is the held-out error of the stage "after".
    fits = list({id(fitted): fitted for fitted in stages.values()}.values())

    def compute_fit_cells(fit_index: int) -> Cells:
        if fit_index == len(fits):
            return compute_cells(measure, stages["after"], floors, held_out=True)
        return compute_cells(measure, fits[fit_index], floors, learned)

    computed_cells: list[Cells] = list(map_(compute_fit_cells, range(len(fits) + 1)))  # type: ignore[arg-type]
    model_error, cells_by_fit_id = (
        collect_model_error(computed_cells[-1]),
        {id(fitted): fit_cells for fitted, fit_cells in zip(fits, computed_cells, strict=False)},
    )
    return MismatchMaps(
        {stage: adjust_for_model_error(cells_by_fit_id[id(fitted)], model_error) for stage, fitted in stages.items()}
    )


def summarise_worst_channel(measure: ErrorMeasure, score: FitScore, fitted: Fitted) -> tuple[Mismatch, ...]:
    """Make one row for the channel with the largest error over the whole band, for use where no other row is listed.
    Its p-value is that of an error above the noise (`_test_against_noise`); its share of the signal is at most 1."""
    record = measure.records[0].recording
    errors = np.fmax(np.maximum(score.fit, score.choose), score.test)
    worst_channel = int(np.argmax(errors))
    channel_names = (*record.response.channels, *(() if record.position is None else record.position.channels))
    signal_rms = np.sqrt(np.nanmean(measure.records[0].measured[:, worst_channel] ** 2))
    error_rms = float(errors[worst_channel] * measure.noise[worst_channel])
    error_share = min(error_rms / signal_rms, 1.0) if signal_rms > 0 else 1.0
    command_names, p_value = "+".join(record.command.channels), _test_against_noise(measure, fitted, worst_channel)
    return (
        Mismatch(
            channel_names[worst_channel],
            command_names,
            (0.0, _find_compared_band_end_hz(measure)),
            None,
            None,
            error_share,
            p_value,
        ),
    )


def _test_against_noise(measure: ErrorMeasure, fitted: Fitted, channel: int) -> float:
    """Compute the p-value of an error power above that of noise, over `STRETCH_COUNT` stretches of each record, within
    which errors are correlated.

    Twice the smaller p-value (Bonferroni), at most 1, of two tests: a one-sided t test of the mean over stretches, and
    a chi-squared test of their sum with each stretch as a single sample of noise. Large errors in a few stretches raise
    the standard error of the t test, but not the limit of the chi-squared test. Where the tests are not defined (an
    infinite power, fewer than two stretches, all equal): 0 for a mean of the finite powers above that of noise or
    without any, else 1.
    """
    powers = []
    for record, residuals in zip(measure.records, fitted.residuals, strict=True):
        channel_residuals = residuals[record.fit | record.choose | record.test, channel]
        powers += [
            float(np.mean(stretch**2)) for stretch in np.array_split(channel_residuals, STRETCH_COUNT) if len(stretch)
        ]
    power_ratios = np.array(powers) * (measure.unit[channel] / measure.noise[channel]) ** 2
    finite_ratios = power_ratios[np.isfinite(power_ratios)]
    if len(finite_ratios) < len(power_ratios) or len(finite_ratios) < 2 or np.ptp(finite_ratios) == 0:
        return 0.0 if not finite_ratios.size or finite_ratios.mean() > 1 else 1.0
    t_statistic = (finite_ratios.mean() - 1.0) / (finite_ratios.std(ddof=1) / np.sqrt(len(finite_ratios)))
    mean_p_value, sum_p_value = (
        float(stdtr(len(finite_ratios) - 1, -t_statistic)),
        float(chdtrc(len(finite_ratios), finite_ratios.sum())),
    )
    return min(2 * min(mean_p_value, sum_p_value), 1.0)


def compute_cells(
    measure: ErrorMeasure,
    fitted: Fitted,
    floors: tuple[NoiseFloor, ...],
    learned: ModelErrorFloor | None = None,
    held_out: bool = False,
) -> Cells:
    """Compute the cells of all records for one fit. Where forces are compared, only of bands that their filter passes
    over at least half an octave. held_out: only from the samples to choose by (to which `confirm_laws` fits, too) and
    to test. learned: mismatch of clean recordings."""
    margin = Margin(learned=learned or ModelErrorFloor())
    highest_low_hz = measure.band_hz / np.sqrt(2.0) if isinstance(measure, PredictedForce) else np.inf
    cells: list[MismatchCell] = []
    for record_index, (record, residuals, floor) in enumerate(
        zip(measure.records, fitted.residuals, floors, strict=True)
    ):
        response_count = record.recording.response.samples.shape[1]
        prediction = record.measured - residuals * measure.unit
        position = prediction[:, response_count:] if prediction.shape[1] > response_count else None
        used_samples = record.choose | record.test if held_out else None
        record_cells = compute_mismatch_cells(
            record.recording, Prediction(prediction[:, :response_count], position), floor, used_samples, margin
        )
        cells += [replace(cell, part=record_index) for cell in record_cells if cell.band_hz[0] < highest_low_hz]
    return tuple(cells)


def _find_compared_band_end_hz(measure: ErrorMeasure) -> float:
    """Find the upper end in Hz of the band in which the measure compares: of the forces' filter (to four digits),
    else half the rate."""
    half_rate_hz = measure.records[0].recording.sample_rate_hz / 2
    return min(float(f"{measure.band_hz:.4g}"), half_rate_hz) if isinstance(measure, PredictedForce) else half_rate_hz


MAX_NEIGHBOUR_RATIO = 2.1
"""Ratio of the lower ends of two octave bands below which these are the same or neighbours: 2, with a tolerance."""


@dataclass(frozen=True, slots=True)
class _HeldOutShare:
    """Mismatch of a held-out cell as a share of the signal, rms."""

    fold: tuple[int, str, float]
    """Index of the record, driven input, and level of the cell."""
    band_hz: Band
    share: float


@dataclass(frozen=True, slots=True, eq=False)
class ModelError:
    """Held-out mismatch as shares of the signal, from which the expected model error near a cell is estimated."""

    held_out_shares: Mapping[tuple[str, str], tuple[_HeldOutShare, ...]]
    """Held-out shares by (channel, quantity)."""

    def estimate_squared_share(self, cell: MismatchCell) -> tuple[float, int]:
        """Estimate the expected square of the cell's share from the other cells of its channel in the same and the
        neighbouring octaves, and their number; 0 and 0 without any."""
        neighbour_squares = [
            neighbour.share**2
            for neighbour in self.held_out_shares.get((cell.output, cell.quantity), ())
            if 1 / MAX_NEIGHBOUR_RATIO < neighbour.band_hz[0] / cell.band_hz[0] < MAX_NEIGHBOUR_RATIO
            and (neighbour.fold, neighbour.band_hz) != (_identify_fold(cell), cell.band_hz)
        ]
        # The power of one line is exponentially distributed, with a median of ln 2 times its mean.
        return (
            (float(np.median(neighbour_squares) / np.log(2)), len(neighbour_squares)) if neighbour_squares else (0.0, 0)
        )


def collect_model_error(held_out_cells: Sequence[MismatchCell]) -> ModelError:
    """Collect the mismatch shares of the held-out cells of the most complete model by channel."""
    shares_by_channel: dict[tuple[str, str], list[_HeldOutShare]] = {}
    for cell in held_out_cells:
        shares_by_channel.setdefault((cell.output, cell.quantity), []).append(
            _HeldOutShare(_identify_fold(cell), cell.band_hz, cell.share)
        )
    return ModelError({channel: tuple(channel_shares) for channel, channel_shares in shares_by_channel.items()})


def adjust_for_model_error(cells: Sequence[MismatchCell], model_error: ModelError) -> tuple[MismatchCell, ...]:
    """Return the cells with p-values against noise and model error together, and newly adjusted; `beyond_noise` is
    unchanged."""
    return adjust_cell_p_values([replace(cell, p_value=_compute_p_value(cell, model_error)) for cell in cells])


def _compute_p_value(cell: MismatchCell, model_error: ModelError) -> float:
    """Compute the p-value of an F ratio of two sums of powers, each with the degrees of freedom of a chi-squared
    variable of its mean and variance (Satterthwaite, Biometrics Bulletin 2:110, 1946); at least the p-value against
    noise, which is returned without neighbours or without model error. The model error in the cell has the degrees of
    freedom of a single line."""
    squared_share, neighbour_count = model_error.estimate_squared_share(cell)
    model_error_power = squared_share * cell.signal_in_noise
    if not neighbour_count or model_error_power <= 0:
        return cell.p_value
    expected_power = 1 + model_error_power
    cell_freedom = 2 * expected_power**2 / (1 / cell.lines + model_error_power**2)
    reference_freedom = (
        2 * expected_power**2 / (2 / cell.freedom + model_error_power**2 / (neighbour_count * np.log(2) ** 2))
    )
    return max(float(fdtrc(cell_freedom, reference_freedom, cell.in_noise**2 / expected_power)), cell.p_value)


def _identify_fold(cell: MismatchCell) -> tuple[int, str, float]:
    """Return record index, driven input and level, by which the cell's own share is excluded from its reference."""
    return cell.part, cell.input, cell.amplitude
