"""Shorten recordings with periodic excitation to one settled period per segment, on which hypotheses are fitted first.

The settled periods of a segment are taken to be equal except for noise. The kept samples are joined and simulated as
one recording (compared forces: each stretch is one); a run-in before each stretch lets transients decay (Pintelon and
Schoukens, System Identification, 2012, ch. 2).
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from analysis.diagnosis.errors.output_error import (
    Fitted,
    Sensitivity,
    evaluate_fit,
    stack_fit_residuals,
)
from analysis.diagnosis.forces.inverse_dynamics import compute_band_motion
from analysis.diagnosis.forces.inverse_response import compute_transmission_zeros
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.limits import RUN_IN_CONSTANTS, RUN_IN_ERROR, SHORT_SHARE
from analysis.diagnosis.noise.periods import find_settled_periods
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.types import Mask
from equalizer.effects.effect import AxisForce, JointForce
from equalizer.effects.simulation.bodies import Restarts
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.linear_simulation import compute_growth_rate
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

Indices = npt.NDArray[np.int64]
COARSE_STEP_FACTOR = 2
"""Factor on the simulation step of screening and first fits. Chosen: its error is far below that of a linearisation."""


def coarsen_steps(measure: ErrorMeasure) -> ErrorMeasure:
    """Multiply the simulation step of a free simulation by `COARSE_STEP_FACTOR`; other measures are unchanged."""
    return replace(measure, step_factor=COARSE_STEP_FACTOR) if isinstance(measure, FreeSimulation) else measure


@dataclass(frozen=True, slots=True, eq=False)
class _KeptSamples:
    """Kept samples of one record, those of them to fit, and the fitted sample that each sample repeats."""

    kept: Indices
    """(k,): indices of the simulated samples: those to fit, and the run-in around them."""
    fit: Mask
    """(n,): whether each of the n samples of the record is to be fitted."""
    repeat_of: Indices
    """(n,): index of the fitted sample of which a sample is a repeat; its own index where it is no repeat."""


@dataclass(frozen=True, slots=True, eq=False)
class ShortRecordings:
    """Search context on the kept samples alone, with their indices in the complete recordings (the long measure)."""

    context: SearchContext
    """Context whose measure holds the kept samples alone: the samples to fit are also those to choose by."""
    kept: tuple[np.ndarray, ...]
    """(k,) per record of the long measure with kept samples: their indices."""
    fitted_sample: Indices
    """(samples to fit of the long measure,): for each, the kept sample to fit of which it is a repeat."""
    fit_index: Indices
    """(kept samples to fit,): their indices among the samples to fit of the long measure."""
    long_measure: ErrorMeasure
    """The long measure: error measure of the complete recordings."""

    def has_same_errors(self, base_fit: Fitted) -> bool:
        """Whether the run-in is long enough: the residuals of the kept samples differ from those in the simulation of
        all samples by at most `RUN_IN_ERROR` times the cost, in mean square. base_fit: on all samples."""
        measure, tuning = self.context.measure, self.context.tuning
        short_fit = evaluate_fit(measure, tuning, base_fit.deviations, base_fit.hypothesis)
        errors = stack_fit_residuals(self.long_measure, base_fit.residuals).reshape(len(self.fitted_sample), -1)[
            self.fit_index
        ]
        with np.errstate(over="ignore", invalid="ignore"):  # a diverged simulation overflows
            difference = stack_fit_residuals(measure, short_fit.residuals) - errors.ravel()
            return float(np.mean(difference**2)) <= RUN_IN_ERROR * base_fit.cost

    def repeat_sensitivity(self, jacobian: Sensitivity) -> Sensitivity:
        """Convert the sensitivity on one period of each segment to the long measure: the Gram matrix counts each kept
        sample as often as it repeats."""
        root_counts = np.sqrt(np.bincount(self.fitted_sample, minlength=self._kept_sample_count)).repeat(
            jacobian.columns.shape[1] // self._kept_sample_count
        )
        weighted = jacobian.columns * root_counts
        return Sensitivity(jacobian.base_deviations, jacobian.columns, weighted @ weighted.T, self.fitted_sample)

    @property
    def _kept_sample_count(self) -> int:
        """Number of kept samples to fit, over all records."""
        return sum(int(record.fit.sum()) for record in self.context.measure.records)

    def restrict_evidence(self, evidence: Evidence) -> Evidence:
        """Restrict the evidence of the first record to the kept samples."""
        kept, n = self.kept[0], len(evidence.command)
        fit = np.concatenate([record.fit for record in self.context.measure.records])[: len(kept)]
        kept_signals = {
            field.name: value[kept]
            for field in fields(evidence)
            if isinstance(value := getattr(evidence, field.name), np.ndarray) and len(value) == n and value.ndim
        }
        used: FloatArray = fit.astype(np.float64)
        # The noise has a value per channel, which must not be cut even if there are as many channels as samples.
        return replace(
            evidence,
            **{**kept_signals, "used": used, "noise": evidence.noise, "position_noise": evidence.position_noise},
        )


def shorten_recordings(context: SearchContext, base_fit: Fitted) -> ShortRecordings | None:
    """Shorten the recordings of a context; None for windows, with references, with effects that depend on time, where
    no run-in suffices, or where `_keep_periods` returns None. base_fit: on all samples.

    A force with memory (dry friction, play) may depend on earlier samples for longer than the linear model's transients
    last. Each piece of a free simulation therefore begins with the motion of the simulation of all samples (states of
    the forces continue from the previous piece), and the run-in is doubled until the errors agree (`has_same_errors`).
    """
    measure = context.measure
    if not isinstance(measure, (FreeSimulation, PredictedForce)) or context.references is not None:
        return None
    effects = base_fit.hypothesis.list_placed_effects()
    if any(effect.effect.of_time for effect in (*measure.model_effects, *effects)):
        return None
    has_memory = any(
        isinstance(effect.effect.action, (AxisForce, JointForce)) for effect in (*measure.model_effects, *effects)
    )
    before_s, after_s = _compute_run_in_s(measure, context.tuning.model)
    periods, kept_count = [_select_last_periods(record) for record in measure.records], -1
    while (shortened := _keep_periods(context, measure, periods, (before_s, after_s))) is not None:
        if has_memory and isinstance(measure, FreeSimulation):
            shortened = _restart_pieces(shortened, measure, base_fit)
        if not has_memory or shortened.has_same_errors(base_fit):
            return shortened
        # A diverged simulation never agrees; the loop ends when a longer run-in adds no samples.
        if (new_count := sum(map(len, shortened.kept))) == kept_count:
            return None
        kept_count, before_s, after_s = new_count, 2 * before_s, 2 * after_s
    return None


def _keep_periods(
    context: SearchContext,
    measure: FreeSimulation | PredictedForce,
    periods: Sequence[tuple[Mask, Indices]],
    run_in_s: tuple[float, float],
) -> ShortRecordings | None:
    """Shorten the recordings to the given periods; None where more than `SHORT_SHARE` of the samples would be kept,
    the first record would keep none, or `_split_pieces` returns None. run_in_s: as for `_add_run_in`."""
    cuts = [_add_run_in(record, cut, run_in_s) for record, cut in zip(measure.records, periods, strict=True)]
    total_samples = sum(len(record.command) for record in measure.records)
    if not len(cuts[0].kept) or sum(len(cut.kept) for cut in cuts) > SHORT_SHARE * total_samples:
        return None
    short_measure = _split_pieces(measure, cuts) if isinstance(measure, PredictedForce) else _join_pieces(measure, cuts)
    if short_measure is None:
        return None
    fitted = np.concatenate([cut.fit[record.fit] for record, cut in zip(measure.records, cuts, strict=True)])
    kept = tuple(cut.kept for cut in cuts if len(cut.kept))
    return ShortRecordings(
        replace(context, measure=short_measure), kept, _index_repeats(measure, cuts), np.flatnonzero(fitted), measure
    )


def _restart_pieces(shortened: ShortRecordings, measure: FreeSimulation, base_fit: Fitted) -> ShortRecordings:
    """Start each piece from the state of the simulation of all samples at its beginning."""
    records = [record for record in measure.records if record.fit.any()]
    model, effects = shortened.context.tuning.tune(base_fit.deviations), base_fit.hypothesis.list_placed_effects()
    restarts = []
    for record, kept in zip(records, shortened.kept, strict=True):
        starts = np.flatnonzero(np.diff(kept, prepend=-2) > 1)
        restarts.append(Restarts(starts, measure.simulate_states_before(model, effects, record, kept[starts])))
    restarted_measure = replace(shortened.context.measure, restarts=tuple(restarts))  # type: ignore[type-var]
    return replace(shortened, context=replace(shortened.context, measure=restarted_measure))


def _index_repeats(measure: ErrorMeasure, cuts: Sequence[_KeptSamples]) -> Indices:
    """Compute `ShortRecordings.fitted_sample`: indices among the kept samples to fit of all records."""
    indices, offset = [], 0
    for record, cut in zip(measure.records, cuts, strict=True):
        indices.append(offset + (np.cumsum(cut.fit) - 1)[cut.repeat_of[record.fit]])
        offset += int(cut.fit.sum())
    return np.concatenate(indices)


def _compute_run_in_s(measure: FreeSimulation | PredictedForce, model: MechanicalModel) -> tuple[float, float]:
    """Compute the seconds before and after a stretch on which its errors depend: `RUN_IN_CONSTANTS` time constants of
    the model for a simulation; for a predicted force, which depends on earlier and later motion, of the model's inverse
    (its zeros) and of the band limit."""
    if isinstance(measure, FreeSimulation):
        return RUN_IN_CONSTANTS / max(-compute_growth_rate(model), np.finfo(float).tiny), 0.0
    zero_decay_rates = np.abs(compute_transmission_zeros(model, 2 * np.pi * measure.band_hz).real)
    settling_s = RUN_IN_CONSTANTS / max(float(zero_decay_rates.min(initial=np.inf)), np.finfo(float).tiny)
    return (settling_s + RUN_IN_CONSTANTS / measure.band_hz,) * 2


def _select_last_periods(record: Observed) -> tuple[Mask, Indices]:
    """Select `fit` and `repeat_of` of `_KeptSamples`: a settled segment keeps only its last period, if to be fitted."""
    fit, repeat_of = record.fit.copy(), np.arange(len(record.fit))
    for periods in find_settled_periods(record.recording):
        segment = slice(periods.segment.start, periods.segment.stop)
        last_period = slice(periods.starts[-1], periods.starts[-1] + periods.length)
        if periods.settled and fit[segment].any() and last_period.stop <= len(fit) and record.fit[last_period].all():
            fit[segment] = False
            fit[last_period] = True
            repeat_of[segment] = last_period.start + (repeat_of[segment] - last_period.start) % periods.length
    return fit, repeat_of


def _add_run_in(record: Observed, periods: tuple[Mask, Indices], run_in_s: tuple[float, float]) -> _KeptSamples:
    """Add the run-in to the samples to fit. run_in_s: seconds kept before and after each stretch to fit."""
    fit, repeat_of = periods
    samples_before, samples_after = (int(np.ceil(min(s * record.recording.sample_rate_hz, len(fit)))) for s in run_in_s)
    simulated, edges = fit.copy(), np.diff(np.concatenate([[0], fit.astype(np.int8), [0]]))
    for start, stop in zip(np.flatnonzero(edges > 0).tolist(), np.flatnonzero(edges < 0).tolist(), strict=True):
        simulated[max(start - samples_before, 0) : stop + samples_after] = True
    return _KeptSamples(np.flatnonzero(simulated), fit, repeat_of)


def _join_pieces(measure: FreeSimulation, cuts: Sequence[_KeptSamples]) -> FreeSimulation:
    """Build the measure on the kept samples, joined end to end; records without any are left out."""
    pairs = zip(measure.records, cuts, strict=True)
    return measure.with_records(tuple(_cut_record(record, cut.kept, cut.fit) for record, cut in pairs if len(cut.kept)))


def _split_pieces(measure: PredictedForce, cuts: Sequence[_KeptSamples]) -> PredictedForce | None:
    """Build the measure with each kept stretch as a record; None for a record without kept samples, or a stretch
    without command on an axis that the whole record drives, because errors are relative to the command."""
    records, motions = [], []
    for record, motion, cut in zip(measure.records, measure.motions, cuts, strict=True):
        is_driven = np.abs(record.command).max(axis=0) > 0
        for kept in np.split(cut.kept, np.flatnonzero(np.diff(cut.kept) > 1) + 1):
            piece = _cut_record(record, kept, cut.fit)
            if not len(kept) or (is_driven & (np.abs(piece.command).max(axis=0) == 0)).any():
                return None
            records.append(piece)
            motions.append(compute_band_motion(motion.position[kept], motion.sample_rate_hz, measure.band_hz))
    return replace(measure, records=tuple(records), motions=tuple(motions))


def _cut_record(record: Observed, kept: Indices, fit: Mask) -> Observed:
    """Reduce a record to the kept samples. Samples to fit are also those to choose by; none is held out."""
    is_held_out = np.zeros(len(kept), dtype=np.bool_)
    return Observed(record.recording, record.command[kept], record.measured[kept], fit[kept], fit[kept], is_held_out)
