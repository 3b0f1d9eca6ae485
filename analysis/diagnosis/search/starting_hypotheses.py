"""List candidate hypotheses: effects of the catalogue at axes or channels, with starting values from data.

Each effect's estimator (`Effect.starts`) computes its starting values from the missing force, the motion and the
residuals of the base fit (`Evidence`); clock drift is also found by grid search. Hypotheses beyond the recorded range
are left out.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, make_claim_hypothesis
from analysis.diagnosis.limits import CLOCK_LEAST_SHARE, CLOCK_TRIALS_PER_PERIOD, MOST_CLOCK_TRIALS, STARTS_PER_CLAIM
from analysis.diagnosis.types import Mapper
from equalizer.effects.clock_drift import LARGEST_PPM
from equalizer.effects.effect import ALL_SITES, Effect, Values
from equalizer.effects.placing import find_device_part
from equalizer.effects.simulation.interpolated_response import resample_response
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

CLOCK_DRIFT = "clock_drift"
"""Catalogue name of the effect that is also found by grid search."""
RANGE_LIMITS: dict[str, dict[str, Literal["travel", "command"]]] = {
    "cogging": {"pitch": "travel"},
    "force_deadband": {"width": "command"},
    "force_saturation": {"limit": "command"},
}
"""By effect, the parameters that cannot exceed the recorded range of travel, or the largest recorded command."""


def list_candidates(catalogue: Sequence[Effect], evidence: Evidence, map_: Mapper = map) -> tuple[Hypothesis, ...]:
    """List hypotheses of single effects, in the catalogue's order, at most `STARTS_PER_CLAIM` per claim; an effect
    whose estimator finds no starting value is left out."""

    def list_effect_hypotheses(effect: Effect) -> list[Hypothesis]:
        is_sensor_effect = find_device_part(effect) == "sensor"
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

    hypotheses_by_effect: list[list[Hypothesis]] = list(map_(list_effect_hypotheses, catalogue))  # type: ignore[arg-type]
    return tuple(
        hypothesis
        for hypotheses in hypotheses_by_effect
        for hypothesis in hypotheses
        if is_newest_within_data(hypothesis, evidence)
    )


def is_newest_within_data(hypothesis: Hypothesis, evidence: Evidence) -> bool:
    """Whether the newest effect's parameters lie within the recorded range: the travel covers a pitch of a ripple, and
    the largest command reaches a dead band's width or a saturation limit."""
    return is_within_data(hypothesis, len(hypothesis.claims) - 1, evidence)


def is_within_data(hypothesis: Hypothesis, claim_index: int, evidence: Evidence, least_pitches: float = 1.0) -> bool:
    """Whether the parameters of the claim with this index lie within the recorded range (`is_newest_within_data`);
    True where that range is unknown or 0. least_pitches: number of pitches of a ripple that the travel must cover."""
    limits, is_used = RANGE_LIMITS.get(hypothesis.claims[claim_index].effect.name, {}), evidence.used > 0
    for placed_effect in hypothesis.list_effects_of(claim_index):
        for name, range_name in limits.items():
            signal = (evidence.axis_position if range_name == "travel" else evidence.command)[is_used][
                :, list(placed_effect.sites)
            ]
            recorded_sizes = (
                np.ptp(signal, axis=0) / least_pitches if range_name == "travel" else np.abs(signal).max(axis=0)
            )
            if (
                np.isfinite(recorded_sizes).all()
                and placed_effect.values[name] > float(recorded_sizes.max(initial=0.0)) > 0
            ):
                return False
    return True


def _make_common_hypotheses(effect: Effect, sites: tuple[int, ...], evidence: Evidence) -> list[Hypothesis]:
    """Make hypotheses of the effect at all sites with the same parameters; empty where the effect does not allow
    that."""
    starts = effect.starts(evidence, ALL_SITES)[:STARTS_PER_CLAIM] if "all" in effect.sites else ()
    return [make_claim_hypothesis(Claim(effect, "all", sites), [values]) for values in starts]


