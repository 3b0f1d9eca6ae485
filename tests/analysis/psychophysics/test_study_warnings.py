from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.anova import compute_one_way_anova
from analysis.psychophysics.repeated_measures import analyse_repeated_measures
from analysis.psychophysics.study_analysis import analyse_study, describe_design_difference
from analysis.psychophysics.study_warnings import STRONG_BIAS
from analysis.psychophysics.thresholds import compute_thresholds
from protocols.procedure.run_rules import make_staircase_rule
from protocols.trial import Phase, TrialStatus
from tests.analysis.conftest import simulate_run


@pytest.fixture
def able_trials(simulate_study):
    """Five able participants: nothing to warn of."""
    return simulate_study(subjects=5, true_n=(0.4, 0.4, 0.4, 0.4, 0.4), seed=2)


def warnings_of(trials, protocol):
    return analyse_study(trials, protocol).warnings


@pytest.mark.slow
def test_a_clean_study_has_no_warning(able_trials, protocol):
    assert warnings_of(able_trials, protocol) == ()


def test_no_trial_is_reported(protocol):
    assert warnings_of([], protocol) == ("There are no test trials, so there is no threshold of direction.",)


@pytest.mark.slow
def test_a_run_that_was_broken_off_is_named(able_trials, protocol):
    cut = [trial for trial in able_trials if not (trial.subject == "s02" and trial.run == 5 and trial.trial > 20)]
    frequency = next(trial.frequency_hz for trial in able_trials if trial.subject == "s02" and trial.run == 5)
    incomplete, missing, unequal = warnings_of(cut, protocol)
    assert incomplete.startswith(f"1 run is not complete and without a threshold: s02 at {frequency:g} Hz (")
    assert incomplete.endswith(" of 13 reversals).")
    assert missing == f"No threshold for s02 at {frequency:g} Hz."
    assert unequal == "The frequencies have unequally many thresholds, so the comparison intervals are approximate."


@pytest.mark.slow
def test_thresholds_that_the_cap_cut_are_named(simulate_study, protocol):
    trials = simulate_study(subjects=5, true_n=(0.3, 0.3, 0.3, 0.3, float("inf")), seed=2)
    bounds, guessed = warnings_of(trials, protocol)
    assert guessed.startswith(
        "Answers not shown to be better than chance (one-sided binomial test, 5 %; a threshold far"
    )
    assert bounds.startswith("5 thresholds are cut by the cap of 3 N, which cut off peaks")
    assert "s05 at 45 Hz" in bounds


