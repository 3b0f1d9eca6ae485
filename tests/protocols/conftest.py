"""The shipped study, as text and as a value, and the published staircase."""

from importlib.resources import files

import pytest

from protocols.definition.staircase_rule import StaircaseRule, StepPhase
from protocols.definition.study_protocol import StudyProtocol
from protocols.document.loading import load_protocol


@pytest.fixture(scope="session")
def threshold_text() -> str:
    return files("protocols").joinpath("direction_threshold.toml").read_text("utf-8")


@pytest.fixture(scope="session")
def threshold(threshold_text: str) -> StudyProtocol:
    protocol = load_protocol(threshold_text, "direction_threshold.toml")
    assert isinstance(protocol, StudyProtocol)
    return protocol


@pytest.fixture(scope="session")
def published() -> StaircaseRule:
    return StaircaseRule(
        start_n=1.0,
        cap_n=3.0,
        up_after_wrong=1,
        down_after_right=3,
        steps=(StepPhase(4.0, 3), StepPhase(1.0, 10)),
        reversals=13,
        averaged_reversals=10,
    )
