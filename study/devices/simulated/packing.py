"""Write the named parameters of the simulated omega.3 into the flat array that its compiled functions read.

`layout` defines the elements of the array. Derived quantities are computed here: modal stiffness m w² and damping 2
zeta m w from frequency and damping ratio, the coefficients of first-order low passes, noise from its density, and the
depth at which the linkage is isotropic.
"""

import math

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.simulated import layout
from study.devices.simulated.compiled import solve_pose
from study.devices.simulated.parameters import GRAVITY_MPS2, Linkage, Omega3Parameters, Vector


def compute_isotropic_depth_m(linkage: Linkage) -> float:
    """Compute the distance from the base plane to the isotropic point on the axis, where the inertia is the same in all
    directions.

    On the axis each Jacobian row is parallel to its forearm. Three rows at 120 degrees give J^T J a multiple of the
    identity when the forearm's radial part is sqrt(2) times its axial part. Raises ValueError where the arms are too
    short or too long for such a point.
    """
    radial_m = linkage.forearm_m * math.sqrt(2 / 3)
    cos_upper_arm = (radial_m - linkage.radius_m) / linkage.upper_arm_m
    if not -1 < cos_upper_arm < 1:
        raise ValueError(f"no isotropic point on the axis: it would need cos q = {cos_upper_arm:.3f}, between -1 and 1")
    return linkage.forearm_m / math.sqrt(3) + linkage.upper_arm_m * math.sqrt(1 - cos_upper_arm**2)


def pack_parameters(parameters: Omega3Parameters, has_hand: bool, place_m: Vector) -> FloatArray:
    """Pack the parameters into an array (layout.PARAMETERS_SIZE,). has_hand: whether a hand holds the handle. place_m:
    position at which the hand's spring is relaxed. Without a given depth, raises ValueError as
    `compute_isotropic_depth_m`."""
    packed = np.zeros(layout.PARAMETERS_SIZE)
    _pack_linkage(packed, parameters)
    _pack_drives(packed, parameters)
    _pack_mount(packed, parameters)
    _pack_handle(packed, parameters, has_hand)
    _pack_sensor(packed, parameters)
    _write_elements(packed, layout.HAND_REST, place_m)
    stops = parameters.stops
    _write_elements(packed, layout.STOP_RADIUS, (stops.radius_m, stops.stiffness_n_per_m, stops.damping_n_s_per_m))
    return packed


def make_rest_state(packed: FloatArray, place_m: Vector) -> FloatArray:
    """Make the state (layout.STATE_SIZE,) at rest: the handle at place_m, the motors at the corresponding joint angles,
    cables and modes without load. packed: the result of `pack_parameters`."""
    state = np.zeros(layout.STATE_SIZE)
    _write_elements(state, layout.HANDLE_POSITION, place_m)
    solve_pose(
        packed, np.array(place_m, dtype=float), state[layout.MOTOR_ANGLE : layout.MOTOR_ANGLE + 3], np.empty((3, 3))
    )
    return state


def compute_effective_mass_kg(parameters: Omega3Parameters, packed: FloatArray) -> float:
    """Compute the effective mass at the origin without a hand, averaged over directions: m + I trace(J^T J) / 3, with
    the mass m of the handle and a third of each forearm, the inertia I of an arm with its drive and the rest of its
    forearm, and the Jacobian J from velocity to joint speeds. At the isotropic point it is the same in all
    directions."""
    jacobian = np.empty((3, 3))
    solve_pose(packed, np.zeros(3), np.empty(3), jacobian)
    masses = parameters.masses
    joint_inertia = packed[layout.ARM_INERTIA] + masses.drive_kg_m2
    return masses.handle_kg + masses.forearm_kg + float(joint_inertia * np.trace(jacobian.T @ jacobian) / 3)


def _write_elements(packed: FloatArray, start: int, values: tuple[float, ...] | FloatArray) -> None:
    """Write values of any shape, row by row, from the index `start` on."""
    flat_values = np.ravel(np.asarray(values, dtype=float))
    packed[start : start + flat_values.size] = flat_values


def _compute_unit_vectors(directions: tuple[Vector, ...]) -> FloatArray:
    """Unit vectors (directions, 3) along the given vectors."""
    rows = np.array(directions, dtype=float)
    unit_vectors: FloatArray = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return unit_vectors


def _compute_low_pass_coefficient(frequency_hz: float) -> float:
    """Coefficient a of a first-order low pass y += a (x - y) per step, exact for a constant input x."""
    return 1.0 - math.exp(-2 * math.pi * frequency_hz * layout.STEP_S)


def _pack_linkage(packed: FloatArray, parameters: Omega3Parameters) -> None:
    """Pack lengths (m), azimuths (as cosine and sine) and inertias (kg m²) of the linkage; without a given depth of the
    platform, that of the isotropic point."""
    linkage = parameters.linkage
    packed[layout.UPPER_ARM_LENGTH] = linkage.upper_arm_m
    packed[layout.FOREARM_LENGTH] = linkage.forearm_m
    packed[layout.RADIUS_DIFFERENCE] = linkage.radius_m
    packed[layout.PLATFORM_DEPTH] = compute_isotropic_depth_m(linkage) if linkage.depth_m is None else linkage.depth_m
    azimuths = np.radians(linkage.azimuths_deg)
    _write_elements(packed, layout.AZIMUTH, np.stack([np.cos(azimuths), np.sin(azimuths)], axis=1))
    masses = parameters.masses
    # Of a forearm, two thirds of the mass are lumped at the elbow and one third at the platform (`Masses`).
    packed[layout.ARM_INERTIA] = masses.upper_arm_kg_m2 + 2 / 3 * masses.forearm_kg * linkage.upper_arm_m**2
    packed[layout.DRIVE_INERTIA] = masses.drive_kg_m2


