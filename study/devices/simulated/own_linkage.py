"""What the simulated device knows of its own linkage, as a real one tells it, and the way back: parameters with which
the simulated device has the linkage and the inertia of a calibration.

The way back has the simulated device's own equations. A device that is built otherwise (hinge offsets, arms that
weigh other than its neighbours') is met as well as these can; what is left is told.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from equalizer.linkage.calibration import LinkageCalibration, LinkageReading
from equalizer.linkage.grid import arm_azimuths
from equalizer.signals.signal import FloatArray
from study.devices.device import DeviceInfo
from study.devices.simulated import layout
from study.devices.simulated.compiled import pose
from study.devices.simulated.omega3 import NAME, omega3_info
from study.devices.simulated.packing import effective_mass_kg, isotropic_depth_m, pack_parameters
from study.devices.simulated.parameters import GRAVITY_M_S2, Linkage, Masses, Omega3Parameters

MOST_MISFIT = 0.1
"""Largest relative misfit of Jacobian or inertia: above it the simulated device would not be that of the
calibration."""
LIGHTEST_KG = 0.07
"""Least mass that moves with the handle: the parts that swing on it weigh 54 g."""


class SimulatedLinkage:
    """Linkage of the simulated omega.3, without a hand."""

    def __init__(self, parameters: Omega3Parameters, info: DeviceInfo) -> None:
        self.info = info
        self._packed = pack_parameters(parameters, False, (0.0, 0.0, 0.0))
        self._masses, self._reach_m = parameters.masses, parameters.stops.radius_m

    def at(self, position_m: FloatArray) -> LinkageReading | None:
        """The linkage at a position of the handle; None in the stops."""
        if not float(np.linalg.norm(position_m)) < self._reach_m:
            return None
        angles, rates = _pose(self._packed, position_m)
        carried = self._masses.handle_kg + self._masses.forearm_kg
        turning = self._packed[layout.ARM_INERTIA] + self._packed[layout.DRIVE_INERTIA]
        inertia = carried * np.eye(3) + turning * rates.T @ rates
        held = np.array([0.0, 0.0, GRAVITY_M_S2 * carried])
        jacobian: FloatArray = np.asarray(np.linalg.inv(rates), dtype=np.float64)
        return LinkageReading(np.array(position_m), angles, jacobian, inertia, held)

    def angles_at(self, position_m: FloatArray) -> FloatArray | None:
        """Joint angles (3,) at a position of the handle, rad; None in the stops."""
        return _pose(self._packed, position_m)[0] if float(np.linalg.norm(position_m)) < self._reach_m else None

    def check_frame(self) -> None:
        """Nothing to check: a simulated linkage has a single frame."""


@dataclass(frozen=True, slots=True)
class FittedLinkage:
    """Parameters of the simulated device fitted to a calibration, and what the fit leaves over."""

    parameters: Omega3Parameters
    jacobian_misfit: float
    """Largest difference from the calibration's joint rates, relative to their largest."""
    inertia_misfit: float
    """Likewise of the inertia."""


def make_simulated_linkage() -> SimulatedLinkage:
    """Linkage of the simulated omega.3 with its default parameters."""
    parameters = Omega3Parameters()
    mass_kg = effective_mass_kg(parameters, pack_parameters(parameters, False, (0.0, 0.0, 0.0)))
    return SimulatedLinkage(parameters, omega3_info(NAME, mass_kg, "parameter set 1, without a hand"))


def fit_linkage(calibration: LinkageCalibration) -> FittedLinkage:
    """Raises ValueError where no linkage of this kind has the calibration's Jacobian and inertia."""
    rates = np.linalg.inv(calibration.jacobian)
    rates = rates * np.sign(rates[:, :, :1])
    centre = int(np.argmin(np.linalg.norm(calibration.position_m, axis=1)))
    azimuths = arm_azimuths(calibration.jacobian[centre])
    linkage, jacobian_misfit = _fit_lengths(calibration.position_m, rates, azimuths)
    parameters = replace(Omega3Parameters(), linkage=linkage)
    masses, inertia_misfit = _fit_masses(parameters, calibration)
    for name, misfit in (("Jacobian", jacobian_misfit), ("inertia", inertia_misfit)):
        if not misfit <= MOST_MISFIT:
            raise ValueError(f"its {name} is {misfit:.0%} off that of any linkage of this kind, at the least")
    return FittedLinkage(replace(parameters, masses=masses), jacobian_misfit, inertia_misfit)


