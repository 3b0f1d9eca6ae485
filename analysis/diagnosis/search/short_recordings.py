"""Shortens periodic recordings to one settled period per segment, on which laws are compared first.

The further periods of a segment repeat the first but for noise. What is kept is joined end to end and simulated as one
recording; a run-in before each kept stretch lets initial transients decay (Pintelon and Schoukens 2012, System
Identification, ch. 2: transients of periodic excitation).
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
"""Factor on the simulation step where laws are only ranked and their fits begun. The integration error stays far below
that of the linearisation that predicts gains."""


def coarsen(measure: ErrorMeasure) -> ErrorMeasure:
    """The measure with longer simulation steps, where it simulates freely."""
    return replace(measure, coarser=COARSER) if isinstance(measure, FreeSimulation) else measure


@dataclass(frozen=True, slots=True, eq=False)
class _Cut:
    """Which samples of one record are kept, fitted, and repeats of others."""

    kept: Places
    """Samples that are simulated: those to fit with the run-in before them."""
    fit: Mask
    """(n,): samples to fit among all of the record."""
    repeat_of: Places
    """(n,): for each sample, the fitted sample of which it is a repeat; itself where it is none."""


@dataclass(frozen=True, slots=True, eq=False)
class ShortRecordings:
    """A search context on the kept samples alone, and how these map to the samples of the whole recordings."""

    context: SearchContext
    """Context whose measure holds the kept samples alone: the samples to fit are also those to choose by."""
    kept: tuple[np.ndarray, ...]
    """Per record of the long measure that has any, the samples that are kept."""
    fitted_sample: Places
    """(samples to fit of the long measure,): for each, the kept sample to fit of which it is a repeat."""
    place: Places
    """(kept samples to fit,): their indices among the samples to fit of the long measure."""
    whole: ErrorMeasure
    """The long measure."""

    def has_same_errors(self, held: Fitted) -> bool:
        """Whether the kept samples have nearly the errors that they have in the simulation of all samples: the mean
        square difference is at most `RUN_IN_ERROR` times the cost. held: fitted on all samples."""
        short, tuning = self.context.measure, self.context.tuning
        here = evaluate_fit(short, tuning, held.deviations, held.hypothesis)
        there = residuals_to_fit(self.whole, held.residuals).reshape(len(self.fitted_sample), -1)[self.place]
        with np.errstate(over="ignore", invalid="ignore"):  # of a simulation that diverged
            apart = residuals_to_fit(short, here.residuals) - there.ravel()
            return float(np.mean(apart**2)) <= RUN_IN_ERROR * held.cost

    def repeat_sensitivity(self, known: Sensitivity) -> Sensitivity:
        """The sensitivity on the long measure, from that on one period of each segment."""
        times = np.sqrt(np.bincount(self.fitted_sample, minlength=self._samples)).repeat(
            known.columns.shape[1] // self._samples
        )
        weighed = known.columns * times
        return Sensitivity(known.at, known.columns, weighed @ weighed.T, self.fitted_sample)

    @property
    def _samples(self) -> int:
        return sum(int(record.fit.sum()) for record in self.context.measure.records)

    def of(self, evidence: Evidence) -> Evidence:
        """The first record's evidence at the kept samples."""
        kept, n = self.kept[0], len(evidence.command)
        fit = np.concatenate([record.fit for record in self.context.measure.records])[: len(kept)]
        cut = {
            field.name: value[kept]
            for field in fields(evidence)
            if isinstance(value := getattr(evidence, field.name), np.ndarray) and len(value) == n and value.ndim
        }
        used: FloatArray = fit.astype(np.float64)
        # The noise is per channel, independent of its length.
        return replace(
            evidence, **{**cut, "used": used, "noise": evidence.noise, "position_noise": evidence.position_noise}
        )


def short_recordings_of(context: SearchContext, held: Fitted) -> ShortRecordings | None:
    """The shortened recordings; None where little would be saved, where held effects depend on sampling times, and
    where the first record, of which evidence is taken, has nothing to fit. held: fitted on the whole.

    A force with a memory (dry friction, play) may depend on samples that were cut out for longer than the linear
    model's transients last: each piece begins with the positions and velocities that the simulation of all samples has
    there (states of the forces continue from the piece before), and the run-in is doubled until the errors agree.
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
        # A diverged simulation never agrees, and all samples before those to fit may be kept already.
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
    """The recordings shortened to the given periods; None where that saves little. around_s: as for `_cut`."""
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
    """The shortened recordings, each piece begun in the state that the whole simulation of a fit has there."""
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
    """Seconds before and after a stretch that its errors depend on: a simulation's transients decay with the model; a
    needed force depends on the motion before and after, as far as the model's inverse rings."""
    if isinstance(measure, FreeSimulation):
        return RUN_IN_CONSTANTS / max(-growth_rate(model), np.finfo(float).tiny), 0.0
    rates = np.abs(zeros_of(model, 2 * np.pi * measure.band_hz).real)
    rings_s = RUN_IN_CONSTANTS / max(float(rates.min(initial=np.inf)), np.finfo(float).tiny)
    return (rings_s + RUN_IN_CONSTANTS / measure.band_hz,) * 2


def _last_periods(record: Observed) -> tuple[Mask, Places]:
    """`fit` and `repeat_of` of a `_Cut`: of each settled segment the last period is fitted."""
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
    """The samples to fit with their run-in. around_s: seconds that are kept before and after each stretch to fit."""
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
    """The measure with each kept stretch as a record of its own; None where a stretch does not drive an axis that the
    whole record drives, for errors are relative to the command."""
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
    """First fits on all samples, the best first, screened on short recordings. timed: hypotheses that depend on
    sampling times, which short recordings cannot judge: they are fitted where the share of the cost that they are
    predicted to remove is not far below that of the others."""
    short, guard = replace(short_form.context, measure=coarsen(short_form.context.measure)), context.guard
    begun = evaluate_fit(short.measure, short.tuning, base.deviations, base.hypothesis)
    known = sensitivity_at(short, base.deviations, base.hypothesis, with_forces=True)
    screened = screen(short.measure, short.tuning, begun, known, timeless, guard.over(short.map_, SCREENING))
    of_all, forced = short_form.repeat_sensitivity(known), has_motion_forces(base.hypothesis)
    if forced:
        of_all = sensitivity(context.measure, context.tuning, base.deviations, base.hypothesis, context.map_)

    def whole(fitted: Fitted) -> Fitted:
        there = evaluate_fit(context.measure, context.tuning, fitted.deviations, fitted.hypothesis)
        # Slow motion under friction, which one period does not show, would be counted as error of the law.
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
    # A law whose parameters the short recordings do not determine may diverge on all samples.
    return sorted((law for law in fits if np.isfinite(law.cost)), key=lambda law: law.cost)


def _keep_promising(
    others: tuple[Fitted, Sequence[Fitted]], begun_whole: Fitted, screened: Sequence[ScreenedHypothesis]
) -> list[ScreenedHypothesis]:
    """The hypotheses whose predicted gain, as a share of the cost of `begun_whole`, is not far below the best share of
    others; shares, because the others' costs are of other samples and steps. others: their base, and fits."""
    base, fits = others
    best = max((1 - law.cost / base.cost for law in fits), default=0.0)
    return [law for law in screened if 1 - law.cost / begun_whole.cost >= max(WORTH_FITTING * best, 0.0)]
