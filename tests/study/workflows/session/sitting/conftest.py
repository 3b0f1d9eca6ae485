"""A seat before a simulated device in virtual time, and plans of sessions."""

from dataclasses import replace

import pytest

from protocols.definition.participant_text import Question
from protocols.definition.preparation import (
    ConsentSettings,
    DemoSettings,
    PracticeSettings,
    SetupSettings,
)
from protocols.definition.session_settings import CatchSettings, DetectionSettings, GateSettings
from protocols.document.dumping import dump_protocol
from protocols.document.loading import load_protocol
from study.devices.clock import VirtualClock
from study.workflows.session.conduct_session import Participant
from study.workflows.session.open_session import SessionPlan
from tests.study.workflows.session.sitting.person import Person


@pytest.fixture(scope="session")
def small_protocol(brief_protocol):
    return brief_protocol


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def person(clock):
    return Person(clock)


@pytest.fixture
def seat(clock, person):
    return Participant(display=person, hand=person, clock=clock)


@pytest.fixture
def plan(tmp_path):
    def planned(protocol) -> SessionPlan:
        text = dump_protocol(protocol)
        return SessionPlan(load_protocol(text, "p.toml"), text, False, "P01", None, 11, tmp_path / "data")

    return planned


@pytest.fixture
def full(small_protocol):
    return replace(
        small_protocol,
        consent=ConsentSettings(version="3", ethics_id="EK 7/26", statements=("I agree.",), exclusions=("A wound?",)),
        setup=SetupSettings(ask=True),
        demo=DemoSettings(level_n=1.0, seconds=1.0),
        practice=PracticeSettings(frequencies_hz=(25.0,), right_needed=2, of_last=3, trial_limit=4),
        catch=CatchSettings(one_in=5),
        detection=DetectionSettings(frequencies_hz=(35.0,), trial_limit=6),
        gate=GateSettings(radius_mm=10.0),
        debrief=(Question("strategy", "How?"),),
    )
