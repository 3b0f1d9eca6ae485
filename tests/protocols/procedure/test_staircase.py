"""The staircase against sequences worked out by hand and against PsychoPy's, and its properties."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.definition.staircase_rule import StaircaseRule, StepChange, StepPhase
from protocols.procedure.staircase import (
    Heading,
    StaircaseState,
    begin_staircase,
    compute_level_n,
    is_finished,
    step,
    to_db,
    to_newton,
)

S1 = "111111011101110011111101110011101110"
S2 = "11111101110011111101110111011101110"
TURNS_S1 = (6, 9, 10, 13, 14, 18, 22, 25, 26, 30, 31, 34, 35)
TURNS_S2 = (6, 9, 10, 14, 18, 21, 22, 25, 26, 29, 30, 33, 34)

HEAD = "0 0 0 -4 -4 -4 -8 -4 -4 -4 -8 "
S1_A = HEAD + "-4 -4 -4 -5 -4 -3 -3 -3 -4 -4 -4 -5 -4 -4 -4 -5 -4 -3 -3 -3 -4 -3 -3 -3 -4"
S1_B = HEAD + "-7 -7 -7 -8 -7 -6 -6 -6 -7 -7 -7 -8 -7 -7 -7 -8 -7 -6 -6 -6 -7 -6 -6 -6 -7"
S2_A = HEAD + "-4 -3 -3 -3 -4 -4 -4 -5 -4 -4 -4 -5 -4 -4 -4 -5 -4 -4 -4 -5 -4 -4 -4 -5"
S2_B = HEAD + "-7 -6 -6 -6 -7 -7 -7 -8" + " -7 -7 -7 -8" * 4
S2_C = HEAD + "-4 0 0 0 -1 -1 -1 -2" + " -1 -1 -1 -2" * 4

A, B, C = StepChange.AFTER_REVERSAL, StepChange.AT_REVERSAL, StepChange.AT_NEXT_REVERSAL

CASES = [
    pytest.param(A, S1, S1_A, TURNS_S1, -4.0, 0.63096, 0.6335, id="S1 after_reversal"),
    pytest.param(B, S1, S1_B, TURNS_S1, -7.0, 0.44668, 0.4485, id="S1 at_reversal"),
    pytest.param(C, S1, S1_A, TURNS_S1, -4.0, 0.63096, 0.6335, id="S1 at_next_reversal"),
    pytest.param(A, S2, S2_A, TURNS_S2, -4.4, 0.60256, 0.6043, id="S2 after_reversal"),
    pytest.param(B, S2, S2_B, TURNS_S2, -7.4, 0.42658, 0.4278, id="S2 at_reversal"),
    pytest.param(C, S2, S2_C, TURNS_S2, -1.4, 0.85114, 0.8537, id="S2 at_next_reversal"),
]


def states(rule: StaircaseRule, answers: str) -> list[StaircaseState]:
    """The state before every answer, and the last one."""
    run = [begin_staircase(rule)]
    for answer in answers:
        run.append(step(rule, run[-1], answer == "1"))
    return run


def levels_db(rule: StaircaseRule, answers: str) -> list[float]:
    """The level of every trial."""
    return [state.level_db for state in states(rule, answers)[:-1]]


def until_finished(rule: StaircaseRule, answers: list[bool]) -> list[StaircaseState]:
    run = [begin_staircase(rule)]
    for correct in answers:
        if is_finished(rule, run[-1]):
            break
        run.append(step(rule, run[-1], correct))
    return run


@pytest.mark.parametrize(("change", "answers", "levels", "turns", "mean_db", "geometric_n", "arithmetic_n"), CASES)
def test_check_sequences(published, change, answers, levels, turns, mean_db, geometric_n, arithmetic_n):
    rule = replace(published, step_change=change)
    expected = [float(level) for level in levels.split()]
    assert levels_db(rule, answers) == pytest.approx(expected, abs=1e-9)
    end = states(rule, answers)[-1]
    assert end.reversal_trials == turns
    averaged = end.reversal_levels_db[-10:]
    assert sum(averaged) / 10 == pytest.approx(mean_db, abs=1e-9)
    assert to_newton(sum(averaged) / 10) == pytest.approx(geometric_n, abs=5e-6)
    assert sum(map(to_newton, averaged)) / 10 == pytest.approx(arithmetic_n, abs=5e-5)
    assert is_finished(rule, end)


def test_reversal_levels_of_the_first_check_sequence(published):
    end = states(published, S1)[-1]
    assert end.reversal_levels_db == pytest.approx([-8, -4, -8, -4, -5, -3, -5, -4, -5, -3, -4, -3, -4])


def test_a_shortcut_until_the_first_reversal_moves_after_every_answer(published):
    rule = replace(published, initial_one_up_one_down=True)
    assert levels_db(rule, S1)[:8] == pytest.approx([0, -4, -8, -12, -16, -20, -24, -20])
    averaged = states(rule, S1)[-1].reversal_levels_db[-10:]
    assert sum(averaged) / 10 == pytest.approx(-20.0)


def test_psychopys_decibel_staircase_is_one_of_ours():
    """Levels of PsychoPy's own test: dB steps 0.4, 0.2, 0.2, 0.1, one up, three down, with its initial rule."""
    rule = StaircaseRule(
        start_n=0.8,
        cap_n=3.0,
        up_after_wrong=1,
        down_after_right=3,
        steps=(StepPhase(0.4, 1), StepPhase(0.2, 2), StepPhase(0.1, 97)),
        reversals=100,
        averaged_reversals=10,
        step_change=StepChange.AT_REVERSAL,
        initial_one_up_one_down=True,
    )
    expected = [
        *(0.8, 0.763994069, 0.729608671, 0.696770872, 0.665411017, 0.680910431, 0.696770872, 0.713000751),
        *(0.729608671, 0.729608671, 0.729608671, 0.713000751, 0.713000751, 0.72125691, 0.729608671, 0.738057142),
        *(0.746603441, 0.746603441, 0.746603441, 0.738057142),
    ]
    run = states(rule, "11110000111100001111")
    assert [compute_level_n(rule, state) for state in run[:-1]] == pytest.approx(expected, abs=1e-9)
    assert run[-1].reversal_trials == (4, 10, 12, 18)


