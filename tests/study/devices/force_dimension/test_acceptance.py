"""A device is locked for hands until an operator has signed that it lets go, and again when it changes."""

import contextlib
import json
import math
import os
import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from study.cli.main import main
from study.devices.clock import RealClock
from study.devices.force_dimension import force_limit_check, loop_cells, watchdog_check
from study.devices.force_dimension.acceptance import VALID_FOR, locate_acceptance_file
from study.devices.governor import cells
from study.devices.opening import accept_device, examine_device, open_device
from study.errors import DeviceError
from study.workflows.checks import examine_setup


@pytest.fixture
def locked(stub):
    locate_acceptance_file().unlink()
    return stub


def open_for_a_hand(rigs) -> None:
    open_device("omega3", rigs.SETTINGS, RealClock(), 1, own_process=False).close()


def refused(rigs) -> str:
    with pytest.raises(
        DeviceError, match=r"omega\.3 is locked for hands.*hapteq doctor --device omega3 --accept"
    ) as no:
        open_for_a_hand(rigs)
    return no.value.happened


def test_a_device_without_an_acceptance_record_opens_for_no_hand(locked, rigs, monkeypatch):
    assert "There is no acceptance of it" in refused(rigs)
    assert locked.safe and locked.get("opened") == 0
    locked.set("watchdog_stretch", 20)  # a busy computer may be late for the watchdog itself
    monkeypatch.setattr(watchdog_check, "MARGIN_S", 1.0)
    settings = replace(rigs.SETTINGS, hand_on_handle=False)
    with contextlib.closing(open_device("omega3", settings, RealClock(), 1, own_process=False)):
        assert locked.get("force_on")


@pytest.mark.parametrize(
    ("details", "said"),
    [
        ("serial 4243, firmware 2.41, SDK 3.17.5.0", "serial 4243"),
        ("serial 4242, firmware 2.40, SDK 3.17.5.0", "firmware 2.40"),
        ("serial 4242, firmware 2.41, SDK 3.16.1.0", "SDK 3.16.1.0"),
    ],
)
def test_another_device_firmware_or_library_voids_the_acceptance(stub, vendor, rigs, details, said):
    vendor.accept("omega.3", details=details)
    assert f"Another was accepted (omega.3, {details})" in refused(rigs) and said in details


@pytest.mark.parametrize("firmware", [math.nan, math.inf, -math.inf, -1.0, 0.0])
def test_a_firmware_that_is_no_version_opens_for_no_hand_and_is_not_accepted(stub, vendor, rigs, firmware):
    """0: answered as read, and never written. An acceptance of the same words unlocks nothing."""
    stub.set("firmware", firmware)
    vendor.accept("omega.3", details=f"serial 4242, firmware {firmware:g}, SDK 3.17.5.0")
    for opens in (
        lambda: open_for_a_hand(rigs),
        lambda: open_device("omega3", without_spring(rigs), RealClock(), 1, own_process=False).close(),
        lambda: accept_device("omega3", without_spring(rigs), RealClock(), "Ada"),
    ):
        with pytest.raises(DeviceError, match=r"omega\.3 does not report its firmware.*Switch the device off and on"):
            opens()
        assert stub.safe and (stub.get("opened"), stub.get("writes")) == (0, stub.get("closes"))
    found = next(each for each in examine_device("omega3") if each.name == "Driver")
    assert found.wrong and f"gives {firmware:g} as the version" in found.value


def test_a_serial_number_that_is_not_told_opens_for_no_hand_and_is_not_accepted(stub, vendor, rigs):
    stub.set("serial_told", 0)
    for details in ("serial 0, firmware 2.41, SDK 3.17.5.0", "serial 65535, firmware 2.41, SDK 3.17.5.0"):
        vendor.accept("omega.3", details=details)
        with pytest.raises(DeviceError, match="does not report its serial number"):
            open_for_a_hand(rigs)
    with pytest.raises(DeviceError, match="does not report its serial number"):
        accept_device("omega3", without_spring(rigs), RealClock(), "Ada")
    assert stub.safe


def test_an_acceptance_expires_and_must_not_be_dated_in_the_future(stub, vendor, rigs):
    today = datetime.now(UTC).date()
    vendor.accept("omega.3", on=(today - VALID_FOR).isoformat())
    open_for_a_hand(rigs)
    for day in (today - VALID_FOR - timedelta(days=1), today + timedelta(days=2)):
        vendor.accept("omega.3", on=day.isoformat())
        assert f"It was accepted on {day}" in refused(rigs)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "hapteq-acceptance"}', "null", "\x00", "[" * 100_000])
def test_a_file_that_is_no_acceptance_unlocks_nothing(stub, rigs, text):
    locate_acceptance_file().write_text(text)
    assert "is no acceptance" in refused(rigs)


def test_a_pipe_in_the_place_of_the_acceptance_unlocks_nothing(stub, rigs):
    locate_acceptance_file().unlink(missing_ok=True)
    os.mkfifo(locate_acceptance_file())
    assert "is no acceptance" in refused(rigs)


def without_spring(rigs):
    return replace(rigs.SETTINGS, spring_frequency_hz=0.0)


@pytest.fixture
def patient(stub, monkeypatch):
    """The firmware waits longer, since the computer of the tests is late; so does the proof."""
    stub.set("watchdog_stretch", 10)
    for module in (watchdog_check, force_limit_check):
        monkeypatch.setattr(module, "MARGIN_S", 0.7)
    monkeypatch.setattr(force_limit_check, "PAUSE_S", 2.0)
    return stub


