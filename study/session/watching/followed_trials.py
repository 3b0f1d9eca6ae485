"""Trials and runs of a followed session as the experimenter's view shows them; called by `make_watch_view`.

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

LAST_TRIALS = 40
"""Largest number of latest trials that the experimenter's view lists. Chosen."""


def find_shown_run(state: SessionState) -> int | None:
    """Index of the run to plot: the current run while a trial is open or before the first answer of the session,
    otherwise the run of the latest counted answer. None for a finished session without answers."""
    counted_runs = [trial.run for trial in state.trials if trial.is_valid]
    if not state.finished and (not counted_runs or state.presented is not None):
        return state.run
    return counted_runs[-1] if counted_runs else None


def _select_counted_trials(state: SessionState, run: int) -> list[Trial]:
    """Trials of a run that count: answered and not void."""
    return [trial for trial in state.trials if trial.run == run and trial.is_valid]


def collect_points(state: SessionState, run: int | None) -> tuple[StaircasePoint, ...]:
    """Counted trials of a run without catch trials, as points of its staircase; empty for None. The open trial is left
    out even after its answer, because it may still become void."""
    if run is None:
        return ()
    closed_trials = [
        t for t in _select_counted_trials(state, run) if t.phase is not Phase.CATCH and not _is_open(state, t)
    ]
    return tuple(StaircasePoint(t.trial, t.staircase_n, bool(t.correct), t.reversal) for t in closed_trials)


def _is_open(state: SessionState, trial: Trial) -> bool:
    """Whether this is the open trial: presented, and neither measured nor void yet."""
    return state.presented is not None and trial is state.trials[-1]


def find_next_level_n(state: SessionState, shown_run: int | None) -> float | None:
    """Level of the next trial of the shown run (N); None if that is not the current run, or the session is finished."""
    if state.finished or shown_run != state.run:
        return None
    run = state.runs[state.run]
    return (
        find_due_presentation(state).level_n
        if run.practice
        else compute_level_n(make_current_rule(state), state.staircase)
    )


def make_watched_run(state: SessionState, run: Run) -> WatchedRun:
    """A run of the schedule with its status; trials and reversals are counted over its trials that count."""
    counted_trials, rule = _select_counted_trials(state, run.index), state.protocol.staircase
    return WatchedRun(
        run=run.index,
        phase="practice" if run.practice else run.phase.value,
        frequency_hz=run.frequency_hz,
        status="present" if run.index == state.run else "done" if run.index < state.run else "to come",
        reversals=sum(trial.reversal for trial in counted_trials),
        reversals_needed=0 if run.practice or rule.is_bayesian else rule.reversals,
        trials=len(counted_trials),
    )


def make_open_trial(state: SessionState, presented_s: float) -> OpenTrial | None:
    """The presented trial without an answer; None if there is none, or the session is closed. presented_s: seconds
    since its presentation."""
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
    """Latest answered or void trials, at most `LAST_TRIALS`, newest first."""
    rows = list(zip(session.state.trials, session.remarks, strict=True))[-LAST_TRIALS - 1 :]
    closed_trials = [
        _make_closed_trial(session.state, trial, remark)
        for trial, remark in rows
        if trial.status is not TrialStatus.OPEN
    ]
    return tuple(closed_trials[::-1][:LAST_TRIALS])


def _make_closed_trial(state: SessionState, trial: Trial, remark: str) -> ClosedTrial:
    """Row of the table for a trial that is answered or void. remark: reason of a void trial, or another remark."""
    # The direction and correctness of a void trial stay hidden, because the same stimulus is presented again. They stay
    # hidden, too, until the health of the device is judged, because the trial may still become void.
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
    """Results of the practice runs before the current run, over their latest `practice.of_last` answers."""
    settings, results = state.protocol.practice, []
    for run in state.runs[: state.run]:
        if run.practice:
            practice_state = PracticeState(
                tuple(bool(trial.correct) for trial in _select_counted_trials(state, run.index))
            )
            answer_count = min(settings.of_last, len(practice_state.correct))
            results.append(
                PracticeResult(
                    run.frequency_hz,
                    count_right_of_last(settings, practice_state),
                    answer_count,
                    is_practice_passed(settings, practice_state),
                )
            )
    return tuple(results)
