"""Model error learned from clean recordings: the residual of the re-tuned model, which then counts as noise.

A linear model is never exact: its residual on recordings of the intact device is no evidence for a missing effect. The
residual is learned in two forms: its share of the signal by channel, input and octave (the floor of the mismatch map),
and its spectrum, as the filter that whitens it (an AR(p) model, `fit_whitening_filter`). In the diagnosed recordings
residuals pass through this filter, and their noise level is the whitened residual's rms, scaled with the signal.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.errors.choose_measure import MeasureChoice, make_measure
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.tuning import Tuning, make_tuning
from analysis.diagnosis.errors.whitened_measure import (
    WhitenedMeasure,
    WhiteningFilter,
    fit_whitening_filter,
    whiten_measure,
)
from analysis.diagnosis.localisation.mismatch_cells import MismatchCell, learn_floor
from analysis.diagnosis.localisation.mismatch_maps import compute_cells
from analysis.diagnosis.localisation.model_error_floor import IncomparableRecordingsError, ModelErrorFloor
from analysis.diagnosis.search.explain import retune_alone
from analysis.diagnosis.search.reference_recordings import ReferenceRecordings, prepare_reference_recording
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.types import Mapper, Progress
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

LEARNING_STEP = "learning from the clean recordings"
"""Name of the step for the progress callback."""
LEARNED_AT = 0.02
"""Progress (share of the whole diagnosis) at the end of learning. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class _RetunedFit:
    """The model re-tuned to a clean recording: error measure, fit, and the residual's share of the signal."""

    measure: ErrorMeasure
    tuning: Tuning
    retuned: FittedCandidate
    """The fit without effects, with its held-out error."""
    cells: tuple[MismatchCell, ...]
    """Mismatch of that fit by channel, input, octave and level."""
    channel_shares: FloatArray
    """(c,): rms of the residual above the noise over the rms of the signal."""

    @property
    def residuals(self) -> tuple[FloatArray, ...]:
        """Residuals, (n, c) each, in the channels' own units; NaN where samples do not count."""
        return tuple(
            np.where((record.fit | record.choose | record.test)[:, None], residual * self.measure.unit, np.nan)
            for record, residual in zip(self.measure.records, self.retuned.fitted.residuals, strict=True)
        )

    @property
    def signal_level(self) -> FloatArray:
        """Signal level (c,), see `_compute_signal_level`."""
        return _compute_signal_level(self.measure, self.retuned.fitted.residuals)


@dataclass(frozen=True, slots=True, eq=False)
class LearnedError:
    """A model's error on clean recordings: its size by cell, its spectrum as a whitening filter, and the recordings."""

    floor: ModelErrorFloor
    """Its share of the signal, by cell and by channel."""
    whitening: WhiteningFilter
    """Filter that makes the residuals white; see the module docstring."""
    share: FloatArray
    """(c,): rms of the whitened residual over the signal's; see `_compute_signal_level`."""
    references: ReferenceRecordings
    """The clean recordings, on which effects are fitted for comparison."""

    def make_noise_measure(self, measure: ErrorMeasure, model: MechanicalModel) -> WhitenedMeasure:
        """Make the error measure of the recordings to diagnose, with this residual as coloured noise."""
        return whiten_measure(
            measure, self.whitening, self.share * _compute_signal_level(measure, measure.residuals(model, ()))
        )


def learn_model_error(
    clean: Sequence[Recording], model: MechanicalModel, diagnosed: Sequence[Recording], map_: Mapper, progress: Progress
) -> LearnedError:
    """Learn the residual spectrum of the re-tuned model on clean recordings, as noise for the search. clean: of the
    same device, alike in channels and units; the model is re-tuned to each separately, because recordings of different
    days may differ. diagnosed: the recordings to diagnose, with the same measure. Raises IncomparableRecordingsError
    where the measures differ, numpy.linalg.LinAlgError where a fit is singular."""
    measure_name = make_measure(diagnosed, model, clean).measure.name
    fits: list[_RetunedFit] = []
    for number, recording in enumerate(clean):
        progress(LEARNING_STEP, LEARNED_AT * number / len(clean))
        measure_choice = make_measure((recording,), model, (*diagnosed, *clean))
        require_same_measure(measure_choice.measure.name, measure_name)
        fits.append(_learn_from_recording(measure_choice, model, recording, map_))
    floor = learn_floor([fit.cells for fit in fits])
    largest_shares = np.max([fit.channel_shares for fit in fits], axis=0)
    floor = replace(floor, error=measure_name, recordings=len(clean), channels=tuple(largest_shares.tolist()))
    return _learn_spectrum(floor, fits, map_)


