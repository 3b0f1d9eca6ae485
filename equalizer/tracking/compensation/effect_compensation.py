"""Compensation of known nonlinear effects: their forces along the planned motion are added to the feedforward.

A linear model that was identified on a device with friction contains a linear equivalent of that friction; adding the
complete friction would count it twice. It is best to identify on recordings from which the effects were subtracted
(`subtract_effects`). Where there is only a model, the equivalent for a sinusoid of the identification's amplitude
(`compute_equivalent_impedance`, a describing function) is subtracted. This is an approximation: it does not describe an
axis that stuck while another was swept.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from equalizer.effects.discovered_law import derive_axis_letters
from equalizer.laws.law import Law as DiscoveredLaw
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from equalizer.plant.model_response import compute_model_response
from equalizer.signals.signal import FloatArray
from equalizer.tracking.compensation.effect_roles import compute_lead_s, explain_not_compensated
from equalizer.tracking.compensation.known_forces import (
    LAWS,
    ForceLaw,
    compute_deadband_describing_function,
    compute_equivalent_impedance,
)
from equalizer.tracking.compensation.law_compensation import (
    compute_compensating_force,
    compute_describing_function,
    invert_command_map,
    make_single_axis_law,
)
from equalizer.tracking.feedforward.band_pass import compute_band_gain, find_padded_length
from equalizer.tracking.feedforward.planned_motion import PlannedMotion, integrate_motion
from equalizer.tracking.learning.iteration import find_largest_share

SMOOTHING_SHARE = 0.05
"""Velocity below which a friction force changes sign smoothly, relative to the axis's rms velocity (in its describing
function, to the velocity amplitude); for an effect on the command, the force below which the correction changes sign
smoothly, relative to the rms force. A smaller share would let errors of the planned velocity near zero switch the force
back and forth; a larger one would compensate too little. Chosen by hand."""

MIN_SPEED_AMPLITUDE_MPS = 1e-9
"""Least velocity amplitude (m/s) in the identification, assumed for an axis that did not move: keeps the describing
function finite."""

OUTPUT_TOLERANCE = 1e-3
"""Largest deviation of an output matrix, relative to its largest entry, from one that measures the driven axes alone at
which it counts as such, because cosines in a model file are rounded; the motion is then wrong by no more. Chosen."""


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
    """Factor, 0 to 1, by which the compensation was scaled to keep the forces under the cap; 1 = complete."""


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
    was identified on the device with the effects; None = the model does not contain them. cap_n: cap (N) on the norm of
    the force vector; None = no cap. Raises ValueError for shapes that differ, an amplitude that is not above zero, an
    axis that the model does not have, and a command map without an inverse (`invert_command_map`).
    """
    if forces.shape != reference.shape:
        raise ValueError(f"forces of shape {forces.shape} do not match the reference accelerations, {reference.shape}")
    if identified_with_n is not None and not identified_with_n > 0:
        raise ValueError(f"identified_with_n is {identified_with_n}; it must be a force above zero")
    rate_hz = model.sample_rate_hz
    to_axes = compute_channels_to_axes(physics, reference.shape[1])
    integrated_motion = integrate_motion(reference, rate_hz, model.band_hz, compute_lead_s(physics, rate_hz))
    motion = convert_motion_to_axes(integrated_motion, to_axes)
    effect_reasons = [(effect, explain_not_compensated(effect, model.input_channels)) for effect in physics.effects]
    compensated_effects = tuple(effect for effect, reason in effect_reasons if not reason)
    axis_gains = compute_axis_gains(physics, model.input_channels, model.output_channels)
    scaled_forces, compensating_forces = forces.copy(), np.zeros_like(forces)
    for effect, axis in _iterate_effects_by_axis(compensated_effects, model):
        if effect.kind in LAWS or _is_force_law(effect):
            compensating_forces[:, axis] += (
                _compute_force_beyond_model(effect, axis, motion, model, to_axes, identified_with_n) / axis_gains[axis]
            )
    for effect, axis in _iterate_effects_by_axis(compensated_effects, model):
        if effect.kind == "force_deadband":
            _compensate_deadband(effect.parameters, scaled_forces, compensating_forces, axis, identified_with_n)
        elif effect.law is not None and not _is_force_law(effect):
            _compensate_command_map(effect.law, scaled_forces, compensating_forces, axis, identified_with_n)
    added_forces = scaled_forces + compensating_forces - forces
    share = 1.0 if cap_n is None else find_largest_share(forces, added_forces, cap_n)
    not_used = tuple((effect, reason) for effect, reason in effect_reasons if reason)
    return Compensation(forces + share * added_forces, compensated_effects, not_used, share)


