"""Devices of the vendor on the USB, and whether this account may open them, as Linux reports it.

A device that may not be opened looks to the vendor's library as if it were not there.
"""

import os
from dataclasses import dataclass
from pathlib import Path

VENDOR = "1451"
"""Force Dimension's USB vendor number, hexadecimal."""

RULE_FILE = "/etc/udev/rules.d/51-forcedimension.rules"
"""Rules of Linux on who may open a device of the vendor on the USB."""
RULE = f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{VENDOR}", MODE="0660", TAG+="uaccess"'
"""Lets the person who sits at the computer open the device."""

ADVICE = (
    f"Write the line {RULE} into {RULE_FILE} as administrator, run `sudo udevadm control --reload`, then plug the "
    "device out and in."
)


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """A device of the vendor on the USB; may_open: whether this account may read and write it."""

    product: str
    may_open: bool


def find_usb_devices(
    devices: Path = Path("/sys/bus/usb/devices"), nodes: Path = Path("/dev/bus/usb")
) -> tuple[UsbDevice, ...] | None:
    """Find devices on the USB; None where this system cannot list them (no Linux)."""
    if not devices.is_dir():
        return None
    found = []
    for folder in sorted(devices.iterdir()):
        if _read(folder / "idVendor") != VENDOR:
            continue
        bus, number = _read(folder / "busnum"), _read(folder / "devnum")
        node = nodes / bus.zfill(3) / number.zfill(3)
        found.append(UsbDevice(_read(folder / "product") or "unnamed", os.access(node, os.R_OK | os.W_OK)))
    return tuple(found)


def _read(path: Path) -> str:
    try:
        return path.read_text("utf-8", "replace").strip()
    except OSError:
        return ""
