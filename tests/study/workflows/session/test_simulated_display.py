"""What a simulated participant does beside the contract of all displays."""

from itertools import pairwise

import pytest

from protocols.trial import Phase
from study.devices.clock import VirtualClock
from study.participants.observer_catalogue import find_observer
from study.session.state.due_trial import PresentTrial
from study.session.views.form_views import Form, FormField, FormKind
from study.session.views.participant_views import (
    Answered,
    DirectionPicture,
    HandleView,
    Question,
    RestNotice,
    Task,
    Unanswered,
)
from study.workflows.session.simulated_display import SimulatedDisplay

PICTURE = DirectionPicture("yz", (135.0, 45.0))


class Seated:
    def __init__(self, observer: str = "ideal") -> None:
        self.clock = VirtualClock()
        self.display = SimulatedDisplay(find_observer(observer, 3), 3, self.clock)

    def right(self, phase: Phase, frequency_hz: float, level_n: float, trials: int = 200) -> float:
        """Share of right answers among so many trials whose right answer alternates in pairs."""
        task = Task.INTERVAL if phase is Phase.DETECTION else Task.DIRECTION
        right = 0
        for trial in range(trials):
            label = 1 + trial // 2 % 2
            stimulus = PresentTrial(0, trial, 0, phase, frequency_hz, 0.0, level_n, label, 1, 45.0, 1)
            self.display.feel(stimulus, trial)
            question = Question(phase, 1, 1, trial + 1, False, 0.0, PICTURE, task)
            reply = self.display.ask(question, lambda: True)
            right += isinstance(reply, Answered) and reply.answer == label
        return right / trials


@pytest.fixture
def seated():
    return Seated()


def test_a_vibration_without_a_direction_is_found_in_detection_trials_only():
    """At 35 Hz and 0.5 N the direction is lost on the median participant and the vibration is not."""
    assert Seated().right(Phase.DETECTION, 35.0, 0.5) > 0.98
    assert Seated().right(Phase.TEST, 35.0, 0.5) < 0.75


def test_who_guesses_guesses_in_detection_trials_too():
    assert 0.35 < Seated("guesser").right(Phase.DETECTION, 15.0, 3.0) < 0.65


def test_catch_trials_at_full_level_are_right():
    assert Seated().right(Phase.CATCH, 15.0, 3.0) == 1.0


def test_a_handle_that_stays_away_ends_the_sitting_after_a_minute(seated):
    away = HandleView(False, "Bring the handle back", (30.0, 0.0), 5.0)
    reply = seated.display.await_handle(lambda: away, lambda: True)
    assert reply == Unanswered("the handle did not come back", ends_sitting=True)
    assert seated.clock.now_s() == pytest.approx(60.0, abs=0.3)


def test_waits_give_signs_of_life_every_tenth_of_a_second(seated):
    times = [0.0]
    rested_s = seated.display.rest(RestNotice(7.25, 1), lambda: times.append(seated.clock.now_s()) is None)
    assert rested_s == times[-1] == pytest.approx(7.25)
    assert max(b - a for a, b in pairwise(times)) <= 0.1 + 1e-9


def test_a_rest_that_is_cut_short_says_how_long_it_was(seated):
    assert seated.display.rest(RestNotice(60.0, 1), lambda: seated.clock.now_s() < 5.0) == pytest.approx(5.0, abs=0.11)


def test_a_form_gets_the_first_choice_of_each_question(seated):
    fields = (
        FormField("hand", "Which hand?", ("right", "left")),
        FormField("grip", "How was it held?"),
        FormField("notes", "Anything else?", needed=False),
    )
    reply = seated.display.fill_in(Form(FormKind.SETUP, "", "", fields))
    assert reply.answers == {"hand": "right", "grip": "simulated", "notes": ""}


def test_asking_before_anything_was_felt_is_a_mistake_of_the_program(seated):
    with pytest.raises(RuntimeError, match="before anything was felt"):
        seated.display.ask(Question(Phase.TEST, 1, 1, 1, False, 0.0, PICTURE), lambda: True)
