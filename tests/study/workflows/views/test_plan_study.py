"""The plan of the studies in a data folder."""

from dataclasses import replace

import pytest

from protocols.definition.declared_analysis import AnalysisSettings
from protocols.document.dumping import dump_protocol
from study.errors import WrongUseError
from study.session.views.participant_views import Unanswered
from study.store.sessions.archive import find_session
from study.store.sessions.event_log import EventLog
from study.workflows.session.conduct_session import conduct_new
from study.workflows.session.withdraw_participant import plan_withdrawal, withdraw
from study.workflows.views.plan_study import format_plan_lines, list_planned_studies, summarise_plans


@pytest.fixture
def sitter(brief):
    return brief


@pytest.fixture
def balanced(sitter):
    """The small protocol with two frequencies in a Williams design, for four people."""
    protocol = replace(
        sitter.protocol,
        stimulus=replace(sitter.protocol.stimulus, frequencies_hz=(5.0, 15.0)),
        schedule=replace(sitter.protocol.schedule, order="williams"),
        analysis=AnalysisSettings(participants=4),
    )
    return protocol, dump_protocol(protocol)


@pytest.fixture
def begin(sitter, balanced):
    """A session of this subject, to its end or left at the first question."""

    def conducted(subject, to_the_end=False, observer="scripted"):
        plan = replace(sitter.plan(subject, observer), protocol=balanced[0], protocol_text=balanced[1])
        stay = sitter.participant()
        leave = sitter.participant(0, lambda: Unanswered("left", ends_sitting=True))
        conduct_new(plan, "simulated", stay if to_the_end else leave)

    return conducted


def only(data, protocol=None, simulated=True):
    (study,) = list_planned_studies(data, protocol, simulated)
    return study


@pytest.mark.slow
def test_done_begun_and_withdrawn_participants_and_who_comes_next(sitter, begin):
    begin("P01", to_the_end=True)
    begin("P02")
    begin("P03", to_the_end=True)
    withdraw(sitter.data, plan_withdrawal(find_session("P03_001", sitter.data)), "2026-01-01T00:00:00+00:00")
    study = only(sitter.data)
    assert [(who.code, who.number, who.progress) for who in study.plan.participants] == [
        ("P01", 0, "done"),
        ("P02", 1, "begun"),
        ("P03", 2, "left out"),
    ]
    assert [(cell.frequencies_hz, cell.needed) for cell in study.plan.cells] == [((5.0, 15.0), 1), ((15.0, 5.0), 1)]
    assert (study.next_code, study.plan.next_number) == ("P04", 3)
    said = format_plan_lines(study)
    assert said[0] == "small: 1 done of 4 planned, 1 begun, 1 left out"
    assert "to resume: P02" in said and "left out: P03 (withdrawn)" in said
    assert "orders still needed: 1, 2" in said
    assert said[-1] == "next: P04, order 2: 15, 5 Hz"


def test_a_second_session_of_a_participant_counts_once_by_the_furthest(sitter, begin):
    begin("P01", to_the_end=True)
    begin("P01")
    assert [(who.code, who.progress) for who in only(sitter.data).plan.participants] == [("P01", "done")]


def test_a_session_that_is_running_is_not_to_be_resumed(sitter, begin):
    begin("P01")
    begin("P02")
    log = EventLog.reopen(find_session("P02_001", sitter.data).log)
    study = only(sitter.data)
    log.close()
    said = format_plan_lines(study)
    assert said[:3] == ["small: 0 done of 4 planned, 2 begun, 0 left out", "to resume: P01", "running: P02"]
    assert [who.reason for who in study.plan.participants] == ["", "running"]


def test_people_and_simulated_participants_are_planned_apart(sitter, begin):
    begin("S01")
    with pytest.raises(WrongUseError, match="no study to plan"):
        list_planned_studies(sitter.data, None, simulated=False)
    begin("P07", observer=None)
    assert [who.code for who in only(sitter.data, simulated=False).plan.participants] == ["P07"]
    assert [who.code for who in only(sitter.data).plan.participants] == ["S01"]
    assert only(sitter.data, simulated=False).next_code == "P08"


def test_a_protocol_without_sessions_is_planned_from_its_file(tmp_path):
    study = only(tmp_path, "direction_threshold", simulated=False)
    assert (study.next_code, study.plan.participants) == ("P01", ())
    assert any("drawn by lot" in line for line in format_plan_lines(study))


def test_different_texts_of_one_protocol_are_reported(sitter, begin, balanced):
    begin("P01")
    assert only(sitter.data).remarks == ()
    other = replace(sitter.plan("P02"), protocol=balanced[0], protocol_text=balanced[1] + "# later\n")
    conduct_new(other, "simulated", sitter.participant(0, lambda: Unanswered("left", ends_sitting=True)))
    assert only(sitter.data).remarks[0].startswith("2 different texts")


def test_where_all_logs_are_gone_the_protocol_is_asked_for(sitter, begin):
    begin("P01")
    withdraw(sitter.data, plan_withdrawal(find_session("P01_001", sitter.data)), "2026-01-01T00:00:00+00:00")
    with pytest.raises(WrongUseError, match="--protocol"):
        list_planned_studies(sitter.data, None, simulated=True)


@pytest.mark.slow
def test_the_document_holds_the_same_facts(sitter, begin):
    begin("P01", to_the_end=True)
    (study,) = summarise_plans(list_planned_studies(sitter.data, None, simulated=True))["studies"]
    assert (study["planned"], study["done"], study["begun"], study["left_out"]) == (4, 1, 0, 0)
    assert [order["needed"] for order in study["orders"]] == [1, 2]
    assert study["next"] == {"code": "P02", "number": 1, "frequencies_hz": [15.0, 5.0], "swapped": False}
