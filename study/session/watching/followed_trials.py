"""Trials and runs of a followed session as the experimenter's view (`watch_view`) shows them.

The direction of a trial is withheld until its answer counts, because an experimenter who knows the direction could
reveal it to the participant.
"""

from protocols.procedure.practice import PracticeState, count_right_of_last, is_practice_passed
from protocols.procedure.schedule import Run
from protocols.procedure.staircase import compute_level_n
from protocols.trial import Phase, Trial, TrialStatus
from study.session.state.state import SessionState, find_due_presentation, make_current_rule
from study.session.watching.followed_session import FollowedSession
from study.session.watching.watch_view import ClosedTrial, OpenTrial, PracticeResult, StaircasePoint, WatchedRun

MAX_LISTED_TRIALS = 40
"""Largest number of latest trials that the experimenter's view lists. Chosen: more than the table shows at once."""


def find_shown_run(state: SessionState) -> int | None:
    """Find the index of the run to plot: the current run while a trial is open or before the first answer of the
    session, otherwise the run of the latest counted answer. None for a finished session without answers."""
    counted_runs = [trial.run for trial in state.trials if trial.is_valid]
    if not state.finished and (not counted_runs or state.presented is not None):
        return state.run
    return counted_runs[-1] if counted_runs else None


def _select_counted_trials(state: SessionState, run_index: int) -> list[Trial]:
    """Select the trials of a run that count: answered and not void."""
    return [trial for trial in state.trials if trial.run == run_index and trial.is_valid]


def collect_staircase_points(state: SessionState, run_index: int | None) -> tuple[StaircasePoint, ...]:
    """Collect the counted trials of a run without catch trials, as points of its staircase; empty for None. The open
    trial is left out even after its answer, because it may still become void."""
    if run_index is None:
        return ()
    closed_trials = [
        t for t in _select_counted_trials(state, run_index) if t.phase is not Phase.CATCH and not _is_open(state, t)
    ]
    return tuple(StaircasePoint(t.trial, t.staircase_n, bool(t.correct), t.reversal) for t in closed_trials)


def _is_open(state: SessionState, trial: Trial) -> bool:
    """Whether this is the open trial: presented, and neither measured nor void yet."""
    return state.presented is not None and trial is state.trials[-1]


def find_next_level_n(state: SessionState, shown_run: int | None) -> float | None:
    """Find the level of the staircase at the next trial (N), before roving and without catch trials; in a practice run
    the level that is drawn for it. None if the shown run is not the current one, or the session is finished."""
    if state.finished or shown_run != state.run:
        return None
    run = state.runs[state.run]
    return (
        find_due_presentation(state).level_n
        if run.practice
        else compute_level_n(make_current_rule(state), state.staircase)
    )


def make_watched_run(state: SessionState, run: Run) -> WatchedRun:
    """Summarise a run of the schedule: phase, frequency, status, and the numbers of its trials that count and of their
    reversals."""
    counted_trials, staircase_rule = _select_counted_trials(state, run.index), state.protocol.staircase
    return WatchedRun(
        run=run.index,
        phase="practice" if run.practice else run.phase.value,
        frequency_hz=run.frequency_hz,
        status="present" if run.index == state.run else "done" if run.index < state.run else "to come",
        reversals=sum(trial.reversal for trial in counted_trials),
        reversals_needed=0 if run.practice or staircase_rule.is_bayesian else staircase_rule.reversals,
        trials=len(counted_trials),
    )


def make_open_trial(state: SessionState, presented_s: float) -> OpenTrial | None:
    """Make the view of the presented trial without an answer; None if there is none, or the session is closed.
    presented_s: seconds since its presentation."""
    presented = state.presented
    if presented is None or state.answered is not None or state.closed:
        return None
    return OpenTrial(
        run=presented.run,
        trial=presented.trial,
        attempt=presented.attempt,
        frequency_hz=presented.frequency_hz,
        level_n=presented.level_n,
        catch=presented.phase is Phase.CATCH,
        presented_s=presented_s,
    )


def list_last_trials(session: FollowedSession) -> tuple[ClosedTrial, ...]:
    """List the latest answered or void trials, at most `MAX_LISTED_TRIALS`, newest first."""
    trials_with_remarks = list(zip(session.state.trials, session.remarks, strict=True))[-MAX_LISTED_TRIALS - 1 :]
    closed_trials = [
        _make_closed_trial(session.state, trial, remark)
        for trial, remark in trials_with_remarks
        if trial.status is not TrialStatus.OPEN
    ]
    return tuple(closed_trials[::-1][:MAX_LISTED_TRIALS])


def _make_closed_trial(state: SessionState, trial: Trial, remark: str) -> ClosedTrial:
    """Make the table row of an answered or void trial. remark: reason of a void trial, or another remark."""
    # The direction and correctness of a void trial stay hidden, because the same stimulus may be presented again. They
    # stay hidden, too, until the health of the device is judged, because the trial may still become void.
    is_revealed = trial.is_valid and not _is_open(state, trial)
    phase = "practice" if state.runs[trial.run].practice else trial.phase.value
    return ClosedTrial(
        run=trial.run,
        trial=trial.trial,
        attempt=trial.attempt,
        phase=phase,
        frequency_hz=trial.frequency_hz,
        level_n=trial.level_n,
        shown=trial.direction_shown if is_revealed else None,
        answer=trial.answer,
        correct=trial.correct if is_revealed else None,
        reversal=trial.reversal,
        response_time_s=trial.response_time_s,
        delivered_mps2=trial.delivered_mps2,
        off_axis_mps2=trial.off_axis_mps2,
        status="measuring" if _is_open(state, trial) else trial.status.value,
        remark=remark,
    )


def collect_practice_results(state: SessionState) -> tuple[PracticeResult, ...]:
    """Collect the results of the practice runs before the current run, over their latest `practice.of_last` answers."""
    practice_settings, results = state.protocol.practice, []
    for run in state.runs[: state.run]:
        if run.practice:
            practice_state = PracticeState(
                tuple(bool(trial.correct) for trial in _select_counted_trials(state, run.index))
            )
            answer_count = min(practice_settings.of_last, len(practice_state.correct))
            results.append(
                PracticeResult(
                    run.frequency_hz,
                    count_right_of_last(practice_settings, practice_state),
                    answer_count,
                    is_practice_passed(practice_settings, practice_state),
                )
            )
    return tuple(results)
