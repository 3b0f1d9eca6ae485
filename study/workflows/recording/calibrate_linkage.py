"""Calibrate the linkage of a delta device, that is the arms between motors and handle (`hapteq calibrate`).

Joint angles, Jacobian, inertia and gravity are read from the device's library over a grid of handle positions, checked
for consistency, and filled in from mirror positions where the library gives none. The result is an HDF5 file, which
`hapteq twin --calibration` reads.
"""

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
    check_difference,
    check_reading,
)
from equalizer.linkage.grid import (
    DIFFERENCE_STEP_M,
    compute_difference_error,
    estimate_arm_azimuths,
    list_difference_positions,
    make_symmetric_grid,
)
from equalizer.linkage.mirror_lines import complete_by_symmetry, measure_line_asymmetry, write_asymmetry_warnings
from equalizer.signals.signal import FloatArray
from study.devices.opening import open_linkage
from study.errors import DeviceError, WrongUseError
from study.store.disk.provenance import gather_provenance
from study.store.formats.calibration_file import write_calibration
from study.workflows.output_paths import require_new_outputs

if TYPE_CHECKING:
    from study.devices.opening import LinkageSource

ERROR_TITLE = "The linkage was not calibrated"
"""Title of the errors about the output file and about inconsistent readings."""
NOTHING_DONE = "Nothing moved and nothing was written."
"""What the errors before the file is written state about the device and the files."""
MAX_GRID_SIZE_M = 0.2
"""Largest accepted radius and depth of the grid (m). Chosen: larger values are mistyped or in another unit."""
MAX_LISTED_PROBLEMS = 3
"""Number of problems that an error lists; of the others only the number is given. Chosen."""


@dataclass(frozen=True, slots=True)
class CalibrationPlan:
    """Input of `calibrate_linkage`: file to write, device, and size of the grid of positions."""

    out: Path
    device: str = "simulated"
    radius_m: float = 0.05
    """Radius of the grid around the x axis (m)."""
    depth_m: float = 0.04
    """Extent of the grid along x, in front of the centre and behind it (m)."""


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationResult:
    """A calibration of a device's linkage, as `calibrate_linkage` writes it to `plan.out`, and warnings about its
    symmetry."""

    plan: CalibrationPlan
    calibration: LinkageCalibration
    warnings: tuple[str, ...]
    unknown_count: int
    """Number of grid positions that could be neither read nor filled in."""


def calibrate_linkage(plan: CalibrationPlan, on_progress: Callable[[float], None]) -> CalibrationResult:
    """Read, check, complete and write the calibration. Nothing moves: the device's library computes Jacobian, inertia
    and gravity. on_progress: called with the fraction of the positions that were read. Raises StudyError; nothing is
    written then."""
    require_new_outputs(plan.out, title=ERROR_TITLE, kind="calibrations", saved=NOTHING_DONE)
    if not (
        DIFFERENCE_STEP_M < plan.radius_m <= MAX_GRID_SIZE_M and DIFFERENCE_STEP_M < plan.depth_m <= MAX_GRID_SIZE_M
    ):
        raise WrongUseError(
            "There is no such grid",
            f"--radius is {plan.radius_m:g} m and --depth {plan.depth_m:g} m; each must be above "
            f"{DIFFERENCE_STEP_M:g} m and at most {MAX_GRID_SIZE_M:g} m.",
            "Correct --radius or --depth.",
            saved=NOTHING_DONE,
        )
    try:
        with open_linkage(plan.device) as linkage:
            linkage.check_frame()
            result = _read_grid(linkage, plan, on_progress)
    except CalibrationError as error:
        raise _make_inconsistency_error(plan.device, error.problems) from error
    except DeviceError as error:
        error.saved = NOTHING_DONE
        raise
    write_calibration(plan.out, result.calibration)
    on_progress(1.0)
    return result


def summarise_calibration(result: CalibrationResult) -> dict[str, Any]:
    """Summarise a calibration as plain values for a JSON document; units by the suffix of a key. difference and
    asymmetry are relative."""
    calibration = result.calibration
    centre_index = int(np.argmin(np.linalg.norm(calibration.position_m, axis=1)))
    masses_kg = np.linalg.eigvalsh(calibration.inertia_kg)
    return {
        "calibration": str(result.plan.out),
        "device": calibration.device,
        "details": calibration.details,
        "positions": {
            "read": int((calibration.filled == 0).sum()),
            "filled": int(calibration.filled.sum()),
            "unknown": result.unknown_count,
        },
        "centre": {
            "inertia_kg": calibration.inertia_kg[centre_index].tolist(),
            "gravity_n": calibration.gravity_n[centre_index].tolist(),
        },
        "mass_kg": [float(masses_kg.min()), float(masses_kg.max())],
        "lines": [
            {"azimuth_deg": float(azimuth_deg), "asymmetry": float(asymmetry)}
            for azimuth_deg, asymmetry in zip(calibration.line_deg, calibration.asymmetry, strict=True)
        ],
        "difference": calibration.difference,
        "warnings": list(result.warnings),
    }


