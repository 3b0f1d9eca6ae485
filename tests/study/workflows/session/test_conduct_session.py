"""Whole sittings on the simulated device, in virtual time."""

import os
from dataclasses import replace

import pytest

from protocols.trial import Phase, TrialStatus
from study.errors import DeviceError, StudyError, UserInterruptError
from study.session.facts.events import TrialMeasured, TrialPresented, TrialSpoiled
from study.session.views.participant_views import Unanswered
from study.store.formats.recording_file import read_recording
from study.store.sessions.event_log import read_log
from study.store.sessions.session_lock import hold_session_lock
from study.workflows.files.validate import validate_file
from study.workflows.results.fold_session import fold_session
from study.workflows.results.session_results import write_tables
from study.workflows.session.conduct_session import conduct_new


def decisions(state):
    """What must not depend on how often a session was interrupted: what was counted, in order."""
    return [(t.run, t.trial, t.frequency_hz, t.level_n, t.correct) for t in state.trials if t.is_valid]


def test_a_session_runs_to_its_end_and_its_log_folds_to_the_same_state(finished):
    done = finished
    assert done.end_reason == ""
    assert done.state.closed
    assert fold_session(done.folder).state == done.state
    assert {t.phase for t in done.state.trials} == {Phase.TRAINING, Phase.TEST}


