"""Candidate hypotheses: every effect of the catalogue at every axis or channel, with starting values from the data.

Each effect's estimator (`Effect.starts`) reads its starting values off the missing force, the motion and the residuals
of the base fit (`Evidence`); clock drift is also found by grid search. Hypotheses beyond the recorded range are left
out.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, hypothesis_of_claim
from analysis.diagnosis.settings import CLOCK_LEAST_SHARE, CLOCK_TRIALS_PER_PERIOD, MOST_CLOCK_TRIALS, STARTS_PER_CLAIM
from analysis.diagnosis.types import Mapper
from equalizer.effects.clock_drift import LARGEST_PPM
from equalizer.effects.effect import ALL_SITES, Effect, Values
from equalizer.effects.placing import place_of_effect
from equalizer.effects.simulation.interpolated_response import read_other_times
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

CLOCK_DRIFT = "clock_drift"
WITHIN: dict[str, dict[str, Literal["travel", "command"]]] = {
    "cogging": {"pitch": "travel"},
    "force_deadband": {"width": "command"},
    "force_saturation": {"limit": "command"},
}
"""By effect, the parameters that cannot exceed the recorded range of travel, or the largest recorded command."""


def candidates(catalogue: Sequence[Effect], evidence: Evidence, map_: Mapper = map) -> tuple[Hypothesis, ...]:
    """Hypotheses of single effects, in the catalogue's order; an effect whose estimator finds no starting value is left
    out."""

    def of_effect(effect: Effect) -> list[Hypothesis]:
        sensed = place_of_effect(effect) == "sensor"
        sites = range(evidence.model.outputs if sensed else evidence.model.inputs)
        starts = [effect.starts(evidence, site)[:STARTS_PER_CLAIM] for site in sites]
        found: list[Hypothesis] = []
        if "one" in effect.sites or len(sites) == 1:
            found += [
                hypothesis_of_claim(Claim(effect, "one", (site,)), [values])
                for site in sites
                for values in starts[site]
            ]
        if len(sites) > 1:
            found += _each(effect, tuple(sites), starts)
            found += _all(effect, tuple(sites), evidence)
        return found

    each: list[list[Hypothesis]] = list(map_(of_effect, catalogue))  # type: ignore[arg-type]
    return tuple(hypothesis for found in each for hypothesis in found if within_data(hypothesis, evidence))


def within_data(hypothesis: Hypothesis, evidence: Evidence) -> bool:
    """Whether the newest effect's parameters lie within the recorded range: the travel covers a pitch of a ripple, and
    the largest command reaches a dead band's width or a saturation limit."""
    return is_within_data(hypothesis, len(hypothesis.claims) - 1, evidence)


def is_within_data(hypothesis: Hypothesis, number: int, evidence: Evidence, pitches: float = 1.0) -> bool:
    """`within_data` for the claim with index `number`. pitches: number of pitches of a ripple that the travel must
    cover."""
    limits, used = WITHIN.get(hypothesis.claims[number].effect.name, {}), evidence.used > 0
    for placed in hypothesis.of_claim(number):
        for name, reached in limits.items():
            signal = (evidence.axis_position if reached == "travel" else evidence.command)[used][:, list(placed.sites)]
            size = np.ptp(signal, axis=0) / pitches if reached == "travel" else np.abs(signal).max(axis=0)
            if np.isfinite(size).all() and placed.values[name] > float(size.max(initial=0.0)) > 0:
                return False
    return True


def _all(effect: Effect, sites: tuple[int, ...], evidence: Evidence) -> list[Hypothesis]:
    """Hypotheses of the effect at all sites with the same parameters; empty where the effect does not allow that."""
    starts = effect.starts(evidence, ALL_SITES)[:STARTS_PER_CLAIM] if "all" in effect.sites else ()
    return [hypothesis_of_claim(Claim(effect, "all", sites), [values]) for values in starts]


def _each(effect: Effect, sites: tuple[int, ...], starts: Sequence[tuple[Values, ...]]) -> list[Hypothesis]:
    """The hypothesis of the effect at all sites, each with its own parameters; empty where the effect does not allow
    that, or no site has starting values."""
    first = [values[0] for values in starts if values]
    if "each" not in effect.sites or not first:
        return []
    whole = [values[0] if values else _faint(effect, first[0]) for values in starts]
    return [hypothesis_of_claim(Claim(effect, "each", sites), whole)]


def _faint(effect: Effect, values: Values) -> Values:
    """Starting values for an axis at which the estimator finds none: those of another axis, the main parameter a tenth
    of it if the effect vanishes at 0."""
    main = effect.parameters[0]
    return {**values, main.name: values[main.name] / 10 if main.none == 0 else values[main.name]}


def clock_drift_by_trial(catalogue: Sequence[Effect], evidence: Evidence) -> tuple[Hypothesis, ...]:
    """Hypotheses of clock drift with starting values by grid search, for recordings too short for the effect's own
    estimator. Empty where that estimator finds some, where clock drift is not in the catalogue, or where no trial fits
    better than no drift."""
    effect = next((known for known in catalogue if known.name == CLOCK_DRIFT), None)
    if effect is None or effect.starts(evidence, ALL_SITES):
        return ()
    ppm = _best_drift(evidence)
    p = evidence.response.shape[1]
    claim = Claim(effect, "all" if p > 1 else "one", tuple(range(p)))
    return tuple(
        hypothesis_of_claim(claim, [{"ppm": ppm, "interpolated": straight, "with_position": 1.0}])
        for straight in (0.0, 1.0)
        if ppm != 0
    )


def _best_drift(evidence: Evidence) -> float:
    """The drift in ppm with the least squared error of the shifted prediction on a grid; 0 where none takes more than
    `CLOCK_LEAST_SHARE` of the error without drift. Step: a fraction of the middle period at the recording's end."""
    used, noise = evidence.used > 0, evidence.noise
    n, step = len(used), _middle_period(evidence) / CLOCK_TRIALS_PER_PERIOD
    furthest = min(int(1e-6 * LARGEST_PPM * n / step), MOST_CLOCK_TRIALS)
    tried = 1e6 * step / n * np.arange(-furthest, furthest + 1)

    def left(ppm: float) -> float:
        read = read_other_times(evidence.predicted, 1 + 1e-6 * ppm, 0.0, 0.0)
        return float(np.sum((((evidence.response - read) / noise) ** 2)[used]))

    misfits = [left(float(ppm)) for ppm in tried]
    best = int(np.argmin(misfits))
    return float(tried[best]) if misfits[best] < (1 - CLOCK_LEAST_SHARE) * misfits[furthest] else 0.0


def _middle_period(evidence: Evidence) -> float:
    """Period, in samples, below and above whose frequency half of the predicted response's power lies; channels are
    weighted by their noise."""
    moving: FloatArray = (evidence.predicted - evidence.predicted.mean(axis=0)) / evidence.noise
    power = np.cumsum(np.sum(np.abs(np.fft.rfft(moving, axis=0)) ** 2, axis=1))
    return len(moving) / max(int(np.searchsorted(power, power[-1] / 2)), 1)
