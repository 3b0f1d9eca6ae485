"""Simulated participant of a session: implements the protocols `Display` and `Hand` of `workflows.trial.display`.

Questions are answered by an `Observer` after its response time; all waiting is done on the given clock, so that a
session can run in virtual time. Methods that only return None continue at once.
"""

from collections.abc import Callable
from dataclasses import replace

from protocols.trial import Phase, VoidCause
from study.devices.clock import Clock
from study.participants.observer import Observer, PerceivedStimulus
from study.session.state.due_trial import PresentTrial
from study.session.views.form_views import Form, FormField, FormReply
from study.session.views.participant_views import (
    AfterPause,
    Answered,
    DemoChoice,
    DemoDone,
    DemoMenu,
    DeviceReport,
    Goodbye,
    HandleView,
    PauseNotice,
    PlayingNotice,
    PracticeResult,
    Question,
    Reply,
    RestNotice,
    Unanswered,
    Welcome,
)
from study.workflows.session.stimulus_sampler import StimulusSampler
from study.workflows.trial.display import SignOfLife

KEEPALIVE_INTERVAL_S = 0.1
"""Interval (s) between two calls of `sign_of_life` while waiting: the longest that `Display` allows."""

MAX_HANDLE_WAIT_S = 60.0
"""Longest wait (s) for the handle to return to its place: no person moves the handle of a simulated participant.
Chosen."""

ENDED_EARLY = Unanswered("the stimulus ended early", ends_sitting=False)
"""Reply where `sign_of_life` returned False, which ends the wait."""


