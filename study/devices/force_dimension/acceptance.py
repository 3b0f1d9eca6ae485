"""Acceptance of a device: checked with no hand on it, signed by an operator, and void when something changes.

Without one, a device opens for no hand: neither for a person's nor for one that is simulated in a session.
"""

import json
from dataclasses import asdict, dataclass
from datetime import date, timedelta
from pathlib import Path

from study.devices.device import DeviceInfo
from study.devices.force_dimension.lab import lab_file
from study.errors import DeviceError

FORMAT, VERSION = "hapteq-acceptance", 1

VALID_FOR = timedelta(days=180)
"""Half a year: twice a year is how often laboratories check what people are connected to."""


@dataclass(frozen=True, slots=True)
class Acceptance:
    """Content of acceptance.json: the accepted device, operator and date, and what was measured."""

    device: str
    details: str
    """Serial number, firmware and SDK. Another of any of them voids it."""
    operator: str
    accepted_on: str
    """ISO 8601 date."""
    force_n: float
    """Force that was held when the loop was stopped on purpose."""
    gone_after_s: float
    """Until the device said that it was off."""
    asked_n: float = 0.0
    """Force asked of each layer, with a cap of `force_n`; 0 where that was not tested, as before November 2026."""
    most_given_n: float = 0.0
    """Then, as the device said."""
    baseline: str = ""
    """Name of the recording beside this file with which the daily check compares; empty where none was made."""
    baseline_sha256: str = ""


def acceptance_file() -> Path:
    """Path of acceptance.json, in the folder of the lab's settings. The file need not exist."""
    return lab_file().with_name("acceptance.json")


def write_acceptance(acceptance: Acceptance) -> Path:
    """Write acceptance.json, in the place of an older acceptance; its folder is made if missing. Returns the path."""
    path = acceptance_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    written = path.with_suffix(".new")
    written.write_text(json.dumps({"format": FORMAT, "version": VERSION, **asdict(acceptance)}, indent=2) + "\n")
    written.replace(path)
    return path


def check_accepted(info: DeviceInfo, today: date) -> tuple[str, str]:
    """Name and SHA-256 of the accepted baseline, empty where none was made. Raises `DeviceError` where this device, as
    it is now, was not accepted, or too long ago."""
    path = acceptance_file()
    try:
        document = json.loads(path.read_text("utf-8"))
        accepted_on = date.fromisoformat(document["accepted_on"])
        known = (document["format"], document["version"], document["device"], document["details"])
        baseline = (str(document.get("baseline", "")), str(document.get("baseline_sha256", "")))
    except FileNotFoundError:
        raise _lock_error(info, f"There is no acceptance of it ({path})") from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise _lock_error(info, f"{path} is no acceptance ({type(error).__name__})") from error
    if known != (FORMAT, VERSION, info.name, info.details):
        raise _lock_error(info, f"Another was accepted ({known[2]}, {known[3]}); this is {info.name}, {info.details}")
    if not accepted_on <= today <= accepted_on + VALID_FOR:
        raise _lock_error(info, f"It was accepted on {accepted_on}; that holds for {VALID_FOR.days} days")
    return baseline


def _lock_error(info: DeviceInfo, happened: str) -> DeviceError:
    option = info.name.replace(".", "")
    return DeviceError(
        f"The {info.name} is locked for hands",
        f"{happened}.",
        f"With no hand on the handle: hapteq doctor --device {option} --accept 'NAME OF THE OPERATOR'.",
    )
