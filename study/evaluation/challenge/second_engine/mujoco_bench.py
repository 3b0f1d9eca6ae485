"""The bench of the blind test as a MuJoCo model: a handle on three slides, attached oscillators, concealed effects.

Dry friction is MuJoCo's friction loss (a constraint, no bristle); an end stop is a tendon whose spring has a dead band;
backlash is a motor body behind a tendon with limits; a hand and added masses are armature, damping and stiffness of the
slides; saturation, gain and lag are those of its actuators. Integrator: Runge-Kutta of fourth order.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from xml.etree import ElementTree as Xml

import mujoco
import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.bench import Bench, Oscillators
from study.evaluation.challenge.drive_plan import AXES, RATE_HZ

STEPS_PER_SAMPLE = 10
"""Integration steps per sample. Chosen: the integrator is of fourth order, so that fewer steps than in `device`
suffice."""
STEP_S = 1.0 / (RATE_HZ * STEPS_PER_SAMPLE)
"""Step of integration (s)."""
HANDLE_MASS_RATIO = 0.4
"""Mass of the handle's body over that of the lightest axis. The rest of an axis's mass is armature, the inertia of that
joint alone. Chosen: with a motor of up to 0.4 of the axis's mass, the armature stays positive."""
CONTACT_IMPEDANCE = 0.01
"""MuJoCo's constraint impedance (0 to 1) of a contact: small, so that the contact force is that of a spring and a
damper with their nominal values. Chosen."""

Values = Mapping[str, float]
"""Drawn parameters of an effect, by name."""


@dataclass(frozen=True, slots=True, eq=False)
class MujocoBench:
    """Parameters of the bench and of its concealed effects; arrays (3,) have a value per axis."""

    mass_kg: FloatArray
    """Mass that moves along each axis (kg), without the oscillators."""
    damping: FloatArray
    """N s/m, to the ground."""
    stiffness: FloatArray
    """N/m, to the ground."""
    oscillators: Oscillators
    """Oscillators attached to the handle."""
    friction_n: FloatArray
    """Dry friction (N)."""
    force_n: FloatArray
    """Constant force on the handle (N)."""
    gain: FloatArray
    """Force per command (N/N)."""
    limit_n: FloatArray
    """Saturation of the force (N); 0 = none."""
    lag_s: float = 0.0
    """Time constant of the actuators' first-order lag (s); 0 = none."""
    delay_s: float = 0.0
    """Delay of the commands (s), rounded to integration steps (of 0.1 ms) by the simulation."""
    stop: tuple[int, float, float, float] | None = None
    """End stop: axis, lower and upper end (m), stiffness (N/m)."""
    play: tuple[int, Values] | None = None
    """Axis, and the parameters of `backlash`: motor mass, gap, contact stiffness and damping (SI units)."""


def make_baseline_bench(bench: Bench) -> MujocoBench:
    """Make the closest MuJoCo equivalent of a bench, without concealed effects: the off-diagonal terms of mass, damping
    and stiffness are dropped."""
    mass, damping, stiffness = (np.diag(matrix).copy() for matrix in (bench.mass, bench.damping, bench.stiffness))
    zeros = np.zeros(3)
    return MujocoBench(mass, damping, stiffness, bench.oscillators, zeros, zeros, np.ones(3), zeros)


def linearise(bench: MujocoBench) -> Bench:
    """Convert the linear part to a bench, without gain, lag and delay. Perpendicular to its slide, an oscillator moves
    with the handle, so that its mass adds to the handle's in these directions."""
    mass = np.diag(bench.mass_kg)
    for oscillator_kg, direction in zip(bench.oscillators.mass_kg, bench.oscillators.direction, strict=True):
        mass += oscillator_kg * (np.eye(3) - np.outer(direction, direction))
    return Bench(mass, np.diag(bench.damping), np.diag(bench.stiffness), bench.oscillators)


