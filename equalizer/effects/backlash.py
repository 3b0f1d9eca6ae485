"""Backlash in a drive: within the gap the motor moves alone, at either end of it contact drives the handle.

The moving mass along the driven axis is split: the motor becomes a body of its own, which the command drives, and acts
on the handle through a spring and a damper that only push.
"""

from dataclasses import replace

import numpy as np

from equalizer.effects.effect import Effect, JointForce, Parameter, PlacedEffect, Values
from equalizer.effects.simulation.bodies import build_bodies, simulate_bodies
from equalizer.effects.simulation.command_path import ActuatorForce
from equalizer.effects.simulation.instant import F_END, STEP_S, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import quadratic_form
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import estimate_spectral_density

STEPS = 20
"""Integration steps per sample: a contact lasts only about a millisecond."""
MOTOR_SHARE, CONTACT_HZ, CONTACT_RATIO = 0.3, 300.0, 0.03
"""Defaults of parameters that a file leaves out: the motor's share of the moving mass; natural frequency (Hz) of the
motor mass on the contact's spring; damping ratio of that oscillator."""
RELATIVE_GAPS, EXCERPT_S, SPECTRUM_WINDOW_S = np.geomspace(0.02, 3.0, 14), 2.0, 0.128
"""Starting values: gaps that are tried, relative to the travel of the free motor (see `_starts`); length (s) of each
simulated excerpt; length (s) of a spectrum's window."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Mean force (N) of the contact's spring and damper over the step, solved for implicitly; the contact never pulls.
    parameters: gap, stiffness, damping; `at` describes the motion of motor minus handle."""
    half, stiffness, rate = 0.5 * parameters[0], parameters[1], parameters[2] / at[STEP_S]
    for side in (1.0, -1.0):
        start, end = max(side * at[X] - half, 0.0), side * at[X_FREE] - half
        if start <= 0 and end <= 0:
            continue
        # For a contact that is stiff relative to the step, the force at the end gets more weight: the plain mean of
        # start and end would overshoot.
        slack = stiffness * at[X_PER_N]
        end_weight = (0.5 + slack) / (1 + slack)
        contact_force = stiffness * ((1 - end_weight) * start + end_weight * end) + rate * (end - start)
        contact_force /= 1 + at[X_PER_N] * (end_weight * stiffness + rate)
        if end - at[X_PER_N] * contact_force < 0:
            contact_force = stiffness * (1 - end_weight) * start
        contact_force = max(contact_force, 0.0)
        end -= at[X_PER_N] * contact_force
        at[F_END] = -side * max(stiffness * end + rate * (end - start), 0.0) if end > 0 else 0.0
        return float(-side * contact_force)
    return 0.0


def _motor_and_contact(model: MechanicalModel, axis: int, values: Values) -> tuple[float, float, float]:
    """Mass of the motor (at most 0.9 of the mass along the axis), and stiffness and damping of the contact."""
    axis_mass = quadratic_form(model.mass, compute_driven_axes(model)[:, axis])
    mass = min(values.get("motor_mass", MOTOR_SHARE * axis_mass), 0.9 * axis_mass)
    stiffness = values.get("contact_stiffness", mass * (2 * np.pi * CONTACT_HZ) ** 2)
    return mass, stiffness, values.get("contact_damping", 2 * CONTACT_RATIO * float(np.sqrt(stiffness * mass)))


