"""Acceptance test of the force limit of a real device, with no hand on the handle. Called by
`study.devices.opening.accept_device`.

1. A stimulus above the cap must be refused. Then more than the cap is commanded, first through the safety layer's
   ticks, then directly through the vendor's library: the device must report no force above the cap, but for 5 %
   (`check_cap_holds`).
2. A small constant force is held, and its commands stop on purpose. The device's watchdog must switch it off in time
   (`check_force_vanishes`).
"""

import time
from typing import Protocol

import numpy as np

from equalizer.signals.signal import Signal
from study.devices.device import Device, DeviceInfo, Fault, Health, PlaybackResult
from study.devices.force_dimension.watchdog_check import MARGIN_S
from study.errors import DeviceError
from study.session.stimulus.held_stimulus import HeldStimulus

TEST_FORCE_N = 0.5
"""Force held in part 2, and cap in part 1 (N): above the friction of such devices, a sixth of the strongest stimulus
(3 N)."""
HOLD_DURATION_S, FADE_S, POLL_INTERVAL_S = 0.12, 0.05, 0.002
"""Duration of the constant force, of the fades of all test forces, and interval of polling the device (s). Short,
because without the virtual spring the handle moves by some 15 mm until the device brakes."""
MIN_COMMANDED_SHARE = 0.8
"""Share of `TEST_FORCE_N` that the device must have reported (part 1) or the loop commanded (part 2) for the test to be
valid: the damper subtracts some."""
PAUSE_S = 0.2
"""Pause in the commands in part 2 (s); a zero force is sent at its end."""

COMMAND_TO_CAP_RATIO = 2.0
"""Ratio of the commanded force to the cap (`TEST_FORCE_N`) in part 1: small, so that the force is harmless if the cap
fails."""
OSCILLATION_HZ, OSCILLATION_DURATION_S = 12.5, 0.24
"""Frequency (Hz) and duration (s) of the command in part 1: three periods. A free handle moves by less than 1 mm and
ends at rest."""
MAX_REPORTED_TO_CAP_RATIO = 1.05
"""Largest accepted ratio of the reported force to the cap: motor currents are quantized."""


class CappedDevice(Protocol):
    """The methods of `study.devices.safe.SafeDevice` that part 1 uses."""

    @property
    def info(self) -> DeviceInfo: ...

    def hold(self, stimulus: HeldStimulus) -> None: ...

    def hold_unchecked(self, stimulus: HeldStimulus) -> None:
        """Hold a stimulus without the check of `admission`, see `SafeDevice.hold_unchecked`. The other methods are
        those of `study.devices.device.Device`."""
        ...

    def keep_alive(self) -> None: ...

    def health(self) -> Health: ...

    def release(self) -> PlaybackResult: ...


class ForceReporting(Protocol):
    """A driver that reads the force that the device reports."""

    def read_reported_n(self) -> float:
        """Norm of the horizontal force (N) that the device reports at this moment."""
        ...

    def read_reported_without_cap_n(self, asked_n: float) -> float:
        """Norm of the horizontal force (N) that the device reports when `asked_n` is commanded without the driver's own
        cap, so that only the cap of the vendor's library acts."""
        ...


class CommandPausing(Protocol):
    """A driver that can stop sending commands on purpose, so that the device's watchdog has to act."""

    drops_force_after_s: float
    """Timeout of the device's watchdog (s)."""

    def withhold(self, seconds: float) -> float:
        """Send no commands for this time (s). Returns the time of the last command (s, monotonic clock)."""
        ...

    def is_force_on(self) -> bool:
        """Whether the device reports that its forces are on."""
        ...


REQUIRED_METHODS = ("read_reported_n", "read_reported_without_cap_n", "withhold", "is_force_on")
"""Methods of `ForceReporting` and `CommandPausing`."""


def require_testable(rig: object) -> None:
    """Raise `DeviceError` for a driver without the methods that this test needs, such as a laboratory's own driver."""
    missing_methods = [name for name in REQUIRED_METHODS if not hasattr(rig, name)]
    if missing_methods:
        raise DeviceError(
            "The device was not accepted",
            f"Its force limit cannot be tested: its driver has no {', '.join(missing_methods)}.",
            "Write these methods, as `ForceReporting` and `CommandPausing` of "
            "study/devices/force_dimension/force_limit_check.py define them. Until then no hand may hold the device.",
        )


def check_cap_holds(device: CappedDevice, rig: ForceReporting) -> float:
    """Part 1: command more than the cap of each layer in turn. Returns the largest force that the device reported (N).
    device: opened without a spring and with caps of TEST_FORCE_N. Raises `DeviceError` where the stimulus was not
    refused, the cap was exceeded, or the force was too small or ended too early for the test to be valid."""
    oscillation = _make_oscillation(device.info.sample_rate_hz)
    try:
        device.hold(oscillation)
    except DeviceError:
        pass
    else:
        device.release()
        raise _make_acceptance_error("A stimulus above its cap was not refused.")
    device.hold_unchecked(oscillation)
    tick_capped_n = _measure_largest_n(device, rig)
    device.release()
    _check_reported_force("at each tick", tick_capped_n)
    _require_lasting_force(device.health())
    library_capped_n = rig.read_reported_without_cap_n(COMMAND_TO_CAP_RATIO * TEST_FORCE_N)
    _check_reported_force("of the library", library_capped_n)
    return max(tick_capped_n, library_capped_n)


