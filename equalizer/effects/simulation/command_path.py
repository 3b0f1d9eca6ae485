"""Force of the actuators for sampled commands: effects at the command, then bandwidth, delay and limit of the model.

Two values are computed per integration step: the mean over the step, which determines the motion (masses integrate the
force), and the value at the step's end, which an acceleration sampled there contains directly. First-order lag T and
step h: F_end = d F_start + (1 - d) u, with d = exp(-h / T); mean = u + (F_start - u) (1 - d) T / h.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from equalizer.effects.effect import OnCommand, PlacedEffect
from equalizer.effects.simulation.sensor_path import filter_one_pole
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ActuatorForce:
    """Forces of the actuators in each step, in the unit of the commands (N or N m)."""

    mean: FloatArray
    """(n * steps, m): mean over each step."""
    end: FloatArray
    """(n * steps, m): at each step's end, just before the next command takes effect."""
    commanded: FloatArray | None = None
    """(n * steps, m): the commands before effects and actuator; None: the same as `mean`."""


def moves_between_samples(model: MechanicalModel, effects: Sequence[PlacedEffect], hold: Hold) -> bool:
    """Whether the actuator force changes between two samples, so that several steps per sample are needed."""
    fine = any(isinstance(placed.effect.action, OnCommand) and placed.effect.action.fine for placed in effects)
    return fine or hold is not Hold.ZERO_ORDER or model.actuator.delay_s > 0 or model.actuator.bandwidth_hz > 0


def drive_actuators(
    model: MechanicalModel, commands: ActuatorForce, step_s: float, effects: Sequence[PlacedEffect]
) -> ActuatorForce:
    """Force of the actuators: first the effects in their order, then the model's own bandwidth, delay and limit.
    step_s: length of the steps of `commands` in s.

    Raises ValueError where an effect acts on a channel that is not there.
    """
    mean, end = commands.mean, commands.end
    if any(isinstance(placed.effect.action, OnCommand) for placed in effects):
        mean, end = mean.copy(), end.copy()
    for placed in effects:
        action, values = placed.effect.action, placed.values
        unchanged = mean.copy() if isinstance(action, OnCommand) and action.of_all is not None else mean
        for site in placed.sites if isinstance(action, OnCommand) else ():
            assert isinstance(action, OnCommand)
            if not 0 <= site < mean.shape[1]:
                raise ValueError(f"{placed.effect.name} is placed at axis {site + 1}; there are {mean.shape[1]}")
            if action.of_all is not None:
                mean[:, site], end[:, site] = action.of_all(unchanged, site, step_s, values)
                continue
            at_end = action.change if action.at_end is None else action.at_end
            end_force = at_end(end[:, site] if action.at_end is None else mean[:, site], step_s, values)
            mean[:, site], end[:, site] = action.change(mean[:, site], step_s, values), end_force
    actuator = model.actuator
    if actuator.bandwidth_hz > 0:
        time_constant_s = 1 / (2 * np.pi * actuator.bandwidth_hz)
        mean, end = lag_mean(mean, step_s, time_constant_s), lag_at_end(mean, step_s, time_constant_s)
    if actuator.delay_s > 0:
        # After a lag, the force is not held over a step: within one, it is interpolated between the ends.
        delay_end = delay_mean if actuator.bandwidth_hz > 0 else delay_at_end
        mean, end = delay_mean(mean, step_s, actuator.delay_s), delay_end(end, step_s, actuator.delay_s)
    if actuator.limit > 0:
        mean, end = np.clip(mean, -actuator.limit, actuator.limit), np.clip(end, -actuator.limit, actuator.limit)
    return ActuatorForce(mean, end, commands.mean)


def subdivide_commands(commands: FloatArray, steps: int, hold: Hold) -> ActuatorForce:
    """Commands (n, m) divided into `steps` per sample, with the course between samples that `hold` states."""
    if steps == 1 or hold is Hold.ZERO_ORDER:
        commands = np.asarray(commands, dtype=np.float64)
        held_commands = np.repeat(commands, steps, axis=0) if steps > 1 else commands
        return ActuatorForce(held_commands, held_commands)
    if hold is Hold.LINEAR:
        change = np.diff(commands, axis=0, append=commands[-1:])
        step_positions = (np.arange(steps) + 0.5) / steps, (np.arange(steps) + 1.0) / steps
        mean, end = (
            (commands[:, None] + step_position[:, None] * change[:, None]).reshape(-1, commands.shape[1])
            for step_position in step_positions
        )
        return ActuatorForce(mean, end)
    # Imported here: SciPy takes longer to import than a diagnosis that does not need it.
    from scipy.signal import resample_poly

    samples = resample_poly(commands, 2 * steps, 1, axis=0)
    # On the grid of half steps, odd points are in the middle of a step (taken as its mean), even points at step ends.
    return ActuatorForce(samples[1::2], np.vstack([samples[2::2], samples[-1:]]))


def lag_mean(commands: FloatArray, step_s: float, time_constant_s: float) -> FloatArray:
    """First-order lag, mean over each step, from zero; exact for commands (n, …) that are held over a step."""
    if time_constant_s <= 0:
        return commands
    decay = float(np.exp(-step_s / time_constant_s))
    at_end = _filter_one_pole(commands, decay)
    start_force = np.concatenate([np.zeros_like(at_end[:1]), at_end[:-1]])
    transient_share = (1 - decay) * time_constant_s / step_s
    return np.asarray(commands + (start_force - commands) * transient_share)


def lag_at_end(commands: FloatArray, step_s: float, time_constant_s: float) -> FloatArray:
    """First-order lag, value at each step's end, from zero; exact for commands (n, …) that are held over a step."""
    if time_constant_s <= 0:
        return commands
    decay = float(np.exp(-step_s / time_constant_s))
    return _filter_one_pole(commands, decay)


def _filter_one_pole(commands: FloatArray, decay: float) -> FloatArray:
    """Commands (n, …) through a first-order low pass with the pole `decay`."""
    filtered = np.empty(commands.shape)
    filter_one_pole(
        np.asarray(commands, dtype=np.float64).reshape(len(commands), -1), decay, filtered.reshape(len(filtered), -1)
    )
    return filtered


def delay_mean(commands: FloatArray, step_s: float, delay_s: float) -> FloatArray:
    """Held commands (n, …) delayed by delay_s, mean over each step; zero before the first."""
    whole_steps, step_fraction = divmod(max(delay_s, 0.0) / step_s, 1.0)
    delayed = np.zeros((len(commands) + 1, *commands.shape[1:]))
    shift = min(int(whole_steps) + 1, len(delayed))
    delayed[shift:] = commands[: len(delayed) - shift]
    return np.asarray((1 - step_fraction) * delayed[1:] + step_fraction * delayed[:-1])


def delay_at_end(commands: FloatArray, step_s: float, delay_s: float) -> FloatArray:
    """Held commands (n, …) delayed by delay_s, at each step's end: only whole steps of the delay matter there."""
    return delay_mean(commands, step_s, np.floor(max(delay_s, 0.0) / step_s) * step_s)
