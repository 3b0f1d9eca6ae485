"""Opening the vendor's devices by name: what works, and what is said where something is missing."""

import contextlib
import subprocess
import time
from concurrent.futures import Future
from dataclasses import replace

import pytest

from study.devices.clock import RealClock, VirtualClock
from study.devices.force_dimension import connect
from study.devices.force_dimension.device_models import MODELS
from study.devices.force_dimension.usb import UsbDevice
from study.devices.opening import REAL_DEVICES, open_device
from study.errors import DeviceError, ExitCode


@pytest.fixture
def opened(rigs):
    def opening(name: str = "omega3", hand: bool = True):
        settings = replace(rigs.SETTINGS, hand_on_handle=hand)
        return contextlib.closing(open_device(name, settings, RealClock(), seed=1, own_process=False))

    return opening


def refused(opened, name: str = "omega3", hand: bool = True) -> str:
    with pytest.raises(DeviceError) as refusal, opened(name, hand):
        pass
    assert refusal.value.exit_code is ExitCode.DEVICE
    assert refusal.value.do_now
    return str(refusal.value)


@pytest.mark.real_time
def test_an_opened_device_states_its_identity_and_closes_with_brakes_on(stub, opened, rigs):
    with opened() as device:
        assert (device.info.name, device.info.simulated, device.info.sample_rate_hz) == ("omega.3", False, 1000.0)
        assert device.info.details == "serial 4242, firmware 2.41, SDK 3.17.5.0"
        assert stub.get("cap_n") == rigs.LIMITS.total_cap_n
        assert stub.get("effector") == 0.148
        assert (stub.get("gravity"), stub.get("guard"), stub.get("watchdog")) == (1, 0, 240)
        # A busy machine lets the vendor's watchdog drop the force for a moment; the next write turns it on again.
        until_s = time.monotonic() + 5.0
        while not stub.get("force_on") and time.monotonic() < until_s:
            time.sleep(0.01)
        assert stub.get("force_on")
    assert stub.safe
    assert (stub.get("opened"), stub.get("peak_n")) == (0, 0)


@pytest.mark.parametrize(
    ("name", "system_type"),
    [("omega6", 36), ("omega7", 35), ("delta3", 63), pytest.param("sigma7", 104, marks=pytest.mark.slow)],
)
def test_the_vendor_s_other_devices_open_by_their_names(stub, vendor, opened, name, system_type):
    vendor.accept(MODELS[name].name)
    stub.set("type", system_type)
    with opened(name) as device:
        assert device.info.name.replace(".", "") == name
    assert stub.safe


def test_without_the_library_the_places_and_the_cure_are_named(stub, opened, monkeypatch, tmp_path):
    monkeypatch.setenv("FDSDK", str(tmp_path / "nowhere"))
    monkeypatch.setenv("HOME", str(tmp_path))
    said = refused(opened)
    assert "library is not installed" in said
    assert str(tmp_path / "nowhere") in said and "FDSDK" in said


@pytest.fixture
def another(tmp_path, monkeypatch, vendor):
    """A place for another library than the stub, which is loaded already."""
    monkeypatch.setenv("FDSDK", str(tmp_path / "other"))
    path = tmp_path / "other" / "lib" / vendor.FILE
    path.parent.mkdir(parents=True)
    return path


def test_a_file_that_is_no_library_is_named(another, opened):
    another.write_text("this is no library")
    assert f"cannot be loaded. {another}" in refused(opened)


def test_an_old_library_is_too_old(stub, opened):
    stub.set("sdk_minor", 9)
    assert "too old" in (said := refused(opened))
    assert "3.9.5.0" in said and "3.16.0 or newer" in said


def test_a_library_without_a_function_is_too_old(another, vendor, opened, tmp_path):
    source = tmp_path / "old.c"
    source.write_text("int dhdErrorGetLast(void) { return 0; }")
    subprocess.run([*vendor.compiler(), "-shared", "-fPIC", "-o", str(another), str(source)], check=True)
    assert "has no dhdErrorGetLastStr, dhdGetSDKVersion" in refused(opened)


