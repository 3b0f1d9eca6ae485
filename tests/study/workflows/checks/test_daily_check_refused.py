"""What the daily check and the acceptance refuse, or do not take for a pass."""

import json
from dataclasses import replace
from datetime import UTC, datetime
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.device_change import compare_measurements
from analysis.device_change.measure_device import measure_device
from equalizer.signals.recording import Recording
from study.cli.main import main
from study.devices.opening import get_device_folder
from study.devices.rigs_by_name import RIGS_BY_NAME
from study.errors import DeviceError
from study.session.views.participant_views import DeviceFinding, DeviceReport
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.provenance import compute_sha256
from study.store.formats.daily_check_file import DailyCheck, read_daily_check, write_daily_check
from study.store.formats.recording_file import read_recording
from study.workflows.checks import daily_check, examine_setup
from study.workflows.checks.daily_check import MotionCallbacks, check_on_device, compare_recordings, judge_last_check
from study.workflows.checks.device_changes import make_change_findings
from study.workflows.checks.examine_setup import Examination, accept_examined_device
from tests.study.workflows.checks.conftest import INFO, QUIET


@pytest.mark.parametrize("sensor", [True, False])
def test_the_proof_of_the_acceptance_is_announced_and_a_no_keeps_the_device_still(monkeypatch, sensor):
    called, notices = [], []
    found = (DeviceFinding("Accelerometer", "", fine=sensor),)
    timing = SimpleNamespace(findings=())
    looked = Examination((), DeviceReport("omega3", simulated=False, findings=found), timing)

    def no(notice: str) -> None:
        notices.append(notice)
        raise KeyboardInterrupt

    monkeypatch.setattr(examine_setup, "require_testable_device", lambda *_: None)
    monkeypatch.setattr(examine_setup, "record_baseline", lambda *_: ("baselines/a.h5", "0"))
    monkeypatch.setattr(examine_setup, "accept_device", lambda *_: called.append("moved"))
    with pytest.raises(KeyboardInterrupt):
        accept_examined_device("omega3", looked, "Ada", MotionCallbacks(no, lambda done: None))
    assert not called
    assert "No person may hold the handle" in notices[0] and "0.5 N" in notices[0]


def test_a_driver_that_cannot_be_tested_is_refused_before_the_device_moves(monkeypatch):
    """A laboratory's own driver without the methods of the test; its handle moved for a minute and a half before."""
    moved = []
    rig = SimpleNamespace(close=lambda: None)
    monkeypatch.setitem(RIGS_BY_NAME, "own", lambda settings, seed: rig)
    monkeypatch.setattr(examine_setup, "record_baseline", lambda *_: moved.append("baseline") or ("a.h5", "0"))
    looked = Examination((), DeviceReport("own", simulated=False, findings=()), SimpleNamespace(findings=()))
    with pytest.raises(DeviceError, match="its driver has no read_reported_n"):
        accept_examined_device("own", looked, "Ada", QUIET)
    assert not moved


@pytest.mark.parametrize("sensor", [True, False])
def test_a_sensor_that_is_not_fine_does_not_hinder_the_acceptance(monkeypatch, sensor):
    asked = []
    found = (DeviceFinding("Accelerometer", "", fine=sensor),)
    looked = Examination((), DeviceReport("omega3", simulated=False, findings=found), SimpleNamespace(findings=()))
    monkeypatch.setattr(examine_setup, "require_testable_device", lambda *_: None)
    monkeypatch.setattr(examine_setup, "record_baseline", lambda *_: ("baselines/a.h5", "0"))
    monkeypatch.setattr(examine_setup, "accept_device", lambda _, settings, *rest: asked.append(settings) or "signed")
    said = accept_examined_device("omega3", looked, "Ada", QUIET)
    assert [settings.with_sensor for settings in asked] == [sensor]
    assert ("no daily check" in said) is not sensor


def test_a_handle_that_stuck_is_written_as_a_change(two_days, monkeypatch):
    _, check = two_days
    read = daily_check.read_recording

    monkeypatch.setattr(
        daily_check, "read_recording", lambda path: stuck(read(path)) if path.name == "2.h5" else read(path)
    )
    document = json.loads(check(2).file.read_text())
    (friction,) = (each for each in document["changes"] if (each["kind"], each["axis"]) == ("friction", "fx"))
    assert friction["changed"] is True and friction["today"] is None
    assert document["passed"] is False


def test_a_band_that_is_not_reliable_any_more_is_no_pass(recorded, monkeypatch):
    recording = recorded(1)
    found = measure_device(recording)
    at_hz = found.response.frequency_hz
    cut = replace(found.response, reliable=found.response.reliable & (at_hz < 70))
    measured = iter([found, replace(found, response=cut)])
    monkeypatch.setattr(compare_measurements, "measure_device", lambda _: next(measured))
    (response,) = (
        each for each in make_change_findings(compare_recordings(recording, recording)) if each.name == "Response"
    )
    assert response.warning and not response.fine
    assert "fx, fy, fz not measured at" in response.value and "Not told (fx, fy, fz)" in response.advice


def lowered(recording: Recording) -> Recording:
    first, *others = recording.meta["segments"]
    weaker = first | {"played_amplitude_n": 0.7 * first["requested_amplitude_n"]}
    return replace(recording, meta=recording.meta | {"segments": [weaker, *others]})


def clipped(recording: Recording) -> Recording:
    first, *others = recording.meta["segments"]
    return replace(recording, meta=recording.meta | {"segments": [first | {"sensor_clipped": 3}, *others]})


def stuck(recording: Recording) -> Recording:
    position = recording.position.samples * [0.0, 1.0, 1.0]
    return replace(recording, position=replace(recording.position, samples=position))


