"""A session whose levels are roved: what is played varies, the staircase does not, and both are in the log."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.psychophysics.hierarchy.answers import count_answers
from analysis.psychophysics.runs import InconsistentTrialsError, recompute_runs
from analysis.psychophysics.study_analysis import analyse_study
from protocols.definition.session_settings import CatchSettings
from protocols.document.dumping import dump_protocol
from protocols.procedure.staircase import to_db
from protocols.trial import Phase
from study.session.facts.events import TrialPresented
from study.session.views.participant_views import Unanswered
from study.store.formats.recording_file import read_recording
from study.store.formats.trials_file import read_trials, write_trials
from study.store.sessions.event_log import read_log
from study.workflows.results.fold_session import fold_session

ROVE_DB, CAP_N = 6.0, 2.1


@pytest.fixture
def roved(sitter):
    plain = sitter.protocol
    sitter.protocol = replace(
        plain,
        stimulus=replace(plain.stimulus, rove_db=ROVE_DB),
        staircase=replace(plain.staircase, cap_n=CAP_N),
        catch=CatchSettings(one_in=6),
    )
    sitter.text = dump_protocol(sitter.protocol)
    return sitter


@pytest.mark.slow
def test_levels_vary_around_those_of_the_staircase_and_none_passes_the_force_cap(roved):
    roved.observer = "guesser"
    state = roved.whole().state
    staircase = [t for t in state.trials if t.phase in (Phase.TEST, Phase.TRAINING)]
    away = np.array([to_db(t.level_n / t.nominal_n) for t in staircase])
    assert len(away) > 40 and np.ptp(away) > 5.0
    assert np.abs(away).max() <= ROVE_DB / 2 + 1e-9
    assert max(t.nominal_n for t in staircase) == pytest.approx(CAP_N)
    assert CAP_N < max(t.level_n for t in state.trials) <= 3.0
    caught = [t for t in state.trials if t.phase is Phase.CATCH]
    assert caught and {(t.level_n, t.nominal_n) for t in caught} == {(CAP_N, None)}


@pytest.mark.slow
def test_what_was_drawn_is_what_the_device_played_and_both_levels_are_logged(roved):
    done = roved.whole()
    events = [event for event in read_log(done.folder.log).events if isinstance(event, TrialPresented)]
    assert all((event.nominal_n is None) == (event.phase is Phase.CATCH) for event in events)
    assert [event.level_db for event in events] == pytest.approx([to_db(event.level_n) for event in events])
    for path in sorted(done.folder.recordings.glob("*.h5"))[:6]:
        recording = read_recording(path)
        assert np.abs(recording.command.samples).max() <= 3.0 + 1.5
        assert recording.meta["level_n"] <= 3.0
    assert fold_session(done.folder).state == done.state


@pytest.mark.slow
def test_the_staircase_follows_the_answers_alone_and_is_checked_against_them(roved, tmp_path):
    state = roved.whole().state
    trials, rule, rove_db = state.trials, roved.protocol.staircase, roved.protocol.stimulus.rove_db
    (first, *_) = recompute_runs(trials, rule, rove_db=rove_db)
    assert [t.nominal_n for t in first.answered][:3] == [rule.start_n] * 3
    wrong = replace(first.answered[4], nominal_n=1.234)
    with pytest.raises(InconsistentTrialsError, match=r"nominal_n is 1\.234 N"):
        recompute_runs([wrong if t is first.answered[4] else t for t in trials], rule, rove_db=rove_db)
    answers = count_answers(trials, roved.protocol.stimulus.frequencies_hz)
    assert len(set(np.round(answers.level_db, 6))) > 0.9 * answers.trials
    analysis = analyse_study(trials, roved.protocol)
    assert all(row.complete for row in analysis.thresholds)
    write_trials(tmp_path / "trials.csv", trials)
    assert read_trials(tmp_path / "trials.csv") == trials


def test_a_repeated_trial_comes_with_the_same_level(roved):
    done = roved.interrupted(7, lambda: Unanswered("asked", ends_sitting=False, repeat_requested=True))
    (void,) = (t for t in done.state.trials if t.void_cause is not None)
    again = next(t for t in done.state.trials if (t.run, t.trial, t.attempt) == (void.run, void.trial, 1))
    assert (again.level_n, again.nominal_n) == (void.level_n, void.nominal_n)
    assert void.nominal_n not in (None, void.level_n)


@pytest.mark.slow
def test_delivered_thresholds_are_those_at_the_staircases_levels(roved):
    """A device that delivers in proportion: the threshold in m/s² is that in newtons times the proportion."""
    trials = [replace(t, delivered_mps2=4.0 * t.level_n) for t in roved.whole().state.trials]
    for row in analyse_study(trials, roved.protocol).thresholds:
        assert row.threshold_mps2 == pytest.approx(4.0 * row.threshold_n)
