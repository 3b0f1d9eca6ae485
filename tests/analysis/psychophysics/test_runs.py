from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.runs import InconsistentTrialsError, recompute_runs
from protocols.trial import Phase, TrialStatus


@pytest.fixture
def rows(simulate):
    return simulate(1.0, np.random.default_rng(3))


def test_a_run_is_rebuilt_from_its_answers(rows, rule):
    (run,) = recompute_runs(rows, rule)
    assert run.complete
    assert run.state.reversals == 13
    assert [run.answered[i].reversal for i in run.state.reversal_trials] == [True] * 13


def test_rows_in_any_order_give_the_same_run(rows, rule):
    assert recompute_runs(rows[::-1], rule) == recompute_runs(rows, rule)


def test_a_spoiled_attempt_moves_nothing_and_is_counted(rows, rule):
    void = replace(rows[4], attempt=0, answer=None, correct=None, status=TrialStatus.SPOILED)
    (run,) = recompute_runs([*rows[:4], void, *rows[4:]], rule)
    assert run.spoiled_trials == 1
    assert run.state == recompute_runs(rows, rule)[0].state


def test_an_open_trial_leaves_the_run_incomplete(rows, rule):
    opened = replace(rows[-1], answer=None, correct=None, status=TrialStatus.OPEN)
    (run,) = recompute_runs([*rows[:-1], opened], rule)
    assert not run.complete


def test_training_is_no_test_run(rows, rule):
    assert recompute_runs([replace(row, phase=Phase.TRAINING) for row in rows], rule) == ()


def test_levels_rounded_in_a_table_still_agree(rows, rule):
    assert recompute_runs([replace(row, level_n=float(f"{row.level_n:.6f}")) for row in rows], rule)


@pytest.mark.parametrize("level", [1.01, float("nan")])
def test_a_changed_level_is_named(rows, rule, level):
    rows[7] = replace(rows[7], level_n=level)
    with pytest.raises(InconsistentTrialsError, match=r"subject s01, session 1, run 1, trial 8: level_n is .* N, but"):
        recompute_runs(rows, rule)


def test_a_changed_answer_is_found_by_a_later_level(rows, rule):
    first_wrong = next(i for i, row in enumerate(rows) if not row.correct)
    rows[first_wrong] = replace(rows[first_wrong], correct=True, answer=rows[first_wrong].direction_shown)
    with pytest.raises(InconsistentTrialsError, match="or were changed"):
        recompute_runs(rows, rule)


def test_an_answer_after_the_last_reversal_is_refused(rows, rule):
    rows.append(replace(rows[-1], trial=rows[-1].trial + 1))
    with pytest.raises(InconsistentTrialsError, match=r"although the run was over after .* with 13 reversals"):
        recompute_runs(rows, rule)


def test_an_answer_without_a_verdict_is_refused(rows, rule):
    rows[2] = replace(rows[2], correct=None)
    with pytest.raises(InconsistentTrialsError, match="trial 3: there is an answer, but correct is empty"):
        recompute_runs(rows, rule)


def test_two_frequencies_in_one_run_are_refused(rows, rule):
    rows[5] = replace(rows[5], frequency_hz=45.0)
    with pytest.raises(InconsistentTrialsError, match="trial 6: 45 Hz in a run that began at 15 Hz"):
        recompute_runs(rows, rule)


def test_a_missing_row_is_named(rows, rule):
    del rows[3]
    with pytest.raises(InconsistentTrialsError, match="trial 5: the trial before it with an answer is 3"):
        recompute_runs(rows, rule)


def test_a_doubled_row_is_named(rows, rule):
    with pytest.raises(InconsistentTrialsError, match="trial 1: two attempts of this trial have an answer"):
        recompute_runs([*rows, rows[0]], rule)


@pytest.fixture
def rows_with_catches(simulate_with_catches):
    return simulate_with_catches(np.random.default_rng(3), lapse=0.5, one_in=4, true_n=1.0)


