"""Commands that take effect later than was assumed: a bus, a servo tick."""

import numpy as np

from equalizer.effects.command_path import delayed, delayed_at_end
from equalizer.effects.command_starts import likeliest_value
from equalizer.effects.effect import Effect, OnCommand, Parameter, Values
from equalizer.effects.evidence import Evidence
from equalizer.effects.response_starts import starts_for_lateness
from equalizer.signals.signal import FloatArray

SHORTEST_S, LONGEST_S = 2e-5, 0.05


def _late(commands: FloatArray, step_s: float, of: Values) -> FloatArray:
    return delayed(commands, step_s, of["delay"])


def _late_at_end(commands: FloatArray, step_s: float, of: Values) -> FloatArray:
    return delayed_at_end(commands, step_s, of["delay"])


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    fitting = likeliest_value(evidence, axis, delayed, list(np.geomspace(SHORTEST_S, LONGEST_S, 24)), False)
    return tuple({"delay": late} for late in starts_for_lateness(evidence, axis, fitting, LONGEST_S))


EFFECT = Effect(
    name="transport_delay",
    equation="F(t) = u(t - delay)",
    source="Diolaiti et al., IEEE Trans. Robot. 22 (2006) 256: delay in a haptic loop",
    signature="the phase falls in proportion to frequency while the gain stays, in position and response alike",
    parameters=(Parameter("delay", 1e-6, 1.0, none=0.0),),
    acts=OnCommand(_late, fine=True, at_end=_late_at_end),
    starts=_starts,
    sites=("all", "one"),
)
