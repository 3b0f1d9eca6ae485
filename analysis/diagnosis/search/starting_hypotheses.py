"""Candidate hypotheses: every effect of the catalogue at every axis or channel, with starting values from the data.

Each effect's estimator (`Effect.starts`) reads its starting values off the missing force, the motion and the residuals
of the base fit (`Evidence`); clock drift is also found by grid search. Hypotheses beyond the recorded range are left
out.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, make_claim_hypothesis
from analysis.diagnosis.settings import CLOCK_LEAST_SHARE, CLOCK_TRIALS_PER_PERIOD, MOST_CLOCK_TRIALS, STARTS_PER_CLAIM
from analysis.diagnosis.types import Mapper
from equalizer.effects.clock_drift import LARGEST_PPM
from equalizer.effects.effect import ALL_SITES, Effect, Values
from equalizer.effects.placing import find_place
from equalizer.effects.simulation.interpolated_response import resample_response
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

CLOCK_DRIFT = "clock_drift"
RANGE_LIMITS: dict[str, dict[str, Literal["travel", "command"]]] = {
    "cogging": {"pitch": "travel"},
    "force_deadband": {"width": "command"},
    "force_saturation": {"limit": "command"},
}
"""By effect, the parameters that cannot exceed the recorded range of travel, or the largest recorded command."""


def list_candidates(catalogue: Sequence[Effect], evidence: Evidence, map_: Mapper = map) -> tuple[Hypothesis, ...]:
    """Hypotheses of single effects, in the catalogue's order; an effect whose estimator finds no starting value is left
    out."""

    def list_effect_hypotheses(effect: Effect) -> list[Hypothesis]:
        is_sensor_effect = find_place(effect) == "sensor"
        sites = range(evidence.model.outputs if is_sensor_effect else evidence.model.inputs)
        starts = [effect.starts(evidence, site)[:STARTS_PER_CLAIM] for site in sites]
        hypotheses: list[Hypothesis] = []
        if "one" in effect.sites or len(sites) == 1:
            hypotheses += [
                make_claim_hypothesis(Claim(effect, "one", (site,)), [values])
                for site in sites
                for values in starts[site]
            ]
        if len(sites) > 1:
            hypotheses += _make_separate_hypotheses(effect, tuple(sites), starts)
            hypotheses += _make_common_hypotheses(effect, tuple(sites), evidence)
        return hypotheses

    by_effect: list[list[Hypothesis]] = list(map_(list_effect_hypotheses, catalogue))  # type: ignore[arg-type]
    return tuple(
        hypothesis
        for hypotheses in by_effect
        for hypothesis in hypotheses
        if is_newest_within_data(hypothesis, evidence)
    )


def is_newest_within_data(hypothesis: Hypothesis, evidence: Evidence) -> bool:
    """Whether the newest effect's parameters lie within the recorded range: the travel covers a pitch of a ripple, and
    the largest command reaches a dead band's width or a saturation limit."""
    return is_within_data(hypothesis, len(hypothesis.claims) - 1, evidence)


def is_within_data(hypothesis: Hypothesis, claim_index: int, evidence: Evidence, pitches: float = 1.0) -> bool:
    """`is_newest_within_data` for the claim with this index. pitches: number of pitches of a ripple that the travel
    must cover."""
    limits, used = RANGE_LIMITS.get(hypothesis.claims[claim_index].effect.name, {}), evidence.used > 0
    for placed_effect in hypothesis.list_effects_of(claim_index):
        for name, range_name in limits.items():
            signal = (evidence.axis_position if range_name == "travel" else evidence.command)[used][
                :, list(placed_effect.sites)
            ]
            size = np.ptp(signal, axis=0) / pitches if range_name == "travel" else np.abs(signal).max(axis=0)
            if np.isfinite(size).all() and placed_effect.values[name] > float(size.max(initial=0.0)) > 0:
                return False
    return True


