"""What the daily check and the acceptance refuse, or do not take for a pass."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest

from study.session.views.views import DeviceFinding, DeviceReport
from study.workflows.checks import daily_check, examine_setup
from study.workflows.checks.daily_check import Moving
from study.workflows.checks.examine_setup import Examination, accept


@pytest.mark.parametrize("sensor", [True, False])
def test_the_proof_of_the_acceptance_is_announced_and_a_no_keeps_the_device_still(monkeypatch, sensor):
    called, notices = [], []
    found = (DeviceFinding("Accelerometer", "", fine=sensor),)
    timing = SimpleNamespace(findings=())
    looked = Examination((), DeviceReport("omega3", simulated=False, findings=found), timing)

    def no(notice: str) -> None:
        notices.append(notice)
        raise KeyboardInterrupt

    monkeypatch.setattr(examine_setup, "record_baseline", lambda *_: ("baselines/a.h5", "0"))
    monkeypatch.setattr(examine_setup, "accept_device", lambda *_: called.append("moved"))
    with pytest.raises(KeyboardInterrupt):
        accept("omega3", looked, "Ada", Moving(no, lambda done: None))
    assert not called
    assert "No person may hold the handle" in notices[0] and "0.5 N" in notices[0]


def test_a_handle_that_stuck_is_written_as_a_change(two_days, monkeypatch):
    _, check = two_days
    read = daily_check.read_recording

    def stuck(path):
        recording = read(path)
        if path.name != "2.h5":
            return recording
        position = recording.position.samples * [0.0, 1.0, 1.0]
        return replace(recording, position=replace(recording.position, samples=position))

    monkeypatch.setattr(daily_check, "read_recording", stuck)
    document = json.loads(check(2).file.read_text())
    (friction,) = (each for each in document["changes"] if (each["kind"], each["axis"]) == ("friction", "fx"))
    assert friction["changed"] is True and friction["today"] is None
    assert document["passed"] is False
