"""Transport delay of the command, as of a bus or a controller's tick: F(t) = u(t - delay).

A command u that is held over a sample period and delayed by (k + r) periods, 0 <= r < 1, has over each period the mean
(1 - r) u[n - k] + r u[n - k - 1] (`compute_delayed_mean`). An entry of `equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnCommand, Parameter, Values
from equalizer.effects.simulation.command_path import compute_delayed_end, compute_delayed_mean
from equalizer.effects.starts.command_starts import find_command_parameter
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import list_lag_starts
from equalizer.signals.signal import FloatArray

SHORTEST_DELAY_S, LONGEST_DELAY_S = 2e-5, 0.05
"""Range of delays (s) among which starting values are searched. Chosen."""
TRIAL_DELAY_COUNT = 24
"""Number of trial delays in that range, at constant ratios. Chosen."""
JUMP_MARGIN_PERIODS = 0.15
"""Distance of the second starting value from the nearest whole number of hold times, in hold times (sample periods).
Chosen. An acceleration follows a force without delay, so that the misfit jumps where the delay passes a whole number of
hold times, and a gradient search does not cross that jump."""


def _delay_force(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Compute the mean force (n,) over each step, for commands (n,) in N: `OnCommand.change` of this effect."""
    return compute_delayed_mean(commands, step_s, values["delay"])


def _delay_force_at_end(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Compute the force (n,) at the end of each step, for commands (n,) in N: `OnCommand.at_end` of this effect."""
    return compute_delayed_end(commands, step_s, values["delay"])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find delays (s) from the response's time shift and from the missing force, and the first of these moved across
    the jump of the misfit (`JUMP_MARGIN_PERIODS`). Empty where the measured response is early (`list_lag_starts`)."""
    trial_delays_s = list(np.geomspace(SHORTEST_DELAY_S, LONGEST_DELAY_S, TRIAL_DELAY_COUNT))
    force_delay_s = find_command_parameter(evidence, axis, compute_delayed_mean, trial_delays_s, False)
    delays_s = list_lag_starts(evidence, axis, force_delay_s, LONGEST_DELAY_S)
    moved_delays_s = tuple(_move_across_jump(delay_s, 1 / evidence.sample_rate_hz) for delay_s in delays_s[:1])
    return tuple({"delay": delay_s} for delay_s in (*delays_s, *moved_delays_s))


def _move_across_jump(delay_s: float, hold_time_s: float) -> float:
    """Move a delay (s) to the other side of the nearest whole number, at least 1, of hold times, `JUMP_MARGIN_PERIODS`
    from it. hold_time_s: sample period."""
    hold_times = max(round(delay_s / hold_time_s), 1)
    return (
        hold_times + (JUMP_MARGIN_PERIODS if delay_s < hold_times * hold_time_s else -JUMP_MARGIN_PERIODS)
    ) * hold_time_s


EFFECT = Effect(
    name="transport_delay",
    equation="F(t) = u(t - delay)",
    source="Diolaiti et al., IEEE Trans. Robot. 22 (2006) 256: delay in a haptic loop",
    signature="the phase falls in proportion to frequency while the gain stays, in position and response alike",
    parameters=(Parameter("delay", 1e-6, 1.0, none=0.0),),
    action=OnCommand(_delay_force, fine=True, at_end=_delay_force_at_end),
    starts=_find_starting_values,
    sites=("all", "one"),
)