def _make_separate_hypotheses(
    effect: Effect, sites: tuple[int, ...], starts: Sequence[tuple[Values, ...]]
) -> list[Hypothesis]:
    """Make the hypothesis of the effect at all sites, each with separate parameters; empty where the effect does not
    allow that, or no site has starting values."""
    known_starts = [values[0] for values in starts if values]
    if "each" not in effect.sites or not known_starts:
        return []
    all_starts = [values[0] if values else _weaken_start(effect, known_starts[0]) for values in starts]
    return [make_claim_hypothesis(Claim(effect, "each", sites), all_starts)]


def _weaken_start(effect: Effect, values: Values) -> Values:
    """Make starting values for an axis or channel at which the estimator finds none: those of another, with a tenth
    (chosen) of the main parameter if the effect vanishes at 0."""
    main_parameter = effect.parameters[0]
    return {
        **values,
        main_parameter.name: values[main_parameter.name] / 10
        if main_parameter.none == 0
        else values[main_parameter.name],
    }


def search_clock_drift(catalogue: Sequence[Effect], evidence: Evidence) -> tuple[Hypothesis, ...]:
    """Find starting values of clock drift by grid search, for recordings too short for the effect's estimator; returns
    two hypotheses, without and with interpolation. Empty where that estimator finds starting values, where clock drift
    is not in the catalogue, or where no trial fits enough better than no drift (`_find_best_drift`)."""
    effect = next((entry for entry in catalogue if entry.name == CLOCK_DRIFT), None)
    if effect is None or effect.starts(evidence, ALL_SITES):
        return ()
    ppm = _find_best_drift(evidence)
    channel_count = evidence.response.shape[1]
    claim = Claim(effect, "all" if channel_count > 1 else "one", tuple(range(channel_count)))
    return tuple(
        make_claim_hypothesis(claim, [{"ppm": ppm, "interpolated": interpolated, "with_position": 1.0}])
        for interpolated in (0.0, 1.0)
        if ppm != 0
    )


def _find_best_drift(evidence: Evidence) -> float:
    """Find the drift in ppm with the least squared error of the resampled prediction on a grid; 0 where none removes
    more than `CLOCK_LEAST_SHARE` of the error without drift. A step of the grid shifts the recording's end by a
    fraction of the median period (`CLOCK_TRIALS_PER_PERIOD`)."""
    is_used, noise = evidence.used > 0, evidence.noise
    sample_count, step_samples = len(is_used), _compute_median_period(evidence) / CLOCK_TRIALS_PER_PERIOD
    most_steps = min(int(1e-6 * LARGEST_PPM * sample_count / step_samples), MOST_CLOCK_TRIALS)
    trials_ppm = 1e6 * step_samples / sample_count * np.arange(-most_steps, most_steps + 1)

    def compute_misfit(ppm: float) -> float:
        shifted_prediction = resample_response(evidence.predicted, 1 + 1e-6 * ppm, 0.0, 0.0)
        return float(np.sum((((evidence.response - shifted_prediction) / noise) ** 2)[is_used]))

    misfits = [compute_misfit(float(ppm)) for ppm in trials_ppm]
    best_index = int(np.argmin(misfits))
    return float(trials_ppm[best_index]) if misfits[best_index] < (1 - CLOCK_LEAST_SHARE) * misfits[most_steps] else 0.0


def _compute_median_period(evidence: Evidence) -> float:
    """Compute the period, in samples, below and above whose frequency half of the predicted response's power lies;
    channels are weighted by the inverse of their noise."""
    whitened_response: FloatArray = (evidence.predicted - evidence.predicted.mean(axis=0)) / evidence.noise
    cumulative_power = np.cumsum(np.sum(np.abs(np.fft.rfft(whitened_response, axis=0)) ** 2, axis=1))
    return len(whitened_response) / max(int(np.searchsorted(cumulative_power, cumulative_power[-1] / 2)), 1)
