"""Linkage of the simulated device by position, as a real device reports it, and the inverse problem: the parameters of
the simulated device that fit the linkage and the inertia of a calibration.

Four lengths and a common turn of the azimuths are fitted to the Jacobians (nonlinear least squares), then two masses to
the inertia matrices (linear least squares). A device of another design (hinge offsets, arms of unequal weight) is only
approximated; `FittedLinkage` states the misfit. `study.devices.opening` calls `make_simulated_linkage`,
`study.devices.rigs_by_name` calls `fit_linkage`.
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
"""Largest accepted relative misfit of Jacobian or inertia; above it, the simulated device would not represent the
calibrated device."""
MIN_MOVING_MASS_KG = 0.07
"""Smallest mass that moves with the handle (kg): the handle modes, which are part of it, have 54 g."""


class SimulatedLinkage:
    """Linkage of the simulated omega.3 without a hand: a `study.devices.opening.LinkageSource`."""

    def __init__(self, parameters: Omega3Parameters, info: DeviceInfo) -> None:
        self.info = info
        self._packed = pack_parameters(parameters, False, (0.0, 0.0, 0.0))
        self._masses, self._reach_m = parameters.masses, parameters.stops.radius_m

    def compute_reading_at(self, position_m: FloatArray) -> LinkageReading | None:
        """Joint angles (rad), Jacobian (m/rad), inertia matrix (kg) and gravity force (N) at a position of the handle
        (3,), m; None at or beyond the end stop."""
        if not float(np.linalg.norm(position_m)) < self._reach_m:
            return None
        angles, rates = _compute_pose(self._packed, position_m)
        moving_mass_kg = self._masses.handle_kg + self._masses.forearm_kg
        arm_inertia = self._packed[layout.ARM_INERTIA] + self._packed[layout.DRIVE_INERTIA]
        inertia = moving_mass_kg * np.eye(3) + arm_inertia * rates.T @ rates
        gravity_force_n = np.array([0.0, 0.0, GRAVITY_MPS2 * moving_mass_kg])
        jacobian: FloatArray = np.asarray(np.linalg.inv(rates), dtype=np.float64)
        return LinkageReading(np.array(position_m), angles, jacobian, inertia, gravity_force_n)

    def compute_angles_at(self, position_m: FloatArray) -> FloatArray | None:
        """Joint angles (3,), rad, at a position of the handle (3,), m; None at or beyond the end stop."""
        return _compute_pose(self._packed, position_m)[0] if float(np.linalg.norm(position_m)) < self._reach_m else None

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
    """Linkage of the simulated omega.3 with its default parameters."""
    parameters = Omega3Parameters()
    mass_kg = compute_effective_mass_kg(parameters, pack_parameters(parameters, False, (0.0, 0.0, 0.0)))
    return SimulatedLinkage(parameters, make_omega3_info(NAME, mass_kg, "parameter set 1, without a hand"))


def fit_linkage(calibration: LinkageCalibration) -> FittedLinkage:
    """Fit the simulated device to a calibration. Raises ValueError where Jacobian or inertia differ by more than
    `MAX_MISFIT`, or a fitted mass is too small."""
    rates = np.linalg.inv(calibration.jacobian)
    rates = rates * np.sign(rates[:, :, :1])
    centre_index = int(np.argmin(np.linalg.norm(calibration.position_m, axis=1)))
    azimuths = estimate_arm_azimuths(calibration.jacobian[centre_index])
    linkage, jacobian_misfit = _fit_lengths(calibration.position_m, rates, azimuths)
    parameters = replace(Omega3Parameters(), linkage=linkage)
    masses, inertia_misfit = _fit_masses(parameters, calibration)
    for name, misfit in (("Jacobian", jacobian_misfit), ("inertia", inertia_misfit)):
        if not misfit <= MAX_MISFIT:
            raise ValueError(f"its {name} is {misfit:.0%} off that of any linkage of this kind, at the least")
    return FittedLinkage(replace(parameters, masses=masses), jacobian_misfit, inertia_misfit)


def _compute_pose(packed: FloatArray, position_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Joint angles (3,), rad, and joint speeds per handle velocity (3, 3), rad/m, at a position (3,), m. packed:
    parameters as in `layout`."""
    angles, rates = np.empty(3), np.empty((3, 3))
    solve_pose(packed, np.array(position_m, dtype=float), angles, rates)
    return angles, rates


