"""Force of the actuators for sampled commands: effects at the command, then bandwidth, delay and limit of the model.

Two values are computed per integration step: the mean over the step, which determines the motion (masses integrate the
force), and the value at the step's end, which an acceleration sampled there contains directly. First-order lag T and
step h: F_end = d F_start + (1 - d) u, with d = exp(-h / T); mean = u + (F_start - u) (1 - d) T / h. Sizes: n samples, m
commands.
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


def has_intersample_changes(model: MechanicalModel, effects: Sequence[PlacedEffect], hold: Hold) -> bool:
    """Whether the actuator force changes between two samples, so that several steps per sample are needed: by an effect
    that declares it (`OnCommand.fine`), a hold other than zero-order, or the model's own delay or bandwidth."""
    has_fine_effect = any(
        isinstance(placed_effect.effect.action, OnCommand) and placed_effect.effect.action.fine
        for placed_effect in effects
    )
    return (
        has_fine_effect or hold is not Hold.ZERO_ORDER or model.actuator.delay_s > 0 or model.actuator.bandwidth_hz > 0
    )


def drive_actuators(
    model: MechanicalModel, commands: ActuatorForce, step_s: float, effects: Sequence[PlacedEffect]
) -> ActuatorForce:
    """Compute the force of the actuators: first the effects on the command in their order, then the model's own
    bandwidth, delay and limit (mean and end are clipped separately; 0 = none of each). step_s: length of the steps of
    `commands` in s. Effects that do not act on the command are ignored; `commands` is not changed.

    Raises ValueError where an effect acts on a channel (index from 0) that does not exist.
    """
    mean, end = commands.mean, commands.end
    if any(isinstance(placed_effect.effect.action, OnCommand) for placed_effect in effects):
        mean, end = mean.copy(), end.copy()
    for placed_effect in effects:
        action, values = placed_effect.effect.action, placed_effect.values
        original_mean = mean.copy() if isinstance(action, OnCommand) and action.of_all is not None else mean
        for channel in placed_effect.sites if isinstance(action, OnCommand) else ():
            assert isinstance(action, OnCommand)
            if not 0 <= channel < mean.shape[1]:
                raise ValueError(
                    f"{placed_effect.effect.name} is placed at axis {channel + 1}; there are {mean.shape[1]}"
                )
            if action.of_all is not None:
                mean[:, channel], end[:, channel] = action.of_all(original_mean, channel, step_s, values)
                continue
            compute_end = action.change if action.at_end is None else action.at_end
            end_force = compute_end(end[:, channel] if action.at_end is None else mean[:, channel], step_s, values)
            mean[:, channel], end[:, channel] = action.change(mean[:, channel], step_s, values), end_force
    actuator = model.actuator
    if actuator.bandwidth_hz > 0:
        time_constant_s = 1 / (2 * np.pi * actuator.bandwidth_hz)
        mean, end = (
            compute_lagged_mean(mean, step_s, time_constant_s),
            compute_lagged_end(mean, step_s, time_constant_s),
        )
    if actuator.delay_s > 0:
        # After a lag, the force is not held over a step: within one, it is interpolated between the ends.
        compute_delay_at_end = compute_delayed_mean if actuator.bandwidth_hz > 0 else compute_delayed_end
        mean, end = (
            compute_delayed_mean(mean, step_s, actuator.delay_s),
            compute_delay_at_end(end, step_s, actuator.delay_s),
        )
    if actuator.limit > 0:
        mean, end = np.clip(mean, -actuator.limit, actuator.limit), np.clip(end, -actuator.limit, actuator.limit)
    return ActuatorForce(mean, end, commands.mean)


def subdivide_commands(commands: FloatArray, steps: int, hold: Hold) -> ActuatorForce:
    """Divide commands (n, m) into `steps` per sample, with the course between samples that `hold` states: constant,
    linear (constant after the last), or band-limited (polyphase interpolation). A single step is always constant."""
    if steps == 1 or hold is Hold.ZERO_ORDER:
        commands = np.asarray(commands, dtype=np.float64)
        held_commands = np.repeat(commands, steps, axis=0) if steps > 1 else commands
        return ActuatorForce(held_commands, held_commands)
    if hold is Hold.LINEAR:
        sample_change = np.diff(commands, axis=0, append=commands[-1:])
        step_fractions = (np.arange(steps) + 0.5) / steps, (np.arange(steps) + 1.0) / steps
        mean, end = (
            (commands[:, None] + step_fraction[:, None] * sample_change[:, None]).reshape(-1, commands.shape[1])
            for step_fraction in step_fractions
        )
        return ActuatorForce(mean, end)
    # Imported here: only a band-limited hold needs it.
    from scipy.signal import resample_poly

    half_steps = resample_poly(commands, 2 * steps, 1, axis=0)
    # On the grid of half steps, odd points are in the middle of a step (taken as its mean), even points at step ends.
    return ActuatorForce(half_steps[1::2], np.vstack([half_steps[2::2], half_steps[-1:]]))


def compute_lagged_mean(commands: FloatArray, step_s: float, time_constant_s: float) -> FloatArray:
    """Compute a first-order lag of the commands, mean over each step, from zero; exact for commands (n, …) that are
    held over a step. Unchanged commands for a time constant of zero or less."""
    if time_constant_s <= 0:
        return commands
    decay = float(np.exp(-step_s / time_constant_s))
    end_force = _filter_one_pole(commands, decay)
    start_force = np.concatenate([np.zeros_like(end_force[:1]), end_force[:-1]])
    transient_share = (1 - decay) * time_constant_s / step_s
    return np.asarray(commands + (start_force - commands) * transient_share)


def compute_lagged_end(commands: FloatArray, step_s: float, time_constant_s: float) -> FloatArray:
    """Compute a first-order lag of the commands, value at each step's end, from zero; exact for commands (n, …) that
    are held over a step. Unchanged commands for a time constant of zero or less."""
    if time_constant_s <= 0:
        return commands
    decay = float(np.exp(-step_s / time_constant_s))
    return _filter_one_pole(commands, decay)


def _filter_one_pole(commands: FloatArray, decay: float) -> FloatArray:
    """Filter commands (n, …) along the first axis with a first-order low pass with the pole `decay`, from zero."""
    filtered = np.empty(commands.shape)
    filter_one_pole(
        np.asarray(commands, dtype=np.float64).reshape(len(commands), -1), decay, filtered.reshape(len(filtered), -1)
    )
    return filtered


def compute_delayed_mean(commands: FloatArray, step_s: float, delay_s: float) -> FloatArray:
    """Delay held commands (n, …) by delay_s, mean over each step; zero before the first. A negative delay counts as
    0."""
    whole_steps, step_fraction = divmod(max(delay_s, 0.0) / step_s, 1.0)
    delayed = np.zeros((len(commands) + 1, *commands.shape[1:]))
    shift = min(int(whole_steps) + 1, len(delayed))
    delayed[shift:] = commands[: len(delayed) - shift]
    return np.asarray((1 - step_fraction) * delayed[1:] + step_fraction * delayed[:-1])


def compute_delayed_end(commands: FloatArray, step_s: float, delay_s: float) -> FloatArray:
    """Delay held commands (n, …) by delay_s, value just before each step's end: only whole steps of the delay matter
    there. A negative delay counts as 0."""
    return compute_delayed_mean(commands, step_s, np.floor(max(delay_s, 0.0) / step_s) * step_s)
