"""Read a device's linkage over a grid of positions, check it, fill it in by its mirror lines, and write it."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from equalizer.linkage.calibration import (
    CalibrationError,
    LinkageCalibration,
    LinkageReading,
    check_reading,
    difference_problems,
)
from equalizer.linkage.grid import STEP_M, arm_azimuths, difference_error, difference_positions, symmetric_grid
from equalizer.linkage.mirror_lines import asymmetry_words, complete_by_symmetry, line_asymmetry
from equalizer.signals.signal import FloatArray
from study.devices.opening import open_linkage
from study.errors import DeviceError, WrongUseError
from study.store.disk.provenance import gather_provenance
from study.store.formats.calibration_file import write_calibration
from study.workflows.free_name import require_free

if TYPE_CHECKING:
    from study.devices.opening import LinkageSource

TITLE = "The linkage was not calibrated"
"""Title of each error of this command."""
SAVED = "Nothing moved and nothing was written."
LARGEST_M = 0.2
"""Largest radius and depth of the grid (m). By hand."""
MAX_LISTED = 3
"""Number of problems that an error lists; the others are counted."""


@dataclass(frozen=True, slots=True)
class CalibrationPlan:
    """What `calibrate_linkage` does: file to write, device, and size of the grid of positions."""

    out: Path
    device: str = "simulated"
    radius_m: float = 0.05
    """Radius of the grid around the x axis (m)."""
    depth_m: float = 0.04
    """Extent of the grid along x, in front of the centre and behind it (m)."""


@dataclass(frozen=True, slots=True, eq=False)
class WrittenCalibration:
    """A calibration of a device's linkage that was written to `plan.out`."""

    plan: CalibrationPlan
    calibration: LinkageCalibration
    warnings: tuple[str, ...]
    unknown: int
    """Positions of the grid that could be neither read nor filled in."""


def calibrate_linkage(plan: CalibrationPlan, on_progress: Callable[[float], None]) -> WrittenCalibration:
    """Read, check, complete and write the calibration. Nothing moves: the device's library computes Jacobian, inertia
    and gravity. `on_progress(share)` counts the positions. Raises StudyError; nothing is written then."""
    require_free(plan.out, title=TITLE, kind="calibrations", saved=SAVED)
    if not (STEP_M < plan.radius_m <= LARGEST_M and STEP_M < plan.depth_m <= LARGEST_M):
        raise WrongUseError(
            "There is no such grid",
            f"--radius is {plan.radius_m:g} m and --depth {plan.depth_m:g} m; each must be above {STEP_M:g} m and at "
            f"most {LARGEST_M:g} m.",
            "Correct --radius or --depth.",
            saved=SAVED,
        )
    try:
        with open_linkage(plan.device) as linkage:
            linkage.check_frame()
            result = _read_grid(linkage, plan, on_progress)
    except CalibrationError as error:
        raise _refusal(plan.device, error.problems) from error
    except DeviceError as error:
        error.saved = SAVED
        raise
    write_calibration(plan.out, result.calibration)
    on_progress(1.0)
    return result


def calibration_summary(result: WrittenCalibration) -> dict[str, Any]:
    """The calibration as plain values, for one JSON document."""
    calibration = result.calibration
    centre = int(np.argmin(np.linalg.norm(calibration.position_m, axis=1)))
    masses = np.linalg.eigvalsh(calibration.inertia_kg)
    return {
        "calibration": str(result.plan.out),
        "device": calibration.device,
        "details": calibration.details,
        "positions": {
            "read": int((calibration.filled == 0).sum()),
            "filled": int(calibration.filled.sum()),
            "unknown": result.unknown,
        },
        "centre": {
            "inertia_kg": calibration.inertia_kg[centre].tolist(),
            "gravity_n": calibration.gravity_n[centre].tolist(),
        },
        "mass_kg": [float(masses.min()), float(masses.max())],
        "lines": [
            {"azimuth_deg": float(azimuth), "asymmetry": float(share)}
            for azimuth, share in zip(calibration.line_deg, calibration.asymmetry, strict=True)
        ],
        "difference": calibration.difference,
        "warnings": list(result.warnings),
    }