def test_the_thirteenth_reversal_ends_the_run_and_a_further_answer_is_refused(published):
    run = states(published, S1)
    assert [is_finished(published, state) for state in run] == [False] * 36 + [True]
    with pytest.raises(ValueError, match="this run is finished: no answer can follow"):
        step(published, run[-1], True)


def test_a_trial_limit_ends_a_run_without_its_reversals(published):
    rule = replace(published, trial_limit=5)
    run = states(rule, "11111")
    assert [is_finished(rule, state) for state in run] == [False] * 5 + [True]


def test_three_right_answers_split_by_a_wrong_one_do_not_lower_the_level(published):
    assert levels_db(published, "1101100")[3:6] == [4.0, 4.0, 4.0]


def test_six_right_answers_make_two_steps(published):
    assert levels_db(published, "1111111")[-1] == pytest.approx(-8.0)


@pytest.mark.parametrize("answers", ["0", "111", "1010"])
def test_neither_the_first_movement_nor_alternating_answers_are_reversals(published, answers):
    assert states(published, answers)[-1].reversals == 0


def test_a_push_against_the_cap_is_counted_and_turns_nothing(published):
    end = states(published, "00000")[-1]
    assert compute_level_n(published, end) == 3.0
    # 0, 4, 8 dB, then 12 dB is asked for and the cap given, then two pushes that move nothing.
    assert (end.reversals, end.pushes_against_cap, end.trials_at_cap) == (0, 3, 2)


def test_a_push_against_the_cap_begins_the_count_afresh(published):
    rule = replace(published, start_n=3.0, up_after_wrong=2)
    assert [state.pushes_against_cap for state in states(rule, "00000")] == [0, 0, 1, 1, 2, 2]


def test_after_the_cap_levels_hang_below_it_and_not_on_the_old_grid(published):
    end = states(published, "000111")[-1]
    assert end.level_db == pytest.approx(to_db(3.0) - 4.0)
    assert (end.reversals, end.reversals_at_cap) == (1, 1)


