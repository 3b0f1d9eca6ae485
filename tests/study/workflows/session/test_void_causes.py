"""Why presentations are void, from the reply at the display to the columns of trials.csv."""

from dataclasses import replace

import pytest

from protocols.trial import VoidCause
from study.devices.device import Fault
from study.errors import UserInterruptError
from study.session.state.rules import LATEST_RULES
from study.session.views.participant_views import Unanswered
from study.store.formats.trials_file import TRIALS_NAME, read_trials
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import read_log
from study.store.sessions.log_seal import find_seals
from study.tui.engine.remote_display import make_silent_screen_reply
from study.tui.trial_replies import LEAVING, PAUSE, REPEAT, TIME_OVER
from study.workflows.files.validate import validate_file
from study.workflows.results.session_results import write_tables
from study.workflows.session.conduct_session import conduct_new
from study.workflows.trial.judge_trial import get_void_cause

CAUSES = [
    (REPEAT, VoidCause.ASKED),
    (PAUSE, VoidCause.PAUSED),
    (LEAVING, VoidCause.PAUSED),
    (Unanswered("the participant left", ends_sitting=True), VoidCause.LEFT),
    (TIME_OVER, VoidCause.LATE),
    (make_silent_screen_reply(0.0, load_per_processor=0.1), VoidCause.SCREEN_LATE),
    (make_silent_screen_reply(0.0, load_per_processor=4.0), VoidCause.SCREEN_LATE),
    (Unanswered("the stimulus ended early", ends_sitting=False), VoidCause.FAULT),
]


def stimulus(trial):
    return trial.level_n, trial.direction_shown, trial.angle_deg


@pytest.mark.parametrize(("reply", "cause"), CAUSES, ids=lambda value: getattr(value, "name", ""))
def test_each_cause_is_logged_in_the_table_and_followed_by_the_same_stimulus(brief, reply, cause):
    end = conduct_new(brief.plan(), "simulated", brief.participant(6, lambda: reply))
    if end.end_reason:
        end = brief.resumed(end.folder)
    write_tables(end.folder)
    trials = read_trials(end.folder.path / TRIALS_NAME)
    (void,) = [trial for trial in trials if trial.void_cause is not None]
    again = trials[trials.index(void) + 1]
    assert (void.void_cause, again.repeat_cause, again.attempt) == (cause, cause, 1)
    assert stimulus(void) == stimulus(again)
    assert sum(trial.repeat_cause is not None for trial in trials) == 1
    assert validate_file(end.folder.path).problems == ()
    assert read_log(end.folder.log).events[0].rules == LATEST_RULES


def test_a_stall_is_distinguished_from_other_faults():
    assert get_void_cause(Fault.STALLED) is VoidCause.SCREEN_LATE
    assert {get_void_cause(fault) for fault in Fault if fault is not Fault.STALLED} == {VoidCause.FAULT}


@pytest.mark.slow
def test_a_display_that_lets_a_used_up_repeat_through_is_asked_again(sitter):
    """It asks at every trial but a third: three in a run are heard, the others answered."""
    sitting = sitter.participant(0, lambda: REPEAT)
    asked, answered = [], sitting.display._display.ask

    def ask(question, sign_of_life):
        asked.append(question)
        return REPEAT if len(asked) % 3 else answered(question, sign_of_life)

    sitting.display.ask = ask
    end = conduct_new(sitter.plan(), "simulated", sitting)
    assert end.state.closed
    for run in end.state.runs:
        causes = [trial.void_cause for trial in end.state.trials if trial.run == run.index]
        assert causes.count(VoidCause.ASKED) == sitter.protocol.trial.repeats_per_run == 3
    assert {question.repeats_left for question in asked} == {0, 1, 2, 3}


def test_without_repeats_the_key_is_refused_from_the_first_trial(brief):
    none = replace(brief.protocol, trial=replace(brief.protocol.trial, repeats_per_run=0))
    brief.protocol, brief.text = none, f"{brief.text}\n[trial]\nrepeats_per_run = 0\n"
    sitting = brief.participant(2, lambda: REPEAT)
    end = conduct_new(brief.plan(), "simulated", sitting)
    assert end.state.closed
    assert all(trial.void_cause is None for trial in end.state.trials)


@pytest.mark.slow
def test_a_session_of_the_first_rules_continues_under_them(sitter, monkeypatch):
    """Its void trials are drawn anew: some seeds give the other direction, which the second rules would refuse."""
    kept = set()
    for number in range(4):
        sitter.seed = 100 + number
        monkeypatch.setattr("study.workflows.session.open_session.LATEST_RULES", 1)
        left = conduct_new(sitter.plan(f"Q{number}"), "simulated", sitter.participant(3, lambda: CAUSES[3][0]))
        monkeypatch.undo()
        done = sitter.resumed(left.folder)
        assert done.state.closed
        first, again = [trial for trial in done.state.trials if (trial.run, trial.trial) == (0, 3)]
        kept.add(stimulus(first) == stimulus(again))
    assert kept == {True, False}


@pytest.mark.slow
def test_ctrl_c_counts_as_leaving_and_a_dead_program_does_not(sitter):
    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(UserInterruptError):
        conduct_new(sitter.plan("P01"), "simulated", sitter.participant(3, interrupt))
    done = sitter.resumed(SessionFolder(sitter.data / "P01_001"))
    assert [t.void_cause for t in done.state.trials if t.void_cause] == [VoidCause.LEFT]

    whole = sitter.whole("P03")
    for seal in find_seals(whole.folder.path).values():  # written after the last line
        seal.unlink(missing_ok=True)
    lines = whole.folder.log.read_bytes().splitlines(keepends=True)
    cut = max(i for i, line in enumerate(lines) if b'"trial_presented"' in line)
    whole.folder.log.write_bytes(b"".join(lines[: cut + 1]))
    again = sitter.resumed(whole.folder)
    assert [t.void_cause for t in again.state.trials if t.void_cause] == [VoidCause.PROGRAM_ENDED]