def shaken(recording: Recording) -> Recording:
    """While the handle moves."""
    random, samples = np.random.default_rng(6), recording.response.samples.copy()
    for segment in recording.segments:
        there = slice(segment.start, segment.stop)
        samples[there] += 2.0 * random.standard_normal(samples[there].shape)
    return replace(recording, response=replace(recording.response, samples=samples))


@pytest.mark.slow
def test_a_baseline_that_tells_too_little_is_refused(device_like, monkeypatch):
    with device_like(1, {}) as (device, plan):
        assert daily_check._record_baseline_on(device, plan, QUIET)[0] == "baselines/1.h5"
        good = read_recording(plan.out)
        monkeypatch.setattr(daily_check, "record_on_device", lambda *_: None)
        for spoil, said in (
            (lowered, "at its limit in 1 of 6"),
            (clipped, "at its limit in 1 of 6"),
            (stuck, "Friction, fx the handle did not move"),
            (shaken, "Too inaccurate to compare with: Response"),
        ):
            monkeypatch.setattr(daily_check, "read_recording", lambda _, spoil=spoil: spoil(good))
            with pytest.raises(DeviceError, match=f"was not accepted.*{said}.*accept it again"):
                daily_check._record_baseline_on(device, plan, QUIET)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"sample_rate_hz": 2000.0}, "the sample rate is 2000 Hz now, but was 1000 Hz at the acceptance"),
        ({"unit": "m/s", "quantity": "velocity"}, r"the response is ax \(m/s\), .* now, but was ax \(m/s\^2\), "),
        ({"channels": ("ax", "az", "ay")}, r"the response is .* now, but was .* at the acceptance"),
    ],
)
def test_what_was_measured_otherwise_is_not_compared(two_days, change, said):
    """At twice the rate, periods of the same length in samples have other frequencies."""
    baseline = read_recording(two_days[0])
    signals = {"response": replace(baseline.response, **change)}
    if "sample_rate_hz" in change:
        names = ("command", "response", "position", "excitation")
        signals = {name: replace(getattr(baseline, name), **change) for name in names}
    with pytest.raises(DeviceError, match=said):
        compare_recordings(baseline, replace(baseline, **signals))


def test_what_was_played_otherwise_is_not_compared(two_days, device_like, recorded):
    baseline = read_recording(two_days[0])
    first, *others = baseline.segments
    weaker = replace(baseline, segments=(replace(first, amplitude=0.7 * first.amplitude), *others))
    with pytest.raises(DeviceError, match="a sine of 0.84 N.* was played instead of a sine of 1.2 N"):
        compare_recordings(baseline, weaker)
    with pytest.raises(DeviceError, match="5 segments were played now, but 6 at the acceptance"):
        compare_recordings(baseline, replace(baseline, segments=tuple(others)))

    def never(notice: str) -> None:
        raise AssertionError(notice)

    with device_like(2, {}) as (device, plan):
        other = replace(plan, protocol=replace(plan.protocol, rest_s=0.6))
        with pytest.raises(DeviceError, match="was played by another version of the protocol"):
            check_on_device(device, other, MotionCallbacks(never, lambda done: None))


@pytest.mark.slow
def test_a_pass_ends_with_another_acceptance_and_with_a_check_that_broke_off(
    two_days, device_like, vendor, monkeypatch
):
    baseline, _ = two_days
    accepted = (baseline.name, compute_sha256(baseline))
    checks = get_device_folder() / "daily_checks"
    checks.mkdir()
    now = datetime.now(UTC).isoformat(timespec="seconds")
    changes = ({"kind": "noise", "changed": False},)
    write_daily_check(
        checks / "1.json", DailyCheck(INFO.name, INFO.details, now, True, (), changes, "1.h5", "0", accepted[1])
    )
    assert judge_last_check(INFO).fine
    vendor.accept("omega.3", baseline=("other.h5", "1" * 64))
    assert "none since it was accepted anew" in judge_last_check(INFO).value and not judge_last_check(INFO).fine
    vendor.accept("omega.3", baseline=accepted)
    assert judge_last_check(INFO).fine

    def broken(device, plan, show, announce):
        announce("It moves.")
        raise DeviceError("The device let go", "A cable.", "Look.")

    monkeypatch.setattr(daily_check, "record_on_device", broken)
    with device_like(2, {}) as (device, plan), pytest.raises(DeviceError, match="let go"):
        check_on_device(device, replace(plan, out=checks / "2.h5"), QUIET)
    assert "it broke off" in judge_last_check(INFO).value and not judge_last_check(INFO).fine
    assert main(["validate", str(checks / "2.json")]) == 0


@pytest.mark.parametrize(
    ("key", "value"), [("passed", "yes"), ("utc", 3), ("sentences", "all well"), ("changes", [3]), ("recording", None)]
)
def test_a_result_with_a_wrong_type_is_refused_with_the_key(tmp_path, key, value):
    path = tmp_path / "check.json"
    check = DailyCheck("omega3", "7", "2026-11-30T00:00:00Z", True, ("All well.",), (), "a.h5", "0", "1")
    write_daily_check(path, check)
    assert read_daily_check(path) == check
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))
    with pytest.raises(UnusableFileError) as refused:
        read_daily_check(path)
    assert refused.value.problems[0].startswith(key)


@pytest.mark.parametrize("name", ["", "  "])
def test_an_acceptance_without_a_name_is_refused_before_anything_is_examined(monkeypatch, capsys, name):
    monkeypatch.setattr(examine_setup, "examine_setup", lambda *_, **__: pytest.fail("it was examined"))
    assert main(["doctor", "--device", "omega3", "--hands-off", "--accept", name]) == 2
    assert "The acceptance needs a name" in capsys.readouterr().err