def test_only_peaks_at_the_cap_count_as_reversals_there(published):
    end = states(published, "0001110")[-1]
    assert (end.reversals, end.reversals_at_cap) == (2, 1)


@given(cap_n=st.floats(0.01, 3.0))
@settings(max_examples=60, deadline=None)
def test_no_rounding_of_decibels_leads_above_the_cap(published, cap_n):
    rule = replace(published, start_n=cap_n, cap_n=cap_n)
    assert compute_level_n(rule, begin_staircase(rule)) <= cap_n


@pytest.mark.parametrize(("change", "last_db"), [(A, -3.0), (B, -6.0), (C, -3.0)])
def test_also_the_last_movement_is_one_of_the_last_phase(published, change, last_db):
    assert states(replace(published, step_change=change), S1)[-1].level_db == pytest.approx(last_db)


def test_a_run_that_starts_at_the_cap_has_nothing_to_turn_from(published):
    rule = replace(published, start_n=3.0)
    end = states(rule, "00111")[-1]
    assert (end.heading, end.reversals, end.pushes_against_cap) == (Heading.DOWN, 0, 2)


@pytest.mark.parametrize("answers", [S1, S2])
@pytest.mark.parametrize("change", list(StepChange))
def test_a_cap_that_is_never_reached_changes_nothing(published, answers, change):
    near = replace(published, step_change=change)
    assert levels_db(replace(near, cap_n=1.3), answers) == levels_db(near, answers)


@given(answers=st.lists(st.booleans(), max_size=300), change=st.sampled_from(StepChange), initial=st.booleans())
@settings(max_examples=60, deadline=None)
def test_levels_stay_within_the_cap_and_counters_within_their_rule(published, answers, change, initial):
    rule = replace(published, step_change=change, initial_one_up_one_down=initial)
    run = until_finished(rule, answers)
    for before, after in pairwise(run):
        assert 0.0 < compute_level_n(rule, after) <= 3.0
        if after.level_db != before.level_db:
            assert (after.right_in_a_row, after.wrong_in_a_row) == (0, 0)
        assert after.right_in_a_row == 0 or after.wrong_in_a_row == 0
        assert after.right_in_a_row < 3
        assert after.reversals <= before.reversals + 1 <= 13


@given(answers=st.lists(st.booleans(), min_size=40, max_size=300), change=st.sampled_from(StepChange))
@settings(max_examples=60, deadline=None)
def test_peaks_and_valleys_alternate(published, answers, change):
    rule = replace(published, step_change=change)
    run = until_finished(rule, answers)
    turned = [before.heading for before, after in pairwise(run) if after.reversals > before.reversals]
    assert all(first is not second for first, second in pairwise(turned))
    turns = run[-1].reversal_levels_db
    for heading, (level, following) in zip(turned, pairwise(turns), strict=False):
        # A peak is where the level had been going up: the next turn is a valley below it.
        assert (level > following) == (heading is Heading.UP)


@given(
    up=st.integers(1, 4), down=st.integers(1, 5), answers=st.lists(st.booleans(), max_size=80), start=st.floats(0.01, 3)
)
@settings(max_examples=60, deadline=None)
def test_any_n_up_m_down_rule_moves_after_so_many_in_a_row(published, up, down, answers, start):
    rule = replace(published, up_after_wrong=up, down_after_right=down, start_n=start)
    since_move: list[bool] = []
    for correct, (before, after) in zip(answers, pairwise(until_finished(rule, answers)), strict=False):
        since_move.append(correct)
        lowered = len(since_move) >= down and all(since_move[-down:])
        raised = len(since_move) >= up and not any(since_move[-up:])
        at_cap = before.level_db >= to_db(3.0) - 1e-9
        assert (after.level_db < before.level_db) == lowered
        assert (after.level_db > before.level_db) == (raised and not at_cap)
        if lowered or raised:
            since_move = []


def test_decibels_and_newtons_are_each_others_inverse():
    assert to_db(1.0) == 0.0
    assert to_newton(to_db(0.37)) == pytest.approx(0.37, rel=1e-15)
    assert math.isclose(to_db(3.0), 9.542425094393249)
