"""Estimate the progress of a session that the participant sees, from completed runs and the number of trials.

Stimulus levels are not used, because the display would reveal the state of the staircase and so the participant's
performance.
"""

import math
from statistics import median

from protocols.procedure.schedule import Run
from protocols.trial import Phase
from study.session.state.state import SessionState
from study.session.views.participant_views import Progress

TYPICAL_STAIRCASE_TRIALS = 65
"""Typical number of trials of a staircase with 13 reversals. Approximate, chosen by hand between about 60 (few errors)
and 110 (pure guessing): only the displayed progress depends on it."""
TRIALS_PER_REVERSAL = TYPICAL_STAIRCASE_TRIALS / 13
"""Typical number of trials per reversal."""
RECENT_ANSWERS = 30
"""Largest number of the most recent valid trials from which the time per trial is estimated. Chosen by hand."""
MIN_ANSWERS = 8
"""Number of answers in this sitting before which no time is estimated, because the first answers are slow. Chosen by
hand."""


def estimate_progress(state: SessionState) -> Progress:
    """Estimate the fraction of the session's trials that are done, 0 to 1, and the minutes left, from the most recent
    answers: with later rests between runs, without those within a run; None while there are too few answers."""
    expected_trials = [_estimate_run_trials(state, run) for run in state.runs]
    done_trials = sum(expected_trials[: state.run])
    if not state.finished:
        # A run that takes more trials than is typical is shown as at most 95 % done, not as completed.
        done_trials += min(state.trial, 0.95 * expected_trials[state.run])
    fraction_done = done_trials / sum(expected_trials)
    return Progress(
        share_done=fraction_done, minutes_left=_estimate_minutes_left(state, sum(expected_trials) - done_trials)
    )


def _estimate_run_trials(state: SessionState, run: Run) -> float:
    """Estimate the number of trials of a run: of a practice run, the number of answers that its criterion considers;
    of another, the number of trials of a Bayesian rule, or else the number of reversals times `TRIALS_PER_REVERSAL`,
    in a training run at most its trial limit."""
    protocol = state.protocol
    if run.practice:
        return protocol.practice.of_last
    rule = protocol.staircase
    typical_trials = rule.bayesian.trials if rule.is_bayesian else rule.reversals * TRIALS_PER_REVERSAL
    trial_limit = protocol.training.trial_limit if run.phase is Phase.TRAINING else 0
    return min(typical_trials, trial_limit) if trial_limit else typical_trials


def _estimate_minutes_left(state: SessionState, remaining_trials: float) -> int | None:
    """Estimate the minutes left for `remaining_trials` trials and the rests between runs, rounded up; None before
    `MIN_ANSWERS` answers in this sitting. Estimated from the median response time, not from the clock, because forms,
    instructions and pauses do not predict the time of further trials."""
    answers_in_sitting = state.answers - state.sitting.answers_before
    response_times_s = [
        trial.response_time_s for trial in state.trials if trial.is_valid and trial.response_time_s is not None
    ]
    if answers_in_sitting < MIN_ANSWERS or not response_times_s:
        return None
    protocol = state.protocol
    trial_s = median(response_times_s[-RECENT_ANSWERS:]) + protocol.stimulus.fade_out_s + protocol.trial.pause_between_s
    remaining_rests_min = (
        sum(not run.practice for run in state.runs[state.run : -1]) * state.protocol.rests.after_run_s / 60
    )
    return math.ceil(trial_s / 60 * remaining_trials + remaining_rests_min)