def _compute_rates(parameters: Omega3Parameters, positions: FloatArray) -> FloatArray:
    """(n, 3, 3), rad/m: joint speeds per handle velocity at the positions (n, 3), m."""
    packed = pack_parameters(parameters, False, (0.0, 0.0, 0.0))
    return np.stack([_compute_pose(packed, position)[1] for position in positions])


def _fit_lengths(positions: FloatArray, rates: FloatArray, azimuths: FloatArray) -> tuple[Linkage, float]:
    """Fit the linkage by least squares. Returns it and its misfit, see `FittedLinkage`. positions: (n, 3), m; rates:
    (n, 3, 3), rad/m; azimuths: (3,), rad. The unknowns are the logarithms of four lengths over their start values,
    which are scaled to the size of the device, and a turn of all azimuths."""
    nominal = Linkage()
    scale = float(np.abs(_compute_rates(Omega3Parameters(), positions)).max() / np.abs(rates).max())
    start_lengths_m = scale * np.array(
        [nominal.upper_arm_m, nominal.forearm_m, nominal.radius_m, compute_isotropic_depth_m(nominal)]
    )
    largest_rate = float(np.abs(rates).max())

    def make_linkage(unknowns: FloatArray) -> Linkage:
        """Linkage of the unknowns (5,): four logarithms of length ratios, and the turn of the azimuths (rad)."""
        azimuths_deg = np.degrees(azimuths + unknowns[4])
        upper_arm, forearm, radius, depth = (float(length) for length in start_lengths_m * np.exp(unknowns[:4]))
        return Linkage(
            upper_arm, forearm, radius, (float(azimuths_deg[0]), float(azimuths_deg[1]), float(azimuths_deg[2])), depth
        )

    def compute_misfits(unknowns: FloatArray) -> FloatArray:
        """Residuals (9 n,) of the inverse Jacobian, relative to its largest element."""
        fitted_rates = _compute_rates(replace(Omega3Parameters(), linkage=make_linkage(unknowns)), positions)
        return np.ravel(fitted_rates - rates) / largest_rate

    solution = least_squares(compute_misfits, np.zeros(5), bounds=(-1.5, 1.5))
    return make_linkage(solution.x), float(np.abs(solution.fun).max())


def _fit_masses(parameters: Omega3Parameters, calibration: LinkageCalibration) -> tuple[Masses, float]:
    """Fit the masses by linear least squares to the calibration's inertia matrices, m I + i J^T J with J the joint
    speeds per handle velocity (rad/m): m (kg) moves with the handle, and i (kg m²) turns with each arm. Returns the
    misfit too, see `FittedLinkage`. Raises ValueError for masses that are too small."""
    nominal, arm_m = parameters.masses, parameters.linkage.upper_arm_m
    rates = _compute_rates(parameters, calibration.position_m)
    rate_products = np.einsum("nki,nkj->nij", rates, rates)
    design_matrix = np.stack(
        [np.ravel(np.broadcast_to(np.eye(3), rate_products.shape)), np.ravel(rate_products)], axis=1
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
    forearm_kg_m2 = 2 / 3 * nominal.forearm_kg * arm_m**2
    inertia_ratio = inertia_kg_m2 / (nominal.upper_arm_kg_m2 + forearm_kg_m2 + nominal.drive_kg_m2)
    arms_kg_m2 = inertia_ratio * (nominal.upper_arm_kg_m2 + forearm_kg_m2) - forearm_kg_m2
    if arms_kg_m2 <= 0:
        raise ValueError(f"its arms would weigh less than forearms of {1000 * nominal.forearm_kg:.0f} g alone")
    masses = replace(
        nominal,
        handle_kg=float(moving_mass_kg) - nominal.forearm_kg,
        upper_arm_kg_m2=float(arms_kg_m2),
        drive_kg_m2=float(inertia_ratio * nominal.drive_kg_m2),
    )
    return masses, misfit
