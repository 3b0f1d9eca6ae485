"""Which orders a sample still needs."""

from dataclasses import replace

import pytest

from protocols.definition.declared_analysis import AnalysisSettings
from protocols.definition.study_protocol import ScheduleSettings
from protocols.procedure.schedule import are_labels_swapped, order_frequencies
from protocols.procedure.study_plan import Participant, plan_study

FIVE = (5.0, 15.0, 25.0, 35.0, 45.0)


@pytest.fixture
def study_of(small_protocol):
    def make(order="williams", labels="fixed", planned=0, frequencies_hz=FIVE):
        return replace(
            small_protocol,
            stimulus=replace(small_protocol.stimulus, frequencies_hz=frequencies_hz),
            schedule=ScheduleSettings(order=order, labels=labels),
            analysis=AnalysisSettings(participants=planned),
        )

    return make


def people(*progress):
    return [Participant(f"P{number + 1:02d}", number, each) for number, each in enumerate(progress)]


@pytest.mark.parametrize(
    ("order", "labels", "frequencies_hz", "cells"),
    [
        ("williams", "fixed", FIVE, 10),
        ("williams", "swapped_for_half", FIVE, 20),
        ("williams", "swapped_for_half", FIVE[:4], 8),
        ("random", "swapped_for_half", FIVE, 2),
        ("as_listed", "swapped_for_half", FIVE, 2),
        ("williams", "fixed", FIVE[:1], 2),
    ],
)
def test_cells_are_what_the_schedule_gives_to_each_number(study_of, order, labels, frequencies_hz, cells):
    protocol = study_of(order, labels, frequencies_hz=frequencies_hz)
    for number in range(60):
        plan = plan_study(protocol, [], number)
        assert len(plan.cells) == cells
        assert plan.next_cell.swapped == are_labels_swapped(protocol.schedule, len(frequencies_hz), number)
        if order == "random":
            assert plan.next_cell.frequencies_hz == ()
        else:
            given = order_frequencies(protocol.schedule, frequencies_hz, 11, number)
            assert plan.next_cell.frequencies_hz == given


@pytest.mark.parametrize("order", ["random", "as_listed"])
def test_where_nothing_is_balanced_there_is_no_cell(study_of, order):
    plan = plan_study(study_of(order), people("done"), 1)
    assert (plan.cells, plan.next_cell, plan.cycle_length) == ((), None, 1)


def test_a_whole_sample_needs_nothing_and_fills_each_cell_equally_often(study_of):
    plan = plan_study(study_of(planned=20), people(*["done"] * 20), 20)
    assert [cell.done for cell in plan.cells] == [2] * 10
    assert sum(cell.needed for cell in plan.cells) == 0
    assert (plan.count("done"), plan.planned) == (20, 20)


def test_cells_of_participants_who_are_left_out_stay_needed(study_of):
    progress = ["done"] * 20
    progress[3], progress[7] = "left out", "begun"
    plan = plan_study(study_of(planned=20), people(*progress), 20)
    assert [place for place, cell in enumerate(plan.cells) if cell.needed] == [3]
    assert plan.cells[3].needed == 1
    assert (plan.cells[7].done, plan.cells[7].begun) == (1, 1)


def test_participants_without_a_number_hold_no_cell(study_of):
    refused = Participant("P09", None, "left out", "refused")
    plan = plan_study(study_of(planned=10), [*people("done"), refused], 1)
    assert [cell.needed for cell in plan.cells] == [0, *[1] * 9]
    assert plan.count("left out") == 1


def test_a_sample_that_is_no_multiple_wants_the_first_cells_once_more(study_of):
    plan = plan_study(study_of(planned=13), [], 0)
    assert [cell.required for cell in plan.cells] == [2, 2, 2, *[1] * 7]
    assert plan.planned % plan.cycle_length == 3


@pytest.mark.parametrize(("begun", "wanted"), [(0, 1), (10, 1), (11, 2)])
def test_without_a_declared_size_the_cycles_begun_are_wanted(study_of, begun, wanted):
    plan = plan_study(study_of(), people(*["done"] * begun), begun)
    assert {cell.required for cell in plan.cells} == {wanted}