@pytest.mark.parametrize(
    ("subjects", "sentence"),
    [
        (1, "There is one participant: individual thresholds can be shown, nothing can be tested."),
        pytest.param(
            3,
            "There are only 3 participants: means and tests say little about people in general.",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_few_participants_are_reported(simulate_study, protocol, subjects, sentence):
    assert sentence in warnings_of(simulate_study(subjects=subjects, true_n=(0.4,) * 5), protocol)


@pytest.mark.slow
def test_a_run_that_the_trial_limit_stopped_is_never_dropped_in_silence(simulate_study, protocol):
    limited = replace(protocol, staircase=replace(protocol.staircase, trial_limit=90))
    trials = simulate_study(subjects=5, true_n=(0.4, 0.4, 0.4, 0.4, float("inf")), seed=2, rule=limited.staircase)
    analysis = analyse_study(trials, limited)
    (stopped,) = [sentence for sentence in analysis.warnings if "limit of 90 trials" in sentence]
    assert stopped.startswith("4 runs are stopped by the limit of 90 trials, without a threshold: s01 at 45 Hz (")
    assert "the remaining means are too low" in stopped
    assert not any("not complete" in sentence for sentence in analysis.warnings)
    assert "4 are missing because of the trial limit" in analysis.table.coverage_warning


@pytest.mark.slow
def test_a_response_bias_is_named(able_trials, protocol):
    # The same answers, right whenever direction 1 was shown: a participant who nearly always says 1.
    leaning = [
        replace(trial, direction_shown=1 if trial.correct else 2, answer=1) if trial.run == 1 else trial
        for trial in able_trials
    ]
    (bias,) = warnings_of(leaning, protocol)
    assert bias.startswith("A bias towards one of the two answers, which raises a threshold, was found in s01 at ")
    assert "(criterion −" in bias


def test_three_answers_of_an_unfinished_run_show_no_bias(able_trials, protocol):
    """All three answered 1, of which one was wrong: one in ten of the unbiased has as much."""
    shown = (1, 1, 2)
    short = [
        replace(trial, direction_shown=shown[trial.trial - 1], answer=1)
        for trial in simulate_run(0.5, np.random.default_rng(44), subject="s09", session="9", frequency_hz=15.0)[:3]
    ]
    assert [trial.correct for trial in short] == [True, True, False]
    (row,) = compute_thresholds(short, protocol.staircase)
    assert abs(row.criterion) > STRONG_BIAS
    assert not any("A bias towards" in sentence for sentence in warnings_of(short, protocol))


@pytest.mark.slow
def test_spoiled_flagged_and_unmeasured_trials_are_counted(able_trials, protocol):
    spoiled = replace(able_trials[3], attempt=2, answer=None, correct=None, status=TrialStatus.SPOILED)
    able_trials[4] = replace(able_trials[4], status=TrialStatus.FLAGGED)
    able_trials[5] = replace(able_trials[5], status=TrialStatus.UNMEASURED, delivered_mps2=None)
    assert warnings_of([*able_trials, spoiled], protocol) == (
        "1 spoiled presentation, played again; the answers do not count.",
        "1 trial flagged: counted, but the stimulus should be checked.",
        "1 counted trial without a measured acceleration: answered before a full period of the steady stimulus was "
        "recorded, or the recording was lost. The answers count.",
    )


@pytest.mark.slow
def test_a_second_run_at_a_frequency_is_named(able_trials, protocol):
    again = [replace(trial, session="2") for trial in able_trials if trial.subject == "s01" and trial.run == 1]
    (second,) = warnings_of([*able_trials, *again], protocol)
    assert "completed more than one run" in second


@pytest.mark.slow
def test_detection_practice_and_catch_trials_of_able_people_are_no_warning(all_trial_kinds, full_protocol, protocol):
    plain = warnings_of([trial for trial in all_trial_kinds if trial.phase is Phase.TEST], protocol)
    assert warnings_of(all_trial_kinds, full_protocol) == plain


def make_catch_trials(able_trials, frequency, wrong):
    """One catch trial before every run at this frequency; wrong: whether its answer is."""
    runs = {(t.subject, t.run): t for t in able_trials if t.frequency_hz == frequency}
    return [
        replace(t, phase=Phase.CATCH, trial=0, level_n=3.0, correct=not wrong, answer=1, direction_shown=1 + wrong)
        for t in runs.values()
    ]


@pytest.mark.slow
def test_lapses_at_low_frequencies_are_named_with_their_interval(able_trials, protocol):
    (sentence,) = warnings_of([*able_trials, *make_catch_trials(able_trials, 5.0, wrong=True)], protocol)
    assert sentence.startswith("More than 10 % wrong in catch trials at full level, up to 15 Hz,")
    assert "s01 (1 of 1; 95 % interval 21 to 100 %)" in sentence


@pytest.mark.slow
def test_an_error_at_full_level_and_high_frequency_is_no_lapse(able_trials, protocol):
    assert warnings_of([*able_trials, *make_catch_trials(able_trials, 45.0, wrong=True)], protocol) == ()
    assert warnings_of([*able_trials, *make_catch_trials(able_trials, 5.0, wrong=False)], protocol) == ()


@pytest.fixture
def add_detection(full_protocol, simulate):
    """One detection run of s01 at 35 Hz after the runs of the able, who tell the direction from 0.4 N."""

    def rows(able, true_n):
        rule = make_staircase_rule(full_protocol, Phase.DETECTION)
        generator = np.random.default_rng(3)
        return [*able, *simulate(true_n, generator, rule=rule, run=9, phase=Phase.DETECTION, frequency_hz=35.0)]

    return rows


@pytest.mark.slow
def test_a_direction_below_the_detection_threshold_is_named(able_trials, full_protocol, add_detection):
    (sentence,) = warnings_of(add_detection(able_trials, 2.0), full_protocol)
    assert sentence.startswith(
        "The direction was identified at a level below the detection threshold of the vibration: s01 at 35"
    )
    assert "differ by 2.4 dB" in sentence


@pytest.mark.slow
def test_a_vibration_that_is_felt_before_its_direction_is_as_it_should_be(able_trials, full_protocol, add_detection):
    assert warnings_of(add_detection(able_trials, 0.05), full_protocol) == ()


@pytest.mark.slow
def test_a_participant_who_feels_nothing_is_named(able_trials, full_protocol, add_detection):
    bound, chance, _ = warnings_of(add_detection(able_trials, float("inf")), full_protocol)
    assert bound == "1 detection threshold is cut by the cap: s01 at 35 Hz."
    assert chance.startswith("Detection not shown to be better than chance: s01 at 35 Hz (")


@pytest.mark.slow
def test_a_detection_run_that_was_broken_off_is_named(able_trials, full_protocol, add_detection):
    (sentence,) = warnings_of(add_detection(able_trials, 0.05)[:-5], full_protocol)
    assert sentence == "1 detection run is not complete and without a threshold: s01 at 35 Hz."


DRUGS = ((30.0, 28.0, 16.0, 34.0), (14.0, 18.0, 10.0, 22.0), (24.0, 20.0, 18.0, 30.0), (38.0, 34.0, 20.0, 44.0))


def both_analyses(values):
    columns = {str(i): column for i, column in enumerate(zip(*values, strict=True))}
    return compute_one_way_anova(columns), analyse_repeated_measures([str(i) for i in range(len(values))], values)


def test_the_two_analyses_are_distinguished_in_numbers():
    anova, within = both_analyses(DRUGS)
    text = describe_design_difference(anova, within)
    assert f"F(3, 12) = {anova.f:.2f}" in text
    assert f"F(3, 9) = {within.f:.2f}" in text
    assert "They disagree at the 5 % level." in text
    assert "(87 % of the spread within frequencies, 4 participants)" in text


@pytest.mark.parametrize(
    ("values", "word"), [(DRUGS[:1], "neither"), ((*DRUGS[:1], (1.0, None, 2.0, 3.0)), "only one")]
)
def test_what_cannot_be_compared_is_reported(values, word):
    assert f"Of the two, {word} can be computed" in describe_design_difference(*both_analyses(values))