def _pose(packed: FloatArray, position_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Joint angles (3,), and joint speeds per handle velocity (3, 3), rad/m."""
    angles, rates = np.empty(3), np.empty((3, 3))
    pose(packed, np.array(position_m, dtype=float), angles, rates)
    return angles, rates


def _all_rates(parameters: Omega3Parameters, positions: FloatArray) -> FloatArray:
    packed = pack_parameters(parameters, False, (0.0, 0.0, 0.0))
    return np.stack([_pose(packed, position)[1] for position in positions])


def _fit_lengths(positions: FloatArray, rates: FloatArray, azimuths: FloatArray) -> tuple[Linkage, float]:
    nominal = Linkage()
    ratio = float(np.abs(_all_rates(Omega3Parameters(), positions)).max() / np.abs(rates).max())
    first = ratio * np.array([nominal.upper_arm_m, nominal.forearm_m, nominal.radius_m, isotropic_depth_m(nominal)])
    largest = float(np.abs(rates).max())

    def linkage_of(numbers: FloatArray) -> Linkage:
        turned = np.degrees(azimuths + numbers[4])
        upper, forearm, radius, depth = (float(each) for each in first * np.exp(numbers[:4]))
        return Linkage(upper, forearm, radius, (float(turned[0]), float(turned[1]), float(turned[2])), depth)

    def misfits(numbers: FloatArray) -> FloatArray:
        found = _all_rates(replace(Omega3Parameters(), linkage=linkage_of(numbers)), positions)
        return np.ravel(found - rates) / largest

    found = least_squares(misfits, np.zeros(5), bounds=(-1.5, 1.5))
    return linkage_of(found.x), float(np.abs(found.fun).max())


def _fit_masses(parameters: Omega3Parameters, calibration: LinkageCalibration) -> tuple[Masses, float]:
    """Masses by least squares on the calibration's inertia matrices: that which moves with the handle and that which
    turns with each arm; the inertia is linear in both."""
    nominal, arm_m = parameters.masses, parameters.linkage.upper_arm_m
    rates = _all_rates(parameters, calibration.position_m)
    turning = np.einsum("nki,nkj->nij", rates, rates)
    columns = np.stack([np.ravel(np.broadcast_to(np.eye(3), turning.shape)), np.ravel(turning)], axis=1)
    wanted = np.ravel(calibration.inertia_kg)
    (carried_kg, inertia_kg_m2), *_ = np.linalg.lstsq(columns, wanted, rcond=None)
    if carried_kg < LIGHTEST_KG or inertia_kg_m2 <= 0:
        raise ValueError(
            f"its handle would weigh {1000 * carried_kg:.0f} g and its arms {inertia_kg_m2:.2g} kg m^2; the simulated "
            f"one weighs at least {1000 * LIGHTEST_KG:.0f} g"
        )
    misfit = float(np.abs(columns @ np.array([carried_kg, inertia_kg_m2]) - wanted).max() / np.abs(wanted).max())
    # Between arms and motors, on either side of the cables, it is shared as in the simulated device.
    forearms = 2 / 3 * nominal.forearm_kg * arm_m**2
    share = inertia_kg_m2 / (nominal.upper_arm_kg_m2 + forearms + nominal.drive_kg_m2)
    arms_kg_m2 = share * (nominal.upper_arm_kg_m2 + forearms) - forearms
    if arms_kg_m2 <= 0:
        raise ValueError(f"its arms would weigh less than forearms of {1000 * nominal.forearm_kg:.0f} g alone")
    masses = replace(
        nominal,
        handle_kg=float(carried_kg) - nominal.forearm_kg,
        upper_arm_kg_m2=float(arms_kg_m2),
        drive_kg_m2=float(share * nominal.drive_kg_m2),
    )
    return masses, misfit