def simulate_motion(bench: MujocoBench, command: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Simulate acceleration (m/s²) and position (m) of the handle, (samples, 3) each, just before each command is
    written.

    The delay consists of whole samples and remaining integration steps. command: (samples, 3), N. Raises ValueError
    where the motion is not finite or reaches 1 m, the bound of a diverging motion (chosen).
    """
    model = mujoco.MjModel.from_xml_string(_format_mjcf(bench))
    data = mujoco.MjData(model)
    handle_dofs = [model.joint(axis).dofadr[0] for axis in AXES]
    data.qfrc_applied[handle_dofs] = bench.force_n
    delay_steps = round(bench.delay_s / STEP_S)
    delay_samples, extra_steps = divmod(delay_steps, STEPS_PER_SAMPLE)
    acceleration, position = np.zeros((len(command), 3)), np.zeros((len(command), 3))
    for sample in range(len(command)):
        mujoco.mj_forward(model, data)
        acceleration[sample], position[sample] = data.qacc[handle_dofs], data.qpos[handle_dofs]
        if extra_steps:
            data.ctrl[:] = _select_command(command, sample - delay_samples - 1)
            mujoco.mj_step(model, data, extra_steps)
        data.ctrl[:] = _select_command(command, sample - delay_samples)
        mujoco.mj_step(model, data, STEPS_PER_SAMPLE - extra_steps)
    if not (np.isfinite(acceleration).all() and np.abs(position).max() < 1.0):
        raise ValueError("the device of the second engine ran away")
    return acceleration, position


def replace_delay(bench: MujocoBench, delay_s: float) -> MujocoBench:
    """Replace the delay (s), rounded to whole steps and at least one, so that the label is exact; returns a new
    bench."""
    return replace(bench, delay_s=max(round(delay_s / STEP_S), 1) * STEP_S)


def _select_command(command: FloatArray, sample: int) -> FloatArray:
    """Select the command (3,), N, of a sample; zero before the first."""
    return command[sample] if sample >= 0 else np.zeros(3)


def _format_mjcf(bench: MujocoBench) -> str:
    """Format the bench as a MuJoCo model (MJCF, XML). Armature adds inertia along a single joint, so that axes
    differ."""
    root = Xml.Element("mujoco")
    _add_element(root, "compiler", {"autolimits": "true"})
    # Solver tolerance and iterations are chosen: the residual of friction and contacts is negligible.
    solver_options = {"integrator": "RK4", "tolerance": "1e-12", "iterations": "50"}
    _add_element(root, "option", {"timestep": f"{STEP_S:.12g}", "gravity": "0 0 0"} | solver_options)
    world = _add_element(root, "worldbody")
    handle = _add_element(world, "body", {"name": "handle"})
    handle_kg = HANDLE_MASS_RATIO * float(bench.mass_kg.min())
    motor_kg = np.zeros(3)
    if bench.play is not None:
        axis, play_values = bench.play
        motor_kg[axis] = play_values["motor_mass"]
        motor = _add_element(world, "body", {"name": "motor"})
        _add_slide(motor, "motor", np.eye(3)[axis], {})
        _add_mass(motor, float(play_values["motor_mass"]))
    for axis_index, axis_name in enumerate(AXES):
        joint_values = {
            "armature": bench.mass_kg[axis_index] - handle_kg - motor_kg[axis_index],
            "damping": bench.damping[axis_index],
            "stiffness": bench.stiffness[axis_index], "frictionloss": bench.friction_n[axis_index],
        }  # fmt: skip
        _add_slide(handle, axis_name, np.eye(3)[axis_index], joint_values)
    _add_mass(handle, handle_kg)
    _add_oscillators(handle, bench.oscillators)
    tendons = _add_element(root, "tendon")
    if bench.stop is not None:
        axis, lower_m, upper_m, stiffness = bench.stop
        spring_range = f"{lower_m:.12g} {upper_m:.12g}"
        stop_tendon = _add_element(
            tendons, "fixed", {"name": "stop", "stiffness": stiffness, "springlength": spring_range}
        )
        _add_element(stop_tendon, "joint", {"joint": AXES[axis], "coef": 1.0})
    if bench.play is not None:
        _add_play(tendons, bench, *bench.play)
    _add_actuators(_add_element(root, "actuator"), bench)
    return Xml.tostring(root, encoding="unicode")


def _add_oscillators(handle: Xml.Element, oscillators: Oscillators) -> None:
    """Add each oscillator as a body on a slide with spring and damper, along its direction."""
    for index, (frequency_hz, mass_kg, damping_ratio, direction) in enumerate(
        zip(
            oscillators.frequency_hz, oscillators.mass_kg, oscillators.damping_ratio, oscillators.direction, strict=True
        )
    ):
        stiffness = mass_kg * (2 * np.pi * frequency_hz) ** 2
        body = _add_element(handle, "body", {"name": f"rider {index}"})
        _add_slide(
            body,
            f"rider {index}",
            direction,
            {"stiffness": stiffness, "damping": 2 * damping_ratio * np.sqrt(stiffness * mass_kg)},
        )
        _add_mass(body, float(mass_kg))


def _add_play(tendons: Xml.Element, bench: MujocoBench, axis: int, values: Values) -> None:
    """Add backlash: a tendon between motor and handle limits their distance, a one-sided contact at each end of the
    gap."""
    motor_kg = values["motor_mass"]
    mass, _, _ = linearise(bench).assemble_matrices()
    mass[axis, axis] -= motor_kg
    # MuJoCo takes stiffness and damping of a contact per unit of effective mass, here of motor and handle in series.
    reduced_mass_kg = 1.0 / (1.0 / motor_kg + np.linalg.inv(mass)[axis, axis])
    stiffness_per_kg, damping_per_kg = (
        values["contact_stiffness"] / reduced_mass_kg,
        values["contact_damping"] / reduced_mass_kg,
    )
    half_gap_m = 0.5 * values["gap"]
    contact = {
        "solreflimit": f"{-stiffness_per_kg:.12g} {-damping_per_kg:.12g}",
        "solimplimit": f"{CONTACT_IMPEDANCE} {CONTACT_IMPEDANCE} 1",
    }
    play_tendon = _add_element(
        tendons, "fixed", {"name": "play", "range": f"{-half_gap_m:.12g} {half_gap_m:.12g}"} | contact
    )
    _add_element(play_tendon, "joint", {"joint": "motor", "coef": 1.0})
    _add_element(play_tendon, "joint", {"joint": AXES[axis], "coef": -1.0})


def _add_actuators(parent: Xml.Element, bench: MujocoBench) -> None:
    """Add the force of each axis, with gain, saturation and lag; with backlash it acts on the motor."""
    for axis_index, axis_name in enumerate(AXES):
        joint = "motor" if bench.play is not None and bench.play[0] == axis_index else axis_name
        actuator = _add_element(parent, "general", {"joint": joint, "gainprm": float(bench.gain[axis_index])})
        if bench.limit_n[axis_index] > 0.0:
            actuator.set("forcerange", f"{-bench.limit_n[axis_index]:.12g} {bench.limit_n[axis_index]:.12g}")
        if bench.lag_s > 0.0:
            actuator.set("dyntype", "filter")
            actuator.set("dynprm", f"{bench.lag_s:.12g}")


def _add_slide(body: Xml.Element, name: str, direction: FloatArray, attributes: Mapping[str, float]) -> None:
    """Add a sliding joint along a direction (3,); attributes (MJCF names) that are zero are left out. Dry friction is a
    nearly rigid constraint with a time constant of two steps, a damping ratio of 1 and an impedance of 0.999 to 0.9999
    (chosen)."""
    joint = _add_element(
        body, "joint", {"name": name, "type": "slide", "axis": " ".join(f"{component:.15g}" for component in direction)}
    )
    for key, value in attributes.items():
        if value:
            joint.set(key, f"{value:.15g}")
    if "frictionloss" in joint.attrib:
        joint.set("solreffriction", f"{2 * STEP_S:.12g} 1")
        joint.set("solimpfriction", "0.999 0.9999 1")


def _add_mass(body: Xml.Element, mass_kg: float) -> None:
    """Give a body its mass. MuJoCo also requires a moment of inertia, which has no effect on slides."""
    _add_element(body, "inertial", {"pos": "0 0 0", "mass": mass_kg, "diaginertia": "1e-4 1e-4 1e-4"})


def _add_element(parent: Xml.Element, tag: str, attributes: Mapping[str, str | float] | None = None) -> Xml.Element:
    """Append an element with this tag and return it; numbers are written with 15 digits."""
    attribute_texts = {
        key: value if isinstance(value, str) else f"{value:.15g}" for key, value in (attributes or {}).items()
    }
    return Xml.SubElement(parent, tag, attribute_texts)
