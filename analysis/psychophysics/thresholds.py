"""Threshold of each run: mean of its last reversal levels, or posterior mean of Psi, and whether the cap cut it.

A run also has its response bias (d', criterion), counts of trials, and the threshold as measured acceleration and
displacement. Runs are recomputed from the answers (`runs`).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from statistics import fmean

from analysis.psychophysics.bias import estimate_response_bias
from analysis.psychophysics.repeated_trials import has_frequent_voids
from analysis.psychophysics.runs import Run, recompute_runs
from protocols.definition.staircase_rule import StaircaseRule
from protocols.procedure.psi import compute_posterior, estimate_threshold
from protocols.procedure.staircase import is_finished, to_db, to_newton
from protocols.trial import Phase, Trial


class RunEnd(StrEnum):
    """Reason for the end of a run."""

    REVERSALS = "reversals"
    """The run reached all reversals of the rule: it has a threshold."""
    PSI = "psi"
    """The run reached all trials of the Psi method, or the posterior spread that the rule requires: it has a
    threshold."""
    TRIAL_LIMIT = "trial_limit"
    """The protocol's `trial_limit` stopped the run, so that it has no threshold. This happens more often at high
    thresholds: under a limit of 100 trials to 58 % of guessers and 0.1 % of people with a threshold of 1 N."""
    UNFINISHED = "unfinished"
    """The sitting ended before the run: the run may be continued, or was abandoned."""


@dataclass(frozen=True, slots=True)
class Threshold:
    """Result of one run, a row of `thresholds.csv`; the fields are its columns, in order. An incomplete run has a row,
    too, with `complete` False and no threshold.
    """

    subject: str
    """Code of the participant."""
    frequency_hz: float
    threshold_n: float | None
    """Arithmetic mean of the averaged reversal levels in newtons; for Psi, the posterior mean (taken in dB)."""
    threshold_db: float | None
    """Mean of the same levels in dB re 1 N; for Psi, the posterior mean."""
    censored: bool
    """Whether the cap cut into the threshold (`is_censored`; Psi: `CUT_PROBABILITY`). The value is then no bound: the
    true threshold may lie above or below it."""
    reversals: int
    trials: int
    """Number of answered trials that count, without catch trials."""
    cap_reversals: int
    """Number of averaged reversals that are peaks at the cap; 0 for Psi."""
    trials_at_cap: int
    pushes_against_cap: int
    """Number of times the up-down rule asked for a level above the cap."""
    complete: bool
    """Whether the run has a threshold by its rule."""
    session: str
    run: int
    """Number of the run in its session."""
    percent_correct: float | None
    """Share of right answers (%) among the trials; None without answers."""
    d_prime: float | None
    """Sensitivity d', as `criterion`; None where it cannot be estimated."""
    criterion: float | None
    """c, positive for a tendency to answer 2: see `analysis.psychophysics.bias`."""
    spoiled_trials: int
    """Number of spoiled presentations, without those of catch trials."""
    threshold_mps2: float | None
    """Mean measured acceleration amplitude along the direction (m/s²) in the trials of the averaged reversals, scaled
    in proportion to the staircase's level; for Psi, in the last trials, scaled to the threshold."""
    threshold_mm: float | None
    """Mean measured displacement amplitude (mm) in the same trials."""
    measured_reversals: int
    """Number of these trials with a measured acceleration."""
    ended: RunEnd | None = None
    """Reason for the end of the run; None in tables of older versions."""
    repeats_at_will: int = 0
    """Number of presentations of the run that the participant made void, including those of catch trials."""
    repeat_rate: float = 0.0
    """`repeats_at_will` over all presentations of the run."""
    asked_often: bool = False
    """Whether presentations were made void often: see `analysis.psychophysics.repeated_trials.has_frequent_voids`."""


def compute_thresholds(trials: Iterable[Trial], rule: StaircaseRule, rove_db: float = 0.0) -> tuple[Threshold, ...]:
    """Compute the thresholds of all test runs, recomputed from the answers. rove_db: as for `recompute_runs`.

    Raises InconsistentTrialsError (a ValueError) naming subject, session, run and trial where the rows contradict
    the rule.
    """
    return tuple(compute_run_threshold(run, rule) for run in recompute_runs(trials, rule, Phase.TEST, rove_db))


def compute_run_threshold(run: Run, rule: StaircaseRule) -> Threshold:
    """Compute the threshold of a run by its reversals or Psi's posterior, with response bias and counts. Where the run
    is not complete, thresholds are None in every unit."""
    run_estimate = _estimate_from_posterior(run, rule) if rule.is_bayesian else _estimate_from_reversals(run, rule)
    state = run.state
    is_correct = [bool(trial.correct) for trial in run.answered]
    bias = estimate_response_bias([trial.direction_shown for trial in run.answered], is_correct)
    return Threshold(
        subject=run.subject,
        frequency_hz=run.frequency_hz,
        threshold_n=run_estimate.newton if run.complete else None,
        threshold_db=run_estimate.db if run.complete else None,
        censored=run_estimate.censored,
        reversals=state.reversals,
        trials=state.trials,
        cap_reversals=run_estimate.cap_reversals,
        trials_at_cap=state.trials_at_cap,
        pushes_against_cap=state.pushes_against_cap,
        complete=run.complete,
        session=run.session,
        run=run.run,
        percent_correct=100.0 * fmean(is_correct) if is_correct else None,
        d_prime=bias.d_prime if bias else None,
        criterion=bias.criterion if bias else None,
        spoiled_trials=run.spoiled_trials,
        threshold_mps2=_compute_measured_mean(
            [_scale_to_level(played, played.delivered_mps2, level_n) for played, level_n in run_estimate.measured]
        )
        if run.complete
        else None,
        threshold_mm=_compute_measured_mean(
            [_scale_to_level(played, played.displacement_mm, level_n) for played, level_n in run_estimate.measured]
        )
        if run.complete
        else None,
        measured_reversals=sum(trial.delivered_mps2 is not None for trial, _ in run_estimate.measured),
        ended=_find_run_end(run, rule),
        repeats_at_will=run.repeats_at_will,
        repeat_rate=run.repeats_at_will / run.presentations if run.presentations else 0.0,
        asked_often=has_frequent_voids(run.repeats_at_will, run.presentations),
    )


