"""Indices into the two flat arrays of the simulated device's compiled functions: state and parameters, in SI units.

Each constant of the two lists is the index of the first number of a quantity, which ends where the next constant
begins. Vectors have the order x, y, z; quantities of the drives have the order of the legs. `packing` fills the arrays;
the equations are in docs/simulated_omega3.md.
"""

HANDLE_MODES = 6
"""Number of handle modes; a constant, because the compiled code needs the sizes of its arrays."""
MOUNT_MODES = 2
"""Number of modes of the mount, in which the base rocks."""
SUBSTEPS = 10
"""Integration steps in a tick; chosen, so that a step of 0.1 ms is short against the modes (up to 391 Hz)."""
TICK_S = 1e-3
"""Duration of a tick of the control loop (s)."""
STEP_S = TICK_S / SUBSTEPS
"""Step of integration (s)."""

# State, SI units.
HANDLE_POSITION = 0
"""Position of the handle against the base, m."""
HANDLE_VELOCITY = HANDLE_POSITION + 3
"""Velocity of the handle against the base, m/s."""
MOTOR_ANGLE = HANDLE_VELOCITY + 3
"""Motor angles divided by the ratio of the capstans, rad."""
MOTOR_SPEED = MOTOR_ANGLE + 3
"""Speeds of the same angles, rad/s."""
MOUNT_DISPLACEMENT = MOTOR_SPEED + 3
"""Modal displacements of the mount at the handle, m."""
MOUNT_SPEED = MOUNT_DISPLACEMENT + MOUNT_MODES
"""Speeds of the mount's modes, m/s."""
MODE_DISPLACEMENT = MOUNT_SPEED + MOUNT_MODES
"""Displacements of the handle modes against the platform, m."""
MODE_SPEED = MODE_DISPLACEMENT + HANDLE_MODES
"""Speeds of the handle modes, m/s."""
MOTOR_TORQUE = MODE_SPEED + HANDLE_MODES
"""Motor torques after the low pass of the amplifiers, N m."""
BRISTLE_DEFLECTION = MOTOR_TORQUE + 3
"""Deflection of the bristle of Dahl's friction model at each motor, rad."""
FILTERED_ACCELERATION = BRISTLE_DEFLECTION + 3
"""Acceleration after the low pass of the accelerometer, m/s²."""
TRUE_ACCELERATION = FILTERED_ACCELERATION + 3
"""True acceleration at the place of the accelerometer, m/s²."""
STATE_SIZE = TRUE_ACCELERATION + 3
"""Length of the state."""

# Parameters, SI units.
UPPER_ARM_LENGTH = 0
"""Length of an upper arm, m."""
FOREARM_LENGTH = 1
"""Length of a forearm, m."""
RADIUS_DIFFERENCE = 2
"""Radius of the base less that of the platform, m."""
PLATFORM_DEPTH = 3
"""Distance of the origin in front of the base's plane, m."""
AZIMUTH = 4
"""Cosine and sine of the azimuth of each leg."""
PLATFORM_MASS = AZIMUTH + 6
"""(3, 3), kg: platform and handle without the masses of the handle modes; with that of the hand, if any."""
ARM_INERTIA = PLATFORM_MASS + 9
"""Inertia of an arm about its pivot, kg m², with the part of the forearm that is lumped at the elbow."""
DRIVE_INERTIA = ARM_INERTIA + 1
"""Inertia of a motor with capstan and drum, about the arm's pivot, kg m²."""
AMPLIFIER_COEFFICIENT = DRIVE_INERTIA + 1
"""Coefficient of the amplifier's first-order low pass: share of the difference that vanishes in a step."""
COULOMB_FRICTION = AMPLIFIER_COEFFICIENT + 1
"""Coulomb friction of a motor, about the arm's pivot, N m."""
PRESLIDING_RANGE = COULOMB_FRICTION + 1
"""Largest deflection z_max of the bristle, over which friction builds up after a reversal, rad."""
DRIVE_DAMPING = PRESLIDING_RANGE + 1
"""Viscous damping of a motor, N m s/rad."""
CABLE_STIFFNESS = DRIVE_DAMPING + 1
"""Stiffness of each cable, N m/rad."""
CABLE_DAMPING = CABLE_STIFFNESS + 3
"""Damping of each cable, N m s/rad."""
ENCODER_STEP = CABLE_DAMPING + 3
"""Resolution of the encoders, rad per count."""
MOUNT_MASS = ENCODER_STEP + 1
"""Modal masses of the mount, kg."""
MOUNT_STIFFNESS = MOUNT_MASS + MOUNT_MODES
"""Modal stiffnesses of the mount, N/m."""
MOUNT_DAMPING = MOUNT_STIFFNESS + MOUNT_MODES
"""Modal dampings of the mount, N s/m."""
MOUNT_DIRECTION = MOUNT_DAMPING + MOUNT_MODES
"""(MOUNT_MODES, 3), unit vectors of the mount's motion at the handle."""
MODE_MASS = MOUNT_DIRECTION + 3 * MOUNT_MODES
"""Masses of the handle modes, kg."""
MODE_STIFFNESS = MODE_MASS + HANDLE_MODES
"""Stiffnesses of the handle modes, N/m."""
MODE_DAMPING = MODE_STIFFNESS + HANDLE_MODES
"""Dampings of the handle modes, N s/m."""
MODE_GAIN = MODE_DAMPING + HANDLE_MODES
"""Share of the displacement of each mode at the accelerometer."""
MODE_DIRECTION = MODE_GAIN + HANDLE_MODES
"""(HANDLE_MODES, 3), unit vectors of the motion of the handle modes."""
HAND_DAMPING = MODE_DIRECTION + 3 * HANDLE_MODES
"""Damping of the hand along x, y, z, N s/m; zero without a hand."""
HAND_STIFFNESS = HAND_DAMPING + 3
"""Stiffness of the hand along x, y, z, N/m; zero without a hand."""
HAND_REST = HAND_STIFFNESS + 3
"""Position at which the spring of the hand is relaxed, m."""
STOP_RADIUS = HAND_REST + 3
"""Radius of the sphere beyond which the end stop pushes back, m."""
STOP_STIFFNESS = STOP_RADIUS + 1
"""Stiffness of the end stop, N/m."""
STOP_DAMPING = STOP_STIFFNESS + 1
"""Damping of the end stop, N s/m."""
SENSOR_COEFFICIENT = STOP_DAMPING + 1
"""Coefficient of the accelerometer's first-order low pass: share of the difference that vanishes in a step."""
SENSOR_MATRIX = SENSOR_COEFFICIENT + 1
"""(3, 3): from device axes to the channels of the accelerometer (mounting and cross-axis sensitivity)."""
SENSOR_NOISE = SENSOR_MATRIX + 9
"""Standard deviation of the noise of each channel, m/s²."""
SENSOR_RANGE = SENSOR_NOISE + 3
"""Acceleration at which a channel clips, m/s²."""
PARAMETERS_SIZE = SENSOR_RANGE + 1
"""Length of the parameters."""