@pytest.mark.real_time
@pytest.mark.may_be_late
def test_a_device_that_lets_go_under_force_is_accepted_and_then_opens(locked, patient, rigs):
    said = accept_device("omega3", without_spring(rigs), RealClock(), "Ada")
    assert "a force of 0.5 N was gone" in said
    document = json.loads(locate_acceptance_file().read_text())
    assert (document["operator"], document["device"], document["force_n"]) == ("Ada", "omega.3", 0.5)
    assert 0.25 < document["gone_after_s"] < 2.0
    assert (document["asked_n"], document["most_given_n"]) == (1.0, pytest.approx(0.5))
    assert 0.4 < locked.get("peak_n") <= 0.5 * (1 + 1e-9)
    assert locked.safe
    open_for_a_hand(rigs)


def cap_opened_at_each_tick(device, rig, stub) -> None:
    device._governor.settings[[cells.STIMULUS_CAP, cells.TOTAL_CAP]] = 3.0
    rig._cells[loop_cells.CAP_N] = 3.0
    stub.set("cap_works", 0)


CAPS = {
    "The cap at each tick does not hold: 1 N were commanded, and the device gave": cap_opened_at_each_tick,
    "The cap of the library does not hold: 1 N were commanded, and the device gave 1.00 N":
        lambda device, rig, stub: stub.set("cap_works", 0),
    "The cap at each tick could not be tried": lambda device, rig, stub: stub.set("gain_told", 0.1),
    "A stimulus above its cap was not refused":
        lambda device, rig, stub: setattr(device, "_limits", replace(device._limits, stimulus_cap_n=3.0)),
}  # fmt: skip


@pytest.mark.real_time
@pytest.mark.may_be_late
@pytest.mark.parametrize("said", CAPS)
def test_a_device_that_gets_more_than_its_cap_is_not_accepted(locked, patient, rigs, monkeypatch, said):
    """Each layer by itself; and one that tells of no force proves nothing."""
    prove = force_limit_check.check_cap_holds

    def broken(device, rig) -> float:
        CAPS[said](device, rig, locked)
        return prove(device, rig)

    monkeypatch.setattr(force_limit_check, "check_cap_holds", broken)
    with pytest.raises(DeviceError, match="was not accepted") as no:
        accept_device("omega3", without_spring(rigs), RealClock(), "Ada")
    assert said in no.value.happened
    assert not locate_acceptance_file().exists()
    assert locked.safe and locked.get("peak_n") <= 1.1


@pytest.mark.real_time
@pytest.mark.may_be_late
def test_a_device_that_fails_during_the_test_is_not_accepted_and_the_cause_is_named(locked, patient, rigs, monkeypatch):
    measure = force_limit_check._measure_largest_n

    def measure_then_fail(device, rig) -> float:
        largest_n = measure(device, rig)
        locked.fail("dhdSetForce", 7)
        time.sleep(0.05)
        return largest_n

    monkeypatch.setattr(force_limit_check, "_measure_largest_n", measure_then_fail)
    with pytest.raises(DeviceError, match=r"The force did not last: .* \(The library says: dhdSetForce: timeout"):
        accept_device("omega3", without_spring(rigs), RealClock(), "Ada")
    assert not locate_acceptance_file().exists()


def test_what_admission_refuses_is_never_held_with_a_hand_on_the_handle(stub, rigs):
    with contextlib.closing(open_device("omega3", rigs.SETTINGS, RealClock(), 1, own_process=False)) as device:
        with pytest.raises(DeviceError, match="A hand is on the handle"):
            device.hold_unchecked(rigs.push(0.1))
        assert stub.get("peak_n") == 0.0


@pytest.mark.real_time
def test_a_device_whose_force_stays_on_is_not_accepted(locked, patient, rigs, monkeypatch):
    """Its watchdog passes the proof at opening, and fails under force."""
    prove = force_limit_check.check_force_vanishes

    def broken(device, rig) -> float:
        locked.set("watchdog_works", 0)
        return prove(device, rig)

    monkeypatch.setattr(force_limit_check, "check_force_vanishes", broken)
    with pytest.raises(DeviceError, match="was not accepted"):
        accept_device("omega3", without_spring(rigs), RealClock(), "Ada")
    assert not locate_acceptance_file().exists()
    assert locked.safe and locked.get("peak_n") < 1.0


@pytest.mark.parametrize("arguments", [["--timing", "0"], ["--timing", "0.1"]])
def test_without_timing_or_after_a_failed_check_no_acceptance_is_written(locked, tmp_path, monkeypatch, arguments):
    if arguments[1] != "0":
        locked.set("powered", 0)
    called: list[str] = []
    monkeypatch.setattr(examine_setup, "accept_device", lambda *_: called.append("signed"))
    assert (
        main(["doctor", "--device", "omega3", "--data", str(tmp_path), "--accept", "Ada", "--hands-off", *arguments])
        == 3
    )
    assert not called and not locate_acceptance_file().exists()
    assert locked.safe


def test_a_simulated_device_needs_no_acceptance(tmp_path):
    assert main(["doctor", "--data", str(tmp_path), "--timing", "0", "--accept", "Ada"]) == 2
