"""Trials and runs of a followed session as the experimenter's view shows them; `make_watch_view` combines them.

The direction of a trial is withheld until its answer counts, because an experimenter who knows the direction could
reveal it to the participant.
"""

from protocols.procedure.practice import PracticeState, practice_passed, right_of_last
from protocols.procedure.schedule import Run
from protocols.procedure.staircase import level_n
from protocols.trial import Phase, Trial, TrialStatus
from study.session.state.state import SessionState, current_rule, due
from study.session.watching.followed_session import FollowedSession
from study.session.watching.watch_view import ClosedTrial, OpenTrial, PracticeLine, StaircasePoint, WatchedRun

LAST_TRIALS = 40
"""Number of latest trials that the experimenter's view lists."""


def shown_run(state: SessionState) -> int | None:
    """Index of the run to plot: the current run while a trial is open or before the first answer of the session,
    otherwise the run of the latest counted answer. None for a finished session without answers."""
    answered = [trial.run for trial in state.trials if trial.counts]
    if not state.finished and (not answered or state.presented is not None):
        return state.run
    return answered[-1] if answered else None


def _select_counted(state: SessionState, run: int) -> list[Trial]:
    """Trials of a run that count."""
    return [trial for trial in state.trials if trial.run == run and trial.counts]


def points(state: SessionState, run: int | None) -> tuple[StaircasePoint, ...]:
    """Counted trials of a run without catch trials, as points of its staircase. The open trial is left out even after
    its answer, because it may still become void."""
    if run is None:
        return ()
    closed = [t for t in _select_counted(state, run) if t.phase is not Phase.CATCH and not _is_open(state, t)]
    return tuple(StaircasePoint(t.trial, t.staircase_n, bool(t.correct), t.reversal) for t in closed)


def _is_open(state: SessionState, trial: Trial) -> bool:
    """Whether this is the presented trial, which is not completed."""
    return state.presented is not None and trial is state.trials[-1]


def next_level_n(state: SessionState, shown: int | None) -> float | None:
    """Level of the next trial of the shown run (N); None if the run is over or is not the current one."""
    if state.finished or shown != state.run:
        return None
    run = state.runs[state.run]
    return due(state).level_n if run.practice else level_n(current_rule(state), state.staircase)


def run_line(state: SessionState, run: Run) -> WatchedRun:
    """A run of the schedule with its status; trials and reversals are counted over its trials that count."""
    counted, rule = _select_counted(state, run.index), state.protocol.staircase
    return WatchedRun(
        run=run.index,
        phase="practice" if run.practice else run.phase.value,
        frequency_hz=run.frequency_hz,
        status="present" if run.index == state.run else "done" if run.index < state.run else "to come",
        reversals=sum(trial.reversal for trial in counted),
        reversals_needed=0 if run.practice or rule.is_bayesian else rule.reversals,
        trials=len(counted),
    )


def open_trial(state: SessionState, presented_s: float) -> OpenTrial | None:
    """The presented trial without an answer; None if there is none. presented_s: seconds since its presentation."""
    shown = state.presented
    if shown is None or state.answered is not None or state.closed:
        return None
    return OpenTrial(
        run=shown.run,
        trial=shown.trial,
        attempt=shown.attempt,
        frequency_hz=shown.frequency_hz,
        level_n=shown.level_n,
        catch=shown.phase is Phase.CATCH,
        presented_s=presented_s,
    )


def last_trials(watched: FollowedSession) -> tuple[ClosedTrial, ...]:
    """Latest answered or void trials, at most `LAST_TRIALS`, newest first."""
    rows = list(zip(watched.state.trials, watched.remarks, strict=True))[-LAST_TRIALS - 1 :]
    closed = [
        _close_trial(watched.state, trial, remark) for trial, remark in rows if trial.status is not TrialStatus.OPEN
    ]
    return tuple(closed[::-1][:LAST_TRIALS])


def _close_trial(state: SessionState, trial: Trial, remark: str) -> ClosedTrial:
    # The direction and correctness of a void trial stay hidden, because the same stimulus is presented again. They stay
    # hidden, too, until the health of the device is judged, because the trial may still become void.
    known = trial.counts and not _is_open(state, trial)
    phase = "practice" if state.runs[trial.run].practice else trial.phase.value
    return ClosedTrial(
        run=trial.run,
        trial=trial.trial,
        attempt=trial.attempt,
        phase=phase,
        frequency_hz=trial.frequency_hz,
        level_n=trial.level_n,
        shown=trial.direction_shown if known else None,
        answer=trial.answer,
        correct=trial.correct if known else None,
        reversal=trial.reversal,
        response_time_s=trial.response_time_s,
        delivered_mps2=trial.delivered_mps2,
        off_axis_mps2=trial.off_axis_mps2,
        status="measuring" if _is_open(state, trial) else trial.status.value,
        remark=remark,
    )


def practice(state: SessionState) -> tuple[PracticeLine, ...]:
    """Results of the practice runs before the current run."""
    settings, lines = state.protocol.practice, []
    for run in state.runs[: state.run]:
        if run.practice:
            done = PracticeState(tuple(bool(trial.correct) for trial in _select_counted(state, run.index)))
            of = min(settings.of_last, len(done.correct))
            lines.append(
                PracticeLine(run.frequency_hz, right_of_last(settings, done), of, practice_passed(settings, done))
            )
    return tuple(lines)
