"""Acceptance test of the force limit, with no hand on the handle.

1. More than the cap is commanded, at each tick and of the vendor's library. The device must report no more than it.
2. A small force is held, and the loop stops on purpose. The device's watchdog must switch the force off in time.
"""

import time
from typing import Protocol

import numpy as np

from equalizer.signals.signal import Signal
from study.devices.device import Device, DeviceInfo, Fault, Played
from study.devices.force_dimension.watchdog_check import MARGIN_S
from study.errors import DeviceError
from study.session.stimulus.held_stimulus import HeldStimulus

FORCE_N = 0.5
"""Force held, and cap, of the test: above the friction of such devices, a sixth of the strongest stimulus (3 N)."""
HELD_S, FADE_S, EVERY_S = 0.12, 0.05, 0.002
"""Duration of the push, of its fades, and interval of polling. Short: without spring and friction the handle moves by
some 15 mm until the device brakes."""
LEAST_SHARE = 0.8
"""Share of `FORCE_N` that must have been commanded for the test to be valid: the damper subtracts some."""
PAUSE_S = 0.2
"""Pause in the commands; a zero force is sent at its end."""

COMMANDED_TO_CAP = 2.0
"""Commanded force over the cap (`FORCE_N`) in part 1: what a failing cap lets through is still small."""
SHAKEN_HZ, SHAKEN_S = 12.5, 0.24
"""Frequency and duration of that command. Three periods: a free handle moves by less than 1 mm and ends at rest."""
ALLOWED_TO_CAP = 1.05
"""Reported force over the cap that is accepted: motor currents are quantized."""


class CappedDevice(Protocol):
    """The safety layer, as far as part 1 needs it."""

    @property
    def info(self) -> DeviceInfo: ...

    def hold(self, stimulus: HeldStimulus) -> None: ...

    def hold_unchecked(self, stimulus: HeldStimulus) -> None:
        """Hold a stimulus without the check of admission: see `study.devices.safe.SafeDevice.hold_unchecked`. The other
        methods are those of `study.devices.device.Device`."""
        ...

    def keep_alive(self) -> None: ...

    def fault(self) -> Fault: ...

    def release(self) -> Played: ...


class ForceReporting(Protocol):
    """A driver that reports the force that the device gives."""

    def given_n(self) -> float:
        """Norm of the force that the device gives now (N)."""
        ...

    def given_past_this_n(self, asked_n: float) -> float:
        """Norm of the force (N) that the device gives when `asked_n` is commanded past the driver's own cap: that of
        the vendor's library alone is tested."""
        ...


class CommandPausing(Protocol):
    """A driver that can stop sending commands on purpose, so that the device's watchdog has to act."""

    drops_force_after_s: float
    """Timeout of the device's watchdog (s)."""

    def withhold(self, seconds: float) -> float:
        """Send nothing for so long. Returns the monotonic time of the last command (s)."""
        ...

    def force_on(self) -> bool:
        """Whether the device says that it gives forces."""
        ...


REQUIRED_METHODS = ("given_n", "given_past_this_n", "withhold", "force_on")
"""Methods of `ForceReporting` and `CommandPausing`."""


def require_testable(rig: object) -> None:
    """Raises `DeviceError` for a driver without the methods that this test needs, as a laboratory's own may be."""
    missing = [name for name in REQUIRED_METHODS if not hasattr(rig, name)]
    if missing:
        raise DeviceError(
            "The device was not accepted",
            f"Its force limit cannot be tested: its driver has no {', '.join(missing)}.",
            "Write these methods, as `ForceReporting` and `CommandPausing` of "
            "study/devices/force_dimension/force_limit_check.py define them. Until then no hand may hold the device.",
        )


