"""Threshold of a run: the mean of its last reversals, and whether the cap cut into it."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from statistics import fmean

from analysis.psychophysics.bias import response_bias
from analysis.psychophysics.repeated_trials import is_often
from analysis.psychophysics.runs import Run, recompute_runs
from protocols.definition.staircase_rule import StaircaseRule
from protocols.procedure.psi import estimate, posterior
from protocols.procedure.staircase import is_finished, to_db, to_newton
from protocols.trial import Phase, Trial


class RunEnd(StrEnum):
    """Reason for the end of a run."""

    REVERSALS = "reversals"
    """All reversals of the rule: there is a threshold."""
    PSI = "psi"
    """All trials of the Psi method, or its wanted spread: there is a threshold."""
    TRIAL_LIMIT = "trial_limit"
    """The protocol's `trial_limit`. The run has no threshold, and is more often that of a high threshold: under a
    limit of 100 trials 58 % of guessers and 0.1 % of people with a threshold of 1 N end so."""
    UNFINISHED = "unfinished"
    """The sitting: the run can go on, or was left."""


@dataclass(frozen=True, slots=True)
class Threshold:
    """One run's result, one row of `thresholds.csv`; the fields are its columns, in order.

    A run that has not reached its reversals is a row too, with `complete` False and no threshold.
    """

    subject: str
    frequency_hz: float
    threshold_n: float | None
    """Arithmetic mean of the averaged reversal levels in newtons."""
    threshold_db: float | None
    """Mean of the same levels in dB re 1 N."""
    censored: bool
    """Cut by the cap: see `is_censored`. No bound: the true threshold may lie above or below."""
    reversals: int
    trials: int
    cap_reversals: int
    """Number of averaged reversals that are peaks at the cap."""
    trials_at_cap: int
    pushes_against_cap: int
    complete: bool
    session: str
    run: int
    percent_correct: float | None
    d_prime: float | None
    criterion: float | None
    """c, positive for a tendency to answer 2: see `analysis.psychophysics.bias`."""
    spoiled_trials: int
    threshold_mps2: float | None
    """Mean acceleration amplitude along the direction, as measured in the trials of the averaged reversals."""
    threshold_mm: float | None
    """Mean displacement amplitude, as measured in the same trials."""
    measured_reversals: int
    """Number of averaged reversals with a measured acceleration."""
    ended: RunEnd | None = None
    """Reason for the end of the run; None in tables of older versions."""
    repeats_at_will: int = 0
    """Presentations of the run that the participant made void; catch trials among them."""
    repeat_rate: float = 0.0
    """Share of void presentations in all presentations of the run."""
    asked_often: bool = False
    """See `analysis.psychophysics.repeated_trials.is_often`."""


def thresholds(trials: Iterable[Trial], rule: StaircaseRule, rove_db: float = 0.0) -> tuple[Threshold, ...]:
    """The thresholds of all test runs, recomputed from the answers. rove_db: as for `recompute_runs`.

    Raises InconsistentTrialsError (a ValueError) naming subject, session, run and trial where the rows contradict
    the rule.
    """
    return tuple(threshold_of(run, rule) for run in recompute_runs(trials, rule, Phase.TEST, rove_db))


def threshold_of(run: Run, rule: StaircaseRule) -> Threshold:
    """Threshold of a run by its reversals or Psi's posterior, with response bias and counts; None in its values where
    the run is not complete."""
    found = _from_posterior(run, rule) if rule.is_bayesian else _from_reversals(run, rule)
    state = run.state
    correct = [bool(trial.correct) for trial in run.answered]
    bias = response_bias([trial.direction_shown for trial in run.answered], correct)
    return Threshold(
        subject=run.subject,
        frequency_hz=run.frequency_hz,
        threshold_n=found.newton if run.complete else None,
        threshold_db=found.db if run.complete else None,
        censored=found.censored,
        reversals=state.reversals,
        trials=state.trials,
        cap_reversals=found.cap_reversals,
        trials_at_cap=state.trials_at_cap,
        pushes_against_cap=state.pushes_against_cap,
        complete=run.complete,
        session=run.session,
        run=run.run,
        percent_correct=100.0 * fmean(correct) if correct else None,
        d_prime=bias.d_prime if bias else None,
        criterion=bias.criterion if bias else None,
        spoiled_trials=run.spoiled_trials,
        threshold_mps2=_mean_of_measured([_at_level(t, t.delivered_mps2, n) for t, n in found.measured])
        if run.complete
        else None,
        threshold_mm=_mean_of_measured([_at_level(t, t.displacement_mm, n) for t, n in found.measured])
        if run.complete
        else None,
        measured_reversals=sum(trial.delivered_mps2 is not None for trial, _ in found.measured),
        ended=_run_end(run, rule),
        repeats_at_will=run.repeats_at_will,
        repeat_rate=run.repeats_at_will / run.presentations if run.presentations else 0.0,
        asked_often=is_often(run.repeats_at_will, run.presentations),
    )


@dataclass(frozen=True, slots=True)
class _Found:
    newton: float | None
    db: float | None
    censored: bool
    cap_reversals: int
    measured: tuple[tuple[Trial, float], ...]
    """Trials that say what the threshold is in other units, and the level (N) to which each is taken in proportion."""


def _from_reversals(run: Run, rule: StaircaseRule) -> _Found:
    state = run.state
    averaged_db = state.reversal_levels_db[-rule.averaged_reversals :]
    averaged_n = [min(to_newton(level), rule.cap_n) for level in averaged_db]
    turned = [run.answered[index] for index in state.reversal_trials[-rule.averaged_reversals :]]
    cap_reversals = sum(level >= rule.cap_n * (1.0 - _SAME_LEVEL) for level in averaged_n)
    return _Found(
        newton=fmean(averaged_n) if averaged_n else None,
        db=fmean(averaged_db) if averaged_db else None,
        censored=is_censored(cap_reversals),
        cap_reversals=cap_reversals,
        measured=tuple((trial, trial.staircase_n) for trial in turned),
    )


def _from_posterior(run: Run, rule: StaircaseRule) -> _Found:
    """Posterior mean, never above the cap; cut where the threshold is as likely as not to be above it, or nearly."""
    cap_db = to_db(rule.cap_n)
    found = estimate(posterior(run.state.answered, cap_db), cap_db)
    db = min(found.mean_db, cap_db)
    latest = run.answered[-rule.averaged_reversals :]
    newton = min(to_newton(db), rule.cap_n)
    return _Found(newton, db, found.above_cap > MAYBE_ABOVE, 0, tuple((trial, newton) for trial in latest))


def _at_level(trial: Trial, measured: float | None, level_n: float) -> float | None:
    """A measured value of a trial scaled in proportion to another level (N), also where the level was roved; None where
    nothing was measured."""
    return None if measured is None else measured * level_n / trial.level_n


MAYBE_ABOVE = 0.1
"""Probability, by Psi's posterior, of a threshold above the cap from which a run is marked as cut."""


