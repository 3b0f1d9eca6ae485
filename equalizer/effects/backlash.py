"""Backlash in a drive: within the gap the motor moves alone, at either end of it contact drives the handle.

The moving mass along the driven axis is split: the motor becomes a separate body, which the command drives, and acts
on the handle through a spring and a damper that only push. The gap and the displacement r of motor minus handle are in
m (a rotation: rad). An entry of `catalogue`.
"""

from dataclasses import replace

import numpy as np

from equalizer.effects.effect import Effect, JointForce, Parameter, PlacedEffect, Values
from equalizer.effects.simulation.bodies import build_bodies, simulate_bodies
from equalizer.effects.simulation.command_path import ActuatorForce
from equalizer.effects.simulation.instant import F_END, STEP_S, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import compute_quadratic_form
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import estimate_spectral_density

STEPS_PER_SAMPLE = 20
"""Integration steps per sample, chosen because a contact with the defaults below lasts only about a millisecond."""
MOTOR_SHARE, CONTACT_HZ, CONTACT_DAMPING_RATIO = 0.3, 300.0, 0.03
"""Defaults of parameters that a file leaves out: the motor's share of the moving mass; natural frequency (Hz) of the
motor mass on the contact's spring; damping ratio of that oscillator. Chosen for a stiff, lightly damped contact."""
RELATIVE_GAPS, EXCERPT_S, SPECTRUM_WINDOW_S = np.geomspace(0.02, 3.0, 14), 2.0, 0.128
"""For starting values: gaps that are tried, relative to the rms travel of the free motor (see `_find_starting_values`);
length (s) of each simulated excerpt; length (s) of a spectrum's window. Chosen."""


@compile_law
def _compute_mean_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the mean force (N) of the contact's spring and damper over the step, solved for implicitly; the contact
    never pulls. parameters: gap (m), stiffness (N/m), damping (N s/m). step_motion: motion of motor minus handle
    (`instant`); under contact, the force at the step's end is written to it."""
    half_gap, stiffness, damping_over_step = 0.5 * parameters[0], parameters[1], parameters[2] / step_motion[STEP_S]
    for side in (1.0, -1.0):
        start_penetration, end_penetration = (
            max(side * step_motion[X] - half_gap, 0.0),
            side * step_motion[X_FREE] - half_gap,
        )
        if start_penetration <= 0 and end_penetration <= 0:
            continue
        # For a contact that is stiff relative to the step, the force at the end gets more weight: the plain mean of
        # start and end would overshoot.
        stiffness_ratio = stiffness * step_motion[X_PER_N]
        end_weight = (0.5 + stiffness_ratio) / (1 + stiffness_ratio)
        contact_force = stiffness * (
            (1 - end_weight) * start_penetration + end_weight * end_penetration
        ) + damping_over_step * (end_penetration - start_penetration)
        contact_force /= 1 + step_motion[X_PER_N] * (end_weight * stiffness + damping_over_step)
        if end_penetration - step_motion[X_PER_N] * contact_force < 0:
            contact_force = stiffness * (1 - end_weight) * start_penetration
        contact_force = max(contact_force, 0.0)
        end_penetration -= step_motion[X_PER_N] * contact_force
        step_motion[F_END] = (
            -side * max(stiffness * end_penetration + damping_over_step * (end_penetration - start_penetration), 0.0)
            if end_penetration > 0
            else 0.0
        )
        return float(-side * contact_force)
    return 0.0


def _derive_motor_and_contact(model: MechanicalModel, axis: int, values: Values) -> tuple[float, float, float]:
    """Derive mass of the motor (kg; at most 0.9, chosen, of the mass along the axis, so that the handle keeps a mass),
    and stiffness (N/m) and damping (N s/m) of the contact, with defaults for values that are left out."""
    axis_mass = compute_quadratic_form(model.mass, compute_driven_axes(model)[:, axis])
    motor_mass = min(values.get("motor_mass", MOTOR_SHARE * axis_mass), 0.9 * axis_mass)
    stiffness = values.get("contact_stiffness", motor_mass * (2 * np.pi * CONTACT_HZ) ** 2)
    return (
        motor_mass,
        stiffness,
        values.get("contact_damping", 2 * CONTACT_DAMPING_RATIO * float(np.sqrt(stiffness * motor_mass))),
    )


def _split_off_motor(model: MechanicalModel, axis: int, values: Values) -> tuple[MechanicalModel, FloatArray]:
    """Split the motor off the model as a further coordinate; returns the model and the direction of motor minus handle,
    along which the contact acts. Without a gap: the unchanged model and a direction of zeros."""
    direction = compute_driven_axes(model)[:, axis]
    if values["gap"] <= 0:
        return model, np.zeros_like(direction)
    motor_mass = _derive_motor_and_contact(model, axis, values)[0]
    mass = np.pad(model.mass - motor_mass * np.outer(direction, direction), ((0, 1), (0, 1)))
    mass[-1, -1] = motor_mass
    input_matrix = np.pad(model.input, ((0, 1), (0, 0)))
    input_matrix[-1, axis] = np.linalg.norm(model.input[:, axis])
    input_matrix[:-1, axis] = 0
    split_model = replace(
        model,
        mass=mass,
        damping=np.pad(model.damping, ((0, 1), (0, 1))),
        stiffness=np.pad(model.stiffness, ((0, 1), (0, 1))),
        input=input_matrix,
        output=np.pad(model.output, ((0, 0), (0, 1))),
    )
    return split_model, np.append(-direction, 1.0)


