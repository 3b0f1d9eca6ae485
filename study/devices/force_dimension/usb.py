"""Lists the Force Dimension devices on the USB, and whether this account may open them (Linux, /sys/bus/usb).

The vendor's library does not report a device that it may not open, as if it were not plugged in. `connect` and
`findings` use this list to distinguish the two cases in their messages.
"""

import os
from dataclasses import dataclass
from pathlib import Path

VENDOR_ID = "1451"
"""USB vendor identifier (idVendor) of Force Dimension, hexadecimal."""
UDEV_RULE_FILE = "/etc/udev/rules.d/51-forcedimension.rules"
"""File for the udev rule below, which sets who may open a device of this vendor."""
UDEV_RULE = f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{VENDOR_ID}", MODE="0660", TAG+="uaccess"'
"""udev rule: the user who is logged in at this computer may open the device (tag uaccess)."""
PERMISSION_ADVICE = (
    f"Write the line {UDEV_RULE} into {UDEV_RULE_FILE} as administrator, run `sudo udevadm control --reload`, then "
    "unplug the device and plug it in again."
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
    devices_folder: Path = Path("/sys/bus/usb/devices"), device_files_folder: Path = Path("/dev/bus/usb")
) -> tuple[UsbDevice, ...] | None:
    """List the Force Dimension devices that are plugged in; None where there is no `devices_folder` (not Linux), which
    contains one folder per USB device. device_files_folder: contains the device files, BUS/NUMBER with three digits
    each."""
    if not devices_folder.is_dir():
        return None
    usb_devices = []
    for folder in sorted(devices_folder.iterdir()):
        if _read_attribute(folder / "idVendor") != VENDOR_ID:
            continue
        bus_number, device_number = _read_attribute(folder / "busnum"), _read_attribute(folder / "devnum")
        device_file = device_files_folder / bus_number.zfill(3) / device_number.zfill(3)
        usb_devices.append(
            UsbDevice(_read_attribute(folder / "product") or "unnamed", os.access(device_file, os.R_OK | os.W_OK))
        )
    return tuple(usb_devices)


def _read_attribute(path: Path) -> str:
    """Read an attribute file of a USB device, without white space around it; empty where it cannot be read."""
    try:
        return path.read_text("utf-8", "replace").strip()
    except OSError:
        return ""