def is_censored(cap_reversals: int) -> bool:
    """Whether the cap cut into a threshold: at least one of the averaged reversals is a peak at the cap.

    Such a peak would have been higher on a stronger device, so the mean is lower than it would have been there.
    That makes it no lower bound of the true threshold: the mean scatters, and in flagged runs of people with a true
    threshold of 2 N it lies above the truth in 78 %, at 2.5 N in 26 %, from 3 N on in none (same simulation). Whether
    the mean *equals* the cap is no test: its valleys lie below, and a pure guesser ends near 2.68 N under a cap of 3 N.

    Operating characteristics under the published rule, 1000 simulated runs each (Weibull slope 2, 2 % lapses),
    by true 79.4 % level: flagged 0.0 % at 1 N, 0.6 % at 1.5 N, 15 % at 2 N (mean already 8 % too low), 54 % at
    2.5 N, 78 % at 3 N, 95 % at 4 N, 98 % at 6 N; a pure guesser 99.8 %. Asking for two or three such peaks would
    miss 13 % or 27 % of participants whose true threshold is 4 N.
    """
    return cap_reversals > 0


def _run_end(run: Run, rule: StaircaseRule) -> RunEnd:
    if run.complete:
        return RunEnd.PSI if rule.is_bayesian else RunEnd.REVERSALS
    return RunEnd.TRIAL_LIMIT if is_finished(rule, run.state) else RunEnd.UNFINISHED


def _mean_of_measured(values: Sequence[float | None]) -> float | None:
    measured = [value for value in values if value is not None]
    return fmean(measured) if measured else None


_SAME_LEVEL = 1e-9
"""Relative difference below which two levels are the same, rounding apart."""
