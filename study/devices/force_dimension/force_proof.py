"""Proof of the force limit, a part of the acceptance with no hand on the handle: more than the cap is requested, and
the device must report no more than the cap; then a small force is held, the loop stops on purpose, and the force must
vanish in time."""

import time
from typing import Protocol

import numpy as np

from equalizer.signals.signal import Signal
from study.devices.device import Device, DeviceInfo, Fault, Played
from study.devices.force_dimension.watchdog_proof import MARGIN_S
from study.errors import DeviceError
from study.session.stimulus.held_stimulus import HeldStimulus

FORCE_N = 0.5
"""Above the friction of such devices, and a sixth of what a participant gets."""
HELD_S, FADE_S, EVERY_S = 0.12, 0.05, 0.002
"""Short: without spring and friction the handle moves by some 15 mm until the device brakes."""
REACHED = 0.8
"""Share of `FORCE_N` that must have been commanded in total: the damper subtracts some."""
WITHHELD_S = 0.2
"""Then the zero is sent even so."""

ASKED_SHARE = 2.0
"""Times the cap, FORCE_N here, that are asked for: what a cap that does not work lets through is still small."""
SHAKEN_HZ, SHAKEN_S = 12.5, 0.24
"""To and fro, three times: a free handle moves by less than 1 mm, and stands still at the end."""
EXACT = 1.05
"""Times the cap that the device may say: its motors have steps."""


class Capped(Protocol):
    """The safety layer itself."""

    @property
    def info(self) -> DeviceInfo: ...

    def hold(self, stimulus: HeldStimulus) -> None: ...

    def hold_unchecked(self, stimulus: HeldStimulus) -> None: ...

    def keep_alive(self) -> None: ...

    def fault(self) -> Fault: ...

    def release(self) -> Played: ...


class Telling(Protocol):
    """The driver behind the safety layer, which knows what the device gives."""

    def given_n(self) -> float: ...

    def given_past_this_n(self, asked_n: float) -> float: ...


class Silenced(Protocol):
    """The driver behind the safety layer, which can be told to send nothing."""

    drops_force_after_s: float

    def withhold(self, seconds: float) -> float: ...

    def force_on(self) -> bool: ...


SHOWN = ("given_n", "given_past_this_n", "withhold", "force_on")
"""Of `Telling` and `Silenced`."""


def check_provable(rig: object) -> None:
    """Raises `DeviceError` for a driver that cannot show what an acceptance signs: a lab's own may be without."""
    missing = [name for name in SHOWN if not hasattr(rig, name)]
    if missing:
        raise DeviceError(
            "The device was not accepted",
            f"Its driver cannot show that the force goes and stays within its cap: it has no {', '.join(missing)}.",
            "Write these methods as `Telling` and `Silenced` of study/devices/force_dimension/force_proof.py ask for "
            "them. Until then no hand may hold the device.",
        )


def prove_cap_holds(device: Capped, rig: Telling) -> float:
    """The most that the device said it gave, N, when `ASKED_SHARE` times FORCE_N were asked of each layer in turn.

    device: opened without a spring and with caps of FORCE_N. Raises `DeviceError` where more came, or where so little
    came that nothing is proved.
    """
    shaking = _shaking(device.info.sample_rate_hz)
    try:
        device.hold(shaking)
    except DeviceError:
        pass
    else:
        device.release()
        raise _not_accepted_error("A stimulus above its cap was not refused.")
    device.hold_unchecked(shaking)
    of_ticks_n = _most_given_n(device, rig)
    device.release()
    _check_given("at each tick", of_ticks_n)
    if device.fault() is not Fault.NONE:
        raise _not_accepted_error(f"The force did not last: {device.fault().value}.")
    of_library_n = rig.given_past_this_n(ASKED_SHARE * FORCE_N)
    _check_given("of the library", of_library_n)
    return max(of_ticks_n, of_library_n)


def _most_given_n(device: Capped, rig: Telling) -> float:
    most_n, until_s = 0.0, time.monotonic() + SHAKEN_S
    while time.monotonic() < until_s:
        most_n = max(most_n, rig.given_n())
        device.keep_alive()
        time.sleep(EVERY_S)
    return most_n


def _check_given(which: str, given_n: float) -> None:
    asked = f"{ASKED_SHARE * FORCE_N:g} N were asked for, and the device gave {given_n:.2f} N"
    if not given_n <= EXACT * FORCE_N:
        raise _not_accepted_error(f"The cap {which} does not hold: {asked}, where {FORCE_N:g} N are allowed.")
    if given_n < REACHED * FORCE_N:
        raise _not_accepted_error(f"The cap {which} could not be tried: {asked}.")


def prove_force_goes(device: Device, rig: Silenced) -> float:
    """After how many seconds without commands the device was found without force. device: opened without a spring.

    It is lost after, as it must be: it is to be closed. Raises `DeviceError` where the force stayed, or never came.
    """
    device.hold(_push(device.info.sample_rate_hz))
    _attend(device, HELD_S)
    if device.fault() is not Fault.NONE or not rig.force_on():
        raise _not_accepted_error(f"The force did not last: {device.fault().value}.")
    if device.health().peak_command_n < REACHED * FORCE_N:
        raise _not_accepted_error(f"The force only reached {device.health().peak_command_n:.2f} N.")
    silent_since_s = rig.withhold(WITHHELD_S)
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
    """Along x, towards the operator."""
    samples = np.tile([[FORCE_N, 0.0, 0.0]], (round(0.05 * rate_hz), 1))
    return HeldStimulus(Signal(samples, rate_hz, "force", "N", ("fx", "fy", "fz")), FADE_S, FADE_S, "linear")


def _shaking(rate_hz: float) -> HeldStimulus:
    """Along x, too strong."""
    phase = 2 * np.pi * np.arange(round(rate_hz / SHAKEN_HZ)) * SHAKEN_HZ / rate_hz
    samples = ASKED_SHARE * FORCE_N * np.sin(phase)[:, None] * [1.0, 0.0, 0.0]
    return HeldStimulus(Signal(samples, rate_hz, "force", "N", ("fx", "fy", "fz")), FADE_S, FADE_S, "linear")


def _attend(device: Device, seconds: float) -> None:
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