class SimulatedDisplay:
    """Display and hand of a simulated participant."""

    def __init__(
        self,
        observer: Observer,
        seed: int,
        clock: Clock,
        on_question: Callable[[Question], None] | None = None,
        sampler: StimulusSampler | None = None,
    ) -> None:
        """observer: model of the participant; seed: of the session, for the observer's draws; on_question: called with
        each question; sampler: measures the delivered acceleration, for an observer who depends on it."""
        self._observer = observer
        self._seed = seed
        self._clock = clock
        self._on_question = on_question
        self._sampler = sampler
        self._perceived: PerceivedStimulus | None = None
        self._stimulus: PresentTrial | None = None

    def feel(self, stimulus: PresentTrial, answers_before: int) -> None:
        """Store the stimulus, for the answer and for `StimulusSampler`."""
        self._stimulus = stimulus
        self._perceived = PerceivedStimulus(
            run=stimulus.run,
            trial=stimulus.trial,
            attempt=stimulus.attempt,
            phase=stimulus.phase,
            frequency_hz=stimulus.frequency_hz,
            level_n=stimulus.level_n,
            direction_shown=stimulus.label,
            trials_before=answers_before,
            nominal_n=stimulus.nominal_n,
        )

    def listen_with(self, listen: Callable[[], None]) -> None:
        return None

    def fill_in(self, form: Form) -> FormReply:
        """Fill each field with the first answer that it allows; a participant who is eligible gives this answer."""
        return FormReply({field.key: _choose_first_answer(field) for field in form.fields})

    def device_checked(self, report: DeviceReport) -> bool:
        """Continue without repeating the check."""
        return True

    def welcome(self, notice: Welcome) -> None:
        return None

    def choose_demo(self, menu: DemoMenu, sign_of_life: SignOfLife) -> DemoChoice:
        """End the demonstration at once."""
        return DemoDone()

    def show_playing(self, notice: PlayingNotice, sign_of_life: SignOfLife) -> Unanswered | None:
        """Wait until the stimulus or interval is over; `ENDED_EARLY` where `sign_of_life` ended the wait."""
        return None if self._wait(notice.seconds, sign_of_life) else ENDED_EARLY

    def await_handle(self, look: Callable[[], HandleView], sign_of_life: SignOfLife) -> Unanswered | None:
        """Wait until the handle is at its place; ends the sitting after `MAX_HANDLE_WAIT_S`."""
        deadline_s = self._clock.now_s() + MAX_HANDLE_WAIT_S
        while not look().ready:
            if self._clock.now_s() > deadline_s:
                return Unanswered("the handle did not come back", ends_sitting=True)
            if not self._wait(KEEPALIVE_INTERVAL_S, sign_of_life):
                return ENDED_EARLY
        return None

    def ask(self, question: Question, sign_of_life: SignOfLife) -> Reply:
        """Return the answer of the observer after its response time. No answer where that exceeds the time limit, where
        `sign_of_life` ended the wait, or where the observer asks for a repetition that is allowed. Raises RuntimeError
        before the first stimulus."""
        if self._on_question is not None:
            self._on_question(question)
        if self._perceived is None:
            raise RuntimeError("a simulated participant was asked before anything was felt")
        # The response time depends on the trial's random numbers alone; the answer may depend on what was delivered.
        response_time_s = self._observer.reply(self._perceived, self._seed).response_time_s
        exceeds_limit = 0 < question.time_limit_s < response_time_s
        perceived = self._wait_and_feel(
            self._perceived, question.time_limit_s if exceeds_limit else response_time_s, sign_of_life
        )
        if perceived is None:
            return ENDED_EARLY
        if exceeds_limit:
            return Unanswered("no answer within the time limit", ends_sitting=False, cause=VoidCause.LATE)
        reply = self._observer.reply(perceived, self._seed)
        if reply.ask_again and question.repeats_left != 0:
            return Unanswered("asked to repeat", ends_sitting=False, repeat_requested=True)
        return Answered(reply.answer, self._clock.now_s())

    def _wait_and_feel(
        self, perceived: PerceivedStimulus, duration_s: float, sign_of_life: SignOfLife
    ) -> PerceivedStimulus | None:
        """Wait for duration_s; return the stimulus, with the delivered acceleration of its last periods where there is
        a `StimulusSampler`. None where `sign_of_life` ended the wait. In a detection trial the stimulus ended before
        the question."""
        sampler, stimulus = self._sampler, self._stimulus
        if sampler is None or stimulus is None or perceived.phase is Phase.DETECTION:
            return perceived if self._wait(duration_s, sign_of_life) else None
        if not self._wait(max(0.0, duration_s - sampler.compute_duration_s(stimulus)), sign_of_life):
            return None
        delivered = sampler.measure_stimulus(stimulus, sign_of_life)
        return replace(perceived, delivered=delivered) if sign_of_life() else None

    def feedback(self, correct: bool) -> None:
        return None

    def practice_over(self, result: PracticeResult) -> None:
        return None

    def rest(self, notice: RestNotice, sign_of_life: SignOfLife) -> float:
        """Wait for the duration of the rest; returns the time (s) that passed."""
        started_s = self._clock.now_s()
        self._wait(notice.seconds, sign_of_life)
        return self._clock.now_s() - started_s

    def pause(self, notice: PauseNotice, sign_of_life: SignOfLife) -> AfterPause:
        """Continue the sitting without waiting."""
        return AfterPause.CONTINUE_SITTING

    def goodbye(self, notice: Goodbye) -> None:
        return None

    def await_return(self, reason: str) -> None:
        return None

    def trouble(self, sentence: str) -> None:
        return None

    def _wait(self, duration_s: float, sign_of_life: SignOfLife) -> bool:
        """Wait for duration_s on the clock, calling `sign_of_life` every `KEEPALIVE_INTERVAL_S`; False if that ended
        the wait."""
        end_s = self._clock.now_s() + duration_s
        while (remaining_s := end_s - self._clock.now_s()) > 1e-9:  # s; above the rounding of sums of intervals
            self._clock.sleep(min(KEEPALIVE_INTERVAL_S, remaining_s))
            if not sign_of_life():
                return False
        return True


def _choose_first_answer(field: FormField) -> str:
    """Choose the first choice of a field with choices, the lowest number of a field with limits; else a placeholder
    text where an answer is required, empty for an optional text."""
    if field.choices:
        return field.choices[0]
    if field.limits is not None:
        return f"{field.limits.lowest:g}"
    return "simulated" if field.needed else ""
