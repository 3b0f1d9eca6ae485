"""Calibration of a linkage: the Jacobian, inertia and gravity that a device reports over a grid of positions, the
plausibility checks of these readings, and the inertia between the positions (`estimate_local_inertia`). Mirror lines
are the traces of the arms' planes of symmetry in the plane y-z, see `mirror_lines`.

J is the Jacobian of the forward kinematics: handle velocity = J joint speeds, joint torques = J^T handle force (Spong,
Hutchinson, Vidyasagar, Robot Modeling and Control, chapter 4). Inertia M(x) is that at the handle (operational space).
"""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from equalizer.signals.listed_problems import ListedProblemsError
from equalizer.signals.signal import FloatArray

LARGEST_CONDITION = 50.0
"""Largest accepted condition number of J. Chosen: that of the simulated omega.3 stays below 2.2."""
LARGEST_ASYMMETRY = 1e-3
"""Largest accepted ratio of the largest entry of |M - M^T| to that of |M|. Chosen; rounding errors are smaller."""
PLAUSIBLE_MASSES_KG = (1e-3, 20.0)
"""Range of plausible effective masses (kg) of the handle of a desktop device, along any direction. Chosen."""
LARGEST_DIFFERENCE = 0.05
"""Largest accepted relative difference of J from finite differences. Chosen: a wrong unit or convention gives at least
40 %, a neglected arm's length some 10 %."""

POLYNOMIAL_DEGREES = (4, 3, 2, 1)
"""Degrees of the polynomial of `estimate_local_inertia`, tried from the highest: the first that the positions determine
is used. Chosen."""
POSITIONS_PER_TERM = 2
"""Smallest ratio of positions to terms of the polynomial; below it a lower degree is used. Chosen."""
WEIGHT_SD_RATIO = 0.3
"""Standard deviation of the Gaussian weight over the distance from the position, relative to the largest distance of a
calibrated position from the origin. Chosen: without it, far positions change the slope at the centre of
the simulated omega.3 by 20 %; with it, by 2 %."""
MAX_LISTED_PROBLEMS = 10
"""Largest number of problems at single positions that are listed; further ones are only counted. Chosen."""


class CalibrationError(ListedProblemsError):
    """Readings that are not plausible for a linkage. `problems`: a clause for each."""


@dataclass(frozen=True, slots=True, eq=False)
class LinkageReading:
    """Readings of a device's linkage at a position of the handle."""

    position_m: FloatArray
    """(3,), of the handle: x from the base towards the operator, y to the right, z up."""
    joint_angle_rad: FloatArray
    """(3,), in the order of the arms."""
    jacobian: FloatArray
    """(3, 3), m/rad: handle velocity per joint speed."""
    inertia_kg: FloatArray
    """(3, 3), at the handle: force = inertia times acceleration, without gravity and velocity terms."""
    gravity_n: FloatArray
    """(3,), force at the handle that balances gravity."""


@dataclass(frozen=True, slots=True, eq=False)
class LinkageCalibration:
    """Readings at n positions, n >= 1. Raises CalibrationError for shapes that differ, or values that are not
    plausible. Arrays without a description are those of `LinkageReading`, stacked."""

    device: str
    """Name of the device."""
    details: str
    """Serial number, firmware, SDK."""
    read_on: str
    """ISO 8601 date."""
    position_m: FloatArray
    """(n, 3)"""
    joint_angle_rad: FloatArray
    """(n, 3), in the order of the arms"""
    jacobian: FloatArray
    """(n, 3, 3), m/rad"""
    inertia_kg: FloatArray
    """(n, 3, 3)"""
    gravity_n: FloatArray
    """(n, 3); NaN where neither a reading nor a mirrored reading exists."""
    filled: FloatArray
    """(n,), 1 where the values are those of a mirrored position, because this position could not be read, else 0."""
    line_deg: FloatArray
    """(3,), azimuth of the mirror lines in degrees, from y towards z, in the order of the arms."""
    asymmetry: FloatArray
    """(3,), largest relative difference between inertia and mirrored inertia, for each mirror line."""
    difference: float
    """Largest relative difference between J and finite differences of the positions."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Origin of the calibration: JSON values by name."""

    def __post_init__(self) -> None:
        if problems := tuple(find_calibration_problems(self)):
            raise CalibrationError(problems)


def find_calibration_problems(calibration: LinkageCalibration) -> Iterator[str]:
    """Find the problems of a calibration, a clause for each; none for a calibration that can be used. Where shapes
    differ, nothing else is checked."""
    count = len(calibration.position_m)
    shapes = {"position_m": (3,), "joint_angle_rad": (3,), "jacobian": (3, 3), "inertia_kg": (3, 3), "gravity_n": (3,)}
    wrong_arrays = [name for name, shape in shapes.items() if getattr(calibration, name).shape != (count, *shape)]
    if wrong_arrays or calibration.filled.shape != (count,) or count == 0:
        yield f"{', '.join(wrong_arrays) or 'filled'} does not have one entry for each of the {count} positions"
        return
    reading_problems = [
        problem
        for index, is_filled in enumerate(calibration.filled)
        for problem in check_reading(
            LinkageReading(*(getattr(calibration, name)[index] for name in shapes)), gravity_known=not is_filled
        )
    ]
    yield from reading_problems[:MAX_LISTED_PROBLEMS]
    if len(reading_problems) > MAX_LISTED_PROBLEMS:
        yield f"and {len(reading_problems) - MAX_LISTED_PROBLEMS} more of this kind at other positions"
    shared_values = calibration.line_deg, calibration.asymmetry, np.atleast_1d(calibration.difference)
    if any(values.shape not in ((3,), (1,)) or not np.isfinite(values).all() for values in shared_values):
        yield "mirror lines, asymmetries or differences are not finite numbers"
    else:
        yield from check_difference(calibration.difference)


