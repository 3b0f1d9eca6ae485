"""Dry friction over one step, compiled: sliding, stopping and sliding back are told apart within it."""

from numba import njit, types

from equalizer.effects.instant import F_END, V_FREE, V_PER_N, V
from equalizer.signals.signal import FloatArray


@njit(types.float64(types.float64, types.float64, types.float64[::1]), cache=True, error_model="numpy")
def rubbing(forward: float, backward: float, at: FloatArray) -> float:
    """The mean force over a step of friction that is `forward` where v > 0 and `backward` where v < 0.

    The velocity is taken to change evenly; where it comes to zero within the step, what is left of the step is held, if
    friction can hold it, or slid back.
    """
    start, per_newton = at[V], at[V_PER_N]
    sliding = -forward if start > 0 else backward
    end = at[V_FREE] + per_newton * sliding
    if start * end > 0:
        at[F_END] = sliding
        return sliding
    before = 0.0 if start == 0 else start / (start - end)
    holding = -(at[V_FREE] - start) / per_newton
    after = min(max(holding, -forward), backward)
    at[F_END] = after
    return float(before * sliding + (1 - before) * after)