def calibration_lines(result: WrittenCalibration) -> tuple[str, ...]:
    """Lines for the terminal."""
    values = calibration_summary(result)
    positions, (least_kg, most_kg) = values["positions"], values["mass_kg"]
    inertia_text = ", ".join(f"{values['centre']['inertia_kg'][axis][axis]:.3g}" for axis in range(3))
    gravity_text = ", ".join(f"{force_n:.2g}" for force_n in values["centre"]["gravity_n"])
    return (
        f"{values['device']}, {values['details']}: {positions['read']} positions read, {positions['filled']} filled in "
        f"by mirror lines, {positions['unknown']} unknown",
        f"Inertia at the centre along x, y, z: {inertia_text} kg; {least_kg:.3g} to {most_kg:.3g} kg over all "
        f"positions and directions; held against gravity by {gravity_text} N",
        "Mirror lines, largest difference of inertia: "
        + "; ".join(f"{line['azimuth_deg']:.0f} degrees {line['asymmetry']:.2%}" for line in values["lines"]),
        f"Jacobian against finite differences of its own positions: {values['difference']:.2%}",
    )


def _read_grid(
    linkage: "LinkageSource", plan: CalibrationPlan, on_progress: Callable[[float], None]
) -> WrittenCalibration:
    """The calibration over the whole grid. All readings are checked before it is refused, so that an error can list the
    problems. Raises CalibrationError, DeviceError."""
    azimuths = arm_azimuths(_centre_jacobian(linkage))
    readings, unread, worst = [], [], 0.0
    problems: list[str] = []
    grid = symmetric_grid(azimuths, plan.radius_m, plan.depth_m)
    for number, position in enumerate(grid):
        reading = linkage.at(position)
        if reading is None:
            unread.append(position)
        else:
            readings.append(reading)
            problems += check_reading(reading)
            worst = max(worst, _difference_error(linkage, reading))
        on_progress(number / len(grid))
    if problems:
        raise CalibrationError(tuple(problems))
    filled_readings, unknown = complete_by_symmetry(readings, azimuths, np.array(unread).reshape(-1, 3))
    asymmetry, worst_position_m = line_asymmetry(readings, azimuths)
    line_deg = np.degrees(azimuths)
    calibration = LinkageCalibration(
        device=linkage.info.name,
        details=linkage.info.details,
        read_on=datetime.now(UTC).date().isoformat(),
        **_arrays([*readings, *filled_readings]),
        filled=np.array([0.0] * len(readings) + [1.0] * len(filled_readings)),
        line_deg=line_deg,
        asymmetry=asymmetry,
        difference=worst,
        provenance=gather_provenance().as_dict(),
    )
    return WrittenCalibration(plan, calibration, asymmetry_words(asymmetry, worst_position_m, line_deg), len(unknown))


def _centre_jacobian(linkage: "LinkageSource") -> FloatArray:
    """(3, 3): the checked Jacobian at the centre, from which the azimuths of the arms follow. Raises CalibrationError,
    DeviceError."""
    centre = linkage.at(np.zeros(3))
    if centre is None:
        raise CalibrationError(("the centre of the workspace is out of its reach",))
    problems = tuple(check_reading(centre)) or tuple(difference_problems(_difference_error(linkage, centre)))
    if problems:
        raise CalibrationError(problems)
    return centre.jacobian


def _difference_error(linkage: "LinkageSource", reading: LinkageReading) -> float:
    """Difference between the device's Jacobian and finite differences of its own joint angles, relative to the
    Jacobian. 0 where a neighbour is out of reach, or where a value is no number, which `check_reading` refuses."""
    positions = difference_positions(reading.position_m)
    rows = [angle for position in positions if (angle := linkage.angles_at(position)) is not None]
    angles = np.array(rows)
    if len(rows) < len(positions) or not np.isfinite(angles).all() or not np.isfinite(reading.jacobian).all():
        return 0.0
    return difference_error(reading.jacobian, positions, angles)


def _arrays(readings: list[LinkageReading]) -> dict[str, Any]:
    """The readings' arrays, positions first, by the fields of `LinkageCalibration`."""
    names = ("position_m", "joint_angle_rad", "jacobian", "inertia_kg", "gravity_n")
    return {name: np.stack([getattr(reading, name) for reading in readings]) for name in names}


def _refusal(name: str, problems: tuple[str, ...]) -> DeviceError:
    remainder_text = f"; and {len(problems) - MAX_LISTED} more" if len(problems) > MAX_LISTED else ""
    return DeviceError(
        TITLE,
        f"The linkage that {name} reports is inconsistent: {'; '.join(problems[:MAX_LISTED])}{remainder_text}.",
        f"Calibrate its handle anew (`hapteq doctor --device {name} --calibrate`), try a smaller grid (--radius, "
        "--depth) and the vendor's newest SDK; if the report stays the same, do without: no other command needs it.",
        saved=SAVED,
    )