def format_calibration_lines(result: CalibrationResult) -> tuple[str, ...]:
    """Format the summary of a calibration as lines of text for the terminal."""
    summary = summarise_calibration(result)
    positions, (min_kg, max_kg) = summary["positions"], summary["mass_kg"]
    inertia_text = ", ".join(f"{summary['centre']['inertia_kg'][axis][axis]:.3g}" for axis in range(3))
    gravity_text = ", ".join(f"{force_n:.2g}" for force_n in summary["centre"]["gravity_n"])
    return (
        f"{summary['device']}, {summary['details']}: {positions['read']} positions read, {positions['filled']} filled "
        f"in by mirror lines, {positions['unknown']} unknown",
        f"Inertia at the centre along x, y, z: {inertia_text} kg; {min_kg:.3g} to {max_kg:.3g} kg over all "
        f"positions and directions; held against gravity by {gravity_text} N",
        "Mirror lines, largest difference of inertia: "
        + "; ".join(f"{line['azimuth_deg']:.0f} degrees {line['asymmetry']:.2%}" for line in summary["lines"]),
        f"Jacobian against finite differences of its own positions: {summary['difference']:.2%}",
    )


def _read_grid(
    linkage: "LinkageSource", plan: CalibrationPlan, on_progress: Callable[[float], None]
) -> CalibrationResult:
    """Read the calibration over the whole grid, without writing it. Raises CalibrationError with the problems of all
    grid positions, or with those of the centre, which is checked first; DeviceError."""
    azimuths_rad = estimate_arm_azimuths(_read_centre_jacobian(linkage))
    readings, unread_positions_m, max_difference_error = [], [], 0.0
    problems: list[str] = []
    grid_m = make_symmetric_grid(azimuths_rad, plan.radius_m, plan.depth_m)
    for index, position_m in enumerate(grid_m):
        reading = linkage.compute_reading_at(position_m)
        if reading is None:
            unread_positions_m.append(position_m)
        else:
            readings.append(reading)
            problems += check_reading(reading)
            max_difference_error = max(max_difference_error, _compute_difference_error(linkage, reading))
        on_progress(index / len(grid_m))
    if problems:
        raise CalibrationError(tuple(problems))
    filled_readings, unknown_positions_m = complete_by_symmetry(
        readings, azimuths_rad, np.array(unread_positions_m).reshape(-1, 3)
    )
    asymmetry, worst_position_m = measure_line_asymmetry(readings, azimuths_rad)
    line_deg = np.degrees(azimuths_rad)
    calibration = LinkageCalibration(
        device=linkage.info.name,
        details=linkage.info.details,
        read_on=datetime.now(UTC).date().isoformat(),
        **_stack_readings([*readings, *filled_readings]),
        filled=np.array([0.0] * len(readings) + [1.0] * len(filled_readings)),
        line_deg=line_deg,
        asymmetry=asymmetry,
        difference=max_difference_error,
        provenance=gather_provenance().as_dict(),
    )
    return CalibrationResult(
        plan, calibration, write_asymmetry_warnings(asymmetry, worst_position_m, line_deg), len(unknown_positions_m)
    )


def _read_centre_jacobian(linkage: "LinkageSource") -> FloatArray:
    """Read and check the Jacobian (3, 3) at the centre (m/rad), from which the azimuths of the arms are computed.
    Raises CalibrationError, DeviceError."""
    centre = linkage.compute_reading_at(np.zeros(3))
    if centre is None:
        raise CalibrationError(("the centre of the workspace is out of its reach",))
    problems = tuple(check_reading(centre)) or tuple(check_difference(_compute_difference_error(linkage, centre)))
    if problems:
        raise CalibrationError(problems)
    return centre.jacobian


def _compute_difference_error(linkage: "LinkageSource", reading: LinkageReading) -> float:
    """Compute the difference between the device's Jacobian and that of its joint angles by central differences,
    relative to the largest entry of the latter. 0 where a neighbouring position is out of reach, or where an angle or a
    value of the Jacobian is not finite; `check_reading` rejects such a Jacobian."""
    positions_m = list_difference_positions(reading.position_m)
    angle_rows = [
        angle_row for position_m in positions_m if (angle_row := linkage.compute_angles_at(position_m)) is not None
    ]
    angles_rad = np.array(angle_rows)
    if (
        len(angle_rows) < len(positions_m)
        or not np.isfinite(angles_rad).all()
        or not np.isfinite(reading.jacobian).all()
    ):
        return 0.0
    return compute_difference_error(reading.jacobian, positions_m, angles_rad)


def _stack_readings(readings: list[LinkageReading]) -> dict[str, Any]:
    """Stack the arrays of all readings along a new first dimension, by the names of the fields of
    `LinkageCalibration`."""
    field_names = ("position_m", "joint_angle_rad", "jacobian", "inertia_kg", "gravity_n")
    return {name: np.stack([getattr(reading, name) for reading in readings]) for name in field_names}


def _make_inconsistency_error(device_name: str, problems: tuple[str, ...]) -> DeviceError:
    """Make the error for a linkage with inconsistent readings; it lists the first `MAX_LISTED_PROBLEMS` problems."""
    remainder_text = f"; and {len(problems) - MAX_LISTED_PROBLEMS} more" if len(problems) > MAX_LISTED_PROBLEMS else ""
    return DeviceError(
        ERROR_TITLE,
        f"The linkage that {device_name} reports is inconsistent: "
        f"{'; '.join(problems[:MAX_LISTED_PROBLEMS])}{remainder_text}.",
        f"Calibrate its handle anew (`hapteq doctor --device {device_name} --calibrate`), try a smaller grid "
        "(--radius, --depth) and the vendor's newest SDK; if the report stays the same, do without: no other command "
        "needs it.",
        saved=NOTHING_DONE,
    )
