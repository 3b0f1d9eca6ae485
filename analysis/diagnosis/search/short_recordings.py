"""Shortens recordings with a periodic drive to one settled period per segment, on which hypotheses are compared first.

All settled periods of a segment are equal except for noise. The kept samples are joined end to end and simulated as one
recording; a run-in before each kept stretch lets the transients of the initial state decay (Pintelon and Schoukens,
System Identification, 2012, ch. 2: transients of periodic excitation).
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from analysis.diagnosis.errors.hypothesis import Hypothesis, has_motion_forces
from analysis.diagnosis.errors.output_error import (
    Fitted,
    Sensitivity,
    evaluate_fit,
    fit,
    residuals_to_fit,
    sensitivity,
)
from analysis.diagnosis.forces.inverse_dynamics import band_motion
from analysis.diagnosis.forces.inverse_response import zeros_of
from analysis.diagnosis.forces.predicted_force import PredictedForce
from analysis.diagnosis.noise.periods import find_settled_periods
from analysis.diagnosis.search.screening import ScreenedHypothesis, screen
from analysis.diagnosis.search.search_context import FITTING, SCREENING, SearchContext, first_fits, sensitivity_at
from analysis.diagnosis.settings import RUN_IN_CONSTANTS, RUN_IN_ERROR, SHORT_SHARE, WORTH_FITTING
from analysis.diagnosis.types import Mask
from equalizer.effects.effect import AxisForce, JointForce
from equalizer.effects.simulation.bodies import Restarts
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.linear_simulation import growth_rate
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

Places = npt.NDArray[np.int64]


COARSER = 2
"""Factor on the simulation step where hypotheses are only ranked and their fits begun: the integration error stays far
below the error of the linearised prediction of gains."""


def coarsen(measure: ErrorMeasure) -> ErrorMeasure:
    """The measure with `COARSER` times the simulation step, if it simulates freely; else the measure itself."""
    return replace(measure, coarser=COARSER) if isinstance(measure, FreeSimulation) else measure


@dataclass(frozen=True, slots=True, eq=False)
class _Cut:
    """Which samples of one record are kept, which are fitted, and which are repeats of fitted ones."""

    kept: Places
    """(k,): indices of the simulated samples: those to fit, with the run-in around them."""
    fit: Mask
    """(n,): the samples to fit, among all n of the record."""
    repeat_of: Places
    """(n,): index of the fitted sample of which a sample is a repeat; its own index where it is no repeat."""


@dataclass(frozen=True, slots=True, eq=False)
class ShortRecordings:
    """A search context on the kept samples alone, and how these map to the samples of the whole recordings."""

    context: SearchContext
    """Context whose measure holds the kept samples alone: the samples to fit are also those to choose by."""
    kept: tuple[np.ndarray, ...]
    """(k,) per record of the long measure with kept samples: their indices."""
    fitted_sample: Places
    """(samples to fit of the long measure,): for each, the kept sample to fit of which it is a repeat."""
    place: Places
    """(kept samples to fit,): their indices among the samples to fit of the long measure."""
    whole: ErrorMeasure
    """The long measure: of the whole recordings."""

    def has_same_errors(self, held: Fitted) -> bool:
        """Whether the run-in is long enough: the residuals of the kept samples differ from those in the simulation of
        all samples by at most `RUN_IN_ERROR` times the cost, in mean square. held: fitted on all samples."""
        short, tuning = self.context.measure, self.context.tuning
        here = evaluate_fit(short, tuning, held.deviations, held.hypothesis)
        there = residuals_to_fit(self.whole, held.residuals).reshape(len(self.fitted_sample), -1)[self.place]
        with np.errstate(over="ignore", invalid="ignore"):  # a diverged simulation overflows
            apart = residuals_to_fit(short, here.residuals) - there.ravel()
            return float(np.mean(apart**2)) <= RUN_IN_ERROR * held.cost

    def repeat_sensitivity(self, known: Sensitivity) -> Sensitivity:
        """The sensitivity on the long measure, from that on one period of each segment: the Gram matrix counts each
        kept sample as often as it repeats."""
        times = np.sqrt(np.bincount(self.fitted_sample, minlength=self._samples)).repeat(
            known.columns.shape[1] // self._samples
        )
        weighed = known.columns * times
        return Sensitivity(known.at, known.columns, weighed @ weighed.T, self.fitted_sample)

    @property
    def _samples(self) -> int:
        return sum(int(record.fit.sum()) for record in self.context.measure.records)

    def of(self, evidence: Evidence) -> Evidence:
        """The evidence of the first record, restricted to the kept samples."""
        kept, n = self.kept[0], len(evidence.command)
        fit = np.concatenate([record.fit for record in self.context.measure.records])[: len(kept)]
        cut = {
            field.name: value[kept]
            for field in fields(evidence)
            if isinstance(value := getattr(evidence, field.name), np.ndarray) and len(value) == n and value.ndim
        }
        used: FloatArray = fit.astype(np.float64)
        # The noise has a value per channel, which must not be cut even if there are as many channels as samples.
        return replace(
            evidence, **{**cut, "used": used, "noise": evidence.noise, "position_noise": evidence.position_noise}
        )


def short_recordings_of(context: SearchContext, held: Fitted) -> ShortRecordings | None:
    """The shortened recordings; None where little would be saved, where effects depend on time within it, or where the
    first record, which gives the evidence, has no samples to fit. held: the base fit, on all samples.

    A force with memory (dry friction, play) may depend on earlier samples for longer than the linear model's transients
    last. Each piece therefore begins with the positions and velocities of the simulation of all samples (states of the
    forces continue from the piece before), and the run-in is doubled until the errors agree (`has_same_errors`).
    """
    measure = context.measure
    if not isinstance(measure, (FreeSimulation, PredictedForce)) or context.references is not None:
        return None
    placed = held.hypothesis.list_placed_effects()
    if any(each.effect.of_time for each in (*measure.known, *placed)):
        return None
    remembers = any(isinstance(each.effect.acts, (AxisForce, JointForce)) for each in (*measure.known, *placed))
    before_s, after_s = _run_in_s(measure, context.tuning.model)
    periods, kept = [_last_periods(record) for record in measure.records], -1
    while (short := _shorten(context, measure, periods, (before_s, after_s))) is not None:
        if remembers and isinstance(measure, FreeSimulation):
            short = _continue_from(short, measure, held)
        if not remembers or short.has_same_errors(held):
            return short
        # A diverged simulation never agrees; the loop ends when a longer run-in adds no samples.
        if (now := sum(map(len, short.kept))) == kept:
            return None
        kept, before_s, after_s = now, 2 * before_s, 2 * after_s
    return None


def _shorten(
    context: SearchContext,
    measure: FreeSimulation | PredictedForce,
    periods: Sequence[tuple[Mask, Places]],
    around_s: tuple[float, float],
) -> ShortRecordings | None:
    """The recordings shortened to the given periods; None where more than `SHORT_SHARE` of the samples would be kept.
    around_s: as for `_cut`."""
    cut = [_cut(record, each, around_s) for record, each in zip(measure.records, periods, strict=True)]
    before = sum(len(record.command) for record in measure.records)
    if not len(cut[0].kept) or sum(len(each.kept) for each in cut) > SHORT_SHARE * before:
        return None
    short = _cut_in_pieces(measure, cut) if isinstance(measure, PredictedForce) else _join_pieces(measure, cut)
    if short is None:
        return None
    fitted = np.concatenate([each.fit[record.fit] for record, each in zip(measure.records, cut, strict=True)])
    kept = tuple(each.kept for each in cut if len(each.kept))
    return ShortRecordings(
        replace(context, measure=short), kept, _index_fitted(measure, cut), np.flatnonzero(fitted), measure
    )


def _continue_from(short: ShortRecordings, measure: FreeSimulation, held: Fitted) -> ShortRecordings:
    """The shortened recordings, each piece started from the state that the simulation of all samples has there."""
    records = [record for record in measure.records if record.fit.any()]
    model, effects = short.context.tuning.tune(held.deviations), held.hypothesis.list_placed_effects()
    pieces = []
    for record, kept in zip(records, short.kept, strict=True):
        begun = np.flatnonzero(np.diff(kept, prepend=-2) > 1)
        pieces.append(Restarts(begun, measure.states_before(model, effects, record, kept[begun])))
    joined = replace(short.context.measure, pieces=tuple(pieces))  # type: ignore[type-var]
    return replace(short, context=replace(short.context, measure=joined))


def _index_fitted(measure: ErrorMeasure, cut: Sequence[_Cut]) -> Places:
    """`ShortRecordings.fitted_sample`: indices over the kept samples to fit of all records."""
    found, before = [], 0
    for record, each in zip(measure.records, cut, strict=True):
        found.append(before + (np.cumsum(each.fit) - 1)[each.repeat_of[record.fit]])
        before += int(each.fit.sum())
    return np.concatenate(found)


def _run_in_s(measure: FreeSimulation | PredictedForce, model: MechanicalModel) -> tuple[float, float]:
    """Seconds before and after a stretch on which its errors depend: `RUN_IN_CONSTANTS` time constants of the model for
    a simulation; for a predicted force, which depends on earlier and later motion, of the model's inverse (its zeros)
    and of the band limit."""
    if isinstance(measure, FreeSimulation):
        return RUN_IN_CONSTANTS / max(-growth_rate(model), np.finfo(float).tiny), 0.0
    rates = np.abs(zeros_of(model, 2 * np.pi * measure.band_hz).real)
    rings_s = RUN_IN_CONSTANTS / max(float(rates.min(initial=np.inf)), np.finfo(float).tiny)
    return (rings_s + RUN_IN_CONSTANTS / measure.band_hz,) * 2


def _last_periods(record: Observed) -> tuple[Mask, Places]:
    """`fit` and `repeat_of` of a `_Cut`: in each settled segment, only the last period is fitted."""
    fit, repeat_of = record.fit.copy(), np.arange(len(record.fit))
    for periods in find_settled_periods(record.recording):
        inside = slice(periods.segment.start, periods.segment.stop)
        last = slice(periods.starts[-1], periods.starts[-1] + periods.length)
        if periods.settled and fit[inside].any() and last.stop <= len(fit) and record.fit[last].all():
            fit[inside] = False
            fit[last] = True
            repeat_of[inside] = last.start + (repeat_of[inside] - last.start) % periods.length
    return fit, repeat_of


def _cut(record: Observed, periods: tuple[Mask, Places], around_s: tuple[float, float]) -> _Cut:
    """The samples to fit with their run-in. around_s: seconds kept before and after each stretch to fit."""
    fit, repeat_of = periods
    before, after = (int(np.ceil(min(s * record.recording.sample_rate_hz, len(fit)))) for s in around_s)
    needed, edges = fit.copy(), np.diff(np.concatenate([[0], fit.astype(np.int8), [0]]))
    for start, stop in zip(np.flatnonzero(edges > 0).tolist(), np.flatnonzero(edges < 0).tolist(), strict=True):
        needed[max(start - before, 0) : stop + after] = True
    return _Cut(np.flatnonzero(needed), fit, repeat_of)


def _join_pieces(measure: FreeSimulation, cut: Sequence[_Cut]) -> FreeSimulation:
    """The measure on the kept samples, joined end to end."""
    pairs = zip(measure.records, cut, strict=True)
    return measure.with_records(
        tuple(_cut_record(record, each.kept, each.fit) for record, each in pairs if len(each.kept))
    )


def _cut_in_pieces(measure: PredictedForce, cut: Sequence[_Cut]) -> PredictedForce | None:
    """The measure with each kept stretch as a separate record; None where a stretch does not drive an axis that the
    whole record drives, because errors are relative to the command."""
    records, motions = [], []
    for record, motion, each in zip(measure.records, measure.motions, cut, strict=True):
        driven = np.abs(record.command).max(axis=0) > 0
        for kept in np.split(each.kept, np.flatnonzero(np.diff(each.kept) > 1) + 1):
            piece = _cut_record(record, kept, each.fit)
            if not len(kept) or (driven & (np.abs(piece.command).max(axis=0) == 0)).any():
                return None
            records.append(piece)
            motions.append(band_motion(motion.position[kept], motion.sample_rate_hz, measure.band_hz))
    return replace(measure, records=tuple(records), motions=tuple(motions))


def _cut_record(record: Observed, kept: Places, fit: Mask) -> Observed:
    """A record of the kept samples alone. Samples to fit are those to choose by; none is held out."""
    held_out = np.zeros(len(kept), dtype=np.bool_)
    return Observed(record.recording, record.command[kept], record.measured[kept], fit[kept], fit[kept], held_out)


def fits_on_short_recordings(
    context: SearchContext,
    short_form: ShortRecordings,
    base: Fitted,
    timeless: Sequence[Hypothesis],
    timed: Sequence[Hypothesis],
) -> list[Fitted]:
    """First fits on all samples, the best first, of hypotheses that were screened on short recordings. timed:
    hypotheses that depend on sampling times, which short recordings cannot judge; fitted only where their predicted
    reduction of the cost is not far below the others' (`_keep_promising`)."""
    short, guard = replace(short_form.context, measure=coarsen(short_form.context.measure)), context.guard
    begun = evaluate_fit(short.measure, short.tuning, base.deviations, base.hypothesis)
    known = sensitivity_at(short, base.deviations, base.hypothesis, with_forces=True)
    screened = screen(short.measure, short.tuning, begun, known, timeless, guard.over(short.map_, SCREENING))
    of_all, forced = short_form.repeat_sensitivity(known), has_motion_forces(base.hypothesis)
    if forced:
        of_all = sensitivity(context.measure, context.tuning, base.deviations, base.hypothesis, context.map_)

    def whole(fitted: Fitted) -> Fitted:
        there = evaluate_fit(context.measure, context.tuning, fitted.deviations, fitted.hypothesis)
        # One step on all samples: slow motion under friction, which one period lacks, is no error of the law.
        return fit(context.measure, context.tuning, there, of_all, 1) if forced else there

    each, found = guard.over(context.map_, FITTING), first_fits(short, begun, known, screened)
    fits: list[Fitted] = list(each(whole, found))  # type: ignore[arg-type]
    if timed:
        coarse = replace(context, measure=coarsen(context.measure))
        begun_whole = evaluate_fit(coarse.measure, context.tuning, base.deviations, base.hypothesis)
        screened = screen(
            coarse.measure, context.tuning, begun_whole, of_all, timed, guard.over(context.map_, SCREENING)
        )
        promising = _keep_promising((begun, found), begun_whole, screened)
        fits += each(whole, first_fits(coarse, begun_whole, of_all, promising))  # type: ignore[arg-type]
    # Hypotheses whose parameters the short recordings do not determine may diverge on all samples: left out.
    return sorted((law for law in fits if np.isfinite(law.cost)), key=lambda law: law.cost)


def _keep_promising(
    others: tuple[Fitted, Sequence[Fitted]], begun_whole: Fitted, screened: Sequence[ScreenedHypothesis]
) -> list[ScreenedHypothesis]:
    """The hypotheses whose predicted relative reduction of the cost is at least `WORTH_FITTING` of the best one among
    the others. It is relative because costs of the others refer to other samples and steps. others: base and fits."""
    base, fits = others
    best = max((1 - law.cost / base.cost for law in fits), default=0.0)
    return [law for law in screened if 1 - law.cost / begun_whole.cost >= max(WORTH_FITTING * best, 0.0)]
