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


def excludes(existing: Claim, added: Claim) -> bool:
    """Whether `added` cannot be added beside `present`: the same effect, or one of its family, at a common place."""
    if not set(existing.sites) & set(added.sites):
        return False
    names = {existing.effect.name, added.effect.name}
    return len(names) == 1 or any(names <= family for family in FAMILIES)


def list_relatives(name: str, catalogue: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects that may replace the named one, itself included: its family, and the laws of which it is a special
    case."""
    families = {name}.union(*(family for family in FAMILIES if name in family))
    return tuple(effect for effect in catalogue if effect.name in families or name in effect.simpler)


def move_plainest_first(fitted_candidates: Sequence[FittedCandidate]) -> tuple[FittedCandidate, ...]:
    """The candidates with the preferred one moved to the front. fitted_candidates: by error, the best first."""
    if not fitted_candidates:
        return ()
    preferred = fitted_candidates[0]
    for rival in fitted_candidates[1:]:
        if _is_plainer(rival, preferred) and _is_preferable(rival, preferred):
            preferred = rival
    return (preferred, *(candidate for candidate in fitted_candidates if candidate is not preferred))


def _is_plainer(simpler: FittedCandidate, reference: FittedCandidate) -> bool:
    return only_refines(reference, simpler) or (
        _compute_information_criterion(simpler) < _compute_information_criterion(reference)
        and not only_refines(simpler, reference)
    )


def _compute_information_criterion(candidate: FittedCandidate) -> float:
    """2 k + |d|²: Akaike's penalty (1974) for k parameters, and the squared deviations d of the re-tuned parameters
    from the calibration, in prior standard deviations. Without the likelihood: it is only used where errors do not
    differ."""
    deviations = candidate.fitted.deviations
    return 2.0 * len(candidate.fitted.hypothesis.point) + float(deviations @ deviations)


def only_refines(general: FittedCandidate, special: FittedCandidate) -> bool:
    """Whether the general candidate's last effect contains the special one's as a special case, at the same place."""
    return _is_special_case(special, general)


def is_equal_rival(named_candidate: FittedCandidate, rival: FittedCandidate) -> bool:
    """Whether the candidate is a rival: inseparable from the named candidate, and no refinement of it."""
    return are_inseparable(named_candidate, rival) and not only_refines(rival, named_candidate)


def compute_excess(candidate: FittedCandidate) -> float:
    """Mean log error power above the noise."""
    return max(candidate.score.mean_log_error - NOISE_KNOWN_TO, 0.0)


def compute_mismatch_share(base: FittedCandidate, completed: FittedCandidate) -> float:
    """Relative decrease of the excess log error power over the noise, between 0 and 1."""
    base_excess = compute_excess(base)
    return min(max(1 - compute_excess(completed) / base_excess, 0.0), 1.0) if base_excess > 0 else 0.0


def leaves_little(retuned: FittedCandidate, candidate: FittedCandidate) -> bool:
    """Whether a candidate leaves little more than noise: as much as the right laws leave of a real device, which none
    fits exactly. retuned: the model without effects."""
    worst_error = candidate.score.worst_channel
    if worst_error <= EXPLAINED_ERROR:
        return True
    return worst_error <= CONVINCING_ERROR and compute_mismatch_share(retuned, candidate) >= CONVINCING_SHARE


def are_inseparable(best: FittedCandidate, rival: FittedCandidate) -> bool:
    """Whether two candidates' errors do not differ enough; also where the difference is smaller than what both gain on
    clean recordings, where neither effect is present."""
    difference = rival.score.mean_log_error - best.score.mean_log_error
    return difference <= max(AS_GOOD_GAIN, AS_GOOD_SHARE * compute_excess(best), min(rival.clean_gain, best.clean_gain))


def is_worthwhile(base: FittedCandidate, extended: FittedCandidate) -> bool:
    """Whether an effect lowers the error enough to be added. Where only the worst channel is above the noise, and not
    the mean over channels, or no more is left than a right law leaves, its logarithm must fall by half."""
    gain, log_error = base.score.mean_log_error - extended.score.mean_log_error, np.log(base.score.worst_channel)
    is_small = compute_excess(base) == 0 or base.score.worst_channel <= EXPLAINED_ERROR
    if is_small and log_error > np.log(NOISE_ALONE) and np.log(extended.score.worst_channel) > log_error / 2:
        return False
    return gain > max(ADDED_SHARE * compute_excess(base), ADDED_GAIN)


def _is_special_case(special_candidate: FittedCandidate, general_candidate: FittedCandidate) -> bool:
    special, general = special_candidate.fitted.hypothesis.claims[-1], general_candidate.fitted.hypothesis.claims[-1]
    return special.effect.name in general.effect.simpler and set(special.sites) <= set(general.sites)


def _is_preferable(simpler: FittedCandidate, refined: FittedCandidate) -> bool:
    """Whether the simpler candidate is preferred: inseparable from the other, or its special case from which the other
    gains too little."""
    if not _is_special_case(simpler, refined):
        return are_inseparable(refined, simpler)
    gain = simpler.score.mean_log_error - refined.score.mean_log_error
    share = REFINED_FRICTION_SHARE if simpler.newest in DRY_FRICTION else REFINED_SHARE
    return gain <= max(REFINED_GAIN, min(share * compute_excess(simpler), REFINED_MOST_GAIN))


def leaves_far_less(candidate: FittedCandidate, rival: FittedCandidate) -> bool:
    """Whether a law outside the catalogue replaces a named effect: its excess error is at most the share `LAW_BEATS` of
    the effect's, and its mean log rms error on the same held-out samples is lower by more than `NOISE_KNOWN_TO`. The
    second condition refuses a law that is the effect's own formula in another form."""
    candidate_error, rival_error = (float(np.mean(np.log(fitted.score.test))) for fitted in (candidate, rival))
    if np.isfinite(candidate_error) and candidate_error >= rival_error - NOISE_KNOWN_TO:
        return False
    return compute_excess(candidate) <= LAW_BEATS * compute_excess(rival)
