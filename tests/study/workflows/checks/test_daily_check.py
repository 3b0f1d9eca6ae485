"""The daily check on the stub of the vendor's library: unchanged it passes, what was changed on purpose is named."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.device_change.compare_measurements import Change
from study.cli.main import main
from study.devices.force_dimension.acceptance import Acceptance, locate_acceptance_file, write_acceptance
from study.devices.opening import get_device_folder
from study.errors import DeviceError, UserInterruptError
from study.session.views.participant_views import DeviceFinding, DeviceReport
from study.workflows.checks import daily_check, examine_setup
from study.workflows.checks.daily_check import MotionCallbacks, check_on_device, compare_recordings, judge_last_check
from study.workflows.checks.device_changes import make_change_findings
from study.workflows.checks.examine_setup import Examination
from tests.study.workflows.checks.conftest import INFO, QUIET, short


def changed_kinds(baseline, today) -> set[str]:
    return {change.kind for change in compare_recordings(baseline, today) if change.changed}


def test_an_unchanged_device_passes_and_what_was_planted_is_named(recorded):
    baseline = recorded(1)
    assert changed_kinds(baseline, recorded(2)) == set()
    worn = compare_recordings(baseline, recorded(4, friction=0.35))
    friction = [change for change in worn if change.kind == "friction"]
    assert all(change.changed for change in friction) and len(friction) == 3
    # The damper's 1 N s/m takes its part of every stroke.
    assert [change.today - change.accepted for change in friction] == pytest.approx([0.2] * 3, rel=0.1)
    assert not any(change.changed for change in worn if change.kind == "noise")
    assert "gain" in changed_kinds(baseline, recorded(5, gain=0.8))
    assert changed_kinds(baseline, recorded(6, noise=0.15)) == {"noise"}
    loose = compare_recordings(baseline, recorded(7, mode_hz=50.0))
    assert {change.kind for change in loose if change.changed} == {"response"}
    for change in loose:
        if change.kind == "response":
            assert change.band_hz[0] < 60 and change.band_hz[1] > 50  # where it swings now, and swung
            assert change.peaks_hz[0] - change.peaks_hz[1] == pytest.approx(10, abs=4)


def change(kind: str, **other) -> Change:
    of_kind = {"axis": "fx", "accepted": 1.0, "today": 1.0, "error": 0.01, "limit": 0.12, "unit": "", "changed": False}
    return Change(kind, **(of_kind | other))


def test_changes_are_said_with_their_numbers_their_limits_and_what_to_do():
    found = make_change_findings(
        [
            change("friction", accepted=0.2, today=0.4, unit="N", changed=True),
            change("gain", today=0.8, limit=0.122, changed=True),
            change("response", accepted=0.0, today=0.5, band_hz=(50.0, 63.0), peaks_hz=(66.0, 54.0), limit=0.122),
            change("noise", axis="ax", accepted=0.03, today=0.031, limit=2.0, unit="m/s^2"),
        ]
    )
    assert [finding.name for finding in found] == ["Friction", "Gain", "Response", "Noise"]
    assert [finding.fine for finding in found] == [False, False, True, True]
    assert found[0].value == "fx 0.4 N, accepted 0.2 (may change by 0.12 N)"
    assert "a cable that rubs" in found[0].advice
    assert "−20.0 %" in found[1].value and "mend it first" in found[1].advice
    assert "50.0 % at 50 to 63 Hz, strongest at 54 Hz, accepted 66 Hz" in found[2].value
    assert not found[3].advice


def test_what_was_measured_too_inaccurately_is_neither_changed_nor_fine():
    (found,) = make_change_findings([change("response", today=0.16, band_hz=(50.0, 63.0), error=0.3, unclear=True)])
    assert found.warning and not found.fine and "close other programs" in found.advice


@pytest.mark.parametrize(("difference", "may_be_reversed"), [(2.0, True), (0.5, False)])
def test_a_reversed_axis_of_the_sensor_is_named_beside_loose_screws(difference, may_be_reversed):
    """Its response differs by twice itself; the advice was to look for a loose screw, or to accept the device anew."""
    (found,) = make_change_findings([change("response", accepted=0.0, today=difference, changed=True)])
    assert ("reversed or exchanged axis of the sensor" in found.advice) is may_be_reversed
    assert "loose screw" in found.advice


def test_a_handle_that_does_not_move_any_more_has_changed():
    (found,) = make_change_findings([change("friction", today=np.nan, unit="N", changed=True)])
    assert "the handle did not move" in found.value and found.wrong


def test_a_check_leaves_a_file_that_the_check_before_a_sitting_finds(two_days, stepped_stub, capsys):
    _, check = two_days
    assert judge_last_check(INFO).value == "none yet" and judge_last_check(INFO).warning
    (get_device_folder() / "daily_checks").mkdir()
    for seed, noise, said in ((2, 0.05, "nothing changed"), (3, 0.2, "noise changed")):
        checked = check(seed, noise=noise)
        assert stepped_stub.get("peak_n") > 0
        document = json.loads(checked.file.read_text())
        assert (document["format"], document["passed"], document["device"]) == (
            "hapteq-daily-check",
            seed == 2,
            "omega.3",
        )
        assert main(["validate", str(checked.file), str(checked.file.with_suffix(".h5"))]) == 0
        assert f"daily check of omega.3 at {document['utc']}" in capsys.readouterr().out
        checked.file.rename(get_device_folder() / "daily_checks" / checked.file.name)
        found = judge_last_check(INFO)
        assert said in found.value and checked.file.name in found.value
        assert found.fine == (seed == 2) and found.warning == (seed != 2)
        if found.fine:
            assert judge_last_check(INFO, required=True) == found
        else:
            with pytest.raises(DeviceError, match="requires a passed daily check.*noise changed.*--daily"):
                judge_last_check(INFO, required=True)
    other = replace(INFO, details="serial 7, firmware 2.41, SDK 3.17.5.0")
    assert judge_last_check(other).value == "none yet"
    path = get_device_folder() / "daily_checks" / "3.json"
    path.write_text(path.read_text().replace(document["utc"], "2020-01-01T08:00:00+00:00"))
    yesterday = judge_last_check(INFO)
    assert yesterday.warning and "none today; the last one was 2020-01-01" in yesterday.value
    assert "hapteq doctor --device omega3 --daily" in yesterday.advice
    # A check made while the clock was wrong would hide every later one.
    path.with_name("4.json").write_text(path.read_text().replace("2020-01-01", "2100-01-01"))
    assert judge_last_check(INFO) == yesterday


def test_another_baseline_than_the_accepted_one_is_refused_before_anything_moves(two_days, stepped_stub):
    baseline, check = two_days
    writes = stepped_stub.get("peak_n")
    baseline.write_bytes(baseline.read_bytes() + b"x")
    with pytest.raises(DeviceError, match="is gone, or is not what was accepted"):
        check(2)
    assert stepped_stub.get("peak_n") == writes and stepped_stub.safe


def test_without_an_acceptance_or_its_recording_there_is_nothing_to_compare_with(device_like, stepped_stub):
    with device_like(2, {}) as (device, plan), pytest.raises(DeviceError, match="accepted without a recording"):
        check_on_device(device, plan, QUIET)
    locate_acceptance_file().unlink()
    with device_like(2, {}) as (device, plan), pytest.raises(DeviceError, match="There is no acceptance of it"):
        check_on_device(device, plan, QUIET)
    assert stepped_stub.get("peak_n") == 0


def test_it_is_announced_and_a_no_keeps_the_device_still(two_days, device_like, stepped_stub):
    def no(notice: str) -> None:
        assert "No person may hold the handle" in notice and "pushed with up to 2 N" in notice
        raise KeyboardInterrupt

    stepped_stub.set("peak_n", 0)
    with device_like(2, {}) as (device, plan), pytest.raises(UserInterruptError):
        check_on_device(device, plan, MotionCallbacks(no, lambda done: None))
    assert stepped_stub.get("peak_n") == 0


def test_a_simulated_device_has_no_daily_check(tmp_path):
    assert main(["doctor", "--data", str(tmp_path), "--timing", "0", "--daily"]) == 2


def fine_setup(*_: object, on_progress: object) -> Examination:
    """Of a device with an accelerometer."""
    found = tuple(DeviceFinding(name, "", fine=True) for name in ("Handle", "Accelerometer"))
    timing = SimpleNamespace(findings=())
    return Examination((), DeviceReport("omega3", simulated=False, findings=found), timing)


@pytest.mark.slow
def test_from_the_acceptance_to_the_first_day_at_the_command_line(device_like, monkeypatch, tmp_path, capsys):
    """The loop in real time, the proof under force and the first checks aside, which have tests of their own."""
    state = {"seed": 1, "noise": 0.05}
    contexts = []

    def opened(plan):
        contexts.append(device_like(state["seed"], {"noise": state["noise"]}))
        return contexts[-1].__enter__()[0]  # closed by its user

    def sign(name, settings, clock, operator, baseline) -> str:
        write_acceptance(
            Acceptance("omega.3", INFO.details, operator, clock.utc()[:10], 0.5, 0.03, 1.0, 0.5, *baseline)
        )
        return "signed"

    monkeypatch.setattr(examine_setup, "examine_setup", fine_setup)
    monkeypatch.setattr(examine_setup, "require_testable_device", lambda *_: None)
    monkeypatch.setattr(examine_setup, "accept_device", sign)
    monkeypatch.setattr(daily_check, "_open_free_device", opened)
    monkeypatch.setattr(daily_check, "_read_protocol", short)
    doctor = ["doctor", "--device", "omega3", "--data", str(tmp_path), "--hands-off"]
    assert main([*doctor, "--accept", "Ada"]) == 0
    assert "No person may hold the handle" in capsys.readouterr().err
    for noise, code, word in ((0.05, 0, "fine"), (0.3, 3, "WRONG")):
        state |= {"seed": state["seed"] + 1, "noise": noise}
        monkeypatch.setattr(daily_check, "_format_time_stamp", lambda seed=state["seed"]: f"{seed}")
        assert main([*doctor, "--daily"]) == code
        shown = capsys.readouterr()
        assert "No person may hold the handle" in shown.err
        assert f"{word:<5}  Noise" in shown.out and shown.out.strip().endswith(".json")
        assert judge_last_check(INFO).fine == (code == 0)