def test_catch_trials_move_no_staircase_and_leave_no_gap(rows, rows_with_catches, rule):
    (run,), (plain,) = recompute_runs(rows_with_catches, rule), recompute_runs(rows, rule)
    assert sum(row.phase is Phase.CATCH for row in rows_with_catches) > 10
    assert run.state.reversals == 13
    assert (run.state, len(run.answered)) == (plain.state, len(plain.answered))
    assert {trial.phase for trial in run.answered} == {Phase.TEST}


def test_a_void_catch_trial_is_none_of_the_staircases_spoiled_trials(rows_with_catches, rule):
    catch = next(row for row in rows_with_catches if row.phase is Phase.CATCH)
    void = replace(catch, attempt=0, answer=None, correct=None, status=TrialStatus.SPOILED)
    (run,) = recompute_runs(rows_with_catches, rule)
    assert recompute_runs([*rows_with_catches, void], rule) == (replace(run, presentations=run.presentations + 1),)


@pytest.mark.parametrize("phase", [Phase.CATCH, Phase.TEST])
def test_a_missing_row_is_named_between_catch_trials_too(rows_with_catches, rule, phase):
    gone = next(i for i, row in enumerate(rows_with_catches) if row.phase is phase and i > 1)
    number = rows_with_catches.pop(gone).trial
    with pytest.raises(InconsistentTrialsError, match=f"trial {number + 1}: the trial before it .* is {number - 1};"):
        recompute_runs(rows_with_catches, rule)


def test_a_catch_trial_below_the_cap_is_refused(rows_with_catches, rule):
    place = next(i for i, row in enumerate(rows_with_catches) if row.phase is Phase.CATCH)
    rows_with_catches[place] = replace(rows_with_catches[place], level_n=1.0)
    with pytest.raises(InconsistentTrialsError, match=r"trial 4: level_n of a catch trial is 1 N; .* cap of 3 N"):
        recompute_runs(rows_with_catches, rule)


def test_a_test_trial_renamed_to_a_catch_trial_is_found(rows, rule):
    rows[5] = replace(rows[5], phase=Phase.CATCH)
    with pytest.raises(InconsistentTrialsError):
        recompute_runs(rows, rule)


def test_a_catch_trial_after_the_end_is_refused(rows_with_catches, rule):
    late = replace(rows_with_catches[-1], trial=rows_with_catches[-1].trial + 1, phase=Phase.CATCH, level_n=rule.cap_n)
    with pytest.raises(InconsistentTrialsError, match="although the run was over"):
        recompute_runs([*rows_with_catches, late], rule)


def test_a_run_that_got_no_further_than_a_catch_trial_is_an_empty_run(rows_with_catches, rule):
    (run,) = recompute_runs([row for row in rows_with_catches if row.phase is Phase.CATCH][:1], rule)
    assert (run.answered, run.complete, run.state.trials) == ((), False, 0)


def test_catch_trials_belong_to_no_detection_run(rows_with_catches, rule):
    assert recompute_runs(rows_with_catches, rule, Phase.DETECTION) == ()


@pytest.mark.parametrize("rove_db", [0.0, 6.0])
@pytest.mark.parametrize("off_db", [0.0, 2.9, 3.1, 40.0])
def test_a_level_that_roving_cannot_have_drawn_is_refused(rows, rule, rove_db, off_db):
    drawn = [replace(row, nominal_n=row.level_n, level_n=row.level_n * 10 ** (off_db / 20)) for row in rows]
    if rove_db and off_db <= rove_db / 2:
        assert recompute_runs(drawn, rule, rove_db=rove_db)[0].complete
    else:
        with pytest.raises(InconsistentTrialsError, match="level_n is .* around a nominal_n of"):
            recompute_runs(drawn, rule, rove_db=rove_db)


def test_an_answer_that_is_not_what_its_verdict_says_is_refused(rows, rule):
    rows[2] = replace(rows[2], direction_shown=3 - rows[2].direction_shown)
    with pytest.raises(InconsistentTrialsError, match=r"trial 3: correct is \w+, but . was shown and . answered"):
        recompute_runs(rows, rule)
