"""A session as it is followed by an experimenter, told fact by fact."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

from protocols.trial import Phase
from study.session.facts.events import (
    AnswerGiven,
    DeviceFacts,
    RestTaken,
    SessionClosed,
    TrialMeasured,
    TrialSpoiled,
)
from study.session.state.due_trial import PresentTrial
from study.session.state.machine import Finish, TakeRest, find_next_action
from study.session.watching.followed_session import FollowedSession, apply_followed_event, begin_watching
from study.session.watching.live_state import LiveState
from study.session.watching.make_watch_view import LiveInfo, make_watch_view
from tests.session_facts import opened, presented

BEGAN = datetime(2026, 11, 22, 10, 0, tzinfo=UTC)


DEVICE = DeviceFacts("a device", simulated=False, sample_rate_hz=1000.0)


def at(seconds: float) -> str:
    return (BEGAN + timedelta(seconds=seconds)).isoformat(timespec="milliseconds")


def place(action: PresentTrial) -> dict[str, int]:
    return {"run": action.run, "trial": action.trial, "attempt": action.attempt}


class Story:
    """A session under way; ten seconds for each trial."""

    def __init__(self, protocol, text, seed=7) -> None:
        self.watched: FollowedSession = begin_watching(
            opened(protocol, text, utc=at(0), observer="scripted", seed=seed, device=DEVICE), protocol
        )
        self.seconds = 0.0

    def tell(self, event) -> "Story":
        self.watched = apply_followed_event(self.watched, event)
        return self

    def open_trial(self) -> PresentTrial:
        action = find_next_action(self.watched.state)
        if isinstance(action, TakeRest):
            state = self.watched.state
            self.tell(RestTaken(at(self.seconds), state.run, state.trial, rested_s=action.seconds))
            action = find_next_action(self.watched.state)
        self.seconds += 10.0
        self.tell(presented(action, at(self.seconds)))
        return action

    def answer(self, correct: bool, **measured) -> "Story":
        action = self.open_trial()
        answer = action.label if correct else 3 - action.label
        self.tell(AnswerGiven(at(self.seconds + 2), **place(action), answer=answer, response_time_s=2.0))
        facts = {"status": "ok", "vibrated_s": 2.0, "delivered_mps2": 4.0, "off_axis_mps2": 3.0} | measured
        return self.tell(TrialMeasured(at(self.seconds + 3), **place(action), **facts))

    def spoil(self, reason: str) -> "Story":
        action = self.open_trial()
        return self.tell(TrialSpoiled(at(self.seconds + 3), **place(action), reason=reason))

    def to_phase(self, phase: Phase) -> "Story":
        while self.watched.state.runs[self.watched.state.run].phase is not phase:
            self.answer(True)
        return self

    def finish(self) -> "Story":
        answers = iter([True, True, True, False] * 100)
        while not isinstance(find_next_action(self.watched.state), Finish):
            self.answer(next(answers))
        return self.tell(SessionClosed(at(self.seconds + 4), "completed"))

    def view(self, live: LiveState | None = None, later: float = 4.0, before=None, writer: bool | None = None):
        return make_watch_view(self.watched, LiveInfo(live, writer), at(self.seconds + later), before)

    def live(
        self, activity="trial", age_s: float = 0.1, since_s: float = 1.0, later: float = 4.0, **changes
    ) -> LiveState:
        now = self.seconds + later
        quiet = LiveState(at(now - age_s), activity, at(now - since_s), "", 0.5, True, 1.0, False, 0)
        return replace(quiet, **changes)


def kinds(view) -> list[str]:
    return [alarm.kind for alarm in view.alarms]
