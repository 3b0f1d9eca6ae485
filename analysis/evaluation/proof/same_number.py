"""One number said in two ways: a phase turns round, and a stop on both sides may be named after either."""

import math
from collections.abc import Mapping

TURN = 2 * math.pi


def as_said(name: str, said: float, values: Mapping[str, float]) -> float:
    """The true value of a number in the way the diagnosis says it. values: all true ones of the effect.

    Where an effect acts the same with another value, that one is taken which lies nearest to what was said.
    """
    true = values[name]
    if name == "phase":
        return true + TURN * round((said - true) / TURN)
    if name == "position" and values.get("opposite") == 1.0:
        return math.copysign(true, said)
    return true
