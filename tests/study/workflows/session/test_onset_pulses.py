"""A pulse for each trial in the log; where the line breaks, the loss is in there and the session is as without it."""

import contextlib

import numpy as np
import pytest

from study.devices.onset_line import Pulse
from study.session.facts.event_words import describe_log
from study.session.facts.events import OnsetPulsed, TrialPresented
from study.store.sessions.event_log import read_log
from study.workflows.results.fold_session import fold_session
from study.workflows.session import conduct_session

LINE = "byte 1 of /dev/ttyUSB0"


@pytest.fixture
def sitter(brief):
    return brief


@pytest.fixture
def pulses(monkeypatch):
    """In the place of the lab's line: every third pulse is lost."""
    given: list[Pulse] = []

    def pulse() -> Pulse:
        lost = len(given) % 3 == 2
        given.append(Pulse(LINE, None, "it is gone") if lost else Pulse(LINE, 12.5))
        return given[-1]

    monkeypatch.setattr(conduct_session, "_open_pulse_line", lambda clock: contextlib.nullcontext(pulse))
    return given


def events_of(folder) -> list:
    return list(read_log(folder.log).events)


def test_each_trial_has_its_pulse_and_a_lost_one_costs_no_trial(sitter, pulses):
    conducted = sitter.whole()
    events = events_of(conducted.folder)
    presented = [event for event in events if isinstance(event, TrialPresented)]
    pulsed = [event for event in events if isinstance(event, OnsetPulsed)]
    places = [(event.run, event.trial, event.attempt) for event in presented]
    assert [(event.run, event.trial, event.attempt) for event in pulsed] == places
    assert [event.pulsed_s for event in pulsed] == [pulse.at_s for pulse in pulses]
    assert [event.trouble for event in pulsed] == [pulse.trouble for pulse in pulses]
    assert conducted.end_reason == "" and fold_session(conducted.folder).state == conducted.state


@pytest.mark.slow
def test_the_session_is_the_same_without_a_line(sitter, pulses, tmp_path, monkeypatch):
    with_line = sitter.whole("P01").state
    sitter.data = tmp_path / "other"
    monkeypatch.setattr(conduct_session, "_open_pulse_line", lambda clock: contextlib.nullcontext(lambda: None))
    without = sitter.whole("P01").state
    assert [trial.answer for trial in with_line.trials] == [trial.answer for trial in without.trials]


@pytest.mark.slow
def test_the_time_of_a_lost_pulse_is_part_of_the_response_time(sitter, tmp_path, monkeypatch):
    def response_times_s(lost_for_s: float) -> list[float]:
        def pulses(clock):
            return contextlib.nullcontext(lambda: clock.sleep(lost_for_s) or Pulse(LINE, None, "it is gone"))

        monkeypatch.setattr(conduct_session, "_open_pulse_line", pulses)
        sitter.data = tmp_path / f"{lost_for_s}"
        return [trial.response_time_s for trial in sitter.whole("P01").state.trials]

    late_s = np.subtract(response_times_s(0.05), response_times_s(0.0))
    np.testing.assert_allclose(late_s, 0.05, atol=1e-6)


def test_a_trial_that_was_left_has_its_pulse_too(sitter, pulses):
    conducted = sitter.interrupted(after=2)
    assert len(pulses) == 3
    assert len([event for event in events_of(conducted.folder) if isinstance(event, OnsetPulsed)]) == 3


def test_a_lost_pulse_is_described_in_words(sitter, pulses):
    events = events_of(sitter.interrupted(after=3).folder)
    told = "\n".join(describe_log(events))
    assert f"Onset pulse, {LINE}: was sent." in told
    assert f"Onset pulse, {LINE}: was lost: it is gone." in told
