"""The safe device as its callers see it: what is refused, interrupted, closed or lost."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.signal import Signal
from study.devices.device import Fault
from study.devices.safe import SafeDevice
from study.errors import DeviceError, ExitCode
from tests.study.devices.safe.feeling import feel


def test_an_interruption_while_playing_lets_go_and_is_passed_on(device, rigs, rig):
    def interrupt(share: float) -> None:
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        device.play(rigs.force(np.tile(rigs.sine(2.0).loop.samples, (10, 1))), interrupt)
    assert not rigs.written(rig)[-1].any()
    assert rigs.violations(rigs.written(rig), rigs.LIMITS) == []
    assert device.play(rigs.force(np.zeros((10, 3)))).recording is not None


def test_an_interruption_in_the_middle_of_a_tick_turns_the_force_off(rigs, clock):
    rig = rigs.ScriptedRig()
    device = SafeDevice(rig, rigs.SETTINGS, clock)
    device.hold(rigs.sine(2.0))
    feel(device, clock, 0.25)

    def interrupt() -> None:
        raise KeyboardInterrupt

    rig.instead_of_sensing = interrupt
    with pytest.raises(KeyboardInterrupt):
        clock.sleep(0.1)
    assert not rigs.written(rig.mass)[-1].any()
    assert device.fault() is Fault.STALLED
    device.close()


REFUSED = {
    "made for 500 Hz": lambda s: replace(s, loop=replace(s.loop, sample_rate_hz=500.0)),
    r"shape \(200, 2\)": lambda s: replace(s, loop=Signal(s.loop.samples[:, :2], 1000.0, "force", "N", ("fx", "fy"))),
    r"shape \(0, 3\)": lambda s: replace(s, loop=s.loop.select_samples(0, 0)),
    "acceleration in m/s": lambda s: replace(s, loop=replace(s.loop, quantity="acceleration", unit="m/s^2")),
    "not numbers": lambda s: replace(s, loop=replace(s.loop, samples=s.loop.samples + np.nan)),
    "cap of the stimulus is 3 N": lambda s: replace(s, loop=replace(s.loop, samples=s.loop.samples * 3.01)),
    "slew limit is 1500 N/s": lambda s: replace(s, loop=replace(s.loop, samples=s.loop.samples[:150])),
    "cap of the stimulus": lambda s: replace(s, onset=replace(s.loop, samples=s.loop.samples * 3.01)),
    "limit is 1500 N/s": lambda s: replace(s, onset=replace(s.loop, samples=s.loop.samples * 0.0 + 1.6)),
    "changes by 2771 N/s": lambda s: replace(
        s, loop=replace(s.loop, samples=s.loop.samples * 0.0 + 1.6), fade_in_s=1e-4, fade_out_s=1e-4
    ),
    "because it changes by 2771 N/s": lambda s: replace(  # a fade of one tick is none
        s, loop=replace(s.loop, samples=s.loop.samples * 0.0 + 1.6), fade_in_s=1e-3
    ),
    "fade_in_s is nan": lambda s: replace(s, fade_in_s=float("nan")),
    "fade_out_s is -1": lambda s: replace(s, fade_out_s=-1.0),
    "fade shape is 'square'": lambda s: replace(s, fade_shape="square"),
}


@pytest.mark.parametrize("why", REFUSED)
def test_a_stimulus_beyond_the_limits_is_refused_before_anything_moves(device, clock, rigs, rig, why):
    steep = rigs.sine(1.0)
    if "slew" in why:
        steep = replace(steep, loop=replace(steep.loop, samples=steep.loop.samples * 2))
    with pytest.raises(DeviceError, match=why) as refusal:
        device.hold(REFUSED[why](steep))
    assert "Nothing has moved" in str(refusal.value)
    feel(device, clock, 0.2)
    assert len(rigs.written(rig)) == 0


def test_commands_that_start_with_a_jump_are_refused(device, rigs):
    with pytest.raises(DeviceError, match="slew limit"):
        device.play(rigs.force(np.full((100, 3), 1.5)))


def test_a_second_hold_before_a_release_is_refused(device, rigs):
    device.hold(rigs.sine())
    with pytest.raises(DeviceError, match="still playing"):
        device.hold(rigs.sine())


def test_a_release_of_nothing_is_refused(device):
    with pytest.raises(DeviceError, match="Nothing is held"):
        device.release()


def test_a_stopped_device_plays_nothing_until_it_is_opened_again(device, clock, rigs, rig):
    device.hold(rigs.sine(3.0))
    feel(device, clock, 0.5)
    device.stop()
    assert device.fault() is Fault.STOPPED
    assert device.release().health.fault is Fault.STOPPED
    assert not rigs.written(rig)[501:].any()
    with pytest.raises(DeviceError, match="emergency stop"):
        device.hold(rigs.sine())
    with pytest.raises(DeviceError, match="emergency stop"):
        device.play(rigs.sine().loop)


def test_a_closed_device_plays_nothing_and_may_be_closed_twice(device, rigs):
    device.close()
    device.close()
    with pytest.raises(DeviceError, match="is closed"):
        device.hold(rigs.sine())


def test_closing_lets_go_first(device, clock, rigs, rig):
    device.hold(rigs.sine(3.0))
    feel(device, clock, 0.5)
    device.close()
    assert not rigs.written(rig)[-1].any()
    assert rigs.violations(rigs.written(rig), rigs.LIMITS) == []


@pytest.mark.parametrize(
    ("where", "fault", "advice"),
    [
        ("instead_of_sensing", Fault.LOST, r"Its force is off\. Check its power and its cable"),
        ("instead_of_writing", Fault.FORCE_LEFT, r"may still be on\. Let go of the handle and switch the device off"),
    ],
)
def test_a_rig_that_fails_is_lost_and_the_next_call_says_what_to_do(rigs, clock, where, fault, advice):
    def fail() -> None:
        raise OSError("cable pulled")

    rig = rigs.ScriptedRig()
    device = SafeDevice(rig, rigs.SETTINGS, clock)
    device.hold(rigs.sine(2.0))
    feel(device, clock, 0.4)
    setattr(rig, where, fail)
    feel(device, clock, 0.4)
    assert device.fault() is fault
    assert device.release().health.fault is fault
    with pytest.raises(DeviceError, match=rf"lost.*cable pulled.*{advice}"):
        device.hold(rigs.sine())
    device.close()
    assert rig.closed


@pytest.mark.parametrize("declared_s", [0.0, -1.0, 1.5, float("inf"), float("nan")])
def test_a_real_device_that_holds_its_force_for_ever_is_not_given_into_a_hand(rigs, clock, declared_s):
    rig = rigs.ScriptedRig()
    rig.drops_force_after_s = declared_s
    with pytest.raises(DeviceError, match=r"it has no watchdog.*drops_force_after_s is .*without a hand") as refusal:
        SafeDevice(rig, rigs.SETTINGS, clock)
    assert refusal.value.exit_code is ExitCode.DEVICE
    SafeDevice(rig, replace(rigs.SETTINGS, hand_on_handle=False), clock).close()


def test_a_simulated_world_needs_no_watchdog_in_its_hardware(rigs, clock):
    class Simulated(rigs.HeldForceRig):
        info = rigs.INFO

    rig = Simulated()
    rig.drops_force_after_s = 0.0
    SafeDevice(rig, rigs.SETTINGS, clock).close()


def test_a_reading_of_the_wrong_shape_counts_as_a_lost_device(rigs, clock):
    rig = rigs.ScriptedRig()
    device = SafeDevice(rig, rigs.SETTINGS, clock)
    rig.instead_of_sensing = lambda: np.zeros(4)
    with pytest.raises(DeviceError, match="shape"):
        device.play(rigs.sine().loop)
    device.close()


@pytest.mark.parametrize("way", ["hold", "play"])
def test_a_stimulus_whose_preparation_fails_never_begins_and_the_next_one_does(rigs, clock, way):
    wrong: list[BaseException] = [ValueError("no such stretch"), KeyboardInterrupt()]

    def prepare(rows, repeats, wait) -> None:
        if wrong:
            raise wrong.pop(0)

    rig = replace(rigs.compiled_rig(), prepare=prepare)
    with contextlib.closing(SafeDevice(rig, rigs.SETTINGS, clock)) as device:
        given = rigs.sine(2.0) if way == "hold" else rigs.sine(2.0).loop
        for kind in (ValueError, KeyboardInterrupt):
            with pytest.raises(kind):
                getattr(device, way)(given)
            clock.sleep(1.0)
            assert device.fault() is Fault.NONE and not rigs.written(rig).any()
        device.hold(rigs.sine(2.0))
        feel(device, clock, 0.5)
        assert device.release().health.ticks > 400 and rigs.written(rig).any()
