"""A protocol that asks for masking noise: heard in every trial, silent in pauses, in the log; without it no session."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest

from protocols.definition.preparation import MaskingSettings
from study.devices.clock import RealClock, VirtualClock
from study.errors import DeviceError
from study.session.facts.events import (
    MaskingPlayed,
    PauseTaken,
    SessionClosed,
    SessionInterrupted,
    TrialPresented,
    TrialSpoiled,
    encode_event,
    parse_event,
)
from study.session.views.participant_views import Unanswered
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import read_log
from study.workflows.session import conduct_session
from study.workflows.trial import masking

NEVER = 10**6
SETTINGS = MaskingSettings(play=True, level_db=-20.0, seed=5)


class Sound:
    output = "Headphones"

    def __init__(self, fails_at: int = NEVER) -> None:
        self.playing = False
        self.checks, self.fails_at = 0, fails_at

    def start(self) -> None:
        self.playing = True

    def check(self) -> None:
        self.checks += 1
        if self.checks >= self.fails_at:
            raise DeviceError("The masking noise has stopped", "Headphones plays no more.", "Plug them in.")
        assert self.playing

    def stop(self) -> bool:
        played, self.playing = self.playing, False
        return played


@pytest.fixture
def sitter(brief):
    return brief


def asks_for_noise(sitter) -> None:
    sitter.text += "\n[masking]\nplay = true\nlevel_db = -20.0\nseed = 5\n"
    sitter.protocol = replace(sitter.protocol, masking=SETTINGS)


@pytest.fixture
def sound(monkeypatch, sitter):
    """In the place of the system's output; the protocol asks for noise."""
    sound = Sound()
    asks_for_noise(sitter)
    monkeypatch.setattr(
        conduct_session, "open_masking_sound", lambda settings, clock, observer: contextlib.nullcontext(sound)
    )
    return sound


def log_of(folder) -> list[str]:
    """The facts that matter here, in order."""
    names = {TrialPresented: "trial", PauseTaken: "pause", SessionClosed: "closed", SessionInterrupted: "left"}
    told = []
    for event in read_log(folder.log).events:
        if isinstance(event, MaskingPlayed):
            told.append("on" if event.playing else f"off {event.trouble}".strip())
        elif type(event) in names:
            told.append(names[type(event)])
    return told


@pytest.mark.slow
def test_it_plays_from_before_the_first_trial_to_the_end(sitter, sound):
    conducted = sitter.whole()
    told = log_of(conducted.folder)
    assert (told[0], told[-2:]) == ("on", ["off", "closed"])
    assert set(told[1:-2]) == {"trial"} and sound.checks == 2 * len(told[1:-2])
    assert not sound.playing


@pytest.mark.slow
def test_it_is_silent_in_a_pause_and_comes_back(sitter, sound):
    pause = lambda: Unanswered("a pause", ends_sitting=False, repeat_requested=True, pause=True)  # noqa: E731
    told = log_of(sitter.interrupted(after=2, instead=pause).folder)
    at = told.index("pause")
    assert told[at - 1 : at + 2] == ["off", "pause", "on"]
    assert told.count("on") == told.count("off") == 2


@pytest.mark.slow
def test_a_session_that_is_left_and_resumed_begins_it_anew(sitter, sound):
    conducted = sitter.interrupted(after=2)
    assert log_of(conducted.folder)[-2:] == ["off", "left"] and not sound.playing
    again = sitter.resumed(conducted.folder)
    assert log_of(again.folder).count("on") == 2 and again.end_reason == ""


def test_every_seed_that_a_protocol_accepts_can_be_logged():
    noise = MaskingSettings(play=True, seed=2**32 - 1)
    event = MaskingPlayed(
        "2026-11-30T11:00:00Z", True, "Headphones", noise.level_db, noise.low_hz, noise.high_hz, noise.seed
    )
    assert parse_event(encode_event(event)) == event


def test_noise_that_falls_silent_ends_the_sitting_before_the_next_trial_and_nothing_is_lost(sitter, sound):
    sound.fails_at = 7  # before the 4th trial; each is checked before it and at its answer
    with pytest.raises(DeviceError, match="masking noise has stopped") as told:
        sitter.whole()
    assert "3 answers" in told.value.saved and "hapteq resume" in told.value.do_now
    (folder,) = (path for path in sitter.data.iterdir() if (path / "events.jsonl").exists())
    session = SessionFolder(folder)
    assert log_of(session)[-1] == "off Headphones plays no more."
    sound.fails_at = NEVER
    assert sitter.resumed(session).end_reason == ""


@pytest.mark.slow
def test_the_trial_in_which_the_noise_falls_silent_is_void_and_comes_again(sitter, sound):
    sound.fails_at = 8
    with pytest.raises(DeviceError, match="masking noise has stopped") as told:
        sitter.whole()
    assert "3 answers" in told.value.saved
    (folder,) = (path for path in sitter.data.iterdir() if (path / "events.jsonl").exists())
    session = SessionFolder(folder)
    (void,) = (event for event in read_log(session.log).events if isinstance(event, TrialSpoiled))
    assert "masking noise stopped" in void.reason
    sound.fails_at = NEVER
    assert sitter.resumed(session).end_reason == ""
    shown = [event for event in read_log(session.log).events if isinstance(event, TrialPresented)]
    assert [(event.run, event.trial, event.attempt) for event in shown[3:5]] == [
        (void.run, void.trial, 0), (void.run, void.trial, 1),
    ]  # fmt: skip


def test_the_level_is_below_that_of_the_file(monkeypatch):
    given = []

    class Closable(Sound):
        def close(self) -> None:
            self.closed = True

    def open_sound(samples, rate_hz: int):
        given.append(samples)
        return Closable()

    monkeypatch.setattr(masking, "make_masking_sound", open_sound)
    monkeypatch.setattr(masking, "LOOP_S", 1)
    for level_db in (0.0, -20.0):
        with masking.open_masking_sound(replace(SETTINGS, level_db=level_db), RealClock(), None) as sound:
            assert sound is not None
        assert sound.closed
    loud, quiet = (np.std(samples.astype(float)) for samples in given)
    assert 20 * np.log10(quiet / loud) == pytest.approx(-20.0, abs=0.01)


def test_nothing_is_opened_where_the_protocol_wants_none_or_no_person_is_there(monkeypatch):
    monkeypatch.setattr(masking, "make_masking_sound", lambda *arguments: 1 / 0)
    none = ((MaskingSettings(), RealClock(), None), (SETTINGS, VirtualClock(), None), (SETTINGS, RealClock(), "ideal"))
    for settings, clock, observer in none:
        with masking.open_masking_sound(settings, clock, observer) as sound:
            assert sound is None


def test_without_an_output_no_session_of_a_person_begins(sitter, monkeypatch):
    def refuse(*arguments: object):
        raise DeviceError("The masking noise cannot be played", "There is no output.", "Connect one.")

    monkeypatch.setattr(masking, "make_masking_sound", refuse)
    monkeypatch.setattr(masking, "LOOP_S", 1)
    asks_for_noise(sitter)
    seated = replace(sitter.participant(), clock=RealClock())
    with pytest.raises(DeviceError, match="cannot be played"):
        conduct_session.conduct_new(sitter.plan("P01", observer=None), "simulated", seated)
    assert not sitter.data.exists() or not list(sitter.data.iterdir())
