"""The one door to a device: whatever comes out of it stands behind the safety layer.

The heavy parts (numba above all) are imported when a device is opened, so that the command line starts at once.
"""

from typing import TYPE_CHECKING

from study.devices.clock import Clock
from study.devices.device import Device, DeviceSettings
from study.errors import DeviceError

if TYPE_CHECKING:
    from study.devices.rig import CompiledRig

SIMULATED = "simulated"

DEVICES = (SIMULATED,)


def open_device(name: str, settings: DeviceSettings, clock: Clock, seed: int) -> Device:
    """`seed` drives what is random in a simulated device. Raises `DeviceError`."""
    if name not in DEVICES:
        raise DeviceError(
            f"There is no device called {name!r}",
            "This version has no driver for a real device yet: it opens a simulated omega.3 only.",
            f"Use --device {SIMULATED}.",
        )
    from study.devices.safe import SafeDevice

    return SafeDevice(_simulated(settings, seed), settings, clock)


def _simulated(settings: DeviceSettings, seed: int) -> "CompiledRig":
    from study.devices.simulated.omega3 import build_omega3

    try:
        return build_omega3(seed=seed, hand=settings.hand_on_handle, place_m=settings.place_m)
    except ValueError as error:
        raise DeviceError(
            "The simulated device cannot be opened", f"It refused its settings: {error}.", "Choose another place."
        ) from error