def convert_motion_to_axes(motion: PlannedMotion, to_axes: FloatArray) -> PlannedMotion:
    """Convert a motion along the response channels to one along the driven axes, on which the effects act. to_axes: by
    `compute_channels_to_axes`."""
    return PlannedMotion(motion.position @ to_axes, motion.velocity @ to_axes, motion.acceleration @ to_axes)


def compute_channels_to_axes(physics: MechanicalModel, axis_count: int) -> FloatArray:
    """Compute the matrix (axis_count, axis_count) by which a row of samples of the response channels is multiplied to
    give the motion along the driven axes. Where the responses measure these axes alone, rotated or scaled, it is the
    inverse of their gains. Elsewhere it reverses the sign of an axis where the diagonal of the product of output matrix
    and driven axes is negative. It is the identity where that product has fewer rows or columns than axis_count."""
    driven_axes = compute_driven_axes(physics)
    axis_gains = physics.output @ np.linalg.pinv(driven_axes.T)
    tolerance = OUTPUT_TOLERANCE * float(np.abs(physics.output).max())
    if (
        axis_gains.shape == (axis_count, axis_count)
        and np.linalg.svd(axis_gains, compute_uv=False)[-1] > tolerance
        and np.allclose(axis_gains @ driven_axes.T, physics.output, rtol=0, atol=tolerance)
    ):
        return np.asarray(np.linalg.inv(axis_gains).T)
    channel_gains = physics.output @ driven_axes
    if min(channel_gains.shape) < axis_count:
        return np.eye(axis_count)
    return np.diag(np.where(np.diagonal(channel_gains)[:axis_count] < 0, -1.0, 1.0))


