"""Places in a balanced order."""

from dataclasses import replace

import pytest

from study.store.sessions.archive import find_session
from study.workflows.session.participant_number import find_participant_number
from study.workflows.session.withdraw_participant import plan_withdrawal, withdraw


@pytest.fixture
def number(sitter):
    """Begins (and leaves) a session of a subject; returns the number it got."""

    def begin(subject: str, protocol_name: str = "small", observer: str | None = "scripted") -> int:
        sitter_plan = sitter.plan(subject, observer)
        protocol = replace(sitter.protocol, name=protocol_name)
        text = sitter.text.replace('name = "small"', f'name = "{protocol_name}"')
        from study.workflows.session.conduct_session import conduct_new

        plan = replace(sitter_plan, protocol=protocol, protocol_text=text)
        from study.session.views.participant_views import Unanswered

        leave = sitter.participant(0, lambda: Unanswered("left", ends_sitting=True))
        return conduct_new(plan, "simulated", leave).state.opened.participant_number

    return begin


def test_each_participant_gets_a_number_and_keeps_it(number):
    assert [number(s) for s in ("P01", "P02", "P01", "P03", "P02")] == [0, 1, 0, 2, 1]


def test_another_protocol_counts_apart(number):
    """P01 practised first; P02 began the study before P01 did."""
    assert number("P01", "practice") == 0
    assert [number("P02"), number("P01"), number("P03")] == [0, 1, 2]


def test_people_and_simulated_participants_count_apart(number):
    assert number("ideal1", observer="ideal") == 0
    assert number("P01", observer=None) == 0


def test_a_withdrawn_participant_keeps_the_number(number, sitter):
    assert [number("P01"), number("P02")] == [0, 1]
    withdraw(sitter.data, plan_withdrawal(find_session("P02_001", sitter.data)), "2026-01-01T00:00:00+00:00")
    assert number("P03") == 2


def test_a_damaged_older_session_keeps_no_participant_out(number, sitter):
    assert number("P01") == 0
    log = sitter.data / "P01_001" / "events.jsonl"
    log.write_text("not a log\n")
    assert number("P01") == 0
    assert find_participant_number(sitter.data, "P02", "small", simulated=True) == 1


def test_a_place_is_not_given_again_where_the_first_line_was_damaged(number, sitter):
    assert [number("P01"), number("P02")] == [0, 1]
    log = sitter.data / "P02_001" / "events.jsonl"
    whole = log.read_bytes()
    for old, new in ((b'"seed":', b'"sead":'), (b"{", b"["), (b'"subject":"P', b'"subject":"\xff'), (b'"seed":', b"")):
        log.write_bytes(whole.replace(old, new, 1))
        assert find_participant_number(sitter.data, "P03", "small", simulated=True) == 2, new
        assert find_participant_number(sitter.data, "P03", "small", simulated=False) == 0
        assert find_participant_number(sitter.data, "P03", "practice", simulated=True) == 0
