"""A simulated participant at the display and at the handle: feels the stimulus and answers after a while."""

from collections.abc import Callable

from study.devices.clock import Clock
from study.participants.observer import Felt, Observer
from study.session.due_trial import Present
from study.session.views import Answered, Goodbye, Question, Reply, RestNotice, Unanswered, Welcome
from study.workflows.display import SignOfLife

GLANCE_S = 0.1
"""How often a waiting participant gives the device a sign of life."""


class SimulatedDisplay:
    def __init__(
        self, observer: Observer, seed: int, clock: Clock, on_question: Callable[[Question], None] | None = None
    ) -> None:
        self._observer = observer
        self._seed = seed
        self._clock = clock
        self._on_question = on_question
        self._felt: Felt | None = None

    def feel(self, stimulus: Present, answers_before: int) -> None:
        self._felt = Felt(
            run=stimulus.run,
            trial=stimulus.trial,
            attempt=stimulus.attempt,
            phase=stimulus.phase,
            frequency_hz=stimulus.frequency_hz,
            level_n=stimulus.level_n,
            direction_shown=stimulus.label,
            trials_before=answers_before,
        )

    def welcome(self, notice: Welcome) -> None:
        return None

    def ask(self, question: Question, sign_of_life: SignOfLife) -> Reply:
        if self._on_question is not None:
            self._on_question(question)
        if self._felt is None:
            raise RuntimeError("a simulated participant was asked before anything was felt")
        reply = self._observer.reply(self._felt, self._seed)
        too_slow = 0 < question.time_limit_s < reply.response_time_s
        until_s = self._clock.now_s() + (question.time_limit_s if too_slow else reply.response_time_s)
        while (left_s := until_s - self._clock.now_s()) > 1e-9:
            self._clock.sleep(min(GLANCE_S, left_s))
            if not sign_of_life():
                return Unanswered("the stimulus ended early", leave=False)
        if too_slow:
            return Unanswered("no answer within the time limit", leave=False)
        return Answered(reply.answer, self._clock.now_s())

    def feedback(self, correct: bool) -> None:
        return None

    def rest(self, notice: RestNotice) -> float:
        self._clock.sleep(notice.seconds)
        return notice.seconds

    def goodbye(self, notice: Goodbye) -> None:
        return None

    def await_return(self, reason: str) -> None:
        return None

    def trouble(self, sentence: str) -> None:
        return None
