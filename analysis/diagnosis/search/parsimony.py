"""Parsimony: whether an effect is worth adding, whether errors distinguish two explanations, and which one is preferred
where they do not.

Errors are compared by the mean log error power over channels (`FitScore.mean_log_error`, 0 = only noise). Its excess
above the accuracy of the noise estimate, `NOISE_KNOWN_TO`, is what is left to explain. Where the errors of two
candidates do not differ by more than chance, the one with the lower information criterion is preferred, and a special
case before the law that contains it, unless the latter gains clearly.
"""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.errors.hypothesis import Claim
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.settings import (
    ADDED_GAIN,
    ADDED_SHARE,
    AS_GOOD_GAIN,
    AS_GOOD_SHARE,
    CONVINCING_ERROR,
    CONVINCING_SHARE,
    EXPLAINED_ERROR,
    LAW_BEATS,
    NOISE_ALONE,
    NOISE_KNOWN_TO,
    REFINED_FRICTION_SHARE,
    REFINED_GAIN,
    REFINED_MOST_GAIN,
    REFINED_SHARE,
)
from equalizer.effects.effect import Effect

DRY_FRICTION = frozenset(
    {
        "coulomb_friction",
        "asymmetric_friction",
        "stribeck_friction",
        "presliding_hysteresis",
        "position_dependent_friction",
    }
)
"""Effects whose force opposes the motion and hardly depends on its speed."""

FAMILIES: tuple[frozenset[str], ...] = (
    DRY_FRICTION,
    frozenset({"amplifier_lag", "transport_delay"}),
    frozenset({"clock_drift", "logger_offset"}),
    frozenset({"sensor_misalignment", "cross_axis_sensitivity"}),
    frozenset({"sensor_offset", "sensor_drift"}),
    frozenset({"added_mass", "hand_impedance", "body_on_actuator"}),
    frozenset({"backlash", "loose_joint"}),
)
"""Effects of similar action: at one place, at most one of a family is named, and they are exchanged for one another."""


def excludes(held: Claim, other: Claim) -> bool:
    """Whether `other` cannot be added beside `held`: the same effect, or one of its family, at a common place."""
    if not set(held.sites) & set(other.sites):
        return False
    names = {held.effect.name, other.effect.name}
    return len(names) == 1 or any(names <= family for family in FAMILIES)


def relatives(name: str, catalogue: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects that may replace the named one, itself included: its family, and the laws of which it is a special
    case."""
    families = {name}.union(*(family for family in FAMILIES if name in family))
    return tuple(effect for effect in catalogue if effect.name in families or name in effect.simpler)


def plainest_first(fitted_candidates: Sequence[FittedCandidate]) -> tuple[FittedCandidate, ...]:
    """The candidates with the preferred one moved to the front. fitted_candidates: by error, the best first."""
    if not fitted_candidates:
        return ()
    chosen = fitted_candidates[0]
    for other in fitted_candidates[1:]:
        if _is_plainer(other, chosen) and _good_enough(other, chosen):
            chosen = other
    return (chosen, *(candidate for candidate in fitted_candidates if candidate is not chosen))


def _is_plainer(plain: FittedCandidate, other: FittedCandidate) -> bool:
    return only_refines(other, plain) or (
        _information_criterion(plain) < _information_criterion(other) and not only_refines(plain, other)
    )


def _information_criterion(candidate: FittedCandidate) -> float:
    """2 k + |d|²: Akaike's penalty (1974) for k parameters, and the squared deviations d of the re-tuned parameters
    from the calibration, in prior standard deviations. Without the likelihood: it is only used where errors do not
    differ."""
    deviations = candidate.fitted.deviations
    return 2.0 * len(candidate.fitted.hypothesis.point) + float(deviations @ deviations)


def only_refines(other: FittedCandidate, plain: FittedCandidate) -> bool:
    """Whether the other's last effect contains the plain one's as a special case, at the same place."""
    return _is_special_case(plain, other)


def both_stand(named: FittedCandidate, other: FittedCandidate) -> bool:
    """Whether the other is a rival: inseparable from the named candidate, and no refinement of it."""
    return inseparable(named, other) and not only_refines(other, named)


def excess(candidate: FittedCandidate) -> float:
    """Mean log error power above the noise."""
    return max(candidate.score.mean_log_error - NOISE_KNOWN_TO, 0.0)


def share_of_mismatch(without: FittedCandidate, with_it: FittedCandidate) -> float:
    """Relative decrease of the excess log error power over the noise, between 0 and 1."""
    whole = excess(without)
    return min(max(1 - excess(with_it) / whole, 0.0), 1.0) if whole > 0 else 0.0


def leaves_little(retuned: FittedCandidate, candidate: FittedCandidate) -> bool:
    """Whether a candidate leaves little more than noise: as much as the right laws leave of a real device, which none
    fits exactly. retuned: the model without effects."""
    worst = candidate.score.worst_channel
    if worst <= EXPLAINED_ERROR:
        return True
    return worst <= CONVINCING_ERROR and share_of_mismatch(retuned, candidate) >= CONVINCING_SHARE


def inseparable(best: FittedCandidate, other: FittedCandidate) -> bool:
    """Whether two candidates' errors do not differ enough; also where the difference is smaller than what both gain on
    clean recordings, where neither effect is present."""
    worse = other.score.mean_log_error - best.score.mean_log_error
    return worse <= max(AS_GOOD_GAIN, AS_GOOD_SHARE * excess(best), min(other.usual, best.usual))


def is_worthwhile(base: FittedCandidate, better: FittedCandidate) -> bool:
    """Whether an effect lowers the error enough to be added. Where only the worst channel is above the noise, and not
    the mean over channels, or no more is left than a right law leaves, its logarithm must fall by half."""
    gained, over = base.score.mean_log_error - better.score.mean_log_error, np.log(base.score.worst_channel)
    little = excess(base) == 0 or base.score.worst_channel <= EXPLAINED_ERROR
    if little and over > np.log(NOISE_ALONE) and np.log(better.score.worst_channel) > over / 2:
        return False
    return gained > max(ADDED_SHARE * excess(base), ADDED_GAIN)


def _is_special_case(candidate: FittedCandidate, other: FittedCandidate) -> bool:
    plain, refined = candidate.fitted.hypothesis.claims[-1], other.fitted.hypothesis.claims[-1]
    return plain.effect.name in refined.effect.simpler and set(plain.sites) <= set(refined.sites)


def _good_enough(plain: FittedCandidate, refined: FittedCandidate) -> bool:
    """Whether the simpler candidate is preferred: inseparable from the other, or its special case from which the other
    gains too little."""
    if not _is_special_case(plain, refined):
        return inseparable(refined, plain)
    gained = plain.score.mean_log_error - refined.score.mean_log_error
    share = REFINED_FRICTION_SHARE if plain.newest in DRY_FRICTION else REFINED_SHARE
    return gained <= max(REFINED_GAIN, min(share * excess(plain), REFINED_MOST_GAIN))


def leaves_far_less(candidate: FittedCandidate, rival: FittedCandidate) -> bool:
    """Whether a law outside the catalogue replaces a named effect: its excess error is at most the share `LAW_BEATS` of
    the effect's, and its mean log rms error on the same held-out samples is lower by more than `NOISE_KNOWN_TO`. The
    second condition refuses a law that is the effect's own formula in another form."""
    held_out, other = (float(np.mean(np.log(each.score.test))) for each in (candidate, rival))
    if np.isfinite(held_out) and held_out >= other - NOISE_KNOWN_TO:
        return False
    return excess(candidate) <= LAW_BEATS * excess(rival)
