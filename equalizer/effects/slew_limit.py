"""Slew-rate limit: an actuator's force follows the command at a limited rate, set by voltage over inductance or by a
software ramp.

    |dF/dt| <= rate        command u and force F in N, rate in N/s (a rotation: N m and N m/s)

An entry of `catalogue`; the force balance and the contrast of actuator faults call `limit_slew`.
"""

import math

import numpy as np
from numba import njit, types

from equalizer.effects.effect import ALL_SITES, Effect, OnCommand, Parameter, Values
from equalizer.effects.starts.command_starts import find_command_parameter
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

RATE_SHARES = (0.3, 0.5, 0.75)
"""Additional starting values, for a limit that is rarely reached, as shares of the command's largest rate of change:
all for a limit common to all axes, the middle one for a single axis. Chosen by hand."""
MISFIT_RATIO = 1.05
"""Rms residual of a channel, over its noise, above which the starting values by `RATE_SHARES` are tried. Chosen by
hand."""

_INPUT_ARRAY = types.Array(types.float64, 1, "A", readonly=True)
"""numba type of an input array (n,), which may be strided and read-only."""


@njit(types.void(_INPUT_ARRAY, types.float64, types.float64[::1], types.float64[::1]), cache=True, nogil=True)
def simulate_slew_limit(commands: FloatArray, max_change: float, mean_force: FloatArray, end_force: FloatArray) -> None:
    """Fill mean_force (n,) and end_force (n,): the mean over each step and the value at its end, for commands (n,) that
    are constant within a step; the force starts at zero. max_change: largest change of the force in one step, > 0."""
    force = 0.0
    for k in range(commands.shape[0]):
        difference = commands[k] - force
        if abs(difference) <= max_change:
            # Share of the step after which the ramp reaches the command; the mean of the step includes the ramp.
            ramp_share = abs(difference) / max_change
            mean_force[k] = commands[k] - difference * ramp_share / 2
            force = commands[k]
        else:
            change = max_change if difference > 0 else -max_change
            mean_force[k] = force + change / 2
            force += change
        end_force[k] = force


def limit_slew(
    commands: FloatArray, step_s: float, rate: float, initial_force: float = 0.0, at_end: bool = False
) -> FloatArray:
    """Limit the slew rate of commands (n,): returns the force (n,), as mean over each step or, with at_end, as value at
    its end. step_s: length of a step (s); rate: limit, > 0, in units of force per s, inf: none; initial_force: force
    before the first step."""
    return np.asarray(initial_force + _compute_mean_and_end_force(commands - initial_force, step_s, rate)[int(at_end)])


def _compute_mean_force(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Compute the mean force (n,) over each step: `OnCommand.change` of this effect."""
    return limit_slew(commands, step_s, values["rate"])


def _compute_end_force(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Compute the force (n,) at the end of each step: `OnCommand.at_end` of this effect."""
    return limit_slew(commands, step_s, values["rate"], at_end=True)


def _compute_mean_and_end_force(commands: FloatArray, step_s: float, rate: float) -> FloatArray:
    """Compute (2, n): mean force over each step, and force at its end; the command itself for an infinite rate."""
    if math.isinf(rate):
        return np.array([commands, commands])
    forces = np.empty((2, len(commands)))
    simulate_slew_limit(np.asarray(commands, dtype=np.float64), rate * step_s, forces[0], forces[1])
    return forces


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find starting values of the rate: the likeliest from 1 to 100 % of the command's largest rate of change, by grid
    search (twelve values, chosen) and golden section; where the residual of the response exceeds its noise, also
    `RATE_SHARES` of that largest rate. Empty for a constant command."""
    commands = evidence.command if axis == ALL_SITES else evidence.command[:, axis]
    largest_rate = float(np.abs(np.diff(commands, axis=0)).max()) * evidence.sample_rate_hz
    if largest_rate == 0:
        return ()
    rate = find_command_parameter(
        evidence,
        axis,
        lambda u, step_s, value: _compute_mean_force(u, step_s, {"rate": value}),
        list(np.geomspace(0.01 * largest_rate, largest_rate, 12)),
        True,
    )
    likeliest_starts = () if rate is None else ({"rate": rate},)
    if not _has_unexplained_error(evidence):
        return likeliest_starts
    # Re-tuning may have absorbed a limit that is rarely reached, so that the missing force does not show it.
    return likeliest_starts + tuple(
        {"rate": share * largest_rate} for share in (RATE_SHARES if axis == ALL_SITES else RATE_SHARES[1:2])
    )


def _has_unexplained_error(evidence: Evidence) -> bool:
    """Whether the rms residual of the response exceeds `MISFIT_RATIO` times its noise in any channel."""
    residual = (evidence.response - evidence.predicted)[evidence.used > 0]
    return bool((np.sqrt(np.nanmean(residual**2, axis=0)) > MISFIT_RATIO * evidence.noise).any())


EFFECT = Effect(
    name="slew_limit",
    equation="|dF/dt| <= rate, F towards u",
    source="Isermann, Mechatronic Systems, Springer 2005, ch. 10: limits of actuators",
    signature="force is missing where the command changes fast, more at high frequencies and high levels",
    parameters=(Parameter("rate", 1e-2, 1e7, none=math.inf),),
    action=OnCommand(_compute_mean_force, fine=True, at_end=_compute_end_force),
    starts=_find_starting_values,
    sites=("one", "all"),
)
