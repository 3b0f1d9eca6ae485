"""Slew-rate limit: an actuator's force follows the command at a limited rate, by voltage over inductance or a software
ramp.

    |dF/dt| <= rate        command u and force F in N, rate in N/s (a rotation: N m/s)
"""

import math

import numpy as np
from numba import njit, types

from equalizer.effects.effect import ALL_SITES, Effect, OnCommand, Parameter, Values
from equalizer.effects.starts.command_starts import likeliest_value
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

RATE_SHARES = (0.3, 0.5, 0.75)
"""Starting values for a limit that is rarely reached, as shares of the command's largest rate of change."""
MISFIT_RATIO = 1.05
"""Rms residual of a channel, over its noise, above which these starting values are tried."""


_IN = types.Array(types.float64, 1, "A", readonly=True)


@njit(types.void(_IN, types.float64, types.float64[::1], types.float64[::1]), cache=True, nogil=True)
def limit_rate(commands: FloatArray, reach: float, mean: FloatArray, end: FloatArray) -> None:
    """Fill mean (n,) and end (n,): the mean force over each step and the force at its end, for held commands (n,), from
    zero. reach: largest change in one step, > 0."""
    force = 0.0
    for k in range(commands.shape[0]):
        missing = commands[k] - force
        if abs(missing) <= reach:
            # Share of the step after which the ramp reaches the command; the mean of the step includes the ramp.
            ramp_share = abs(missing) / reach
            mean[k] = commands[k] - missing * ramp_share / 2
            force = commands[k]
        else:
            change = reach if missing > 0 else -reach
            mean[k] = force + change / 2
            force += change
        end[k] = force


def limit_slew(
    commands: FloatArray, step_s: float, rate: float, first: float = 0.0, at_end: bool = False
) -> FloatArray:
    """(n,): mean force over each step, or the force at its end, for commands (n,). first: force before the first step;
    rate: in units of force per s."""
    return np.asarray(first + _mean_and_end(commands - first, step_s, rate)[int(at_end)])


def _limit_rate(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    return limit_slew(commands, step_s, values["rate"])


def _limit_rate_at_end(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    return limit_slew(commands, step_s, values["rate"], at_end=True)


def _mean_and_end(commands: FloatArray, step_s: float, rate: float) -> FloatArray:
    """(2, n): mean force over each step, and force at its end; the command itself for an infinite rate."""
    if math.isinf(rate):
        return np.array([commands, commands])
    forces = np.empty((2, len(commands)))
    limit_rate(np.asarray(commands, dtype=np.float64), rate * step_s, forces[0], forces[1])
    return forces


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Likeliest rate by grid search; where the response errs by more than its noise, also fixed shares of the fastest
    change."""
    commanded = evidence.command if axis == ALL_SITES else evidence.command[:, axis]
    fastest = float(np.abs(np.diff(commanded, axis=0)).max()) * evidence.sample_rate_hz
    if fastest == 0:
        return ()
    rate = likeliest_value(
        evidence,
        axis,
        lambda u, step_s, value: _limit_rate(u, step_s, {"rate": value}),
        list(np.geomspace(0.01 * fastest, fastest, 12)),
        True,
    )
    likeliest = () if rate is None else ({"rate": rate},)
    if not _has_unexplained_error(evidence):
        return likeliest
    # Re-tuning may have absorbed a limit that is rarely reached, so that the missing force does not show it.
    return likeliest + tuple(
        {"rate": share * fastest} for share in (RATE_SHARES if axis == ALL_SITES else RATE_SHARES[1:2])
    )


def _has_unexplained_error(evidence: Evidence) -> bool:
    """Whether the rms residual of any channel exceeds `MISFIT_RATIO` times its noise."""
    residual = (evidence.response - evidence.predicted)[evidence.used > 0]
    return bool((np.sqrt(np.nanmean(residual**2, axis=0)) > MISFIT_RATIO * evidence.noise).any())


EFFECT = Effect(
    name="slew_limit",
    equation="|dF/dt| <= rate, F towards u",
    source="Isermann, Mechatronic Systems, Springer 2005, ch. 10: limits of actuators",
    signature="force is missing where the command changes fast, more at high frequencies and high levels",
    parameters=(Parameter("rate", 1e-2, 1e7, none=math.inf),),
    action=OnCommand(_limit_rate, fine=True, at_end=_limit_rate_at_end),
    starts=_starts,
    sites=("one", "all"),
)