def _measure_largest_n(device: CappedDevice, rig: ForceReporting) -> float:
    """The largest force (N) that the device reports during `OSCILLATION_DURATION_S`."""
    largest_n, end_s = 0.0, time.monotonic() + OSCILLATION_DURATION_S
    while time.monotonic() < end_s:
        largest_n = max(largest_n, rig.read_reported_n())
        device.keep_alive()
        time.sleep(POLL_INTERVAL_S)
    return largest_n


def _check_reported_force(cap_name: str, reported_n: float) -> None:
    """Raise `DeviceError` unless the reported force (N) is within the cap and large enough for a valid test; NaN is
    refused. cap_name: the cap that was tested, for the message."""
    result_text = f"{COMMAND_TO_CAP_RATIO * TEST_FORCE_N:g} N were commanded, and the device gave {reported_n:.2f} N"
    if not reported_n <= MAX_REPORTED_TO_CAP_RATIO * TEST_FORCE_N:
        raise _make_acceptance_error(
            f"The cap {cap_name} does not hold: {result_text}, where {TEST_FORCE_N:g} N are allowed."
        )
    if reported_n < MIN_COMMANDED_SHARE * TEST_FORCE_N:
        raise _make_acceptance_error(f"The cap {cap_name} could not be tried: {result_text}.")


def _require_lasting_force(health: Health) -> None:
    """Raise `DeviceError` with the cause where a fault ended the test force."""
    if health.fault is not Fault.NONE:
        cause = f" ({health.why})" if health.why else ""
        raise _make_acceptance_error(f"The force did not last: {health.fault.value}{cause}.")


def check_force_vanishes(device: Device, rig: CommandPausing) -> float:
    """Part 2: stop the commands while a force is held. Returns the time (s) after which the device reported its forces
    as off. device: opened without a spring; its loop counts as failed afterwards, so that it must be closed. Raises
    `DeviceError` where the force remained, or was too small or off before the commands stopped."""
    device.hold(_make_constant_force(device.info.sample_rate_hz))
    _keep_alive_for(device, HOLD_DURATION_S)
    health = device.health()
    _require_lasting_force(health)
    if not rig.is_force_on():
        raise _make_acceptance_error("The force did not last: the device reports its forces as off.")
    if health.peak_command_n < MIN_COMMANDED_SHARE * TEST_FORCE_N:
        raise _make_acceptance_error(f"The force only reached {health.peak_command_n:.2f} N.")
    silent_since_s = rig.withhold(PAUSE_S)
    limit_s = rig.drops_force_after_s + MARGIN_S
    while rig.is_force_on():
        if time.monotonic() - silent_since_s > limit_s and rig.is_force_on():
            rig.withhold(0.0)
            device.stop()
            raise _make_acceptance_error(f"The force was still there {1000 * limit_s:.0f} ms after the last command.")
        time.sleep(POLL_INTERVAL_S)
    force_off_after_s = time.monotonic() - silent_since_s
    device.release()
    return force_off_after_s


def _make_constant_force(rate_hz: float) -> HeldStimulus:
    """A constant force of `TEST_FORCE_N` along x, towards the operator, a loop of 0.05 s. rate_hz: sample
    rate of the device (Hz)."""
    samples = np.tile([[TEST_FORCE_N, 0.0, 0.0]], (round(0.05 * rate_hz), 1))
    return HeldStimulus(Signal(samples, rate_hz, "force", "N", ("fx", "fy", "fz")), FADE_S, FADE_S, "linear")


def _make_oscillation(rate_hz: float) -> HeldStimulus:
    """A sinusoidal force along x, with `COMMAND_TO_CAP_RATIO` times the cap as amplitude. rate_hz: rate of
    the device (Hz)."""
    phase = 2 * np.pi * np.arange(round(rate_hz / OSCILLATION_HZ)) * OSCILLATION_HZ / rate_hz
    samples = COMMAND_TO_CAP_RATIO * TEST_FORCE_N * np.sin(phase)[:, None] * [1.0, 0.0, 0.0]
    return HeldStimulus(Signal(samples, rate_hz, "force", "N", ("fx", "fy", "fz")), FADE_S, FADE_S, "linear")


def _keep_alive_for(device: Device, duration_s: float) -> None:
    """Restart the safety layer's watchdog every 20 ms for this time (s), so that the force is not faded out; its
    timeout is several times longer."""
    end_s = time.monotonic() + duration_s
    while time.monotonic() < end_s:
        time.sleep(0.02)
        device.keep_alive()


def _make_acceptance_error(reason: str) -> DeviceError:
    """Error for a device that failed the test. reason: a sentence."""
    return DeviceError(
        "The device was not accepted",
        reason,
        "Do not let a person hold the handle. Check power and cable, close other programs, and try again.",
    )
