"""Linkage of the simulated device by position, as a real device reports it, and the inverse problem: the parameters of
the simulated device that fit the linkage and the inertia of a calibration.

Four lengths and a common turn of the azimuths are fitted to the Jacobians (nonlinear least squares), then the moving
mass and the inertia of the arms to the inertia matrices (linear least squares). A device of another design (hinge
offsets, arms of unequal weight) is only approximated; `FittedLinkage` states the misfit. Begin at
`make_simulated_linkage` and `fit_linkage`.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from equalizer.linkage.calibration import LinkageCalibration, LinkageReading
from equalizer.linkage.grid import estimate_arm_azimuths
from equalizer.signals.signal import FloatArray
from study.devices.device import DeviceInfo
from study.devices.simulated import layout
from study.devices.simulated.compiled import solve_pose
from study.devices.simulated.omega3 import NAME, make_omega3_info
from study.devices.simulated.packing import compute_effective_mass_kg, compute_isotropic_depth_m, pack_parameters
from study.devices.simulated.parameters import GRAVITY_MPS2, Linkage, Masses, Omega3Parameters

MAX_MISFIT = 0.1
"""Largest accepted relative misfit of Jacobian or inertia. Chosen: above it, the simulated device would not represent
the calibrated device."""
MIN_MOVING_MASS_KG = 0.07
"""Smallest mass that moves with the handle (kg): the handle modes, which are part of it, have 54 g."""


class SimulatedLinkage:
    """Linkage of the simulated omega.3 without a hand: a `study.devices.opening.LinkageSource`."""

    def __init__(self, parameters: Omega3Parameters, info: DeviceInfo) -> None:
        self.info = info
        self._packed_parameters = pack_parameters(parameters, False, (0.0, 0.0, 0.0))
        self._masses, self._reach_m = parameters.masses, parameters.stops.radius_m

    def compute_reading_at(self, position_m: FloatArray) -> LinkageReading | None:
        """Compute joint angles (rad), Jacobian (m/rad), inertia matrix (kg) and the force that balances gravity
        (N) at a position of the handle (3,), m; None at or beyond the end stop."""
        if not float(np.linalg.norm(position_m)) < self._reach_m:
            return None
        angles, inverse_jacobian = _compute_pose(self._packed_parameters, position_m)
        moving_mass_kg = self._masses.handle_kg + self._masses.forearm_kg
        arm_inertia = self._packed_parameters[layout.ARM_INERTIA] + self._packed_parameters[layout.DRIVE_INERTIA]
        inertia = moving_mass_kg * np.eye(3) + arm_inertia * inverse_jacobian.T @ inverse_jacobian
        balancing_force_n = np.array([0.0, 0.0, GRAVITY_MPS2 * moving_mass_kg])
        jacobian: FloatArray = np.asarray(np.linalg.inv(inverse_jacobian), dtype=np.float64)
        return LinkageReading(np.array(position_m), angles, jacobian, inertia, balancing_force_n)

    def compute_angles_at(self, position_m: FloatArray) -> FloatArray | None:
        """Compute the joint angles (3,), rad, at a position of the handle (3,), m; None at or beyond the end stop."""
        return (
            _compute_pose(self._packed_parameters, position_m)[0]
            if float(np.linalg.norm(position_m)) < self._reach_m
            else None
        )

    def check_frame(self) -> None:
        """Nothing to check: positions and readings of the simulated device have the same axes."""


@dataclass(frozen=True, slots=True)
class FittedLinkage:
    """Parameters of the simulated device fitted to a calibration, and the misfit."""

    parameters: Omega3Parameters
    jacobian_misfit: float
    """Largest difference from the calibration's inverse Jacobian (rad/m), relative to its largest element."""
    inertia_misfit: float
    """Largest difference from the calibration's inertia (kg), relative to its largest element."""


def make_simulated_linkage() -> SimulatedLinkage:
    """Make the linkage of the simulated omega.3 with its default parameters."""
    parameters = Omega3Parameters()
    mass_kg = compute_effective_mass_kg(parameters, pack_parameters(parameters, False, (0.0, 0.0, 0.0)))
    return SimulatedLinkage(parameters, make_omega3_info(NAME, mass_kg, "parameter set 1, without a hand"))


def fit_linkage(calibration: LinkageCalibration) -> FittedLinkage:
    """Fit the simulated device to a calibration. Raises ValueError where Jacobian or inertia differ by more than
    `MAX_MISFIT`, or a fitted mass is too small."""
    inverse_jacobians = np.linalg.inv(calibration.jacobian)
    # The sign of each joint angle is chosen as in the simulated device, where it increases with x.
    inverse_jacobians = inverse_jacobians * np.sign(inverse_jacobians[:, :, :1])
    centre_index = int(np.argmin(np.linalg.norm(calibration.position_m, axis=1)))
    azimuths = estimate_arm_azimuths(calibration.jacobian[centre_index])
    linkage, jacobian_misfit = _fit_lengths(calibration.position_m, inverse_jacobians, azimuths)
    parameters = replace(Omega3Parameters(), linkage=linkage)
    masses, inertia_misfit = _fit_masses(parameters, calibration)
    for name, misfit in (("Jacobian", jacobian_misfit), ("inertia", inertia_misfit)):
        if not misfit <= MAX_MISFIT:
            raise ValueError(f"its {name} is {misfit:.0%} off that of any linkage of this kind, at the least")
    return FittedLinkage(replace(parameters, masses=masses), jacobian_misfit, inertia_misfit)


