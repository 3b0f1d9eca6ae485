"""An actuator whose force cannot change faster than so: voltage over inductance, or a ramp in its software."""

import math

import numpy as np

from equalizer.effects.effect import ALL_SITES, Effect, OnCommand, Parameter, Values
from equalizer.effects.simulation.slew_kernel import follow
from equalizer.effects.starts.command_starts import likeliest_value
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

SELDOM = (0.3, 0.5, 0.75)
"""Of the command's fastest change."""
ERRS = 1.05
"""Times its noise that a channel must err by for a guess to be tried."""


def _followed(commands: FloatArray, step_s: float, of: Values) -> FloatArray:
    return np.asarray(_both(commands, step_s, of["rate"])[0])


def _followed_at_end(commands: FloatArray, step_s: float, of: Values) -> FloatArray:
    return np.asarray(_both(commands, step_s, of["rate"])[1])


def _both(commands: FloatArray, step_s: float, rate: float) -> FloatArray:
    if math.isinf(rate):
        return np.array([commands, commands])
    found = np.empty((2, len(commands)))
    follow(np.asarray(commands, dtype=np.float64), rate * step_s, found[0], found[1])
    return found


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    commanded = evidence.command if axis == ALL_SITES else evidence.command[:, axis]
    fastest = float(np.abs(np.diff(commanded, axis=0)).max()) * evidence.sample_rate_hz
    if fastest == 0:
        return ()
    rate = likeliest_value(
        evidence,
        axis,
        lambda u, step_s, value: _followed(u, step_s, {"rate": value}),
        list(np.geomspace(0.01 * fastest, fastest, 12)),
        True,
    )
    likeliest = () if rate is None else ({"rate": rate},)
    if not _unexplained(evidence):
        return likeliest
    # Seldom exceeded, a limit hides in what re-tuning did: then it must be tried.
    return likeliest + tuple({"rate": share * fastest} for share in (SELDOM if axis == ALL_SITES else SELDOM[1:2]))


def _unexplained(evidence: Evidence) -> bool:
    """Whether any channel errs by more than its noise."""
    left = (evidence.response - evidence.predicted)[evidence.used > 0]
    return bool((np.sqrt(np.nanmean(left**2, axis=0)) > ERRS * evidence.noise).any())


EFFECT = Effect(
    name="slew_limit",
    equation="|dF/dt| <= rate, F towards u",
    source="Isermann, Mechatronic Systems, Springer 2005, ch. 10: limits of actuators",
    signature="force is missing where the command changes fast, more at high frequencies and high levels",
    parameters=(Parameter("rate", 1e-2, 1e7, none=math.inf),),
    acts=OnCommand(_followed, fine=True, at_end=_followed_at_end),
    starts=_starts,
    sites=("one", "all"),
)
