"""The wall clock is set while a session runs, or between two sittings: no limit follows it, and it is said."""

from datetime import datetime, timedelta

import pytest

from study.devices.clock import VirtualClock
from study.participants.observer_catalogue import find_observer
from study.session.facts.events import NoteTaken, SessionResumed
from study.session.state.sitting_state import compute_daily_dose
from study.session.views.participant_views import Unanswered
from study.store.sessions.event_log import read_log
from study.workflows.files.validate import validate_file
from study.workflows.results.fold_session import fold_session
from study.workflows.session.conduct_session import Participant, conduct_new, conduct_resumed
from study.workflows.session.simulated_display import SimulatedDisplay
from study.workflows.views.view_session import make_session_view

NOON = datetime.fromisoformat("2026-06-01T12:00:00+00:00")


class SetClock(VirtualClock):
    """Its wall clock can be set; its monotonic clock cannot."""

    set_by_s = 0.0

    def utc(self) -> str:
        shifted = datetime.fromisoformat(super().utc()) + timedelta(seconds=self.set_by_s)
        return shifted.isoformat(timespec="milliseconds")


class Answers:
    """A simulated participant beside whom the clock is set before one question, and who leaves at another."""

    def __init__(self, display, clock, set_at=None, by_s=0.0, leave_at=None) -> None:
        self._display, self._clock, self._set_at, self._by_s, self._leave_at = display, clock, set_at, by_s, leave_at
        self._asked = 0
        self.told: list[str] = []

    def ask(self, question, sign_of_life):
        if self._asked == self._set_at:
            self._clock.set_by_s = self._by_s
        self._asked += 1
        if self._asked - 1 == self._leave_at:
            return Unanswered("the participant left", ends_sitting=True)
        return self._display.ask(question, sign_of_life)

    def trouble(self, sentence: str) -> None:
        self.told.append(sentence)

    def __getattr__(self, name: str):
        return getattr(self._display, name)


@pytest.fixture
def at(sitter):
    def participant(start: datetime, **what) -> Participant:
        clock = SetClock(start)
        quiet = SimulatedDisplay(find_observer(sitter.observer, sitter.seed), sitter.seed, clock)
        return Participant(display=Answers(quiet, clock, **what), hand=quiet, clock=clock)

    return participant


def notes(folder) -> list[str]:
    return [event.text for event in read_log(folder.log).events if isinstance(event, NoteTaken)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hours", "said"),
    [(10, "set forward by 10 h 0 min"), (-3, "set back by 3 h 0 min")],
)
def test_a_clock_that_is_set_in_a_sitting_changes_nothing_and_is_said_everywhere(sitter, at, hours, said):
    seat = at(NOON, set_at=3, by_s=3600.0 * hours)
    end = conduct_new(sitter.plan(), "simulated", seat)
    undisturbed = sitter.whole("P02")
    assert end.end_reason == ""
    assert end.state.sitting.dose == undisturbed.state.sitting.dose
    assert end.state.sitting.sitting_elapsed_s == pytest.approx(undisturbed.state.sitting.sitting_elapsed_s, abs=0.1)
    (told,) = seat.display.told
    assert told.startswith("The computer's clock was ") and said in told
    assert notes(end.folder) == [told]
    assert any(told in warning for warning in make_session_view(end.folder.path).warnings)
    checked = validate_file(end.folder.path)
    assert checked.problems == ()
    assert said in checked.kind
    assert fold_session(end.folder).state == end.state


@pytest.mark.slow
def test_a_clock_set_back_between_sittings_is_reported_when_the_session_continues(sitter, at):
    first = conduct_new(sitter.plan(), "simulated", at(NOON, leave_at=4))
    seat = at(NOON - timedelta(hours=2))
    again = conduct_resumed(first.folder, "simulated", seat)
    (told,) = seat.display.told
    assert told.startswith("The computer's clock reads 2 h 0 min earlier than at the last entry of the log.")
    assert notes(again.folder) == [told]
    assert again.state.sitting.dose.vibrated_s > first.state.sitting.dose.vibrated_s
    assert again.state.sitting.sitting_elapsed_s >= 0.0


def test_every_entry_of_a_sitting_carries_the_monotonic_clock(finished):
    events = read_log(finished.folder.log).events
    stamps = [event.monotonic_s for event in events]
    assert None not in stamps
    assert stamps == sorted(stamps)


def test_a_simulated_session_that_continues_does_so_after_its_own_last_entry(sitter):
    """Its time runs ahead of the computer's, which is no clock that was set back."""
    clock = VirtualClock.resume_at("2099-01-01T00:00:00.000+00:00")
    assert clock.utc() == "2099-01-01T00:00:00.000+00:00"
    assert VirtualClock.resume_at("2001-01-01T00:00:00.000+00:00").utc() > "2026"


@pytest.mark.slow
def test_a_second_session_on_the_same_day_continues_with_the_dose_of_the_first(sitter):
    first = conduct_new(sitter.plan(observer=None), "simulated", sitter.participant())
    second = conduct_new(sitter.plan(observer=None), "simulated", sitter.participant(2, leave))
    opened = read_log(second.folder.log).events[0]
    assert opened.dose_elsewhere.sessions == (first.folder.name,)
    assert opened.dose_elsewhere.vibrated_s == first.state.sitting.dose.vibrated_s > 0
    assert compute_daily_dose(second.state.sitting).vibrated_s > first.state.sitting.dose.vibrated_s
    other = conduct_new(sitter.plan("P02", observer=None), "simulated", sitter.participant(2, leave))
    assert read_log(other.folder.log).events[0].dose_elsewhere is None
    again = sitter.resumed(second.folder)
    resumed = [event for event in read_log(again.folder.log).events if isinstance(event, SessionResumed)]
    assert [event.dose_elsewhere.sessions for event in resumed] == [(first.folder.name,)]


@pytest.mark.slow
def test_a_session_that_cannot_be_read_is_named_where_its_dose_is_missing(sitter, at):
    first = sitter.whole()
    first.folder.log.write_bytes(b"no event\n" + first.folder.log.read_bytes())
    seat = at(NOON, leave_at=2)
    second = conduct_new(sitter.plan(observer=None), "simulated", seat)
    said = f"{first.folder.name} cannot be read: what the hand got in it is not in the vibration dose of today."
    assert seat.display.told == [said]
    assert said in notes(second.folder)


def leave() -> Unanswered:
    return Unanswered("the participant left", ends_sitting=True)