def test_each_fact_is_logged_before_the_next_thing_happens(finished):
    kinds = [event.event for event in read_log(finished.folder.log).events]
    assert (kinds[0], kinds[-1]) == ("session_opened", "session_closed")
    trials = [kind for kind in kinds if kind.startswith(("trial", "answer"))]
    assert trials == ["trial_presented", "answer_given", "trial_measured"] * (len(trials) // 3)
    assert kinds.count("rest_taken") == 2


def test_the_same_seed_gives_the_same_trials(brief):
    first, second = brief.whole("P01").state, brief.whole("P02").state
    nameless = [[replace(t, subject="", session="", onset_s=None) for t in state.trials] for state in (first, second)]
    assert nameless[0] == nameless[1]
    onsets = [[t.onset_s for t in state.trials] for state in (first, second)]
    assert onsets[0] == pytest.approx(onsets[1], abs=0.002)  # the log's times are rounded to milliseconds


@pytest.mark.slow
def test_another_seed_gives_others(sitter):
    first = sitter.whole("P01").state
    sitter.seed = 12
    assert [t.direction_shown for t in sitter.whole("P02").state.trials] != [t.direction_shown for t in first.trials]


def test_what_was_really_played_is_measured_and_kept(finished):
    events = [e for e in read_log(finished.folder.log).events if isinstance(e, TrialMeasured)]
    assert len(events) == len([t for t in finished.state.trials if t.is_valid])
    for event, trial in zip(events, finished.state.trials, strict=True):
        assert event.missed_ticks == 0
        assert trial.delivered_mps2 > 0.5 * trial.level_n
        assert trial.off_axis_mps2 < trial.delivered_mps2
    recording = read_recording(finished.folder.path / events[-1].recording)
    assert len(recording) == 200
    assert recording.meta["frequency_hz"] == finished.state.trials[-1].frequency_hz
    assert recording.excitation is not None


@pytest.mark.slow
def test_a_louder_level_is_a_stronger_acceleration(sitter):
    sitter.observer = "guesser"
    trials = [t for t in sitter.whole().state.trials if t.frequency_hz == 35.0]
    levels = sorted({t.level_n for t in trials})
    assert len(levels) > 2
    means = [sum(t.delivered_mps2 for t in trials if t.level_n == n) for n in levels]
    counts = [sum(t.level_n == n for t in trials) for n in levels]
    gains = [m / c / n for m, c, n in zip(means, counts, levels, strict=True)]
    assert max(gains) < 1.5 * min(gains)


def test_leaving_and_coming_back_changes_no_decision(sitter, played):
    whole = decisions(played.state)
    left = sitter.interrupted(after=9)
    assert left.end_reason == "the participant left"
    assert not left.state.closed
    done = sitter.resumed(left.folder)
    assert done.state.closed
    assert decisions(done.state) == whole


def test_the_log_only_grows(brief):
    left = brief.interrupted(after=5)
    before = left.folder.log.read_bytes()
    brief.resumed(left.folder)
    assert left.folder.log.read_bytes().startswith(before)


def test_a_trial_that_was_open_at_the_end_is_void_and_drawn_again(brief):
    left = brief.interrupted(after=1)
    spoiled = [e for e in read_log(left.folder.log).events if isinstance(e, TrialSpoiled)]
    assert [(e.trial, e.attempt, e.reason) for e in spoiled] == [(1, 0, "the participant left")]
    done = brief.resumed(left.folder)
    again = [t for t in done.state.trials if (t.run, t.trial) == (0, 1)]
    assert [(t.attempt, t.status) for t in again] == [(0, TrialStatus.SPOILED), (1, TrialStatus.OK)]
    assert again[0].level_n == again[1].level_n


def test_a_repeat_that_was_asked_for_is_drawn_again_in_the_same_sitting(brief):
    done = conduct_new(
        brief.plan(), "simulated", brief.participant(4, lambda: Unanswered("asked to repeat", ends_sitting=False))
    )
    assert done.state.closed
    assert sum(t.status is TrialStatus.SPOILED for t in done.state.trials) == 1


def test_a_crash_between_answer_and_measurement_loses_nothing(sitter, finished, session_logs):
    """The log is cut right after an answer, as a SIGKILL there would leave it; the recording reached the disk."""
    done = finished
    lines = done.folder.log.read_bytes().splitlines(keepends=True)
    cut = max(i for i, line in enumerate(lines) if b'"answer_given"' in line)
    session_logs.cut(done.folder.path, cut + 1)
    resumed = sitter.resumed(done.folder)
    assert decisions(resumed.state) == decisions(done.state)
    last = resumed.state.trials[-1]
    assert last.status is TrialStatus.FLAGGED
    assert last.delivered_mps2 == pytest.approx(done.state.trials[-1].delivered_mps2, rel=1e-5)


def test_the_answer_counts_even_when_its_recording_was_lost(sitter, finished, session_logs):
    done = finished
    lines = done.folder.log.read_bytes().splitlines(keepends=True)
    cut = max(i for i, line in enumerate(lines) if b'"answer_given"' in line)
    session_logs.cut(done.folder.path, cut + 1)
    late = b'"late_ticks":5,"latest_s":0.0042'
    forge = lambda events: [*events[:-1], events[-1].replace(b'"late_ticks":0,"latest_s":0.0', late)]  # noqa: E731
    session_logs.forged(done.folder.path, forge)
    trial = done.state.trials[-1]
    (done.folder.recordings / f"run-{trial.run:02d}_trial-{trial.trial:03d}_attempt-0.h5").unlink()
    resumed = sitter.resumed(done.folder)
    assert decisions(resumed.state) == decisions(done.state)
    last = resumed.state.trials[-1]
    assert (last.status, last.late_ticks, last.latest_s) == (TrialStatus.UNMEASURED, 5, 0.0042)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (b'"missed_ticks":0', b'"missed_ticks":900', "of the 1 kHz ticks were missed"),
        (b'"fault":"NONE","felt_whole":true', b'"fault":"LOST","felt_whole":false', "the device stopped answering"),
        (b'"fault":"NONE","felt_whole":true', b'"fault":"LATER","felt_whole":false', "no plausible number"),
    ],
)
def test_an_answer_whose_program_died_is_judged_by_what_was_logged_with_it(
    sitter, finished, session_logs, old, new, reason
):
    done = finished
    lines = done.folder.log.read_bytes().splitlines()
    cut = max(i for i, line in enumerate(lines) if b'"answer_given"' in line)
    session_logs.cut(done.folder.path, cut + 1)
    session_logs.forged(done.folder.path, lambda events: [*events[:-1], events[-1].replace(old, new)])
    assert new in done.folder.log.read_bytes()
    trial = done.state.trials[-1]
    (done.folder.recordings / f"run-{trial.run:02d}_trial-{trial.trial:03d}_attempt-0.h5").unlink()
    resumed = sitter.resumed(done.folder)
    (judged,) = [t for t in resumed.state.trials if (t.run, t.trial, t.attempt) == (trial.run, trial.trial, 0)]
    assert judged.status is TrialStatus.SPOILED
    spoiled = [e for e in read_log(done.folder.log).events if e.event == "trial_spoiled"]
    assert reason in spoiled[-1].reason
    assert spoiled[-1].vibrated_s > 0
    assert resumed.state.closed


def test_a_torn_last_line_is_mended_and_remembered(brief):
    left = brief.interrupted(after=6)
    whole = left.folder.log.read_bytes()
    left.folder.log.write_bytes(whole + b'{"utc": "2026", "run": 0, "tri')
    resumed = brief.resumed(left.folder)
    assert resumed.state.closed
    text = left.folder.log.read_bytes()
    assert text.startswith(whole)
    assert b'"mended":"{\\"utc\\": \\"2026\\", \\"run\\": 0, \\"tri"' in text


def test_a_level_changed_in_the_log_is_found_out(sitter, session_logs):
    left = sitter.interrupted(after=6)
    session_logs.as_older(left.folder.path, lambda text: text.replace(b'"level_n":1.0,', b'"level_n":0.9,', 1))
    changed = left.folder.log.read_bytes()
    with pytest.raises(StudyError) as error:
        sitter.resumed(left.folder)
    assert error.value.title == "The session log contradicts the rules"
    assert "level_n 0.9 where 1.0 is due" in error.value.happened
    assert left.folder.log.read_bytes() == changed


