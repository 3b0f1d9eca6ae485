"""Lists the Force Dimension devices on the USB, and whether this account may open them (Linux, /sys/bus/usb).

The vendor's library does not see a device that it may not open, just as if it were not plugged in. The device check
uses this list to distinguish the two cases in its message.
"""

import os
from dataclasses import dataclass
from pathlib import Path

VENDOR = "1451"
"""USB vendor number of Force Dimension, hexadecimal."""
RULE_FILE = "/etc/udev/rules.d/51-forcedimension.rules"
"""File for the udev rule below, which sets who may open a device of this vendor."""
RULE = f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{VENDOR}", MODE="0660", TAG+="uaccess"'
"""udev rule: the user who is logged in at this computer may open the device (tag uaccess)."""
ADVICE = (
    f"Write the line {RULE} into {RULE_FILE} as administrator, run `sudo udevadm control --reload`, then unplug "
    "the device and plug it in again."
)
"""Instruction for the user where a device may not be opened."""


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """A Force Dimension device on the USB."""

    product: str
    """Product name that the device reports; "unnamed" where it reports none."""
    may_open: bool
    """Whether this account may read and write it."""


def find_usb_devices(
    devices: Path = Path("/sys/bus/usb/devices"), nodes: Path = Path("/dev/bus/usb")
) -> tuple[UsbDevice, ...] | None:
    """Force Dimension devices that are plugged in; None where this system cannot list them (not Linux). devices: folder
    with one folder per USB device. nodes: folder of the device files, BUS/NUMBER with three digits each."""
    if not devices.is_dir():
        return None
    usb_devices = []
    for folder in sorted(devices.iterdir()):
        if _read(folder / "idVendor") != VENDOR:
            continue
        bus, number = _read(folder / "busnum"), _read(folder / "devnum")
        node = nodes / bus.zfill(3) / number.zfill(3)
        usb_devices.append(UsbDevice(_read(folder / "product") or "unnamed", os.access(node, os.R_OK | os.W_OK)))
    return tuple(usb_devices)


def _read(path: Path) -> str:
    """Text of a file without white space around it; empty where it cannot be read."""
    try:
        return path.read_text("utf-8", "replace").strip()
    except OSError:
        return ""
