"""What an actuator makes of a held command. A sample in and out is the mean over its step."""

import numpy as np
from scipy.signal import lfilter, resample_poly

from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray


def finer(commands: FloatArray, steps: int, hold: Hold) -> FloatArray:
    """(n steps, m) from (n, m), by how the command moves between its samples."""
    if steps == 1:
        return np.ascontiguousarray(commands)
    if hold is Hold.ZERO_ORDER:
        return np.repeat(commands, steps, axis=0)
    if hold is Hold.LINEAR:
        after = np.vstack([commands[1:], commands[-1:]])
        share = ((np.arange(steps) + 0.5) / steps)[:, None]
        return np.asarray((commands[:, None] + share * (after - commands)[:, None]).reshape(-1, commands.shape[1]))
    samples = resample_poly(commands, 2 * steps, 1, axis=0)
    # Every other one stands in the middle of a step.
    return np.ascontiguousarray(samples[1::2])


def lagged(commands: FloatArray, step_s: float, time_constant_s: float) -> FloatArray:
    """One pole; exact for commands (n, …) that are held over a step."""
    if time_constant_s <= 0:
        return commands
    decay = float(np.exp(-step_s / time_constant_s))
    before = lfilter([0.0, 1 - decay], [1.0, -decay], commands, axis=0)
    left = (1 - decay) * time_constant_s / step_s
    return np.asarray(commands + (before - commands) * left)


def delayed(commands: FloatArray, step_s: float, delay_s: float) -> FloatArray:
    """Held commands (n, …) that arrive later; nothing before the first."""
    whole, part = divmod(max(delay_s, 0.0) / step_s, 1.0)
    late = np.zeros((len(commands) + 1, *commands.shape[1:]))
    shift = min(int(whole) + 1, len(late))
    late[shift:] = commands[: len(late) - shift]
    return np.asarray((1 - part) * late[1:] + part * late[:-1])