def learn_model_floor(
    clean: Sequence[Recording], model: MechanicalModel, diagnosed: Sequence[Recording], map_: Mapper, progress: Progress
) -> ModelErrorFloor:
    """Learn only the floor of `learn_model_error`; an empty one where the clean recordings cannot be compared, or a fit
    is singular (LinAlgError)."""
    try:
        return learn_model_error(clean, model, diagnosed, map_, progress).floor
    except (IncomparableRecordingsError, np.linalg.LinAlgError):
        return ModelErrorFloor()


def require_same_measure(clean_measure: str, diagnosed_measure: str) -> None:
    """Require that clean and diagnosed recordings have the same error measure, each given by its name. Raises
    IncomparableRecordingsError where they differ."""
    if clean_measure != diagnosed_measure:
        raise IncomparableRecordingsError(
            f"the clean recordings can only be compared by {clean_measure}, those to diagnose by {diagnosed_measure}, "
            "so their errors are not comparable; give clean recordings that were made in the same way"
        )


def _learn_spectrum(floor: ModelErrorFloor, fits: Sequence[_RetunedFit], map_: Mapper) -> LearnedError:
    """Fit the whitening filter of all residuals, and compute the whitened residual's share of the signal (the largest
    of all recordings) and the clean recordings as references."""
    residuals = [record_residual for fit in fits for record_residual in fit.residuals]
    whitening = fit_whitening_filter(residuals, np.min([fit.measure.noise for fit in fits], axis=0))
    shares = [
        _compute_rms([whitening.apply(residual) for residual in fit.residuals])
        / _compute_signal_level(fit.measure, fit.retuned.fitted.residuals)
        for fit in fits
    ]
    share = np.max(shares, axis=0)
    references = [
        prepare_reference_recording(
            whiten_measure(add_learned_noise(fit.measure, floor), whitening, share * fit.signal_level),
            fit.tuning,
            fit.retuned.fitted.deviations,
            map_,
        )
        for fit in fits
    ]
    return LearnedError(floor, whitening, share, ReferenceRecordings(tuple(references), floor.margin_factor))


def _compute_signal_level(measure: ErrorMeasure, residuals: Sequence[FloatArray]) -> FloatArray:
    """Compute (c,): standard deviation of the measured or the predicted signal, whichever is smaller, so that neither
    hum and drift nor a bad model increases it."""
    measured = [record.measured for record in measure.records]
    predicted = [samples - residual * measure.unit for samples, residual in zip(measured, residuals, strict=True)]
    channel_levels = [np.nanstd(np.vstack(signals), axis=0) for signals in (measured, predicted)]
    return np.asarray(np.maximum(np.fmin(*channel_levels), np.finfo(float).tiny))


def _compute_rms(residuals: Sequence[FloatArray]) -> FloatArray:
    """Compute (c,): rms over the samples of all records; NaN is left out. residuals: (n, c) each."""
    return np.asarray(np.sqrt(np.nanmean(np.vstack(residuals) ** 2, axis=0)))


def _learn_from_recording(
    measure_choice: MeasureChoice, model: MechanicalModel, recording: Recording, map_: Mapper
) -> _RetunedFit:
    """Re-tune the model to one clean recording, and compute its mismatch cells and residual shares."""
    full_measure, tuning = measure_choice.measure, make_tuning(model, recording.command.channels)
    context = SearchContext(full_measure.shorten(), full_measure, tuning, map_)
    retuned = context.with_test_score(context.score_fit(retune_alone(context)))
    cells = compute_cells(full_measure, retuned.fitted, measure_choice.floors)
    return _RetunedFit(full_measure, tuning, retuned, cells, _compute_channel_shares(full_measure, retuned))


def _compute_channel_shares(measure: ErrorMeasure, retuned: FittedCandidate) -> FloatArray:
    """Compute (c,): rms of the residual above the noise over the rms of the signal, the largest over the samples to
    fit, to choose and to test by: sqrt(score² - 1) noise / signal, where the score is rms residual over rms noise."""
    score = retuned.score
    worst_score = np.nanmax(np.maximum([score.fit, score.choose, score.test], 1.0), axis=0)
    return np.asarray(
        np.sqrt(worst_score**2 - 1) * measure.noise / np.maximum(_compute_signal_rms(measure), np.finfo(float).tiny)
    )


def add_learned_noise(measure: ErrorMeasure, floor: ModelErrorFloor) -> ErrorMeasure:
    """Add the learned residual to the noise of a measure; unchanged without a learned share per channel."""
    return measure.with_floor(np.array(floor.channels) * _compute_signal_rms(measure)) if floor.channels else measure


def _compute_signal_rms(measure: ErrorMeasure) -> FloatArray:
    """Compute (c,): standard deviation of the measured signal, in the channel's unit."""
    return np.asarray(np.nanstd(np.vstack([record.measured for record in measure.records]), axis=0))
