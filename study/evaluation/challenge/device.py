"""The true device of a case: the linear bench with all physics that its model may lack, and its sensor.

Path of the signal: command -> law of the drive, skipped commands -> `actuator_kernel` -> `mechanism_kernel` (motion) ->
`sensor` (readings). By default a device has none of the effects. `record` simulates a measurement.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge import handle_force_kernel
from study.evaluation.challenge.actuator_kernel import GAIN, drive_actuators
from study.evaluation.challenge.bench import Bench
from study.evaluation.challenge.drive_plan import RATE_HZ
from study.evaluation.challenge.law_kernel import COLUMN_COUNT
from study.evaluation.challenge.mechanism_kernel import MOTOR_MASS, PLAY_AXIS, Mechanism, Motion, integrate_motion
from study.evaluation.challenge.sensor import Sensor, read_sensor

STEPS_PER_SAMPLE = 20
"""Default number of integration steps per sample, the same as in `case_settings`."""


def _make_zero_forces() -> FloatArray:
    """Make the table (3, 11) of handle forces that are all zero, with end stops at infinity."""
    forces = np.zeros((3, 11))
    forces[:, handle_force_kernel.UPPER_STOP], forces[:, handle_force_kernel.LOWER_STOP] = np.inf, -np.inf
    return forces


def _make_ideal_amplifiers() -> FloatArray:
    """Make the table (3, 9) of amplifiers with gain 1 and no other effect: the force equals the command."""
    amplifiers = np.zeros((3, 9))
    amplifiers[:, GAIN] = 1.0
    return amplifiers


@dataclass(frozen=True, slots=True, eq=False)
class Device:
    """Parameters of bench, actuators, mechanism and sensor. The columns of the arrays are named in the kernels that
    read them."""

    bench: Bench
    """Linear dynamics: masses, dampers, springs."""
    amplifiers: FloatArray = field(default_factory=_make_ideal_amplifiers)
    """(3, 9), columns in `actuator_kernel`"""
    friction: FloatArray = field(default_factory=lambda: np.zeros((3, 7)))
    """(3, 7), columns in `friction_kernel`"""
    forces: FloatArray = field(default_factory=_make_zero_forces)
    """(3, 11), columns in `handle_force_kernel`"""
    inertia_per_m: FloatArray = field(default_factory=lambda: np.zeros(3))
    """(3,), 1/m: relative change of the whole handle's inertia with the position along each axis"""
    axis_mass_per_m: FloatArray = field(default_factory=lambda: np.zeros(3))
    """(3,), kg/m: change of the mass for motion along an axis with the position along it"""
    modulation: FloatArray = field(default_factory=lambda: np.zeros((3, 5)))
    """(3, 5), time-varying damping and stiffness, columns in `mechanism_kernel`"""
    play: FloatArray = field(default_factory=lambda: np.array([-1.0, 0.0, 0.0, 0.0, 0.0]))
    """(5,), backlash, columns in `mechanism_kernel`; axis -1: no axis has play"""
    creep_stiffness: FloatArray = field(default_factory=lambda: np.zeros((3, 1)))
    """(3, elements), N/m: springs to the ground, each in series with a damper"""
    creep_time_s: FloatArray = field(default_factory=lambda: np.ones(1))
    """(elements,), s: relaxation times of these elements"""
    coupling: float = 0.0
    """N/m^2: coupling of the axes x and y, with the potential coupling * x^2 y / 2"""
    skipped: int = 0
    """Every n-th command is not written, so that the previous command is held; 0 = none."""
    laws: FloatArray = field(default_factory=lambda: np.zeros((0, COLUMN_COUNT)))
    """(laws, 7), columns in `law_kernel`"""
    drive_law: Callable[[FloatArray], FloatArray] | None = None
    """Maps the commands (samples, 3), N, to a new array of them before they reach the amplifiers; None: the
    identity."""
    sensor: Sensor = field(default_factory=Sensor)
    """Sensor, with its clock and the logger."""
    steps: int = STEPS_PER_SAMPLE
    """Integration steps per sample."""

    def make_mechanism(self) -> Mechanism:
        """Make the parameters of `mechanism_kernel.integrate_motion`, in SI units. On an axis with play the motor moves
        separately, so its mass is subtracted from the mass matrix."""
        mass, damping, stiffness = self.bench.assemble_matrices()
        axis = int(self.play[PLAY_AXIS])
        if axis >= 0:
            mass[axis, axis] -= self.play[MOTOR_MASS]
        inverse_mass = np.linalg.inv(mass).astype(np.float64)
        return Mechanism(
            inverse_mass, damping, stiffness,
            self.friction, self.forces, self.inertia_per_m, self.axis_mass_per_m, self.modulation, self.play,
            self.creep_stiffness, 1.0 / (RATE_HZ * self.steps * self.creep_time_s), self.coupling, self.laws,
        )  # fmt: skip


def simulate_motion(device: Device, command: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Simulate the true acceleration (m/s^2) and position (m) of the handle at the samples, (samples, 3) each. command:
    (samples, 3), N. Raises ValueError where `simulate_full_motion` does."""
    full_motion = simulate_full_motion(device, command)
    return full_motion.acceleration, full_motion.position


def simulate_full_motion(device: Device, command: FloatArray) -> Motion:
    """Simulate the true motion of the handle, with velocity and the forces of its laws. command: (samples, 3), N.

    Raises ValueError where the motion is not finite or reaches 1 m: the parameters make the integration unstable.
    """
    written_command = command.copy() if device.drive_law is None else device.drive_law(command)
    if device.skipped:
        written_command[device.skipped :: device.skipped] = written_command[device.skipped - 1 : -1 : device.skipped]
    force = drive_actuators(written_command, device.amplifiers, device.steps, RATE_HZ)
    full_motion = integrate_motion(device.make_mechanism(), force, device.steps, RATE_HZ)
    if not (np.isfinite(full_motion.acceleration).all() and np.abs(full_motion.position).max() < 1.0):
        raise ValueError("the simulated device ran away: a stiffness, mass or per_m is too large for its step")
    return full_motion


def record(device: Device, command: FloatArray, random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Simulate the measured acceleration (m/s^2) and position (m), (samples, 3) each. command: (samples, 3), N; random:
    of the sensor's noise and lost samples. Raises ValueError where `simulate_full_motion` does."""
    acceleration, position = simulate_motion(device, command)
    return read_sensor(device.sensor, acceleration, position, RATE_HZ, random)