def _pack_parameters(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """Pack the parameters of `_compute_mean_force`, (3,): gap, contact stiffness, contact damping."""
    return np.array([values["gap"], *_derive_motor_and_contact(model, axis, values)[1:]])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find the two gaps whose simulated impacts match the residual's spectrum best (mean squared log ratio); empty
    where the command does not vary. Spectra are compared because the waveform of impacts cannot be predicted. The tried
    gaps scale with the rms travel that the command would give the free motor if all its power were at 10 Hz (chosen;
    the tried gaps span two decades)."""
    motor_mass, contact_stiffness, contact_damping = _derive_motor_and_contact(evidence.model, axis, {})
    contact_values = {
        "motor_mass": motor_mass,
        "contact_stiffness": contact_stiffness,
        "contact_damping": contact_damping,
    }
    excerpts = _find_weakest_and_strongest_excerpt(evidence, axis)
    free_motor_rms_travel = float(np.std(evidence.command[excerpts[-1], axis])) / motor_mass / (2 * np.pi * 10.0) ** 2
    noise_density = evidence.noise**2 / (0.5 * evidence.sample_rate_hz)
    residual_spectra = [
        _estimate_spectrum(evidence, (evidence.response - evidence.predicted)[excerpt]) for excerpt in excerpts
    ]
    linear_responses = [_simulate_excerpt(evidence, axis, None, excerpt) for excerpt in excerpts]
    candidates = []
    for gap in (RELATIVE_GAPS * free_motor_rms_travel).tolist():
        spectral_error = 0.0
        for excerpt, residual_spectrum, linear_response in zip(
            excerpts, residual_spectra, linear_responses, strict=True
        ):
            impact_spectrum = _estimate_spectrum(
                evidence, _simulate_excerpt(evidence, axis, {"gap": gap, **contact_values}, excerpt) - linear_response
            )
            # The residual contains noise already: a tenth more only keeps the logarithm finite.
            spectral_error += float(
                np.mean(np.log((impact_spectrum + noise_density) / (residual_spectrum + 0.1 * noise_density)) ** 2)
            )
        candidates.append((spectral_error, gap))
    return tuple({"gap": gap, **contact_values} for _, gap in sorted(candidates)[:2] if gap > 0)


def _find_weakest_and_strongest_excerpt(evidence: Evidence, axis: int) -> list[slice]:
    """Find two excerpts of `EXCERPT_S`: that with the least command power above a thousandth (chosen) of the largest,
    and that with the largest. Samples with `evidence.used` = 0 add no power. Shorter in a recording below that
    length."""
    excerpt_samples = min(int(EXCERPT_S * evidence.sample_rate_hz), len(evidence.command))
    cumulative_power = np.cumsum(np.append(0.0, evidence.command[:, axis] ** 2 * evidence.used))
    first_samples = np.arange(0, len(evidence.command) - excerpt_samples + 1, max(excerpt_samples // 4, 1))
    excerpt_power = cumulative_power[first_samples + excerpt_samples] - cumulative_power[first_samples]
    significant_power = np.where(excerpt_power > 1e-3 * excerpt_power.max(), excerpt_power, np.inf)
    return [
        slice(int(first_sample), int(first_sample) + excerpt_samples)
        for first_sample in (first_samples[np.argmin(significant_power)], first_samples[np.argmax(excerpt_power)])
    ]


def _simulate_excerpt(evidence: Evidence, axis: int, values: Values | None, excerpt: slice) -> FloatArray:
    """Simulate the response (samples, p) to an excerpt of the commands, from rest. values: of the backlash; None:
    without it."""
    placed_effects = () if values is None else (PlacedEffect(EFFECT, (axis,), values),)
    bodies = build_bodies(evidence.model, placed_effects)
    commands = evidence.command[excerpt]
    outputs, _ = simulate_bodies(
        bodies,
        ActuatorForce(commands, commands),
        (excerpt.stop - excerpt.start, STEPS_PER_SAMPLE),
        1 / evidence.sample_rate_hz / STEPS_PER_SAMPLE,
    )
    port_count, response_count = bodies.ports.shape[1], evidence.model.outputs
    return outputs[:, 3 * port_count : 3 * port_count + response_count]


def _estimate_spectrum(evidence: Evidence, signal: FloatArray) -> FloatArray:
    """Estimate the power spectral density (lines, p) of a signal (samples, p), without the line at frequency zero."""
    window_samples = max(int(SPECTRUM_WINDOW_S * evidence.sample_rate_hz), 16)
    return estimate_spectral_density(signal, evidence.sample_rate_hz, window_samples)[1][1:]


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
    action=JointForce(_split_off_motor, _compute_mean_force, _pack_parameters, steps=STEPS_PER_SAMPLE),
    starts=_find_starting_values,
)