def check_cap_holds(device: CappedDevice, rig: ForceReporting) -> float:
    """Part 1: the largest force that the device reported (N) while each layer in turn was commanded more than the cap.

    device: opened without a spring and with caps of FORCE_N. Raises `DeviceError` where more was given, or where too
    little was given for the test to be valid.
    """
    shaking = _oscillation(device.info.sample_rate_hz)
    try:
        device.hold(shaking)
    except DeviceError:
        pass
    else:
        device.release()
        raise _not_accepted_error("A stimulus above its cap was not refused.")
    device.hold_unchecked(shaking)
    of_ticks_n = _largest_given_n(device, rig)
    device.release()
    _check_given("at each tick", of_ticks_n)
    if device.fault() is not Fault.NONE:
        raise _not_accepted_error(f"The force did not last: {device.fault().value}.")
    of_library_n = rig.given_past_this_n(COMMANDED_TO_CAP * FORCE_N)
    _check_given("of the library", of_library_n)
    return max(of_ticks_n, of_library_n)


def _largest_given_n(device: CappedDevice, rig: ForceReporting) -> float:
    """The largest force that the device reports during `SHAKEN_S`."""
    most_n, until_s = 0.0, time.monotonic() + SHAKEN_S
    while time.monotonic() < until_s:
        most_n = max(most_n, rig.given_n())
        device.keep_alive()
        time.sleep(EVERY_S)
    return most_n


def _check_given(which: str, given_n: float) -> None:
    """Raise unless the given force is within the cap and large enough for a valid test."""
    asked = f"{COMMANDED_TO_CAP * FORCE_N:g} N were asked for, and the device gave {given_n:.2f} N"
    if not given_n <= ALLOWED_TO_CAP * FORCE_N:
        raise _not_accepted_error(f"The cap {which} does not hold: {asked}, where {FORCE_N:g} N are allowed.")
    if given_n < LEAST_SHARE * FORCE_N:
        raise _not_accepted_error(f"The cap {which} could not be tried: {asked}.")


def check_force_vanishes(device: Device, rig: CommandPausing) -> float:
    """Part 2: time without commands after which the device was found without force (s). device: opened without a
    spring; its loop counts as failed afterwards, so that it must be closed.

    Raises `DeviceError` where the force stayed, or where there was none to begin with.
    """
    device.hold(_push(device.info.sample_rate_hz))
    _keep_alive_for(device, HELD_S)
    if device.fault() is not Fault.NONE or not rig.force_on():
        raise _not_accepted_error(f"The force did not last: {device.fault().value}.")
    if device.health().peak_command_n < LEAST_SHARE * FORCE_N:
        raise _not_accepted_error(f"The force only reached {device.health().peak_command_n:.2f} N.")
    silent_since_s = rig.withhold(PAUSE_S)
    limit_s = rig.drops_force_after_s + MARGIN_S
    while rig.force_on():
        if time.monotonic() - silent_since_s > limit_s and rig.force_on():
            rig.withhold(0.0)
            device.stop()
            raise _not_accepted_error(f"The force was still there {1000 * limit_s:.0f} ms after the last command.")
        time.sleep(EVERY_S)
    gone_after_s = time.monotonic() - silent_since_s
    device.release()
    return gone_after_s


def _push(rate_hz: float) -> HeldStimulus:
    """A constant force along x, towards the operator."""
    samples = np.tile([[FORCE_N, 0.0, 0.0]], (round(0.05 * rate_hz), 1))
    return HeldStimulus(Signal(samples, rate_hz, "force", "N", ("fx", "fy", "fz")), FADE_S, FADE_S, "linear")


def _oscillation(rate_hz: float) -> HeldStimulus:
    """A sinusoidal force along x, stronger than the cap."""
    phase = 2 * np.pi * np.arange(round(rate_hz / SHAKEN_HZ)) * SHAKEN_HZ / rate_hz
    samples = COMMANDED_TO_CAP * FORCE_N * np.sin(phase)[:, None] * [1.0, 0.0, 0.0]
    return HeldStimulus(Signal(samples, rate_hz, "force", "N", ("fx", "fy", "fz")), FADE_S, FADE_S, "linear")


def _keep_alive_for(device: Device, seconds: float) -> None:
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        time.sleep(0.02)
        device.keep_alive()


def _not_accepted_error(happened: str) -> DeviceError:
    return DeviceError(
        "The device was not accepted",
        happened,
        "Do not let a person hold the handle. Check power and cable, close other programs, and try again.",
    )
