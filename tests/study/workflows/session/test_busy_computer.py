"""A computer that is too busy during a sitting: what the participant, the experimenter and the log are told."""

import pytest

from study.errors import UserInterruptError
from study.session.facts.events import NoteTaken, TrialSpoiled
from study.session.facts.void_reasons import SCREEN_DELAYED_BY_LOAD
from study.session.views.participant_views import Unanswered
from study.store.sessions.event_log import read_log
from study.workflows.results.fold_session import fold_session
from study.workflows.session.conduct_session import Participant, conduct_new
from study.workflows.session.end_sitting import end_sitting
from study.workflows.views.session_facts import list_session_facts

UTC = "2026-01-01T00:00:00.000+00:00"


class LateScreen:
    """A simulated participant whose screen is late at some questions."""

    def __init__(self, display, late_at) -> None:
        self._display, self._late_at, self._asked = display, late_at, 0
        self.told: list[str] = []
        self.voids: list[str] = []

    def ask(self, question, sign_of_life):
        self._asked += 1
        if self._asked - 1 in self._late_at:
            return Unanswered(SCREEN_DELAYED_BY_LOAD, ends_sitting=False)
        return self._display.ask(question, sign_of_life)

    def await_return(self, reason: str) -> None:
        self.voids.append(reason)

    def trouble(self, sentence: str) -> None:
        self.told.append(sentence)

    def __getattr__(self, name: str):
        return getattr(self._display, name)


@pytest.fixture
def late_at(brief):
    def conducted(*questions: int):
        seat = brief.participant()
        screen = LateScreen(seat.display, questions)
        return conduct_new(brief.plan(), "simulated", Participant(screen, seat.hand, seat.clock)), screen

    return conducted


def of(end, kind):
    return [event for event in read_log(end.folder.log).events if isinstance(event, kind)]


def test_trials_that_a_busy_computer_spoiled_are_repeated_counted_and_told_at_the_end(late_at):
    end, screen = late_at(2, 5)
    assert end.end_reason == ""
    assert screen.voids == [SCREEN_DELAYED_BY_LOAD] * 2
    assert [event.reason for event in of(end, TrialSpoiled)] == [SCREEN_DELAYED_BY_LOAD] * 2
    (told,) = screen.told
    assert told.startswith("The computer was too busy: 2 trials were void because of it in this sitting and repeated.")
    assert [note.text for note in of(end, NoteTaken)] == [told]
    facts = dict(list_session_facts(fold_session(end.folder), lambda moment: moment))
    assert facts["answers"].endswith("and 2 void presentations, 2 of them because the computer was too busy")


def test_three_in_a_row_end_the_sitting_in_words_that_fit(late_at):
    end, screen = late_at(1, 2, 3)
    assert end.end_reason == (
        "the computer is too busy: 3 trials in a row were void because of it, not because of the participant "
        f"(the last because {SCREEN_DELAYED_BY_LOAD})"
    )
    with pytest.raises(UserInterruptError) as left:
        end_sitting(end, UTC)
    assert left.value.do_now.startswith("Close other programs, and measure with hapteq doctor whether that helps.")
    assert left.value.do_now.endswith(f"Continue with: hapteq resume {end.folder.path}")
    assert len(screen.told) == 1


def test_a_sitting_on_a_calm_computer_says_nothing_of_it(late_at):
    end, screen = late_at()
    assert screen.told == []
    assert of(end, NoteTaken) == []
