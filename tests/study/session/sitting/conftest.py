"""A protocol with everything around its trials, and sessions begun with it."""

from dataclasses import replace

import pytest

from protocols.definition.participant_text import Question
from protocols.definition.preparation import (
    ConsentSettings,
    DemoSettings,
    PracticeSettings,
    SetupSettings,
)
from study.session.state.state import begin_session


@pytest.fixture
def full(small_protocol):
    """The small protocol with everything around the trials that there is."""
    return replace(
        small_protocol,
        consent=ConsentSettings(version="3", ethics_id="EK 7/26", statements=("I agree.",), exclusions=("A wound?",)),
        setup=SetupSettings(ask=True),
        demo=DemoSettings(level_n=1.0),
        practice=PracticeSettings(frequencies_hz=(25.0,), right_needed=2, of_last=3, trial_limit=4),
        debrief=(Question("strategy", "How?"), Question("felt", "Directed?", ("yes", "no"))),
    )


@pytest.fixture
def begun(facts, small_text):
    def begin(protocol, **changes):
        return begin_session(facts.opened(protocol, small_text, **changes), protocol)

    return begin
