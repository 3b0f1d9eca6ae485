"""A session whose levels Psi chooses: folded from its log to the same levels, below the cap, analysed."""

from dataclasses import replace

import pytest

from analysis.psychophysics.runs import InconsistentTrialsError
from analysis.psychophysics.study_analysis import analyse_study
from protocols.definition.staircase_rule import BayesianPlacement
from protocols.document.dumping import dump_protocol
from protocols.document.hashing import hash_protocol
from protocols.trial import Phase
from study.workflows.results.fold_session import fold_session

TRIALS = 15


@pytest.fixture
def placed(sitter):
    plain = sitter.protocol
    rule = replace(plain.staircase, bayesian=BayesianPlacement(TRIALS))
    sitter.protocol = replace(plain, staircase=rule)
    sitter.text = dump_protocol(sitter.protocol)
    return sitter


def test_a_session_is_played_folded_and_analysed(placed):
    done = placed.whole()
    tested = [trial for trial in done.state.trials if trial.phase is Phase.TEST and trial.is_valid]
    runs = len(placed.protocol.stimulus.frequencies_hz)
    assert len(tested) == TRIALS * runs
    assert max(trial.level_n for trial in tested) <= placed.protocol.staircase.cap_n
    assert len({trial.level_n for trial in tested}) > 3
    assert fold_session(done.folder).state == done.state
    analysis = analyse_study(done.state.trials, placed.protocol)
    assert all(row.complete and row.threshold_n is not None for row in analysis.thresholds)
    first = next(trial for trial in tested if trial.trial == 1)
    other = [replace(t, level_n=1.01 * t.level_n) if t is first else t for t in done.state.trials]
    with pytest.raises(InconsistentTrialsError, match="level_n"):
        analyse_study(other, placed.protocol)


def test_off_it_leaves_the_hash_alone_and_it_does_not_go_with_roving(placed):
    off = replace(placed.protocol.staircase, bayesian=BayesianPlacement())
    assert hash_protocol(replace(placed.protocol, staircase=off)) != hash_protocol(placed.protocol)
    with pytest.raises(ValueError, match="rove_db"):
        replace(placed.protocol, stimulus=replace(placed.protocol.stimulus, rove_db=3.0))


def test_what_of_the_staircase_does_not_go_with_it_is_refused(placed):
    rule = placed.protocol.staircase
    with pytest.raises(ValueError, match="initial_one_up_one_down"):
        replace(rule, initial_one_up_one_down=True)
    with pytest.raises(ValueError, match=r"staircase\.trial_limit"):
        replace(placed.protocol, staircase=replace(rule, trial_limit=TRIALS - 1))
    replace(placed.protocol, staircase=replace(rule, trial_limit=TRIALS))


def test_a_detection_that_could_never_end_with_a_threshold_is_refused(placed):
    short = replace(placed.protocol.detection, frequencies_hz=(35.0,), trial_limit=TRIALS - 1)
    with pytest.raises(ValueError, match="detection.trial_limit"):
        replace(placed.protocol, detection=short)
