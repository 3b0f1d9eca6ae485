"""A tombstone with facts of a wrong type counts as one without facts: it neither ends a command nor takes a number."""

import json

import pytest

from study.store.sessions.archive import create_session_folder
from study.store.sessions.withdrawal_files import SessionParticipant, read_participant, write_tombstone

BEGUN = SessionParticipant("paper", False, 3)


@pytest.fixture
def folder(tmp_path):
    folder = create_session_folder(tmp_path, "P01")
    write_tombstone(folder, "2026-11-01T10:00:00Z", BEGUN)
    return folder


def test_a_tombstone_keeps_protocol_and_number(folder):
    assert read_participant(folder) == BEGUN


@pytest.mark.parametrize(
    "facts", [{"number": "3"}, {"number": -1}, {"number": True}, {"number": 2.5}, {"protocol": 7}, {"simulated": "no"}]
)
def test_facts_of_a_wrong_type_are_no_facts(folder, facts):
    content = json.loads(folder.tombstone.read_text())
    content["begun"] |= facts
    folder.tombstone.write_text(json.dumps(content))
    assert read_participant(folder) is None