def check_difference(difference: float) -> Iterator[str]:
    """Check the relative difference of a Jacobian from finite differences of positions; yields a clause if it is
    negative, NaN or above `LARGEST_DIFFERENCE`."""
    if not 0 <= difference <= LARGEST_DIFFERENCE:
        yield (
            f"the Jacobian differs from finite differences of its own positions by {difference:.0%}; "
            f"{LARGEST_DIFFERENCE:.0%} is the most"
        )


def check_reading(reading: LinkageReading, gravity_known: bool = True) -> Iterator[str]:
    """Check a reading and yield its problems, a clause for each: values that are not finite, a singular Jacobian, an
    inertia that is not symmetric, not positive definite or not plausible. gravity_known: whether the gravity force must
    be a number; an infinite one is a problem in any case. Where Jacobian or inertia is not finite, the other conditions
    are not checked."""
    position_text = "(" + ", ".join(f"{1000 * coordinate:.0f}" for coordinate in reading.position_m) + ") mm"
    jacobian, inertia = reading.jacobian, reading.inertia_kg
    position_and_angles = {"position": reading.position_m, "joint angles": reading.joint_angle_rad}
    for name, values in (position_and_angles | {"Jacobian": jacobian, "inertia": inertia}).items():
        if not np.isfinite(values).all():
            yield f"at {position_text} the {name} contains a value that is not a number"
    if not (np.isfinite(jacobian).all() and np.isfinite(inertia).all()):
        return
    if np.isinf(reading.gravity_n).any() or (gravity_known and np.isnan(reading.gravity_n).any()):
        yield f"at {position_text} the gravity force is not a number"
    condition_number = float(np.linalg.cond(jacobian))
    if not condition_number <= LARGEST_CONDITION:
        yield f"at {position_text} the Jacobian is singular, or nearly so (condition {condition_number:.3g})"
    if np.abs(inertia - inertia.T).max() > LARGEST_ASYMMETRY * np.abs(inertia).max():
        yield f"at {position_text} the inertia is not symmetric"
        return
    masses_kg = np.linalg.eigvalsh(0.5 * (inertia + inertia.T))
    if masses_kg[0] <= 0:
        yield f"at {position_text} the inertia is not positive definite: {masses_kg[0]:.3g} kg along a direction"
    elif not PLAUSIBLE_MASSES_KG[0] <= masses_kg[0] <= masses_kg[-1] <= PLAUSIBLE_MASSES_KG[1]:
        yield (
            f"at {position_text} the inertia is {masses_kg[0]:.3g} to {masses_kg[-1]:.3g} kg, which is not plausible "
            "for a handle"
        )


def estimate_local_inertia(calibration: LinkageCalibration, position_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Estimate the inertia (3, 3) at position_m (3,), kg, and its derivatives (3, 3, 3), kg/m: entry [a] is the
    derivative along axis a.

    A polynomial of the position is fitted by weighted least squares, with weights that fall with the distance (local
    regression; `WEIGHT_SD_RATIO`). Raises ValueError where the positions do not determine a polynomial of degree 1:
    fewer than eight, or all in one plane.
    """
    reach_m = float(np.linalg.norm(calibration.position_m, axis=1).max())
    offsets = (calibration.position_m - position_m) / (reach_m or 1.0)
    weights = np.exp(-0.5 * np.sum((offsets / WEIGHT_SD_RATIO) ** 2, axis=1))[:, None]
    for degree in POLYNOMIAL_DEGREES:
        exponents = [powers for powers in itertools.product(range(degree + 1), repeat=3) if sum(powers) <= degree]
        terms = weights * np.stack(
            [np.prod(offsets ** np.array(exponent_triple), axis=1) for exponent_triple in exponents], axis=1
        )
        if len(offsets) >= POSITIONS_PER_TERM * len(exponents) and np.linalg.matrix_rank(terms) == len(exponents):
            coefficients = np.linalg.lstsq(terms, weights * calibration.inertia_kg.reshape(-1, 9), rcond=None)[0]
            linear_rows = [exponents.index((axis == 0, axis == 1, axis == 2)) for axis in range(3)]
            return coefficients[exponents.index((0, 0, 0))].reshape(3, 3), coefficients[linear_rows].reshape(
                3, 3, 3
            ) / reach_m
    raise ValueError(
        f"{len(offsets)} positions do not determine how the inertia changes: read at least eight, not in one plane"
    )
