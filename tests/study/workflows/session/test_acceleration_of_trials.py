"""What was lost between accelerometer and computer stands beside each trial; above the limit nothing is said of what
was delivered, or the trial comes again where the protocol needs the accelerometer."""

from dataclasses import replace

import pytest

from protocols.trial import TrialStatus, VoidCause
from study.devices.device import Fault, Health
from study.errors import DeviceError
from study.session.facts.sensor_facts import SensorFacts
from study.session.facts.void_reasons import TOO_LITTLE_MOTION, is_computer_busy
from study.store.formats.recording_file import read_recording
from study.store.sessions.event_log import read_log
from study.tui.trial_words import describe_void_trial
from study.workflows.session import conduct_session
from study.workflows.trial.judge_trial import judge_trial

GOOD = SensorFacts(packets=9900, lost=100, spoiled_bytes=1500, restarts=0, ticks=1000, unplaced_ticks=0, drift_ppm=31.5)
BAD = replace(GOOD, packets=9000, lost=1000)


@pytest.fixture
def dead(monkeypatch):
    """How much of the acceleration is recorded, of the device that is opened next."""
    share = [0.0]
    real_open = conduct_session.open_device

    def opened(*arguments):
        device = real_open(*arguments)
        release = device.release

        def release_and_deaden():
            played = release()
            if played.recording is None:
                return played
            response = played.recording.response
            response = replace(response, samples=share[0] * response.samples + response.samples[:1])
            return replace(played, recording=replace(played.recording, response=response))

        device.release = release_and_deaden
        return device

    monkeypatch.setattr(conduct_session, "open_device", opened)
    return share


@pytest.fixture
def heard(monkeypatch):
    """The sensor facts of each trial in turn, the last one again and again; and whether the device has a sensor."""
    facts, has_sensor = [GOOD], [True]
    real_open = conduct_session.open_device

    def opened(*arguments):
        device = real_open(*arguments)
        release = device.release

        def release_and_tell():
            played = release()
            now = facts.pop(0) if len(facts) > 1 else facts[0]
            return replace(played, health=replace(played.health, sensor=now))

        device.release = release_and_tell
        device._info = replace(device.info, has_sensor=has_sensor[0])
        return device

    monkeypatch.setattr(conduct_session, "open_device", opened)
    return facts, has_sensor


def judged(sensor, protocol, **settings):
    health = Health(Fault.NONE, 1000, 0, 0, 0, 0, 0, 1.0, sensor=sensor)
    return judge_trial(health, replace(protocol.measurement, **settings), True)


@pytest.mark.parametrize(
    ("sensor", "missing"),
    [
        (None, None),
        (GOOD, 0.01),
        (BAD, 0.1),
        (replace(GOOD, unplaced_ticks=51), 0.051),
        (replace(GOOD, unplaced_ticks=50), 0.05),
        (replace(GOOD, packets=0, lost=0), 1.0),
        (replace(GOOD, ticks=0), 0.01),
    ],
)
def test_what_is_missing_above_the_limit_cannot_be_trusted(small_protocol, sensor, missing):
    found = judged(sensor, small_protocol)
    assert sensor is None or sensor.missing == pytest.approx(missing)
    too_much = missing is not None and missing > 0.05
    assert (found.void_reason, found.is_measurable) == ("", not too_much)
    assert any("no trustworthy acceleration" in flag for flag in found.flags) is too_much
    needed = judged(sensor, small_protocol, accelerometer_needed=True)
    assert bool(needed.void_reason) is too_much
    assert needed.cause is (VoidCause.NO_ACCELERATION if too_much else VoidCause.FAULT)


def test_a_participant_reads_that_the_sensor_was_not_heard(small_protocol):
    reason = judged(BAD, small_protocol, accelerometer_needed=True).void_reason
    assert reason == "10.0 % of the acceleration is missing" and not is_computer_busy(reason)
    assert describe_void_trial(reason).startswith("The sensor at the handle gave too few readings")


def test_the_counts_stand_beside_each_trial_and_in_its_recording(brief, heard):
    done = brief.whole()
    rows = {(row.lost_packets, row.garbled_bytes, row.acceleration_missing) for row in done.state.trials}
    assert rows == {(100, 1500, 0.01)}
    measured = [event for event in read_log(done.folder.log).events if event.event == "trial_measured"]
    assert {event.sensor for event in measured} == {GOOD}
    meta = read_recording(done.folder.path / next(event.recording for event in measured if event.recording)).meta
    assert (meta["sensor"]["lost"], meta["acceleration_trusted"]) == (100, True)


@pytest.mark.slow
def test_a_trial_without_trustworthy_acceleration_counts_and_says_nothing_of_what_was_delivered(sitter, heard):
    heard[0][:] = [BAD, BAD, GOOD]
    done = sitter.whole()
    first, second, *others = [row for row in done.state.trials if row.is_valid]
    assert {(row.status, row.delivered_mps2) for row in (first, second)} == {(TrialStatus.FLAGGED, None)}
    assert all(row.delivered_mps2 is not None for row in others)
    assert done.state.closed


@pytest.mark.slow
def test_a_protocol_that_needs_the_accelerometer_has_such_trials_again(sitter, heard):
    sitter.protocol = replace(
        sitter.protocol, measurement=replace(sitter.protocol.measurement, accelerometer_needed=True)
    )
    heard[0][:] = [BAD, GOOD]
    done = sitter.whole()
    void, again = done.state.trials[:2]
    assert (void.status, void.void_cause) == (TrialStatus.SPOILED, VoidCause.NO_ACCELERATION)
    assert (void.lost_packets, again.attempt, again.repeat_cause) == (1000, 1, VoidCause.NO_ACCELERATION)
    assert done.state.closed


def test_such_a_protocol_begins_nothing_where_there_is_no_accelerometer(sitter, heard):
    sitter.protocol = replace(
        sitter.protocol, measurement=replace(sitter.protocol.measurement, accelerometer_needed=True)
    )
    heard[1][0] = False
    with pytest.raises(DeviceError, match="needs the accelerometer"):
        sitter.whole()


@pytest.mark.parametrize(("share", "flagged"), [(0.0, True), (0.02, True), (0.3, False), (1.0, False)])
def test_a_strong_stimulus_of_which_nothing_arrives_is_flagged_and_its_answer_counts(brief, dead, share, flagged):
    """A device that answers that all is well and does not move, or a sensor that is dead."""
    dead[0] = share
    done = brief.whole()
    rows = [row for row in done.state.trials if row.is_valid and row.delivered_mps2 is not None]
    measured = [event for event in read_log(done.folder.log).events if event.event == "trial_measured"]
    said = {
        row.level_n: TOO_LITTLE_MOTION in event.flags for row, event in zip(done.state.trials, measured, strict=True)
    }
    assert max(row.level_n for row in rows) >= 1.0
    assert all(said[row.level_n] is (flagged and row.level_n >= 1.0) for row in rows if not 0.6 < row.level_n < 1.0)
