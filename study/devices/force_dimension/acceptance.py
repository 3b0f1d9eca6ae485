"""Acceptance record of a device (acceptance.json): tested with no hand on the handle, with an operator's name.

Without a valid record, a real device cannot be opened with a hand on the handle. The record is void after `VALID_FOR`
and for another device, firmware or SDK. The tests are in `force_limit_check`.
"""

import json
from dataclasses import asdict, dataclass
from datetime import date, timedelta
from pathlib import Path

from study.devices.device import DeviceInfo
from study.devices.force_dimension.lab import locate_lab_file, replace_file
from study.errors import DeviceError
from study.regular_file import MAX_DOCUMENT_BYTES, read_regular

FORMAT, VERSION = "hapteq-acceptance", 1
"""Values by which the file and its version are recognised."""

VALID_FOR = timedelta(days=180)
"""Validity of an acceptance. Chosen: half a year."""


@dataclass(frozen=True, slots=True)
class Acceptance:
    """Content of acceptance.json: the accepted device, operator and date, and what was measured."""

    device: str
    """Name of the device (`DeviceInfo.name`)."""
    details: str
    """Serial number, firmware and SDK. A change of any of them voids the acceptance."""
    operator: str
    """Name of the operator who accepted it."""
    accepted_on: str
    """ISO 8601 date."""
    force_n: float
    """Force (N) that was held when the commands were paused for the test of the watchdog, and the cap of the test of
    the force limit."""
    gone_after_s: float
    """Time (s) from the last command until the device reported its force as off."""
    asked_n: float = 0.0
    """Force (N) commanded of each layer, above the cap of `force_n`; 0 in older records, where it was not tested."""
    most_given_n: float = 0.0
    """Largest force (N) that the device reported during the test of the force limit."""
    baseline: str = ""
    """File name of the recording, in the same folder, with which the daily check compares; empty where none was
    made."""
    baseline_sha256: str = ""
    """SHA-256 of that file."""


def locate_acceptance_file() -> Path:
    """Return the path of acceptance.json, in the folder of the lab's settings. The file need not exist."""
    return locate_lab_file().with_name("acceptance.json")


def write_acceptance(acceptance: Acceptance) -> Path:
    """Write acceptance.json, replacing an older acceptance; its folder is made if missing. Returns the path. Raises
    OSError where the file cannot be written."""
    path = locate_acceptance_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    document = json.dumps({"format": FORMAT, "version": VERSION, **asdict(acceptance)}, indent=2) + "\n"
    replace_file(path, document.encode())
    return path


def check_accepted(info: DeviceInfo, today: date) -> tuple[str, str]:
    """Check that this device is accepted on the day `today` (UTC). Returns file name and SHA-256 of the accepted
    baseline, both empty where none was made. Raises `DeviceError` where the record cannot be read or is that of another
    device, serial number, firmware or SDK, or where `today` is before the acceptance or after its validity."""
    path = locate_acceptance_file()
    try:
        document = json.loads(read_regular(path, MAX_DOCUMENT_BYTES))
        accepted_on = date.fromisoformat(document["accepted_on"])
        accepted_device = (document["format"], document["version"], document["device"], document["details"])
        baseline = (str(document.get("baseline", "")), str(document.get("baseline_sha256", "")))
    except FileNotFoundError:
        raise _make_lock_error(info, f"There is no acceptance of it ({path})") from None
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise _make_lock_error(info, f"{path} is no acceptance ({type(error).__name__})") from error
    if accepted_device != (FORMAT, VERSION, info.name, info.details):
        raise _make_lock_error(
            info,
            f"Another was accepted ({accepted_device[2]}, {accepted_device[3]}); this is {info.name}, {info.details}",
        )
    if not accepted_on <= today <= accepted_on + VALID_FOR:
        raise _make_lock_error(info, f"It was accepted on {accepted_on}; that holds for {VALID_FOR.days} days")
    return baseline


def _make_lock_error(info: DeviceInfo, reason: str) -> DeviceError:
    """Make the error for a device that must not be opened with a hand on the handle. reason: a clause, no full stop."""
    device_option = info.name.replace(".", "")
    return DeviceError(
        f"The {info.name} is locked for hands",
        f"{reason}.",
        f"With no hand on the handle: hapteq doctor --device {device_option} --accept 'NAME OF THE OPERATOR'.",
    )