def _pack_drives(packed: FloatArray, parameters: Omega3Parameters) -> None:
    """Pack amplifier, friction, encoders and cables of the drives; cable damping 2 zeta sqrt(k I) from its ratio."""
    drives = parameters.drives
    packed[layout.AMPLIFIER_COEFFICIENT] = _compute_low_pass_coefficient(drives.amplifier_hz)
    packed[layout.COULOMB_FRICTION] = drives.friction_n_m
    packed[layout.PRESLIDING_RANGE] = drives.presliding_rad
    packed[layout.DRIVE_DAMPING] = drives.damping_n_m_s
    packed[layout.ENCODER_STEP] = 2 * math.pi / drives.counts_per_turn
    stiffness = np.array(drives.cable_n_m_per_rad)
    _write_elements(packed, layout.CABLE_STIFFNESS, stiffness)
    damping = 2 * drives.cable_damping_ratio * np.sqrt(stiffness * parameters.masses.drive_kg_m2)
    _write_elements(packed, layout.CABLE_DAMPING, damping)


def _pack_mount(packed: FloatArray, parameters: Omega3Parameters) -> None:
    """Pack modal mass, stiffness, damping and direction of the rocking modes of the base."""
    mount = parameters.mount
    masses, natural_rad_per_s = np.array(mount.masses_kg), 2 * math.pi * np.array(mount.frequencies_hz)
    _write_elements(packed, layout.MOUNT_MASS, masses)
    _write_elements(packed, layout.MOUNT_STIFFNESS, masses * natural_rad_per_s**2)
    _write_elements(packed, layout.MOUNT_DAMPING, 2 * np.array(mount.damping_ratios) * masses * natural_rad_per_s)
    _write_elements(packed, layout.MOUNT_DIRECTION, _compute_unit_vectors(mount.directions))


def _pack_handle(packed: FloatArray, parameters: Omega3Parameters, has_hand: bool) -> None:
    """Pack the modes of the handle, the mass matrix of the platform (kg) and, with a hand, its impedance."""
    modes = parameters.handle_modes
    masses, natural_rad_per_s = np.array(modes.masses_kg), 2 * math.pi * np.array(modes.frequencies_hz)
    directions = _compute_unit_vectors(modes.directions)
    _write_elements(packed, layout.MODE_MASS, masses)
    _write_elements(packed, layout.MODE_STIFFNESS, masses * natural_rad_per_s**2)
    _write_elements(packed, layout.MODE_DAMPING, 2 * np.array(modes.damping_ratios) * masses * natural_rad_per_s)
    _write_elements(packed, layout.MODE_GAIN, modes.gains)
    _write_elements(packed, layout.MODE_DIRECTION, directions)
    # Each of the three forearms adds a third of its mass to the platform.
    moving_mass_kg = parameters.masses.handle_kg + parameters.masses.forearm_kg
    # The modes' masses are part of the handle, so that its mass at low frequency is the same in all directions.
    platform_mass = moving_mass_kg * np.eye(3) - np.einsum("m,mi,mj->ij", masses, directions, directions)
    if has_hand:
        platform_mass += np.diag(parameters.hand.mass_kg)
        _write_elements(packed, layout.HAND_DAMPING, parameters.hand.damping_n_s_per_m)
        _write_elements(packed, layout.HAND_STIFFNESS, parameters.hand.stiffness_n_per_m)
    _write_elements(packed, layout.PLATFORM_MASS, platform_mass)


def _pack_sensor(packed: FloatArray, parameters: Omega3Parameters) -> None:
    """Pack mounting, as a small rotation (first order in the angles), cross-axis sensitivity, bandwidth, noise and
    range. White noise through a first-order low pass has the noise bandwidth pi/2 times the corner frequency."""
    sensor = parameters.accelerometer
    about_x, about_y, about_z = np.radians(sensor.turns_deg)
    yz, zx, xy = sensor.cross_axis
    rotation = np.array([[1, about_z, -about_y], [-about_z, 1, about_x], [about_y, -about_x, 1]])
    cross_axis = np.array([[1, xy, zx], [xy, 1, yz], [zx, yz, 1]])
    _write_elements(packed, layout.SENSOR_MATRIX, cross_axis @ rotation)
    packed[layout.SENSOR_COEFFICIENT] = _compute_low_pass_coefficient(sensor.bandwidth_hz)
    noise_bandwidth_hz = math.pi / 2 * sensor.bandwidth_hz
    density = np.array(sensor.noise_g_per_rthz)
    _write_elements(packed, layout.SENSOR_NOISE, density * math.sqrt(noise_bandwidth_hz) * GRAVITY_MPS2)
    packed[layout.SENSOR_RANGE] = sensor.range_g * GRAVITY_MPS2