@pytest.mark.parametrize(
    ("switches", "said"),
    [
        ({"devices": 0}, "No device of the vendor answers. Plug its USB cable in"),
        ({"unplugged": 1}, "No device of the vendor answers"),
        ({"type": 63}, "Found instead: delta3. Use `--device delta3`, or plug the omega.3 in"),
        (
            {"type": 999},
            "Found instead: 'another device', which hapteq does not drive. Plug the omega.3 in and switch",
        ),
        ({"in_use": 1}, "another program has it. Close the other program"),
        ({"open_fails": 2}, "cannot be opened: dhdOpenID: communication error (error 2)"),
        ({"powered": 0}, "has no power"),
        ({"calibrated": 0}, "not calibrated. It does not know where its handle is. Push the handle gently"),
        ({"force_enables": 0}, "accepts no forces"),
        ({"write_fails": 2}, "dhdSetForce: communication error"),
        ({"watchdog_works": 0}, "watchdog failed its test"),
        ({"off_by": 6}, "dead-man"),
        ({"watchdog_settable": 0}, "it has no watchdog"),
    ],
)
def test_a_failed_opening_names_the_cause_and_leaves_the_brakes_on(stub, opened, switches, said):
    for name, value in switches.items():
        stub.set(name, value)
    assert said in refused(opened)
    for name in switches:
        stub.set(name, {"devices": 1, "powered": 1}.get(name, 0))
    assert stub.safe
    assert (stub.get("opened"), stub.get("peak_n")) == (0, 0)


def test_a_device_that_hangs_while_it_is_opened_is_reported_and_closed_when_it_opens_late(stub, opened, monkeypatch):
    monkeypatch.setattr(connect, "OPENING_TIMEOUT_S", 0.2)
    stub.delay("dhdOpenID", 3.0, times=1)
    said = refused(opened)
    assert stub.get("closes") == 0
    assert "does not answer" in said and "within 0.2 s" in said and "Unplug its USB cable" in said
    until_s = time.monotonic() + 10.0
    while stub.get("closes") == 0:
        assert time.monotonic() < until_s
        time.sleep(0.05)
    assert stub.safe and stub.get("opened") == 0


@pytest.mark.parametrize("reason", [TimeoutError, KeyboardInterrupt])
def test_a_device_that_opens_in_the_moment_in_which_the_wait_ends_is_closed(stub, opened, monkeypatch, reason):
    class EndedLate(Future):
        def result(self, timeout=None):
            number = super().result()
            if timeout is None:
                return number
            raise reason

    monkeypatch.setattr(connect, "Future", EndedLate)
    with pytest.raises(DeviceError if reason is TimeoutError else reason), opened():
        pass
    assert (stub.get("opened"), stub.get("closes")) == (0, 1)


def test_a_library_that_crashes_while_it_opens_a_device_is_not_said_to_hang(stub, opened, monkeypatch):
    def crash(library, name, *arguments):
        raise OSError("exception: access violation reading 0x0000000000000000")

    monkeypatch.setattr(connect.Library, "call", crash)
    with pytest.raises(OSError, match="access violation"), opened():
        pass


def test_without_a_watchdog_it_opens_where_no_hand_is_on_the_handle(stub, opened):
    stub.set("watchdog_settable", 0)
    with opened(hand=False) as device:
        until_s = time.monotonic() + 5.0
        while device.look().position_m is None and time.monotonic() < until_s:
            time.sleep(0.005)
        assert device.look().position_m is not None
    assert stub.safe


def test_a_device_that_this_account_may_not_open_looks_as_if_it_were_not_there(stub, opened, monkeypatch):
    stub.set("devices", 0)
    monkeypatch.setattr(connect, "find_usb_devices", lambda: (UsbDevice("omega.3", may_open=False),))
    said = refused(opened)
    assert "this account may not open it" in said and "udev" in said and '"1451"' in said


def test_settings_that_are_not_safe_close_it_again(stub, rigs):
    settings = replace(rigs.SETTINGS, limits=replace(rigs.LIMITS, stimulus_cap_n=3.5))
    with pytest.raises(DeviceError, match="limits are not safe"):
        open_device("omega3", settings, RealClock(), seed=1, own_process=False)
    assert stub.safe
    assert stub.get("opened") == 0


@pytest.mark.parametrize("name", REAL_DEVICES)
def test_real_devices_are_not_played_in_virtual_time(stub, rigs, name):
    with pytest.raises(DeviceError, match="needs real time"):
        open_device(name, rigs.SETTINGS, VirtualClock(), seed=1)
    assert stub.get("opened") == 0


def test_what_a_lab_knows_of_its_device_is_taken_from_its_file(stub, opened, tmp_path, monkeypatch):
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "device.toml"))
    (tmp_path / "device.toml").write_text("effector_mass_kg = 0.16\neffective_mass_kg = 0.3\n")
    with opened() as device:
        assert (stub.get("effector"), device.info.effective_mass_kg) == (0.16, 0.3)


@pytest.mark.parametrize(
    ("text", "said"),
    [("effector_mass_kg = -1", "effector_mass_kg"), ("colour = 'red'", "colour"), ("nonsense", "device.toml")],
)
def test_a_file_of_the_lab_that_is_wrong_is_named(stub, opened, tmp_path, monkeypatch, text, said):
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "device.toml"))
    (tmp_path / "device.toml").write_text(text)
    assert said in refused(opened)
    assert stub.get("opened") == 0
