"""A session as a fold of its events: `begin_session` the first, `apply` each of the others."""

from dataclasses import dataclass, replace

from protocols.schedule import Run, runs
from protocols.staircase import StaircaseState, begin, finished, step
from protocols.staircase_rule import StaircaseRule
from protocols.study_protocol import StudyProtocol
from protocols.trial import Phase, Trial, TrialStatus
from study.session.draw_check import LogContradiction, check_draw, place_of
from study.session.due_trial import Place, Present, due_trial
from study.session.events import (
    AnswerGiven,
    Event,
    NoteTaken,
    RestTaken,
    SessionClosed,
    SessionInterrupted,
    SessionOpened,
    SessionResumed,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)


@dataclass(frozen=True, slots=True)
class SessionState:
    """Everything decided so far in one sitting."""

    opened: SessionOpened
    protocol: StudyProtocol
    runs: tuple[Run, ...]
    run: int
    """Index of the present run; len(runs) when all are finished."""
    staircase: StaircaseState
    trial: int
    attempt: int
    presented: TrialPresented | None
    """The open trial."""
    answered: AnswerGiven | None
    """Its answer, not yet closed by a measurement."""
    trials: tuple[Trial, ...]
    rest_due_s: float
    closed: bool

    @property
    def finished(self) -> bool:
        return self.run >= len(self.runs)

    @property
    def answers(self) -> int:
        return sum(trial.counts for trial in self.trials)


def begin_session(opened: SessionOpened, protocol: StudyProtocol) -> SessionState:
    return SessionState(
        opened=opened,
        protocol=protocol,
        runs=runs(protocol, opened.seed, opened.participant_number),
        run=0,
        staircase=begin(protocol.staircase),
        trial=0,
        attempt=0,
        presented=None,
        answered=None,
        trials=(),
        rest_due_s=0.0,
        closed=False,
    )


def apply(state: SessionState, event: Event) -> SessionState:
    """The state after one more event. Raises LogContradiction where it cannot follow."""
    if state.closed and not isinstance(event, NoteTaken | SessionInterrupted):
        raise LogContradiction(f"{event.event} after the session was closed")
    match event:
        case TrialPresented():
            return _present(state, event)
        case AnswerGiven():
            return _answer(state, event)
        case TrialMeasured():
            return _measure(state, event)
        case TrialSpoiled():
            return _spoil(state, event)
        case RestTaken():
            return _rest(state, event)
        case SessionClosed():
            return _close(state)
        case NoteTaken() | SessionInterrupted() | SessionResumed():
            return state
        case SessionOpened():
            raise LogContradiction("a session cannot be opened twice")


def rule_of_run(protocol: StudyProtocol, run: Run) -> StaircaseRule:
    """The staircase rule of one run: a training run may be shorter."""
    if run.phase is Phase.TRAINING and protocol.training.trial_limit:
        return replace(protocol.staircase, trial_limit=protocol.training.trial_limit)
    return protocol.staircase


def current_rule(state: SessionState) -> StaircaseRule:
    return rule_of_run(state.protocol, state.runs[state.run])


def due(state: SessionState) -> Present:
    """The trial that comes next."""
    place = Place(state.runs[state.run], state.trial, state.attempt, state.staircase)
    return due_trial(state.protocol, state.opened, current_rule(state), place)


def felt(opened: SessionOpened) -> bool | None:
    """Whether a person felt the stimuli; None for a simulated participant."""
    return None if opened.observer is not None else not opened.device.simulated


def _present(state: SessionState, event: TrialPresented) -> SessionState:
    if state.presented is not None:
        raise LogContradiction(f"{place_of(event)} presented while another trial is open")
    if state.finished:
        raise LogContradiction(f"{place_of(event)} presented after the last run")
    check_draw(event, due(state))
    row = _row(state, event)
    return replace(state, presented=event, trials=(*state.trials, row))


def _answer(state: SessionState, event: AnswerGiven) -> SessionState:
    presented = _open_trial(state, event)
    if state.answered is not None:
        raise LogContradiction(f"{place_of(event)} answered twice")
    row = replace(
        state.trials[-1],
        answer=event.answer,
        correct=event.answer == presented.direction,
        response_time_s=event.response_time_s,
        status=TrialStatus.UNMEASURED,
    )
    return replace(state, answered=event, trials=(*state.trials[:-1], row))


def _rest(state: SessionState, event: RestTaken) -> SessionState:
    if state.rest_due_s <= 0:
        raise LogContradiction(f"a rest before trial {event.trial} of run {event.run}, where none was due")
    return replace(state, rest_due_s=0.0)


def _close(state: SessionState) -> SessionState:
    if not state.finished or state.presented is not None:
        raise LogContradiction("the session was closed before its last run was finished")
    return replace(state, closed=True)


def _measure(state: SessionState, event: TrialMeasured) -> SessionState:
    presented = _open_trial(state, event)
    if state.answered is None:
        raise LogContradiction(f"{place_of(event)} measured before it was answered")
    rule = current_rule(state)
    staircase = step(rule, state.staircase, state.answered.answer == presented.direction)
    row = replace(
        state.trials[-1],
        reversal=staircase.reversals > state.staircase.reversals,
        delivered_mps2=event.delivered_mps2,
        off_axis_mps2=event.off_axis_mps2,
        displacement_mm=event.displacement_mm,
        missed_ticks=event.missed_ticks,
        status=TrialStatus(event.status),
    )
    after = replace(
        state,
        presented=None,
        answered=None,
        staircase=staircase,
        trial=state.trial + 1,
        attempt=0,
        trials=(*state.trials[:-1], row),
        rest_due_s=_rest_within_run(state.protocol, state.trial + 1),
    )
    return _next_run(after) if finished(rule, staircase) else after


def _next_run(state: SessionState) -> SessionState:
    last = state.run + 1 == len(state.runs)
    return replace(
        state,
        run=state.run + 1,
        staircase=begin(state.protocol.staircase),
        trial=0,
        attempt=0,
        rest_due_s=0.0 if last else state.protocol.rests.after_run_s,
    )


def _spoil(state: SessionState, event: TrialSpoiled) -> SessionState:
    _open_trial(state, event)
    row = replace(state.trials[-1], missed_ticks=event.missed_ticks, status=TrialStatus.SPOILED)
    return replace(state, presented=None, answered=None, attempt=state.attempt + 1, trials=(*state.trials[:-1], row))


def _open_trial(state: SessionState, event: AnswerGiven | TrialMeasured | TrialSpoiled) -> TrialPresented:
    presented = state.presented
    if presented is None or (presented.run, presented.trial, presented.attempt) != (
        event.run,
        event.trial,
        event.attempt,
    ):
        raise LogContradiction(f"{event.event} for {place_of(event)}, which is not open")
    return presented


def _rest_within_run(protocol: StudyProtocol, trials_done: int) -> float:
    every = protocol.rests.after_trials
    return protocol.rests.within_run_s if every and trials_done % every == 0 else 0.0


def _row(state: SessionState, event: TrialPresented) -> Trial:
    return Trial(
        subject=state.opened.subject,
        session=state.opened.session,
        run=event.run,
        trial=event.trial,
        attempt=event.attempt,
        phase=event.phase,
        frequency_hz=event.frequency_hz,
        level_n=event.level_n,
        direction_shown=event.direction,
        answer=None,
        correct=None,
        reversal=False,
        response_time_s=None,
        delivered_mps2=None,
        off_axis_mps2=None,
        displacement_mm=None,
        missed_ticks=None,
        felt=felt(state.opened),
        status=TrialStatus.OPEN,
        angle_deg=event.angle_deg,
    )
