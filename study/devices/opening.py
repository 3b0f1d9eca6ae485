"""The one door to a device: whatever comes out of it stands behind the safety layer.

The heavy parts (numba above all) are imported when a device is opened, so that the command line starts at once.
"""

from study.devices.clock import Clock
from study.devices.device import Device, DeviceSettings
from study.errors import DeviceError

SIMULATED = "simulated"

DEVICES = (SIMULATED,)
"""What a study or a recording may be made on."""

FRICTIONLESS = "simulated-frictionless"
"""The simulated device with no friction in its drives: what friction costs is seen by comparing. Offered nowhere."""

SIMULATIONS = (*DEVICES, FRICTIONLESS)
"""Those that need no real clock."""


def open_device(name: str, settings: DeviceSettings, clock: Clock, seed: int) -> Device:
    """`seed` drives what is random in a simulated device. Raises `DeviceError`."""
    if name not in SIMULATIONS:
        raise DeviceError(
            f"There is no device called {name!r}",
            "This version has no driver for a real device yet: it opens a simulated omega.3 only.",
            f"Use --device {SIMULATED}.",
        )
    from study.devices.rigs_by_name import RIGS_BY_NAME
    from study.devices.safe import SafeDevice

    return SafeDevice(RIGS_BY_NAME[name](settings, seed), settings, clock)
