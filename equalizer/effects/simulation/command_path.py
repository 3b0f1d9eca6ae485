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
    fine = any(isinstance(placed.effect.acts, OnCommand) and placed.effect.acts.fine for placed in effects)
    return fine or hold is not Hold.ZERO_ORDER or model.actuator.delay_s > 0 or model.actuator.bandwidth_hz > 0


def drive_actuators(
    model: MechanicalModel, commands: ActuatorForce, step_s: float, effects: Sequence[PlacedEffect]
) -> ActuatorForce:
    """Force of the actuators: first the effects in their order, then the model's own bandwidth, delay and limit.
    step_s: length of the steps of `commands` in s.

    Raises ValueError where an effect acts on a channel that is not there.
    """
    mean, end = commands.mean, commands.end
    if any(isinstance(placed.effect.acts, OnCommand) for placed in effects):
        mean, end = mean.copy(), end.copy()
    for placed in effects:
        acts, values = placed.effect.acts, placed.values
        before = mean.copy() if isinstance(acts, OnCommand) and acts.of_all is not None else mean
        for site in placed.sites if isinstance(acts, OnCommand) else ():
            assert isinstance(acts, OnCommand)
            if not 0 <= site < mean.shape[1]:
                raise ValueError(f"{placed.effect.name} is placed at axis {site + 1}; there are {mean.shape[1]}")
            if acts.of_all is not None:
                mean[:, site], end[:, site] = acts.of_all(before, site, step_s, values)
                continue
            at_end = acts.change if acts.at_end is None else acts.at_end
            last = at_end(end[:, site] if acts.at_end is None else mean[:, site], step_s, values)
            mean[:, site], end[:, site] = acts.change(mean[:, site], step_s, values), last
    known = model.actuator
    if known.bandwidth_hz > 0:
        time_constant_s = 1 / (2 * np.pi * known.bandwidth_hz)
        mean, end = lag_mean(mean, step_s, time_constant_s), lag_at_end(mean, step_s, time_constant_s)
    if known.delay_s > 0:
        # After a lag, the force is not held over a step: within one, it is interpolated between the ends.
        delay_end = delay_mean if known.bandwidth_hz > 0 else delay_at_end
        mean, end = delay_mean(mean, step_s, known.delay_s), delay_end(end, step_s, known.delay_s)
    if known.limit > 0:
        mean, end = np.clip(mean, -known.limit, known.limit), np.clip(end, -known.limit, known.limit)
    return ActuatorForce(mean, end, commands.mean)


def subdivide_commands(commands: FloatArray, steps: int, hold: Hold) -> ActuatorForce:
    """Commands (n, m) divided into `steps` per sample, with the course between samples that `hold` states."""
    if steps == 1 or hold is Hold.ZERO_ORDER:
        commands = np.asarray(commands, dtype=np.float64)
        held = np.repeat(commands, steps, axis=0) if steps > 1 else commands
        return ActuatorForce(held, held)
    if hold is Hold.LINEAR:
        change = np.diff(commands, axis=0, append=commands[-1:])
        places = (np.arange(steps) + 0.5) / steps, (np.arange(steps) + 1.0) / steps
        mean, end = (
            (commands[:, None] + share[:, None] * change[:, None]).reshape(-1, commands.shape[1]) for share in places
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
    before = np.concatenate([np.zeros_like(at_end[:1]), at_end[:-1]])
    left = (1 - decay) * time_constant_s / step_s
    return np.asarray(commands + (before - commands) * left)


def lag_at_end(commands: FloatArray, step_s: float, time_constant_s: float) -> FloatArray:
    """First-order lag, value at each step's end, from zero; exact for commands (n, …) that are held over a step."""
    if time_constant_s <= 0:
        return commands
    decay = float(np.exp(-step_s / time_constant_s))
    return _filter_one_pole(commands, decay)


def _filter_one_pole(commands: FloatArray, decay: float) -> FloatArray:
    """Commands (n, …) through a first-order low pass with the pole `decay`."""
    out = np.empty(commands.shape)
    filter_one_pole(np.asarray(commands, dtype=np.float64).reshape(len(commands), -1), decay, out.reshape(len(out), -1))
    return out


def delay_mean(commands: FloatArray, step_s: float, delay_s: float) -> FloatArray:
    """Held commands (n, …) delayed by delay_s, mean over each step; zero before the first."""
    whole, part = divmod(max(delay_s, 0.0) / step_s, 1.0)
    late = np.zeros((len(commands) + 1, *commands.shape[1:]))
    shift = min(int(whole) + 1, len(late))
    late[shift:] = commands[: len(late) - shift]
    return np.asarray((1 - part) * late[1:] + part * late[:-1])


def delay_at_end(commands: FloatArray, step_s: float, delay_s: float) -> FloatArray:
    """Held commands (n, …) delayed by delay_s, at each step's end: only whole steps of the delay matter there."""
    return delay_mean(commands, step_s, np.floor(max(delay_s, 0.0) / step_s) * step_s)
