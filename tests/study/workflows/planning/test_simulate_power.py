"""Power: effects are found, nulls are not, broken runs go on, and any executor gives the same numbers."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.anova import compute_one_way_anova
from analysis.psychophysics.comparisons import compare_group_means
from analysis.psychophysics.group_contrasts import compute_contrasts
from analysis.psychophysics.power.power_curve import judge_study
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from protocols.definition.staircase_rule import StaircaseRule, StepPhase
from study.cli.power import parse_sample_sizes
from study.errors import StudyError, WrongUseError
from study.workflows.planning.simulate_power import (
    PROGRESS_NAME,
    PowerPlan,
    format_power_lines,
    judge_chunk,
    simulate_power,
)

RULE = StaircaseRule(1.0, 3.0, 1, 3, (StepPhase(4.0, 3), StepPhase(1.0, 10)), 13, 10)
PLAN = PowerPlan(Crowd((5.0, 45.0), (0.7, 1.4)), RULE, (3, 8), 12, 3)


@pytest.fixture
def run(tmp_path):
    def simulated(plan, folder="power", workers=1):
        with ThreadPoolExecutor(workers) as pool:
            return simulate_power(plan, tmp_path / folder, pool, lambda done: None)

    return simulated


@pytest.mark.slow
def test_a_large_effect_is_found_more_often_by_more_people(run):
    few, many = run(PLAN)
    assert (few.people, many.people, few.studies) == (3, 8, 12)
    assert many.primary.value >= few.primary.value
    assert many.primary.value > 0.8
    assert many.primary.lower < many.primary.value <= many.primary.upper
    assert len(format_power_lines((few, many))) == 3


@pytest.mark.slow
def test_without_an_effect_few_studies_find_one(run):
    (point,) = run(replace(PLAN, crowd=Crowd((5.0, 45.0), (0.7, 0.7)), people=(5,), studies=30))
    assert point.primary.value < 0.15  # at 5 % five of 30 come once in 50 repetitions
    assert point.coverage.value == pytest.approx(1.0 - point.primary.value)


@pytest.mark.slow
def test_the_published_verdict_is_that_of_the_pair_in_the_report():
    crowd, found = Crowd((5.0, 25.0, 45.0), (0.7, 0.7, 1.2)), []
    for number in range(4):
        study = simulate_study(crowd, RULE, 8, (5, number))
        groups = {f"{f:g} Hz": list(column) for f, column in zip((5, 25, 45), study.threshold_n.T, strict=True)}
        (pair,) = [
            pair
            for pair in compare_group_means(compute_one_way_anova(groups)).pairs
            if (pair.first, pair.second) == ("5 Hz", "45 Hz")
        ]
        found.append(judge_study(crowd, RULE, 8, (5, number)).published_found)
        assert found[-1] == (pair.p < 0.05)
    assert len(set(found)) == 2  # both verdicts occur


SHORT = StaircaseRule(1.0, 3.0, 1, 3, (StepPhase(4.0, 3),), 3, 2)
"""Two reversals averaged, in steps of 4 dB: two people often differ equally."""


def test_equal_differences_are_not_judged_and_not_found():
    """Of two people, in a protocol with two frequencies."""
    crowd = Crowd((5.0, 45.0), (0.7, 1.4))
    study = simulate_study(crowd, SHORT, 2, (9,))
    assert np.ptp(study.threshold_db[:, 1] - study.threshold_db[:, 0]) == 0
    verdict = judge_study(crowd, SHORT, 2, (9,))
    assert not verdict.means_found
    true_db = 20 * np.log10(2.0)
    assert verdict.means_error_db == pytest.approx(
        study.threshold_db[:, 1].mean() - study.threshold_db[:, 0].mean() - true_db
    )


def test_another_frequency_does_not_stand_in_for_the_highest():
    """Where 45 Hz differs by 8 dB in both people, 25 Hz alone can be judged."""
    crowd = Crowd((5.0, 25.0, 45.0), (0.7, 0.7, 1.4))
    study = simulate_study(crowd, SHORT, 2, (26,))
    (other,) = compute_contrasts(crowd.frequencies_hz, study.threshold_db, 0.95)
    assert other.frequency_hz == 25.0
    verdict = judge_study(crowd, SHORT, 2, (26,))
    assert not verdict.means_found
    assert verdict.means_error_db == pytest.approx(8.0 - 20 * np.log10(2.0))


@pytest.mark.slow
def test_a_broken_run_continues_and_any_number_of_workers_gives_the_same_numbers(run, tmp_path):
    plan = replace(PLAN, people=(3,))
    whole = run(plan)
    path = tmp_path / "power" / PROGRESS_NAME
    lines = path.read_text("utf-8").splitlines()
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / PROGRESS_NAME).write_text("\n".join([*lines[:2], lines[2][:40]]), "utf-8")
    assert run(plan, "broken") == whole
    assert run(plan, "two", workers=2) == whole
    assert judge_chunk(plan, (3, 10)) == judge_chunk(plan, (3, 10))


@pytest.mark.slow
def test_a_run_that_was_killed_anywhere_goes_on_with_the_same_numbers(run, tmp_path):
    """Also where it had written nothing, or a part of the plan."""
    plan = replace(PLAN, people=(2,), studies=2)
    whole = run(plan)
    text = (tmp_path / "power" / PROGRESS_NAME).read_text("utf-8")
    plan_ends = text.index("\n")
    for number, length in enumerate((0, 1, plan_ends // 2, plan_ends, plan_ends + 1, plan_ends + 9, len(text) - 1)):
        broken = tmp_path / f"broken-{number}"
        broken.mkdir()
        (broken / PROGRESS_NAME).write_text(text[:length], "utf-8")
        assert run(plan, broken.name) == whole
        assert run(plan, broken.name) == whole  # what it left is whole, too


@pytest.mark.slow
def test_a_folder_of_another_plan_is_left_alone(run):
    run(replace(PLAN, people=(4,), studies=10))
    with pytest.raises(StudyError, match="another power simulation"):
        run(replace(PLAN, people=(4,), studies=10, seed=4))


@pytest.mark.slow
def test_studies_of_sizes_that_are_no_longer_asked_for_are_not_counted(run, tmp_path):
    run(replace(PLAN, people=(2, 3), studies=2))
    counts: list[int] = []
    with ThreadPoolExecutor(1) as pool:
        simulate_power(replace(PLAN, people=(3, 4), studies=2), tmp_path / "power", pool, counts.append)
    assert (counts[0], counts[-1]) == (2, 4)


def test_a_trial_limit_is_refused(run):
    with pytest.raises(WrongUseError, match="trial limit"):
        run(replace(PLAN, rule=replace(RULE, trial_limit=50)))


def test_runs_that_do_not_end_are_refused(run):
    """After nine right answers in a row the level falls: a threshold above the cap is a run of thousands of trials."""
    rule = replace(RULE, down_after_right=9)
    with pytest.raises(WrongUseError, match="did not reach its reversals in 2000 trials"):
        run(replace(PLAN, crowd=Crowd((5.0, 45.0), (5.0, 5.0)), rule=rule, people=(3,), studies=2))


def test_runs_that_do_not_end_are_refused_before_further_studies_are_simulated(run, tmp_path):
    """All studies of all sizes were simulated first."""
    rule = replace(RULE, down_after_right=9)
    plan = replace(PLAN, crowd=Crowd((5.0, 45.0), (5.0, 5.0)), rule=rule, people=(3, 4, 5), studies=1)
    for _ in range(2):
        with pytest.raises(WrongUseError, match="1 of 1 studies of 3 people"):
            run(plan)
        assert len((tmp_path / "power" / PROGRESS_NAME).read_text("utf-8").splitlines()) == 2


def test_a_run_without_an_end_at_a_frequency_that_is_not_compared_is_refused_too():
    """The published analysis has no result then, which counted as not found."""
    rule = replace(RULE, down_after_right=9)
    verdict = judge_study(Crowd((5.0, 25.0, 45.0), (0.2, 5.0, 0.2)), rule, 3, (1,))
    assert np.isnan(verdict.means_error_db) and not verdict.published_found


def test_sample_sizes_are_read():
    assert parse_sample_sizes("5:40:5") == (5, 10, 15, 20, 25, 30, 35, 40)
    assert parse_sample_sizes("12") == (12,)
    assert parse_sample_sizes("3:5") == (3, 4, 5)
    for wrong in ("", "a", "1", "9:5", "5:9:0", "5:9:1:1", "1001"):
        with pytest.raises(WrongUseError):
            parse_sample_sizes(wrong)
