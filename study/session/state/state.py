"""State of a session: an immutable value, computed from the logged events by `study.session.state.fold`.

The state depends on the log alone (event sourcing), so that an interrupted session is resumed from its log. `machine`
gives the next action from a state.
"""

from dataclasses import dataclass, field, replace

from protocols.definition.staircase_rule import StaircaseRule
from protocols.definition.study_protocol import StudyProtocol
from protocols.procedure.practice import PracticeState
from protocols.procedure.run_rules import make_staircase_rule
from protocols.procedure.schedule import Run, schedule_runs
from protocols.procedure.staircase import StaircaseState, begin_staircase
from protocols.trial import Trial, VoidCause
from study.session.facts.events import AnswerGiven, SessionOpened, TrialPresented
from study.session.facts.log_time import Moment
from study.session.state.daily_dose import set_dose_elsewhere
from study.session.state.due_trial import Place, PresentTrial, compute_due_trial
from study.session.state.presentation_check import LogContradictionError
from study.session.state.rules import is_place_assigned_later, is_refusal_final, is_same_stimulus_repeated
from study.session.state.sitting_state import SittingState


@dataclass(frozen=True, slots=True)
class SessionState:
    """Position in the schedule, open trial, presentations so far, and state of the current sitting."""

    opened: SessionOpened
    """The opening event of the log, with the participant number of `assign_place`, if there is one."""
    protocol: StudyProtocol
    runs: tuple[Run, ...]
    """Schedule of the participant, in order."""
    run: int
    """Index of the current run; len(runs) when all are finished."""
    staircase: StaircaseState
    """Staircase of the current run."""
    trial: int
    """Number of the current trial in its run, from 0."""
    attempt: int
    """Number of the current presentation of that trial, from 0; above 0 where earlier presentations were void."""
    presented: TrialPresented | None
    """The presentation that is not completed; None between trials."""
    answered: AnswerGiven | None
    """The answer of the open trial, whose measurement is not logged yet; None without one."""
    trials: tuple[Trial, ...]
    """All presentations so far, including void presentations, and the open trial as the last."""
    rest_due_s: float
    """Rest that is due before the next trial (s); 0 for none."""
    closed: bool
    """Whether the log contains the closing event."""
    practice: PracticeState = field(default_factory=PracticeState)
    """Answers of the current run, if it is a practice run; its staircase is then unused."""
    sitting: SittingState = field(default_factory=SittingState)

    @property
    def finished(self) -> bool:
        """Whether all runs of the schedule are done."""
        return self.run >= len(self.runs)

    @property
    def is_finally_ineligible(self) -> bool:
        """Whether the participant refused or was excluded, where the rules make that final."""
        return bool(self.sitting.ineligibility) and is_refusal_final(self.opened)

    @property
    def has_final_place(self) -> bool:
        """Whether the participant number in `opened` is the participant's final place in the counterbalanced order."""
        return self.sitting.place_assigned or bool(self.trials) or not is_place_assigned_later(self.opened)

    @property
    def answers(self) -> int:
        """Number of answers that count, that of the open trial included."""
        return sum(trial.is_valid for trial in self.trials)


def begin_session(opened: SessionOpened, protocol: StudyProtocol) -> SessionState:
    """Compute the state after the opening event of the log. Raises LogContradictionError where an equalized session has
    no scale of levels for a frequency of the protocol."""
    _check_scales(opened, protocol)
    state = SessionState(
        opened=opened,
        protocol=protocol,
        runs=schedule_runs(protocol, opened.seed, opened.participant_number),
        run=0,
        staircase=begin_staircase(protocol.staircase),
        trial=0,
        attempt=0,
        presented=None,
        answered=None,
        trials=(),
        rest_due_s=0.0,
        closed=False,
        sitting=set_dose_elsewhere(
            SittingState(last_moment=Moment(opened.utc, opened.monotonic_s)), opened.dose_elsewhere
        ),
    )
    return replace(state, staircase=begin_staircase(make_current_rule(state)))


def _check_scales(opened: SessionOpened, protocol: StudyProtocol) -> None:
    """Raise LogContradictionError unless an equalized session has a scale of levels for every frequency."""
    if opened.equalized is None:
        return
    scaled_hz = {scale.frequency_hz for scale in opened.equalized.levels}
    unscaled_frequencies = [
        f"{frequency_hz:g} Hz" for frequency_hz in protocol.all_frequencies_hz if frequency_hz not in scaled_hz
    ]
    if unscaled_frequencies:
        raise LogContradictionError(f"the session has no scale of levels for {', '.join(unscaled_frequencies)}")


def assign_place(state: SessionState, participant_number: int) -> SessionState:
    """Return the state with the place in the counterbalanced order, assigned before the first trial. participant_number
    replaces the number of the opening event and determines the order of the runs."""
    opened = replace(state.opened, participant_number=participant_number)
    runs = schedule_runs(state.protocol, opened.seed, participant_number)
    updated_state = replace(state, opened=opened, runs=runs, sitting=replace(state.sitting, place_assigned=True))
    return replace(updated_state, staircase=begin_staircase(make_current_rule(updated_state)))


def make_current_rule(state: SessionState) -> StaircaseRule:
    """Make the staircase rule of the current run. Raises IndexError if all runs are done."""
    return make_staircase_rule(state.protocol, state.runs[state.run].phase)


def find_due_presentation(state: SessionState) -> PresentTrial:
    """Find the next presentation, determined by the staircase and the schedule of the current run, which must exist."""
    place = Place(state.runs[state.run], state.trial, state.attempt, state.staircase)
    return compute_due_trial(state.protocol, state.opened, make_current_rule(state), place)


def count_repeats_left(state: SessionState) -> int | None:
    """Count the further repeats of a stimulus that the participant may request in this run; None if unlimited."""
    if not is_same_stimulus_repeated(state.opened):
        return None
    repeat_count = sum(trial.run == state.run and trial.void_cause is VoidCause.ASKED for trial in state.trials)
    return max(0, state.protocol.trial.repeats_per_run - repeat_count)


def is_felt_by_person(opened: SessionOpened) -> bool | None:
    """Whether a person felt the stimuli: False on a simulated device, None for a simulated participant."""
    return None if opened.observer is not None else not opened.device.simulated