def find_effect_axes(effect: ModelEffect, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> tuple[int, ...]:
    """Find the indices of the axes that an effect acts on, by the name of an input channel or its last letter, else of
    an output channel; all where the effect has no axis. Raises ValueError for an unknown axis, and for different
    numbers of channels."""
    if len(inputs) != len(outputs):
        raise ValueError(
            f"there are {len(inputs)} commands and {len(outputs)} responses; give one response per command"
        )
    if effect.axis is None:
        return tuple(range(len(inputs)))
    for names in (inputs, [name[-1:] for name in inputs], outputs, [name[-1:] for name in outputs]):
        if axis_indices := tuple(index for index, name in enumerate(names) if name == effect.axis):
            return axis_indices
    raise ValueError(
        f"{effect.kind} is on the axis '{effect.axis}', but there are {', '.join(inputs)} and {', '.join(outputs)}"
    )


def compute_axis_gains(physics: MechanicalModel, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> FloatArray:
    """Compute the ratio (m,) of actual to commanded force of each axis: the product of its effects `force_gain`."""
    axis_gains = np.ones(len(inputs))
    for effect in physics.effects:
        if effect.kind == "force_gain":
            axis_gains[list(find_effect_axes(effect, inputs, outputs))] *= effect.parameters["gain"]
    return axis_gains


def compute_slip_speed(velocity: FloatArray) -> float:
    """Compute the velocity below which a friction force changes sign smoothly: `SMOOTHING_SHARE` of the rms of velocity
    (N,), N >= 1, in its unit."""
    return SMOOTHING_SHARE * float(np.sqrt(np.mean(velocity**2)))


def _iterate_effects_by_axis(
    effects: tuple[ModelEffect, ...], model: IdentifiedModel
) -> Iterator[tuple[ModelEffect, int]]:
    """Yield each effect with the index of each axis that it acts on."""
    for effect in effects:
        for axis in find_effect_axes(effect, model.input_channels, model.output_channels):
            yield effect, axis


def _compute_force_beyond_model(
    effect: ModelEffect,
    axis: int,
    motion: PlannedMotion,
    model: IdentifiedModel,
    to_axes: FloatArray,
    identified_with_n: float | None,
) -> FloatArray:
    """Compute the force (N,), N, that compensates an effect along the motion, minus its linear equivalent at the
    amplitude of the identification, which the model contains; the complete force where identified_with_n is None.
    to_axes: from `compute_channels_to_axes`."""
    velocity = motion.velocity[:, axis]
    slip_mps = compute_slip_speed(velocity)
    law, force = evaluate_force_law(effect, axis, motion, (model.input_channels, model.sample_rate_hz), slip_mps)
    if identified_with_n is None:
        return force
    padded_length = find_padded_length(len(velocity), model.sample_rate_hz)
    lines_hz = np.asarray(np.fft.rfftfreq(padded_length, 1 / model.sample_rate_hz), dtype=np.float64)
    band_lines = np.flatnonzero(compute_band_gain(lines_hz, model.band_hz) > 0)
    direct_gain = np.abs(compute_model_response(model, lines_hz[band_lines])[:, :, axis] @ to_axes[:, axis])
    speed_amplitudes = np.maximum(
        direct_gain * identified_with_n / (2 * np.pi * lines_hz[band_lines]), MIN_SPEED_AMPLITUDE_MPS
    )
    equivalent_impedance = np.zeros(len(lines_hz), dtype=np.complex128)
    equivalent_impedance[band_lines] = compute_equivalent_impedance(
        law, effect.parameters, lines_hz[band_lines], speed_amplitudes, SMOOTHING_SHARE
    )
    return np.asarray(
        force
        - np.fft.irfft(equivalent_impedance * np.fft.rfft(velocity, padded_length), padded_length)[: len(velocity)]
    )


def evaluate_force_law(
    effect: ModelEffect,
    axis: int,
    motion: PlannedMotion,
    command_channels_and_rate: tuple[tuple[str, ...], float],
    slip_mps: float,
) -> tuple[ForceLaw, FloatArray]:
    """Return the law of an effect along a single axis, and the force (N,) to be added along a motion.
    command_channels_and_rate: channels of the commands, and the sample rate (Hz). slip_mps: speed below which a change
    of sign is smoothed, m/s; for 0 (an axis at rest), the force of a law of `LAWS` is zero."""
    if effect.law is not None:
        axis_letters = derive_axis_letters(command_channels_and_rate[0])
        force = compute_compensating_force(effect.law, axis_letters, motion, command_channels_and_rate[1], slip_mps)
        return make_single_axis_law(effect.law, axis_letters, axis), force
    law, velocity = LAWS[effect.kind], motion.velocity[:, axis]
    if slip_mps == 0:
        return law, np.zeros_like(velocity)
    return law, law(effect.parameters, motion.position[:, axis], velocity, slip_mps)


def _is_force_law(effect: ModelEffect) -> bool:
    """Whether the effect is a discovered law of the force."""
    return effect.law is not None and effect.law.acts_on == "force"


def _compensate_command_map(
    law: DiscoveredLaw,
    scaled_forces: FloatArray,
    compensating_forces: FloatArray,
    axis: int,
    identified_with_n: float | None,
) -> None:
    """Change column `axis` of both arrays (N, m), N, in place, so that a command map (a discovered law) turns their sum
    into the intended force: scale scaled_forces by the map's describing function at the amplitude identified_with_n
    (unless None), and add to compensating_forces the command minus the intended force."""
    if identified_with_n is not None:
        scaled_forces[:, axis] *= compute_describing_function(law, identified_with_n)
    intended_n = scaled_forces[:, axis] + compensating_forces[:, axis]
    slip_n = SMOOTHING_SHARE * float(np.sqrt(np.mean(intended_n**2)))
    compensating_forces[:, axis] += invert_command_map(law, intended_n, slip_n) - intended_n


def _compensate_deadband(
    parameters: Mapping[str, float],
    scaled_forces: FloatArray,
    compensating_forces: FloatArray,
    axis: int,
    identified_with_n: float | None,
) -> None:
    """Change column `axis` of both arrays (N, m), N, in place, so that the force after a dead band is the intended one:
    the force that the dead band removes, (1 - jump) width (N), is added in the direction of the force, smoothly near
    zero. scaled_forces is first scaled as in `_compensate_command_map`. Intended forces below the jump, which no
    command gives, are not played."""
    if identified_with_n is not None:
        scaled_forces[:, axis] *= compute_deadband_describing_function(parameters, identified_with_n)
    intended_n = scaled_forces[:, axis] + compensating_forces[:, axis]
    rms_n = float(np.sqrt(np.mean(intended_n**2)))
    if rms_n > 0:
        deadband_loss_n = (1.0 - parameters.get("jump", 0.0)) * parameters["width"]
        compensating_forces[:, axis] += deadband_loss_n * np.tanh(intended_n / (SMOOTHING_SHARE * rms_n))