def test_a_protocol_changed_in_the_log_is_found_out(sitter, session_logs):
    left = sitter.interrupted(after=2)
    session_logs.as_older(left.folder.path, lambda text: text.replace(b"start_n = 1.0", b"start_n = 0.5", 1))
    with pytest.raises(StudyError, match="protocol text of P01_001 does not match the hash"):
        sitter.resumed(left.folder)


def test_a_finished_session_is_not_resumed(sitter, finished):
    with pytest.raises(StudyError, match="This session is finished"):
        sitter.resumed(finished.folder)


def test_a_log_without_an_opening_line_says_that_nothing_is_lost(sitter):
    left = sitter.interrupted(after=0)
    left.folder.log.write_bytes(b'{"utc": "20')
    with pytest.raises(StudyError, match="never began.*holds no answers"):
        sitter.resumed(left.folder)


def test_a_session_that_runs_elsewhere_is_refused_and_unchanged(sitter):
    left = sitter.interrupted(after=2)
    before = left.folder.log.read_bytes()
    with hold_session_lock(left.folder.path), pytest.raises(StudyError, match="running elsewhere"):
        sitter.resumed(left.folder)
    assert left.folder.log.read_bytes() == before


def test_ctrl_c_leaves_a_log_that_can_be_resumed(brief):
    def press() -> None:
        raise KeyboardInterrupt

    with pytest.raises(UserInterruptError) as left:
        brief.interrupted(after=4, instead=press)
    assert left.value.saved == "4 answers are on disk."
    assert left.value.do_now.startswith("Continue with: hapteq resume ")
    (folder,) = [f for f in brief.data.iterdir() if f.is_dir()]
    from study.store.sessions.archive import SessionFolder

    assert brief.resumed(SessionFolder(folder)).state.closed


def test_a_device_that_does_not_exist_makes_no_session(sitter):
    with pytest.raises(DeviceError):
        conduct_new(sitter.plan(), "omega9", sitter.participant())
    assert not sitter.data.exists()


def test_a_protocol_in_acceleration_is_refused_without_an_equalizer(sitter):
    stimulus = replace(sitter.protocol.stimulus, quantity="delivered_acceleration")
    sitter.protocol = replace(sitter.protocol, stimulus=stimulus)
    with pytest.raises(StudyError) as error:
        sitter.whole()
    assert "needs an equalizer" in error.value.title
    assert "--model MODEL.h5" in error.value.do_now


def test_nothing_is_presented_when_the_log_cannot_be_written(sitter, monkeypatch):
    """The disk is full at the third presentation: the device must not have moved for it."""
    written = []
    real = os.write

    def full(descriptor: int, data: bytes) -> int:
        if b'"trial_presented"' in data:
            written.append(data)
            if len(written) == 3:
                raise OSError(28, "No space left on device")
        return real(descriptor, data)

    monkeypatch.setattr("study.store.sessions.event_log.os.write", full)
    with pytest.raises(StudyError) as error:
        sitter.whole()
    assert "No space left on device" in error.value.happened
    assert error.value.saved == "2 answers are on disk."
    assert error.value.do_now.endswith("P01_001")
    assert "Then continue with: hapteq resume " in error.value.do_now
    monkeypatch.undo()
    (folder,) = [f for f in sitter.data.iterdir() if f.is_dir()]
    presented = [e for e in read_log(folder / "events.jsonl").events if isinstance(e, TrialPresented)]
    assert len(presented) == 2
    assert len(list((folder / "recordings").glob("*.h5"))) == 2


def test_a_finished_session_folder_is_valid_and_a_changed_recording_is_found(finished):
    done = finished
    write_tables(done.folder)
    sound = validate_file(done.folder.path)
    assert sound.problems == ()
    assert sound.kind.startswith("session P01_001 of simulated participant 'scripted', small, ")
    for name in ("events.jsonl", "trials.csv", "thresholds.csv", "session.json"):
        assert validate_file(done.folder.path / name).problems == (), name
    recording = sorted(done.folder.recordings.iterdir())[0]
    recording.write_bytes(recording.read_bytes()[:-1] + b"!")
    (problem,) = validate_file(done.folder.path).problems
    assert "is not the file that was written" in problem


def test_a_missing_recording_and_a_changed_table_are_found(finished):
    done = finished
    write_tables(done.folder)
    sorted(done.folder.recordings.iterdir())[0].unlink()
    table = done.folder.path / "trials.csv"
    table.write_text(table.read_text().replace(",true,", ",false,", 1))
    problems = " ".join(validate_file(done.folder.path).problems)
    assert "is missing" in problems
    assert "trials.csv" in problems
