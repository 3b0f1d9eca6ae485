"""Progress of a session for the participant, estimated from completed runs and counted trials.

Levels are not used, because the display would reveal the state of the staircase and so the participant's performance.
"""

import math
from statistics import median

from protocols.procedure.schedule import Run
from protocols.trial import Phase
from study.session.state.state import SessionState
from study.session.views.views import Progress

USUAL_TRIALS = 65
"""Typical number of trials of a staircase with 13 reversals; about 60 with few errors, 110 for pure guessing."""
TRIALS_PER_REVERSAL = USUAL_TRIALS / 13
"""Typical number of trials per reversal."""


LATEST = 30
"""Number of latest answers from which the time per trial is estimated."""
FIRST = 8
"""Number of answers in this sitting before which no time is estimated, because the first answers are slow."""


def estimate_progress(state: SessionState) -> Progress:
    """Fraction of the session done, 0 to 1, and minutes left, estimated from the latest answers; later rests are
    included."""
    expected = [_typical_trials(state, run) for run in state.runs]
    done = sum(expected[: state.run])
    if not state.finished:
        # A run that takes more trials than is typical must not be shown as completed.
        done += min(state.trial, 0.95 * expected[state.run])
    share = done / sum(expected)
    return Progress(share_done=share, minutes_left=_minutes_left(state, sum(expected) - done))


def _typical_trials(state: SessionState, run: Run) -> float:
    """Typical number of trials of a run, from the settings of its rule."""
    protocol = state.protocol
    if run.practice:
        return protocol.practice.of_last
    rule = protocol.staircase
    typical = rule.bayesian.trials if rule.is_bayesian else rule.reversals * TRIALS_PER_REVERSAL
    limit = protocol.training.trial_limit if run.phase is Phase.TRAINING else 0
    return min(typical, limit) if limit else typical


def _minutes_left(state: SessionState, trials_left: float) -> int | None:
    """Minutes left, rounded up; None before `FIRST` answers in this sitting. Estimated from the median response time,
    not from the clock, because forms, instructions and pauses do not predict the time of further trials."""
    answered = state.answers - state.sitting.answers_before
    response_times_s = [
        trial.response_time_s for trial in state.trials if trial.is_valid and trial.response_time_s is not None
    ]
    if answered < FIRST or not response_times_s:
        return None
    protocol = state.protocol
    trial_s = median(response_times_s[-LATEST:]) + protocol.stimulus.fade_out_s + protocol.trial.pause_between_s
    rests_min = sum(not run.practice for run in state.runs[state.run : -1]) * state.protocol.rests.after_run_s / 60
    return math.ceil(trial_s / 60 * trials_left + rests_min)
