"""A trial whose program died between its answer and its measurement, judged when the session is resumed."""

from dataclasses import replace

import pytest

from protocols.definition.session_settings import DetectionSettings
from protocols.trial import Phase, TrialStatus, VoidCause
from study.session.facts.events import TrialMeasured, TrialPresented
from study.session.stimulus.stimulus import compute_direction_angle_deg
from study.store.sessions.event_log import read_log


def cut_after_answer(folder, presented: TrialPresented, session_logs) -> None:
    """Leave what a kill right after the answer to this trial leaves; its recording reached the disk."""
    events = read_log(folder.log).events
    at = events.index(presented)
    answered = next(i for i in range(at, len(events)) if events[i].event == "answer_given")
    session_logs.cut(folder.path, answered + 1)


@pytest.mark.slow
def test_a_detection_trial_is_measured_along_the_direction_that_was_played(sitter, session_logs):
    """Its answer is an interval, whose number says nothing of the direction."""
    detection = DetectionSettings(frequencies_hz=(35.0,), interval_s=0.4, gap_s=0.2)
    sitter.protocol = replace(sitter.protocol, detection=detection)
    sitter.text += "\n[detection]\nfrequencies_hz = [35.0]\ninterval_s = 0.4\ngap_s = 0.2\n"
    done = sitter.whole()
    directions = sitter.protocol.directions
    presented = next(
        event
        for event in read_log(done.folder.log).events
        if isinstance(event, TrialPresented)
        and event.phase is Phase.DETECTION
        and event.angle_deg != compute_direction_angle_deg(directions, event.direction)
    )
    place = (presented.run, presented.trial, presented.attempt)
    (before,) = [t for t in done.state.trials if (t.run, t.trial, t.attempt) == place]
    cut_after_answer(done.folder, presented, session_logs)
    (after,) = [t for t in sitter.resumed(done.folder).state.trials if (t.run, t.trial, t.attempt) == place]
    assert after.status is TrialStatus.FLAGGED
    assert after.delivered_mps2 == pytest.approx(before.delivered_mps2, rel=1e-5)
    assert after.off_axis_mps2 == pytest.approx(before.off_axis_mps2, rel=1e-4)


@pytest.mark.parametrize(
    ("needed", "status"),
    [(False, TrialStatus.UNMEASURED), pytest.param(True, TrialStatus.SPOILED, marks=pytest.mark.slow)],
)
def test_a_trial_without_its_recording_is_void_where_the_accelerometer_is_needed(sitter, session_logs, needed, status):
    measurement = replace(sitter.protocol.measurement, accelerometer_needed=needed)
    sitter.protocol = replace(sitter.protocol, measurement=measurement)
    sitter.text = sitter.text.replace(
        "[measurement]\n", f"[measurement]\naccelerometer_needed = {str(needed).lower()}\n"
    )
    done = sitter.whole()
    (measured,) = [e for e in read_log(done.folder.log).events if isinstance(e, TrialMeasured)][-1:]
    presented = [e for e in read_log(done.folder.log).events if isinstance(e, TrialPresented)][-1]
    cut_after_answer(done.folder, presented, session_logs)
    (done.folder.path / measured.recording).unlink()
    place = (presented.run, presented.trial, presented.attempt)
    resumed = sitter.resumed(done.folder).state
    (after,) = [t for t in resumed.trials if (t.run, t.trial, t.attempt) == place]
    assert (after.status, after.void_cause) == (status, VoidCause.NO_ACCELERATION if needed else None)
    assert resumed.closed
