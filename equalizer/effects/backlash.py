"""Backlash in a drive: within the gap the motor moves alone, at either end of it contact drives the handle.

The moving mass along the driven axis is split: the motor becomes a body of its own, which the command drives, and acts
on the handle through a spring and a damper that only push.
"""

from dataclasses import replace

import numpy as np

from equalizer.effects.effect import Effect, JointForce, Parameter, PlacedEffect, Values
from equalizer.effects.simulation.bodies import bodies_of, simulate_bodies
from equalizer.effects.simulation.command_path import ActuatorForce
from equalizer.effects.simulation.instant import F_END, STEP_S, X_FREE, X_PER_N, X
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.starting_values import value_along
from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import spectral_density

STEPS = 20
"""Integration steps per sample: a contact lasts only about a millisecond."""
MOTOR_SHARE, CONTACT_HZ, CONTACT_RATIO = 0.3, 300.0, 0.03
"""Defaults of parameters that a file leaves out: the motor's share of the moving mass; natural frequency (Hz) of the
motor mass on the contact's spring; damping ratio of that oscillator."""
GAPS, TRIED_S, BAND_S = np.geomspace(0.02, 3.0, 14), 2.0, 0.128
"""Starting values: gaps that are tried, relative to the travel of the free motor (see `_starts`); length (s) of each
simulated excerpt; length (s) of a spectrum's window."""


@compile_law
def _law(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Mean force (N) of the contact's spring and damper over the step, solved for implicitly; the contact never pulls.
    parameters: gap, stiffness, damping; `at` describes the motion of motor minus handle."""
    half, stiffness, rate = 0.5 * parameters[0], parameters[1], parameters[2] / at[STEP_S]
    for way in (1.0, -1.0):
        start, end = max(way * at[X] - half, 0.0), way * at[X_FREE] - half
        if start <= 0 and end <= 0:
            continue
        # For a contact that is stiff relative to the step, the force at the end gets more weight: the plain mean of
        # start and end would overshoot.
        slack = stiffness * at[X_PER_N]
        late = (0.5 + slack) / (1 + slack)
        push = stiffness * ((1 - late) * start + late * end) + rate * (end - start)
        push /= 1 + at[X_PER_N] * (late * stiffness + rate)
        if end - at[X_PER_N] * push < 0:
            push = stiffness * (1 - late) * start
        push = max(push, 0.0)
        end -= at[X_PER_N] * push
        at[F_END] = -way * max(stiffness * end + rate * (end - start), 0.0) if end > 0 else 0.0
        return float(-way * push)
    return 0.0


def _motor_and_contact(model: MechanicalModel, axis: int, values: Values) -> tuple[float, float, float]:
    """Mass of the motor (at most 0.9 of the mass along the axis), and stiffness and damping of the contact."""
    known = value_along(model.mass, driven_axes(model)[:, axis])
    mass = min(values.get("motor_mass", MOTOR_SHARE * known), 0.9 * known)
    stiffness = values.get("contact_stiffness", mass * (2 * np.pi * CONTACT_HZ) ** 2)
    return mass, stiffness, values.get("contact_damping", 2 * CONTACT_RATIO * float(np.sqrt(stiffness * mass)))


def _change(model: MechanicalModel, axis: int, values: Values) -> tuple[MechanicalModel, FloatArray]:
    """The model with the motor as a further coordinate, and the direction of motor minus handle, along which the
    contact acts. Without a gap: the unchanged model and a direction of zeros."""
    along = driven_axes(model)[:, axis]
    if values["gap"] <= 0:
        return model, np.zeros_like(along)
    motor = _motor_and_contact(model, axis, values)[0]
    mass = np.pad(model.mass - motor * np.outer(along, along), ((0, 1), (0, 1)))
    mass[-1, -1] = motor
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
    return split, np.append(-along, 1.0)


def _pack(model: MechanicalModel, axis: int, values: Values) -> FloatArray:
    """(3,): gap, contact stiffness, contact damping."""
    return np.array([values["gap"], *_motor_and_contact(model, axis, values)[1:]])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """The two gaps whose simulated impacts match the residual's spectrum best (mean squared log ratio). Spectra are
    compared because the waveform of impacts cannot be predicted. The tried gaps scale with the rms travel that the
    command would give the free motor at 10 Hz."""
    motor, stiffness, damping = _motor_and_contact(evidence.model, axis, {})
    rest = {"motor_mass": motor, "contact_stiffness": stiffness, "contact_damping": damping}
    kept = _weakest_and_strongest_part(evidence, axis)
    alone = float(np.std(evidence.command[kept[-1], axis])) / motor / (2 * np.pi * 10.0) ** 2
    floor = evidence.noise**2 / (0.5 * evidence.sample_rate_hz)
    residuals = [_spectrum(evidence, (evidence.response - evidence.predicted)[part]) for part in kept]
    linear = [_simulate_part(evidence, axis, None, part) for part in kept]
    tried = []
    for gap in (GAPS * alone).tolist():
        off = 0.0
        for part, missed, smooth in zip(kept, residuals, linear, strict=True):
            rattled = _spectrum(evidence, _simulate_part(evidence, axis, {"gap": gap, **rest}, part) - smooth)
            off += float(np.mean(np.log((rattled + floor) / (missed + 0.1 * floor)) ** 2))
        tried.append((off, gap))
    return tuple({"gap": gap, **rest} for _, gap in sorted(tried)[:2] if gap > 0)


def _weakest_and_strongest_part(evidence: Evidence, axis: int) -> list[slice]:
    """Two excerpts of `TRIED_S`: with the least command power above a thousandth of the largest, and with the
    largest."""
    length = min(int(TRIED_S * evidence.sample_rate_hz), len(evidence.command))
    power = np.cumsum(np.append(0.0, evidence.command[:, axis] ** 2 * evidence.used))
    firsts = np.arange(0, len(evidence.command) - length + 1, max(length // 4, 1))
    inside = power[firsts + length] - power[firsts]
    gentle = np.where(inside > 1e-3 * inside.max(), inside, np.inf)
    return [slice(int(first), int(first) + length) for first in (firsts[np.argmin(gentle)], firsts[np.argmax(inside)])]


def _simulate_part(evidence: Evidence, axis: int, values: Values | None, kept: slice) -> FloatArray:
    """(samples, p): simulated response to an excerpt of the commands; values: of the backlash, None = without it."""
    placed = () if values is None else (PlacedEffect(EFFECT, (axis,), values),)
    bodies = bodies_of(evidence.model, placed)
    commands = evidence.command[kept]
    looked, _ = simulate_bodies(
        bodies, ActuatorForce(commands, commands), (kept.stop - kept.start, STEPS), 1 / evidence.sample_rate_hz / STEPS
    )
    ports, p = bodies.ports.shape[1], evidence.model.outputs
    return looked[:, 3 * ports : 3 * ports + p]


def _spectrum(evidence: Evidence, signal: FloatArray) -> FloatArray:
    """(lines, p): power spectral density without the line at frequency zero."""
    window = max(int(BAND_S * evidence.sample_rate_hz), 16)
    return spectral_density(signal, evidence.sample_rate_hz, window)[1][1:]


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
    acts=JointForce(_change, _law, _pack, steps=STEPS),
    starts=_starts,
)