@dataclass(frozen=True, slots=True)
class _RunEstimate:
    """Threshold of a run before the other columns are added."""

    newton: float | None
    """Threshold in N; None without reversals."""
    db: float | None
    """Threshold in dB re 1 N; None without reversals."""
    censored: bool
    cap_reversals: int
    measured: tuple[tuple[Trial, float], ...]
    """Trials whose measurements give the threshold in other units, each with the level (N) to which it is scaled."""


def _estimate_from_reversals(run: Run, rule: StaircaseRule) -> _RunEstimate:
    """Compute the means of the last `averaged_reversals` reversal levels, in newtons and in dB."""
    state = run.state
    averaged_db = state.reversal_levels_db[-rule.averaged_reversals :]
    averaged_n = [min(to_newton(level), rule.cap_n) for level in averaged_db]
    averaged_trials = [run.answered[index] for index in state.reversal_trials[-rule.averaged_reversals :]]
    cap_reversals = sum(level >= rule.cap_n * (1.0 - _LEVEL_TOLERANCE) for level in averaged_n)
    return _RunEstimate(
        newton=fmean(averaged_n) if averaged_n else None,
        db=fmean(averaged_db) if averaged_db else None,
        censored=is_censored(cap_reversals),
        cap_reversals=cap_reversals,
        measured=tuple((trial, trial.staircase_n) for trial in averaged_trials),
    )


def _estimate_from_posterior(run: Run, rule: StaircaseRule) -> _RunEstimate:
    """Compute the posterior mean, limited by the cap; cut where the posterior probability of a threshold above the cap
    exceeds `CUT_PROBABILITY`."""
    cap_db = to_db(rule.cap_n)
    posterior_estimate = estimate_threshold(compute_posterior(run.state.answered, cap_db), cap_db)
    threshold_db = min(posterior_estimate.mean_db, cap_db)
    last_trials = run.answered[-rule.averaged_reversals :]
    threshold_n = min(to_newton(threshold_db), rule.cap_n)
    return _RunEstimate(
        threshold_n,
        threshold_db,
        posterior_estimate.above_cap > CUT_PROBABILITY,
        0,
        tuple((trial, threshold_n) for trial in last_trials),
    )


def _scale_to_level(trial: Trial, measured_value: float | None, level_n: float) -> float | None:
    """Scale the measured value of a trial in proportion from the level played to another level (N); None where nothing
    was measured."""
    return None if measured_value is None else measured_value * level_n / trial.level_n


CUT_PROBABILITY = 0.1
"""Posterior probability (Psi) of a threshold above the cap above which the threshold is marked as cut. Chosen: a
threshold without the mark is at or below the cap with a posterior probability of at least 0.9."""


def is_censored(cap_reversals: int) -> bool:
    """Whether the cap cut into a threshold: at least one of the averaged reversals is a peak at the cap.

    Such a peak would be higher on a stronger device, and so would the mean. A mean equal to the cap is no criterion:
    valleys lie below the cap, and a pure guesser ends near 2.68 N under a cap of 3 N.

    Share of flagged runs under the published rule, from 1000 simulated runs each (Weibull slope 2, 2 % lapses), by true
    79.4 % level: 0.0 % at 1 N, 0.6 % at 1.5 N, 15 % at 2 N (mean already 8 % too low), 54 % at 2.5 N, 78 % at 3 N, 95 %
    at 4 N, 98 % at 6 N; a pure guesser 99.8 %. Two or three required peaks would miss 13 % or 27 % of participants with
    a true threshold of 4 N. A flagged mean is no lower bound of the true threshold: in flagged runs it is above the
    true value in 78 % at 2 N, in 26 % at 2.5 N, and in none from 3 N on.
    """
    return cap_reversals > 0


def _find_run_end(run: Run, rule: StaircaseRule) -> RunEnd:
    """Find the reason for the end of the run, from its state and rule."""
    if run.complete:
        return RunEnd.PSI if rule.is_bayesian else RunEnd.REVERSALS
    return RunEnd.TRIAL_LIMIT if is_finished(rule, run.state) else RunEnd.UNFINISHED


def _compute_measured_mean(values: Sequence[float | None]) -> float | None:
    """Compute the mean of the values that are not None; None without any."""
    measured_values = [value for value in values if value is not None]
    return fmean(measured_values) if measured_values else None


_LEVEL_TOLERANCE = 1e-9
"""Relative difference below which a level counts as equal to the cap, for rounding. Chosen."""
