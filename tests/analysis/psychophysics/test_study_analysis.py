import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from analysis.psychophysics.anova import compute_one_way_anova
from analysis.psychophysics.population import Population
from analysis.psychophysics.repeated_measures import analyse_repeated_measures
from analysis.psychophysics.study_analysis import analyse_study, make_anova_document
from analysis.psychophysics.threshold_table import tabulate_thresholds
from analysis.psychophysics.thresholds import compute_thresholds
from protocols.trial import Phase


@pytest.fixture(scope="module")
def statistics_json():
    def document(analysis) -> dict[str, Any]:
        return json.loads(json.dumps(make_anova_document(analysis), allow_nan=False))

    return document


@pytest.mark.slow
def test_a_whole_study_is_analysed(simulate_study, protocol, statistics_json):
    analysis = analyse_study(simulate_study(), protocol)
    assert analysis.population is Population.SIMULATED
    assert len(analysis.thresholds) == 50
    assert analysis.anova.p < 0.001
    assert analysis.repeated_measures.p < 0.001
    assert len(analysis.comparisons.pairs) == 10
    document = statistics_json(analysis)
    assert (document["format"], document["version"]) == ("hapteq-anova", 1)
    assert document["cut_by_cap"] == document["lower_bounds"] == sum(row.censored for row in analysis.thresholds)


@pytest.mark.slow
def test_thresholds_rise_where_they_were_made_to_rise(simulate_study, protocol):
    analysis = analyse_study(simulate_study(), protocol)
    means = [group.mean for group in analysis.anova.groups]
    assert np.argsort(means).tolist()[-2:] == [3, 4]


@pytest.mark.slow
def test_without_an_effect_few_studies_find_one(simulate_study, protocol):
    frequencies = protocol.stimulus.frequencies_hz
    p = []
    for seed in range(24):
        rows = compute_thresholds(simulate_study(subjects=6, true_n=(0.6,) * 5, seed=seed), protocol.staircase)
        table = tabulate_thresholds(rows, frequencies)
        p.append(
            (
                compute_one_way_anova(table.group_by_frequency()).p,
                analyse_repeated_measures(table.subjects, table.values).p,
            )
        )
    # At 5 % a right test exceeds four of 24 in one of 200 repetitions of this test; the seeds are fixed.
    assert np.all(np.sum(np.array(p) < 0.05, axis=0) <= 4)


def test_one_participant_gives_thresholds_and_reasons(simulate_study, protocol, statistics_json):
    analysis = analyse_study(simulate_study(subjects=1, felt=True), protocol)
    assert analysis.population is Population.PEOPLE
    assert len(analysis.thresholds) == 5
    document = statistics_json(analysis)
    assert document["one_way"]["f"] is None
    assert document["within_participants"]["notes"]
    assert document["friedman"]["notes"]


def test_nothing_at_all_is_a_result_too(protocol, statistics_json):
    document = statistics_json(analyse_study([], protocol))
    assert document["population"] is None
    assert document["participants"] == []


def test_training_alone_gives_no_threshold(simulate_study, protocol):
    trained = [replace(trial, phase=Phase.TRAINING) for trial in simulate_study(subjects=1)]
    analysis = analyse_study(trained, protocol)
    assert analysis.population is Population.SIMULATED
    assert (analysis.trials, analysis.thresholds) == ((), ())


@pytest.mark.slow
def test_detection_practice_and_catch_trials_change_no_threshold(all_trial_kinds, full_protocol, protocol):
    analysis = analyse_study(all_trial_kinds, full_protocol)
    plain = analyse_study([trial for trial in all_trial_kinds if trial.phase is Phase.TEST], protocol)
    assert analysis.thresholds == plain.thresholds
    assert analysis.anova == plain.anova
    assert analysis.trials == plain.trials
    assert (len(analysis.detection), len(analysis.catches), len(analysis.practice)) == (3, 15, 6)
    assert {tally.wrong for tally in analysis.catches} == {0}
    assert all(run.passed for run in analysis.practice)


def test_a_study_of_detection_alone_has_thresholds_of_detection(all_trial_kinds, full_protocol):
    alone = [trial for trial in all_trial_kinds if trial.phase is Phase.DETECTION]
    analysis = analyse_study(alone, full_protocol)
    assert (analysis.thresholds, len(analysis.detection)) == ((), 3)
    assert analysis.detection_table.frequencies_hz == (35.0,)


def test_two_kinds_of_participants_are_refused(simulate_study, protocol):
    people = [replace(trial, subject="p1", session="9", felt=True) for trial in simulate_study(subjects=1)]
    with pytest.raises(ValueError, match="trials of people and simulated participants cannot enter one analysis"):
        analyse_study([*simulate_study(subjects=1), *people], protocol)


@pytest.mark.slow
def test_the_order_of_the_rows_does_not_matter_within_a_study(simulate_study, protocol):
    trials = simulate_study(subjects=2)
    assert analyse_study(trials[::-1], protocol).anova.f == pytest.approx(analyse_study(trials, protocol).anova.f)


def test_trials_may_come_from_a_generator(simulate, protocol):
    rows = simulate(1.0, np.random.default_rng(3))
    assert analyse_study((row for row in rows), protocol).runs == analyse_study(rows, protocol).runs
