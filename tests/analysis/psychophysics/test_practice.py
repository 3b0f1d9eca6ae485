from dataclasses import replace

import pytest

from analysis.psychophysics.study_analysis import evaluate_practice_runs
from protocols.definition.preparation import PracticeSettings
from protocols.definition.study_protocol import TrainingSettings
from protocols.trial import Phase, TrialStatus


@pytest.fixture
def practice_protocol(protocol):
    """One training staircase (run 0), two practice runs (1 and 2)."""
    return replace(
        protocol,
        training=TrainingSettings(frequencies_hz=(5.0,)),
        practice=PracticeSettings(frequencies_hz=(15.0, 35.0), right_needed=4, of_last=5, trial_limit=10),
    )


@pytest.fixture
def make_practice_run(make_run_from_answers):
    """Rows of one practice run from answers written as 1 (right) and 0 (wrong)."""
    (template,) = make_run_from_answers("1")

    def run(answers, **columns):
        return [
            replace(template, trial=i, phase=Phase.TRAINING, level_n=2.0, correct=a == "1", **({"run": 1} | columns))
            for i, a in enumerate(answers)
        ]

    return run


@pytest.mark.parametrize(
    ("answers", "right", "of_last", "passed", "over"),
    [
        ("1111", 4, 4, True, True),
        ("00001111", 4, 4, True, True),
        ("1010101010", 5, 2, False, True),
        ("101", 2, 2, False, False),
    ],
)
def test_a_practice_run_is_reported_as_passed_or_not(
    practice_protocol, make_practice_run, answers, right, of_last, passed, over
):
    (row,) = evaluate_practice_runs(make_practice_run(answers), practice_protocol)
    assert (row.trials, row.right, row.right_of_last) == (len(answers), right, of_last)
    assert (row.passed, row.over) == (passed, over)


def test_training_staircases_and_test_runs_are_no_practice(practice_protocol, make_practice_run):
    others = [
        *make_practice_run("1111", run=0),
        *[replace(row, phase=Phase.TEST, run=3) for row in make_practice_run("1111")],
    ]
    assert evaluate_practice_runs(others, practice_protocol) == ()


def test_void_presentations_count_for_nothing(practice_protocol, make_practice_run):
    first, *rest = make_practice_run("1111")
    void = replace(first, answer=None, correct=None, status=TrialStatus.SPOILED)
    (row,) = evaluate_practice_runs([void, replace(first, attempt=2), *rest], practice_protocol)
    assert (row.trials, row.passed) == (4, True)


def test_each_run_of_each_participant_has_its_row(practice_protocol, make_practice_run):
    trials = [
        *make_practice_run("1111", subject="a"),
        *make_practice_run("0000000000", subject="a", run=2, frequency_hz=35.0),
        *make_practice_run("1111", subject="b"),
    ]
    assert [
        (row.subject, row.frequency_hz, row.passed) for row in evaluate_practice_runs(trials, practice_protocol)
    ] == [
        ("a", 15.0, True),
        ("a", 35.0, False),
        ("b", 15.0, True),
    ]


def test_a_protocol_without_practice_has_none(protocol, make_practice_run):
    assert evaluate_practice_runs(make_practice_run("1111"), protocol) == ()
