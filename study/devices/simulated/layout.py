"""Layout of the two flat arrays that the compiled functions share: state and parameters, in SI units.

Each constant is the index of a quantity's first number; the next constant shows how many there are. The equations:
docs/simulated_omega3.md.
"""

MODES = 6
"""Handle modes; a shape, so known when compiled."""
MOUNTS = 2
"""Modes of the mount: its base rocks in two directions."""
SUBSTEPS = 10
"""Steps of integration in a tick."""
TICK_S = 1e-3
"""Duration of a tick of the loop (s)."""
STEP_S = TICK_S / SUBSTEPS
"""Step of integration (s)."""

# State, SI units.
RELATIVE = 0
"""Handle's position and then velocity, against the base."""
VELOCITY = RELATIVE + 3
"""Handle's velocity against the base."""
MOTOR = VELOCITY + 3
"""Motor angles, behind the capstans, and then speeds."""
MOTOR_SPEED = MOTOR + 3
ROCKING = MOTOR_SPEED + 3
"""The mount's modal displacements at the handle, and speeds."""
ROCKING_SPEED = ROCKING + MOUNTS
BENDING = ROCKING_SPEED + MOUNTS
"""The handle modes' displacements against the platform, and speeds."""
BENDING_SPEED = BENDING + MODES
TORQUE = BENDING_SPEED + MODES
"""Motor torques behind the amplifiers' bandwidth."""
BRISTLE = TORQUE + 3
"""Deflections of the friction's bristles, one per motor."""
FILTERED = BRISTLE + 3
"""Acceleration behind the accelerometer's bandwidth."""
TRUE = FILTERED + 3
"""Acceleration of the accelerometer's place."""
STATE_SIZE = TRUE + 3
"""Numbers in the state."""

# Parameters, SI units.
UPPER_ARM = 0
"""Length, as the next three."""
FOREARM = 1
RADIUS = 2
PLATFORM_DEPTH = 3
"""Distance of the origin in front of the base's plane."""
AZIMUTH = 4
"""Cosine and sine of each leg's azimuth."""
PLATFORM_MASS = AZIMUTH + 6
"""(3, 3): what moves with the platform and is no handle mode; with the hand's mass."""
ARM_INERTIA = PLATFORM_MASS + 9
"""Of one arm about its pivot, kg m², with the part of the forearm that is lumped at the elbow."""
DRIVE_INERTIA = ARM_INERTIA + 1
"""Of one motor with capstan and drum, about the arm's pivot, kg m²."""
AMPLIFIER = DRIVE_INERTIA + 1
"""Part of the way that the torque goes in one step."""
FRICTION = AMPLIFIER + 1
"""Coulomb friction of a motor, N m."""
PRESLIDING = FRICTION + 1
"""Angle over which the friction of a motor builds up after a reversal, rad."""
DRIVE_DAMPING = PRESLIDING + 1
"""Viscous damping of one motor, N m s/rad."""
CABLE = DRIVE_DAMPING + 1
"""Stiffness of each cable."""
CABLE_DAMPING = CABLE + 3
"""Damping of each cable, N m s/rad."""
COUNT = CABLE_DAMPING + 3
"""One encoder count, rad."""
MOUNT_MASS = COUNT + 1
"""Modal masses of the mount, then stiffnesses and dampings."""
MOUNT_STIFFNESS = MOUNT_MASS + MOUNTS
MOUNT_DAMPING = MOUNT_STIFFNESS + MOUNTS
MOUNT_DIRECTION = MOUNT_DAMPING + MOUNTS
"""(MOUNTS, 3), unit vectors."""
MODE_MASS = MOUNT_DIRECTION + 3 * MOUNTS
"""Modal masses of the handle modes, then stiffnesses and dampings."""
MODE_STIFFNESS = MODE_MASS + MODES
MODE_DAMPING = MODE_STIFFNESS + MODES
MODE_GAIN = MODE_DAMPING + MODES
"""Share of each mode in the motion at the sensor."""
MODE_DIRECTION = MODE_GAIN + MODES
"""(MODES, 3), unit vectors."""
HAND_DAMPING = MODE_DIRECTION + 3 * MODES
"""Of the hand along x, y, z, then its stiffness and its place of rest; zero damping and stiffness without a hand."""
HAND_STIFFNESS = HAND_DAMPING + 3
HAND_REST = HAND_STIFFNESS + 3
STOP_RADIUS = HAND_REST + 3
"""Radius of the sphere beyond which the stop pushes back, then its stiffness and damping."""
STOP_STIFFNESS = STOP_RADIUS + 1
STOP_DAMPING = STOP_STIFFNESS + 1
SENSOR_POLE = STOP_DAMPING + 1
"""Part of the way that the filtered acceleration goes in one step."""
SENSOR_MATRIX = SENSOR_POLE + 1
"""(3, 3): from device axes to the sensor's channels."""
SENSOR_NOISE = SENSOR_MATRIX + 9
"""Standard deviation of each channel, m/s²."""
SENSOR_RANGE = SENSOR_NOISE + 3
"""Acceleration at which a channel clips, m/s²."""
PARAMETERS_SIZE = SENSOR_RANGE + 1
"""Numbers in the parameters."""
