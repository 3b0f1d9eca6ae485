"""Part of the acceptance: a small force is held through the safety layer, the loop stops on purpose, and the force must
be gone in time. With no hand on the handle."""

import time
from typing import Protocol

import numpy as np

from equalizer.signals.signal import Signal
from study.devices.device import Device, Fault
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


class Silenced(Protocol):
    """The driver behind the safety layer, which can be told to send nothing."""

    drops_force_after_s: float

    def withhold(self, seconds: float) -> float: ...

    def force_on(self) -> bool: ...


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
