"""Slew-rate limit of a force, compiled."""

from numba import njit, types

from equalizer.signals.signal import FloatArray

_IN = types.Array(types.float64, 1, "A", readonly=True)


@njit(types.void(_IN, types.float64, types.float64[::1], types.float64[::1]), cache=True, nogil=True)
def limit_rate(commands: FloatArray, reach: float, mean: FloatArray, end: FloatArray) -> None:
    """Fill mean (n,) and end (n,): the force over each step and at its end, for held commands (n,). reach: largest
    change in one step."""
    force = 0.0
    for k in range(commands.shape[0]):
        missing = commands[k] - force
        if abs(missing) <= reach:
            # Still ramping for a share of the step.
            on_way = abs(missing) / reach
            mean[k] = commands[k] - missing * on_way / 2
            force = commands[k]
        else:
            change = reach if missing > 0 else -reach
            mean[k] = force + change / 2
            force += change
        end[k] = force