def _change(model: MechanicalModel, axis: int, values: Values) -> tuple[MechanicalModel, FloatArray]:
    """The model with the motor as a further coordinate, and the direction of motor minus handle, along which the
    contact acts. Without a gap: the unchanged model and a direction of zeros."""
    direction = compute_driven_axes(model)[:, axis]
    if values["gap"] <= 0:
        return model, np.zeros_like(direction)
    motor_mass = _motor_and_contact(model, axis, values)[0]
    mass = np.pad(model.mass - motor_mass * np.outer(direction, direction), ((0, 1), (0, 1)))
    mass[-1, -1] = motor_mass
    force = np.pad(model.input, ((0, 1), (0, 0)))
    force[-1, axis] = np.linalg.norm(model.input[:, axis])
    force[:-1, axis] = 0
    split = replace(
        model,
        mass=mass,
        damping=np.pad(model.damping, ((0, 1), (0, 1))),
        stiffness=np.pad(model.stiffness, ((0, 1), (0, 1))),
        input=force,
        output=np.pad(model.output, ((0, 0), (0, 1))),
    )
    return split, np.append(-direction, 1.0)


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """(3,): gap, contact stiffness, contact damping."""
    return np.array([values["gap"], *_motor_and_contact(model, axis, values)[1:]])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """The two gaps whose simulated impacts match the residual's spectrum best (mean squared log ratio). Spectra are
    compared because the waveform of impacts cannot be predicted. The tried gaps scale with the rms travel that the
    command would give the free motor at 10 Hz."""
    motor_mass, stiffness, damping = _motor_and_contact(evidence.model, axis, {})
    contact_values = {"motor_mass": motor_mass, "contact_stiffness": stiffness, "contact_damping": damping}
    excerpts = _weakest_and_strongest_excerpt(evidence, axis)
    free_motor_travel = float(np.std(evidence.command[excerpts[-1], axis])) / motor_mass / (2 * np.pi * 10.0) ** 2
    floor = evidence.noise**2 / (0.5 * evidence.sample_rate_hz)
    residual_spectra = [_spectrum(evidence, (evidence.response - evidence.predicted)[excerpt]) for excerpt in excerpts]
    linear_responses = [_simulate_excerpt(evidence, axis, None, excerpt) for excerpt in excerpts]
    candidates = []
    for gap in (RELATIVE_GAPS * free_motor_travel).tolist():
        spectral_error = 0.0
        for excerpt, residual_spectrum, linear_response in zip(
            excerpts, residual_spectra, linear_responses, strict=True
        ):
            impact_spectrum = _spectrum(
                evidence, _simulate_excerpt(evidence, axis, {"gap": gap, **contact_values}, excerpt) - linear_response
            )
            spectral_error += float(np.mean(np.log((impact_spectrum + floor) / (residual_spectrum + 0.1 * floor)) ** 2))
        candidates.append((spectral_error, gap))
    return tuple({"gap": gap, **contact_values} for _, gap in sorted(candidates)[:2] if gap > 0)


def _weakest_and_strongest_excerpt(evidence: Evidence, axis: int) -> list[slice]:
    """Two excerpts of `EXCERPT_S`: with the least command power above a thousandth of the largest, and with the
    largest."""
    length = min(int(EXCERPT_S * evidence.sample_rate_hz), len(evidence.command))
    power = np.cumsum(np.append(0.0, evidence.command[:, axis] ** 2 * evidence.used))
    starts = np.arange(0, len(evidence.command) - length + 1, max(length // 4, 1))
    excerpt_power = power[starts + length] - power[starts]
    significant_power = np.where(excerpt_power > 1e-3 * excerpt_power.max(), excerpt_power, np.inf)
    return [
        slice(int(first), int(first) + length)
        for first in (starts[np.argmin(significant_power)], starts[np.argmax(excerpt_power)])
    ]


def _simulate_excerpt(evidence: Evidence, axis: int, values: Values | None, excerpt: slice) -> FloatArray:
    """(samples, p): simulated response to an excerpt of the commands; values: of the backlash, None = without it."""
    placed_effects = () if values is None else (PlacedEffect(EFFECT, (axis,), values),)
    bodies = build_bodies(evidence.model, placed_effects)
    commands = evidence.command[excerpt]
    outputs, _ = simulate_bodies(
        bodies,
        ActuatorForce(commands, commands),
        (excerpt.stop - excerpt.start, STEPS),
        1 / evidence.sample_rate_hz / STEPS,
    )
    ports, p = bodies.ports.shape[1], evidence.model.outputs
    return outputs[:, 3 * ports : 3 * ports + p]


def _spectrum(evidence: Evidence, signal: FloatArray) -> FloatArray:
    """(lines, p): power spectral density without the line at frequency zero."""
    window = max(int(SPECTRUM_WINDOW_S * evidence.sample_rate_hz), 16)
    return estimate_spectral_density(signal, evidence.sample_rate_hz, window)[1][1:]


EFFECT = Effect(
    name="backlash",
    equation="F = contact_stiffness (|r| - gap / 2) + contact_damping d|r|/dt where |r| > gap / 2, r = motor - handle",
    source="Nordin and Gutman 2002, Automatica 38:1633",
    signature="the drive does not act on the handle until the gap is crossed, then there is an impact: short peaks "
    "that no waveform predicts, most of all at low levels",
    parameters=(
        Parameter("gap", 1e-9, 1e3, none=0.0, step=0.03),
        Parameter("motor_mass", 1e-9, 1e6, none=None, step=0.05),
        Parameter("contact_stiffness", 1e-3, 1e12, none=None, step=0.05),
        Parameter("contact_damping", 1e-9, 1e6, none=None, step=0.1),
    ),
    action=JointForce(_change, _law, _pack, steps=STEPS),
    starts=_starts,
)