def _make_common_hypotheses(effect: Effect, sites: tuple[int, ...], evidence: Evidence) -> list[Hypothesis]:
    """Hypotheses of the effect at all sites with the same parameters; empty where the effect does not allow that."""
    starts = effect.starts(evidence, ALL_SITES)[:STARTS_PER_CLAIM] if "all" in effect.sites else ()
    return [make_claim_hypothesis(Claim(effect, "all", sites), [values]) for values in starts]


def _make_separate_hypotheses(
    effect: Effect, sites: tuple[int, ...], starts: Sequence[tuple[Values, ...]]
) -> list[Hypothesis]:
    """The hypothesis of the effect at all sites, each with its own parameters; empty where the effect does not allow
    that, or no site has starting values."""
    known_starts = [values[0] for values in starts if values]
    if "each" not in effect.sites or not known_starts:
        return []
    all_starts = [values[0] if values else _weaken_start(effect, known_starts[0]) for values in starts]
    return [make_claim_hypothesis(Claim(effect, "each", sites), all_starts)]


def _weaken_start(effect: Effect, values: Values) -> Values:
    """Starting values for an axis at which the estimator finds none: those of another axis, the main parameter a tenth
    of it if the effect vanishes at 0."""
    main = effect.parameters[0]
    return {**values, main.name: values[main.name] / 10 if main.none == 0 else values[main.name]}


def search_clock_drift(catalogue: Sequence[Effect], evidence: Evidence) -> tuple[Hypothesis, ...]:
    """Hypotheses of clock drift with starting values by grid search, for recordings too short for the effect's own
    estimator. Empty where that estimator finds some, where clock drift is not in the catalogue, or where no trial fits
    better than no drift."""
    effect = next((entry for entry in catalogue if entry.name == CLOCK_DRIFT), None)
    if effect is None or effect.starts(evidence, ALL_SITES):
        return ()
    ppm = _find_best_drift(evidence)
    p = evidence.response.shape[1]
    claim = Claim(effect, "all" if p > 1 else "one", tuple(range(p)))
    return tuple(
        make_claim_hypothesis(claim, [{"ppm": ppm, "interpolated": interpolated, "with_position": 1.0}])
        for interpolated in (0.0, 1.0)
        if ppm != 0
    )


def _find_best_drift(evidence: Evidence) -> float:
    """The drift in ppm with the least squared error of the shifted prediction on a grid; 0 where none takes more than
    `CLOCK_LEAST_SHARE` of the error without drift. Step: a fraction of the middle period at the recording's end."""
    used, noise = evidence.used > 0, evidence.noise
    n, step = len(used), _compute_median_period(evidence) / CLOCK_TRIALS_PER_PERIOD
    most_steps = min(int(1e-6 * LARGEST_PPM * n / step), MOST_CLOCK_TRIALS)
    trials_ppm = 1e6 * step / n * np.arange(-most_steps, most_steps + 1)

    def compute_misfit(ppm: float) -> float:
        shifted = resample_response(evidence.predicted, 1 + 1e-6 * ppm, 0.0, 0.0)
        return float(np.sum((((evidence.response - shifted) / noise) ** 2)[used]))

    misfits = [compute_misfit(float(ppm)) for ppm in trials_ppm]
    best = int(np.argmin(misfits))
    return float(trials_ppm[best]) if misfits[best] < (1 - CLOCK_LEAST_SHARE) * misfits[most_steps] else 0.0


def _compute_median_period(evidence: Evidence) -> float:
    """Period, in samples, below and above whose frequency half of the predicted response's power lies; channels are
    weighted by their noise."""
    whitened: FloatArray = (evidence.predicted - evidence.predicted.mean(axis=0)) / evidence.noise
    power = np.cumsum(np.sum(np.abs(np.fft.rfft(whitened, axis=0)) ** 2, axis=1))
    return len(whitened) / max(int(np.searchsorted(power, power[-1] / 2)), 1)