def _compute_pose(packed_parameters: FloatArray, position_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute joint angles (3,), rad, and inverse Jacobian (3, 3), rad/m, at a position (3,), m. packed_parameters:
    laid out as in `layout`."""
    angles, inverse_jacobian = np.empty(3), np.empty((3, 3))
    solve_pose(packed_parameters, np.array(position_m, dtype=float), angles, inverse_jacobian)
    return angles, inverse_jacobian


def _compute_inverse_jacobians(parameters: Omega3Parameters, positions_m: FloatArray) -> FloatArray:
    """Compute the inverse Jacobians (n, 3, 3), rad/m, at the positions (n, 3), m."""
    packed_parameters = pack_parameters(parameters, False, (0.0, 0.0, 0.0))
    return np.stack([_compute_pose(packed_parameters, position)[1] for position in positions_m])


def _fit_lengths(positions_m: FloatArray, inverse_jacobians: FloatArray, azimuths: FloatArray) -> tuple[Linkage, float]:
    """Fit the linkage by least squares. Returns it and its misfit, see `FittedLinkage`. positions_m: (n, 3);
    inverse_jacobians: (n, 3, 3), rad/m; azimuths: (3,), rad. The unknowns are the logarithms of four lengths over their
    start values, which are scaled to the size of the device, and a turn of all azimuths, each within ±1.5 (lengths by a
    factor of 4.5)."""
    nominal_linkage = Linkage()
    size_ratio = float(
        np.abs(_compute_inverse_jacobians(Omega3Parameters(), positions_m)).max() / np.abs(inverse_jacobians).max()
    )
    start_lengths_m = size_ratio * np.array(
        [
            nominal_linkage.upper_arm_m,
            nominal_linkage.forearm_m,
            nominal_linkage.radius_m,
            compute_isotropic_depth_m(nominal_linkage),
        ]
    )
    largest_element = float(np.abs(inverse_jacobians).max())

    def make_linkage(unknowns: FloatArray) -> Linkage:
        """Make the linkage of the unknowns (5,): four logarithms of length ratios, and the turn of the azimuths
        (rad)."""
        azimuths_deg = np.degrees(azimuths + unknowns[4])
        upper_arm, forearm, radius, depth = (float(length) for length in start_lengths_m * np.exp(unknowns[:4]))
        return Linkage(
            upper_arm, forearm, radius, (float(azimuths_deg[0]), float(azimuths_deg[1]), float(azimuths_deg[2])), depth
        )

    def compute_misfits(unknowns: FloatArray) -> FloatArray:
        """Compute the residuals (9 n,) of the inverse Jacobians, relative to the largest element."""
        fitted_inverse_jacobians = _compute_inverse_jacobians(
            replace(Omega3Parameters(), linkage=make_linkage(unknowns)), positions_m
        )
        return np.ravel(fitted_inverse_jacobians - inverse_jacobians) / largest_element

    least_squares_result = least_squares(compute_misfits, np.zeros(5), bounds=(-1.5, 1.5))
    return make_linkage(least_squares_result.x), float(np.abs(least_squares_result.fun).max())


def _fit_masses(parameters: Omega3Parameters, calibration: LinkageCalibration) -> tuple[Masses, float]:
    """Fit the masses by linear least squares to the calibration's inertia matrices, m I + i J^T J with J the inverse
    Jacobian (rad/m): m (kg) moves with the handle, and i (kg m²) turns with each arm. Returns the
    misfit too, see `FittedLinkage`. Raises ValueError for masses that are too small."""
    nominal_masses, upper_arm_m = parameters.masses, parameters.linkage.upper_arm_m
    inverse_jacobians = _compute_inverse_jacobians(parameters, calibration.position_m)
    jacobian_products = np.einsum("nki,nkj->nij", inverse_jacobians, inverse_jacobians)
    design_matrix = np.stack(
        [np.ravel(np.broadcast_to(np.eye(3), jacobian_products.shape)), np.ravel(jacobian_products)], axis=1
    )
    inertia_kg = np.ravel(calibration.inertia_kg)
    (moving_mass_kg, inertia_kg_m2), *_ = np.linalg.lstsq(design_matrix, inertia_kg, rcond=None)
    if moving_mass_kg < MIN_MOVING_MASS_KG or inertia_kg_m2 <= 0:
        raise ValueError(
            f"its handle would weigh {1000 * moving_mass_kg:.0f} g and its arms {inertia_kg_m2:.2g} kg m^2; the "
            f"simulated one weighs at least {1000 * MIN_MOVING_MASS_KG:.0f} g"
        )
    misfit = float(
        np.abs(design_matrix @ np.array([moving_mass_kg, inertia_kg_m2]) - inertia_kg).max() / np.abs(inertia_kg).max()
    )
    # The inertia does not show how i is divided between arms and motors: the ratio is that of the nominal device.
    forearm_kg_m2 = 2 / 3 * nominal_masses.forearm_kg * upper_arm_m**2
    inertia_ratio = inertia_kg_m2 / (nominal_masses.upper_arm_kg_m2 + forearm_kg_m2 + nominal_masses.drive_kg_m2)
    arms_kg_m2 = inertia_ratio * (nominal_masses.upper_arm_kg_m2 + forearm_kg_m2) - forearm_kg_m2
    if arms_kg_m2 <= 0:
        raise ValueError(f"its arms would weigh less than forearms of {1000 * nominal_masses.forearm_kg:.0f} g alone")
    masses = replace(
        nominal_masses,
        handle_kg=float(moving_mass_kg) - nominal_masses.forearm_kg,
        upper_arm_kg_m2=float(arms_kg_m2),
        drive_kg_m2=float(inertia_ratio * nominal_masses.drive_kg_m2),
    )
    return masses, misfit
