"""Compensation of known nonlinear effects: their forces along the planned motion are added to the feedforward.

A linear model that was identified on a device with friction contains a linear equivalent of that friction; adding the
complete friction would count it twice, which is worse than no compensation. It is best to identify on recordings from
which the effects were subtracted (`subtract_effects`). Where there is only a model, the equivalent for a sinusoid of
the identification's amplitude (`compute_equivalent_impedance`, a describing function) is subtracted. This is an
approximation: it does not describe an axis that stuck while another was swept. Called by `equalize_trajectory`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from equalizer.effects.discovered_law import derive_axis_letters
from equalizer.laws.law import Law as FoundLaw
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import FloatArray
from equalizer.tracking.compensation.effect_roles import compute_lead_s, explain_not_compensated
from equalizer.tracking.compensation.known_forces import LAWS, Law, compute_deadband_share, compute_equivalent_impedance
from equalizer.tracking.compensation.law_compensation import (
    compute_compensating_force,
    compute_linear_share,
    invert_command_map,
    make_single_axis_law,
)
from equalizer.tracking.feedforward.band_pass import compute_band_gain, find_padded_length
from equalizer.tracking.feedforward.planned_motion import PlannedMotion, integrate_motion
from equalizer.tracking.learning.iteration import find_largest_share

SLIP_SHARE = 0.05
"""Velocity below which a friction force changes sign smoothly, relative to the axis's rms velocity. With a smaller
velocity, errors of the planned velocity near zero would switch the force back and forth; with a larger velocity, too
little would be compensated. Heuristic."""

LEAST_SPEED_M_S = 1e-9
"""Velocity (m/s) assumed for an axis that did not move in the identification, which keeps divisions finite."""


@dataclass(frozen=True, slots=True, eq=False)
class Compensation:
    """Result of `compensate`: forces with those of the known effects added, and which effects these are."""

    forces: FloatArray
    """(N, m), N: forces to play instead of the given forces."""
    used: tuple[ModelEffect, ...]
    """Compensated effects."""
    not_used: tuple[tuple[ModelEffect, str], ...]
    """Effects that are not compensated, with the reason."""
    share: float
    """Factor, 0 to 1, by which the compensation was scaled to fit under the cap; 1 = complete."""


def compensate(
    forces: FloatArray,
    reference: FloatArray,
    model: IdentifiedModel,
    physics: MechanicalModel,
    identified_with_n: float | None,
    cap_n: float | None = None,
) -> Compensation:
    """Add the forces of known effects to the forces (N, m) of a linear model, for reference accelerations (N, p), m/s²,
    that begin and end at rest; p = m, in the same order of axes.

    identified_with_n: amplitude (N) of the sinusoidal forces (sweeps of one axis after the other) with which the model
    was identified on the device with the effects; None = the model does not contain them. Raises ValueError for shapes
    that differ, an amplitude that is not above zero, and an axis that the model does not have.
    """
    if forces.shape != reference.shape:
        raise ValueError(f"forces of shape {forces.shape} do not match the wanted accelerations, {reference.shape}")
    if identified_with_n is not None and not identified_with_n > 0:
        raise ValueError(f"identified_with_n is {identified_with_n}; it must be a force above zero")
    rate_hz = model.sample_rate_hz
    motion = convert_motion_to_axes(
        integrate_motion(reference, rate_hz, model.band_hz, compute_lead_s(physics, rate_hz)), physics
    )
    effect_reasons = [(effect, explain_not_compensated(effect, model.input_channels)) for effect in physics.effects]
    used = tuple(effect for effect, reason in effect_reasons if not reason)
    gain = compute_axis_gains(physics, model.input_channels, model.output_channels)
    scaled_forces, compensating = forces.copy(), np.zeros_like(forces)
    for effect, axis in _iterate_effects_by_axis(used, model):
        if effect.kind in LAWS or _is_force(effect):
            compensating[:, axis] += (
                _compute_force_beyond_model(effect, axis, motion, model, identified_with_n) / gain[axis]
            )
    for effect, axis in _iterate_effects_by_axis(used, model):
        if effect.kind == "force_deadband":
            _compensate_deadband(effect.parameters, scaled_forces, compensating, axis, identified_with_n)
        elif effect.law is not None and not _is_force(effect):
            _compensate_command_map(effect.law, scaled_forces, compensating, axis, identified_with_n)
    added_forces = scaled_forces + compensating - forces
    scale = 1.0 if cap_n is None else find_largest_share(forces, added_forces, cap_n)
    not_used = tuple((effect, reason) for effect, reason in effect_reasons if reason)
    return Compensation(forces + scale * added_forces, used, not_used, scale)


def convert_motion_to_axes(motion: PlannedMotion, physics: MechanicalModel) -> PlannedMotion:
    """Motion along the driven axes, on which the effects act, from the motion along the response channels: the sign of
    an axis is reversed where the diagonal of the product of output matrix and driven axes is negative. Unchanged where
    that product has fewer rows or columns than the motion has axes."""
    gains = physics.output @ compute_driven_axes(physics)
    columns = motion.position.shape[1]
    if min(gains.shape) < columns:
        return motion
    signs = np.where(np.diagonal(gains)[:columns] < 0, -1.0, 1.0)
    return PlannedMotion(motion.position * signs, motion.velocity * signs, motion.acceleration * signs)


def find_effect_axes(effect: ModelEffect, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> tuple[int, ...]:
    """Find the indices of the axes that an effect acts on; all where it names none. Raises ValueError for an unknown
    axis."""
    matches = tuple(
        index
        for index, channels in enumerate(zip(inputs, outputs, strict=True))
        if effect.axis is None or any(effect.axis in (channel, channel[-1:]) for channel in channels)
    )
    if not matches:
        raise ValueError(
            f"{effect.kind} is on the axis '{effect.axis}', but there are {', '.join(inputs)} and {', '.join(outputs)}"
        )
    return matches


def compute_axis_gains(physics: MechanicalModel, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> FloatArray:
    """(m,): actual over commanded force of each axis, by the effects `force_gain`."""
    gain = np.ones(len(inputs))
    for effect in physics.effects:
        if effect.kind == "force_gain":
            gain[list(find_effect_axes(effect, inputs, outputs))] *= effect.parameters["gain"]
    return gain


def compute_slip_speed(velocity: FloatArray) -> float:
    """Velocity below which a friction force changes sign smoothly: SLIP_SHARE of the rms of velocity (N,), in its
    unit."""
    return SLIP_SHARE * float(np.sqrt(np.mean(velocity**2)))


def _iterate_effects_by_axis(
    effects: tuple[ModelEffect, ...], model: IdentifiedModel
) -> Iterator[tuple[ModelEffect, int]]:
    """Yields each effect with the index of each axis that it acts on."""
    for effect in effects:
        for axis in find_effect_axes(effect, model.input_channels, model.output_channels):
            yield effect, axis


def _compute_force_beyond_model(
    effect: ModelEffect, axis: int, motion: PlannedMotion, model: IdentifiedModel, identified_with_n: float | None
) -> FloatArray:
    """(N,), N: force that compensates an effect along the motion, less the linear equivalent that the identified model
    contains. Lines at which the axis did not move get the equivalent of `LEAST_SPEED_M_S`."""
    v = motion.velocity[:, axis]
    slip_m_s = compute_slip_speed(v)
    law, force = evaluate_force_law(effect, axis, motion, (model.input_channels, model.sample_rate_hz), slip_m_s)
    if identified_with_n is None:
        return force
    length = find_padded_length(len(v), model.sample_rate_hz)
    lines_hz = np.asarray(np.fft.rfftfreq(length, 1 / model.sample_rate_hz), dtype=np.float64)
    in_band = np.flatnonzero(compute_band_gain(lines_hz, model.band_hz) > 0)
    direct_gain = np.abs(compute_model_response(model, lines_hz[in_band])[:, axis, axis])
    speed = np.maximum(direct_gain * identified_with_n / (2 * np.pi * lines_hz[in_band]), LEAST_SPEED_M_S)
    equivalent = np.zeros(len(lines_hz), dtype=np.complex128)
    equivalent[in_band] = compute_equivalent_impedance(law, effect.parameters, lines_hz[in_band], speed, SLIP_SHARE)
    return np.asarray(force - np.fft.irfft(equivalent * np.fft.rfft(v, length), length)[: len(v)])


def evaluate_force_law(
    effect: ModelEffect,
    axis: int,
    motion: PlannedMotion,
    command_channels_and_rate: tuple[tuple[str, ...], float],
    slip_m_s: float,
) -> tuple[Law, FloatArray]:
    """The law of an effect along a single axis, and the force (N,) to be added along a motion.
    command_channels_and_rate: channels of the commands, and the sample rate (Hz). slip_m_s: speed below which a change
    of sign is smoothed, m/s."""
    if effect.law is not None:
        letters = derive_axis_letters(command_channels_and_rate[0])
        force = compute_compensating_force(effect.law, letters, motion, command_channels_and_rate[1], slip_m_s)
        return make_single_axis_law(effect.law, letters, axis), force
    law, v = LAWS[effect.kind], motion.velocity[:, axis]
    if slip_m_s == 0:
        return law, np.zeros_like(v)
    return law, law(effect.parameters, motion.position[:, axis], v, slip_m_s)


def _is_force(effect: ModelEffect) -> bool:
    """Whether the effect is a discovered law of the force."""
    return effect.law is not None and effect.law.acts_on == "force"


def _compensate_command_map(
    law: FoundLaw, scaled_forces: FloatArray, compensating: FloatArray, axis: int, identified_with_n: float | None
) -> None:
    """Change the commands in place so that a command map (a discovered law) turns them into the intended forces."""
    if identified_with_n is not None:
        scaled_forces[:, axis] *= compute_linear_share(law, identified_with_n)
    intended = scaled_forces[:, axis] + compensating[:, axis]
    slip_n = SLIP_SHARE * float(np.sqrt(np.mean(intended**2)))
    compensating[:, axis] += invert_command_map(law, intended, slip_n) - intended


def _compensate_deadband(
    parameters: Mapping[str, float],
    scaled_forces: FloatArray,
    compensating: FloatArray,
    axis: int,
    identified_with_n: float | None,
) -> None:
    """Change the commands in place so that the forces after a dead band are the intended forces: what the dead band
    takes, (1 - jump) width (N), is added in the direction of the force, smoothly near zero. Intended forces below the
    jump, which no command gives, are not played."""
    if identified_with_n is not None:
        scaled_forces[:, axis] *= compute_deadband_share(parameters, identified_with_n)
    intended_n = scaled_forces[:, axis] + compensating[:, axis]
    rms_n = float(np.sqrt(np.mean(intended_n**2)))
    if rms_n > 0:
        deadband_loss = (1.0 - parameters.get("jump", 0.0)) * parameters["width"]
        compensating[:, axis] += deadband_loss * np.tanh(intended_n / (SLIP_SHARE * rms_n))
