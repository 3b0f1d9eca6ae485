"""Model selection: whether an effect is worth adding, and which of two candidates is preferred (parsimony).

Candidates are compared by the mean log error power over channels (`FitScore.mean_log_error`, 0 = noise alone). Its
excess above the accuracy of the noise estimate, `NOISE_ACCURACY`, is the part that remains unexplained. Where the
errors of two candidates do not differ by more than chance, the one with the lower information criterion is preferred,
and a special case before the more general law, unless the latter's error is smaller by a margin (`REFINED_SHARE`).
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import gammaincc

from analysis.diagnosis.errors.hypothesis import Claim
from analysis.diagnosis.limits import (
    ADDED_GAIN,
    ADDED_SHARE,
    AS_GOOD_GAIN,
    AS_GOOD_SHARE,
    CONVINCING_ERROR,
    CONVINCING_SHARE,
    DECISIVE_CRITERION,
    EXPLAINED_ERROR,
    IMPROBABLE_DEVIATIONS,
    LAW_REPLACES_RATIO,
    NOISE_ACCURACY,
    NOISE_ALONE,
    REFINED_FRICTION_SHARE,
    REFINED_GAIN,
    REFINED_MOST_GAIN,
    REFINED_SHARE,
)
from analysis.diagnosis.search.search_context import FittedCandidate
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
"""Names of the effects whose force opposes the motion and depends little on its speed."""

FAMILIES: tuple[frozenset[str], ...] = (
    DRY_FRICTION,
    frozenset({"amplifier_lag", "transport_delay"}),
    frozenset({"clock_drift", "logger_offset"}),
    frozenset({"sensor_misalignment", "cross_axis_sensitivity"}),
    frozenset({"sensor_offset", "sensor_drift"}),
    frozenset({"added_mass", "hand_impedance", "body_on_actuator"}),
    frozenset({"backlash", "loose_joint"}),
)
"""Names of effects with similar forces or errors. A search adds at most one of a family at a place, and exchanges them
for one another."""


def are_exclusive(existing: Claim, added: Claim) -> bool:
    """Whether two claims exclude each other: the same effect, or two of one family, at a common site."""
    if not set(existing.sites) & set(added.sites):
        return False
    names = {existing.effect.name, added.effect.name}
    return len(names) == 1 or any(names <= family for family in FAMILIES)


def list_relatives(name: str, catalogue: Sequence[Effect]) -> tuple[Effect, ...]:
    """List the effects that may replace the named one, itself included: its family, and the laws of which it is a
    special case."""
    relative_names = {name}.union(*(family for family in FAMILIES if name in family))
    return tuple(effect for effect in catalogue if effect.name in relative_names or name in effect.simpler)


def move_preferred_first(fitted_candidates: Sequence[FittedCandidate]) -> tuple[FittedCandidate, ...]:
    """Move the preferred candidate to the front; the order of the others stays. fitted_candidates: by error, the best
    first."""
    if not fitted_candidates:
        return ()
    preferred = fitted_candidates[0]
    for rival in fitted_candidates[1:]:
        if _is_simpler(rival, preferred) and _is_preferable(rival, preferred):
            preferred = rival
    return (preferred, *(candidate for candidate in fitted_candidates if candidate is not preferred))


def _is_simpler(simpler: FittedCandidate, reference: FittedCandidate) -> bool:
    """Whether a candidate is a special case of the reference, or has a lower information criterion and is no refinement
    of it."""
    return is_refined_candidate(reference, simpler) or (
        _compute_information_criterion(simpler) < _compute_information_criterion(reference)
        and not is_refined_candidate(simpler, reference)
    )


def _compute_information_criterion(candidate: FittedCandidate) -> float:
    """Compute 2 k + |d|²: Akaike's penalty (1974) for the k parameters of the effects, and the squared deviations d of
    the re-tuned parameters from the calibration, in prior standard deviations. The likelihood term is omitted, because
    only candidates with equal errors are compared by it."""
    deviations = candidate.fitted.deviations
    return 2.0 * len(candidate.fitted.hypothesis.point) + float(deviations @ deviations)


def has_improbable_deviations(candidate: FittedCandidate) -> bool:
    """Whether the re-tuned parameters of the model deviate from the calibration by more than its tolerances explain:
    |d|² is significant in a chi-square test with a degree of freedom per parameter (`IMPROBABLE_DEVIATIONS`)."""
    deviations = candidate.fitted.deviations
    return bool(gammaincc(len(deviations) / 2, float(deviations @ deviations) / 2) < IMPROBABLE_DEVIATIONS)


def is_more_probable(current: FittedCandidate, replacement: FittedCandidate) -> bool:
    """Whether a replacement has no larger error than the current candidate, chance aside, and an information criterion
    that is lower by `DECISIVE_CRITERION` or more."""
    difference = _compute_information_criterion(current) - _compute_information_criterion(replacement)
    return difference >= DECISIVE_CRITERION and are_inseparable(current, replacement)


def is_refined_candidate(general: FittedCandidate, special: FittedCandidate) -> bool:
    """Whether the last effect of the general candidate contains that of the special one as a special case, at the same
    sites or more."""
    return _is_special_case(special, general)


def is_equal_rival(named_candidate: FittedCandidate, rival: FittedCandidate) -> bool:
    """Whether a candidate is a rival of the named one: errors inseparable, and no refinement of it."""
    return are_inseparable(named_candidate, rival) and not is_refined_candidate(rival, named_candidate)


def compute_excess(candidate: FittedCandidate) -> float:
    """Compute the mean log error power above the noise and its uncertainty, at least 0."""
    return max(candidate.score.mean_log_error - NOISE_ACCURACY, 0.0)


def compute_mismatch_share(base: FittedCandidate, completed: FittedCandidate) -> float:
    """Compute the share of the base's excess (`compute_excess`) that the completed candidate removes, 0 to 1; 0 without
    excess."""
    base_excess = compute_excess(base)
    return min(max(1 - compute_excess(completed) / base_excess, 0.0), 1.0) if base_excess > 0 else 0.0


def has_small_error(retuned: FittedCandidate, candidate: FittedCandidate) -> bool:
    """Whether a candidate's largest error over channels is close to the noise: at most `EXPLAINED_ERROR`, or at most
    `CONVINCING_ERROR` if it also removes the share `CONVINCING_SHARE` of the excess of the model without effects,
    `retuned`."""
    worst_error = candidate.score.worst_channel
    if worst_error <= EXPLAINED_ERROR:
        return True
    return worst_error <= CONVINCING_ERROR and compute_mismatch_share(retuned, candidate) >= CONVINCING_SHARE


def are_inseparable(best: FittedCandidate, rival: FittedCandidate) -> bool:
    """Whether the rival's error exceeds that of the best candidate by no more than chance (`AS_GOOD_GAIN`,
    `AS_GOOD_SHARE`), or by no more than the smaller of their gains on clean recordings, where neither effect is
    present."""
    difference = rival.score.mean_log_error - best.score.mean_log_error
    return difference <= max(AS_GOOD_GAIN, AS_GOOD_SHARE * compute_excess(best), min(rival.clean_gain, best.clean_gain))


def is_worthwhile(base: FittedCandidate, extended: FittedCandidate) -> bool:
    """Whether an effect lowers the mean log error enough to be added. Where the base has no excess or its largest error
    over channels is at most `EXPLAINED_ERROR`, but above `NOISE_ALONE`, the logarithm of that error must also fall by
    half."""
    gain, log_error = base.score.mean_log_error - extended.score.mean_log_error, np.log(base.score.worst_channel)
    is_small = compute_excess(base) == 0 or base.score.worst_channel <= EXPLAINED_ERROR
    if is_small and log_error > np.log(NOISE_ALONE) and np.log(extended.score.worst_channel) > log_error / 2:
        return False
    return gain > max(ADDED_SHARE * compute_excess(base), ADDED_GAIN)


def _is_special_case(special_candidate: FittedCandidate, general_candidate: FittedCandidate) -> bool:
    """Whether the last effect of one candidate is a special case of the other's last effect, at a subset of its
    sites."""
    special_claim, general_claim = (
        special_candidate.fitted.hypothesis.claims[-1],
        general_candidate.fitted.hypothesis.claims[-1],
    )
    return special_claim.effect.name in general_claim.effect.simpler and set(special_claim.sites) <= set(
        general_claim.sites
    )


def _is_preferable(simpler: FittedCandidate, refined: FittedCandidate) -> bool:
    """Whether the simpler candidate is preferred: where it is a special case of the refined one, whether that gains too
    little; else whether both are inseparable."""
    if not _is_special_case(simpler, refined):
        return are_inseparable(refined, simpler)
    gain = simpler.score.mean_log_error - refined.score.mean_log_error
    share = REFINED_FRICTION_SHARE if simpler.newest in DRY_FRICTION else REFINED_SHARE
    return gain <= max(REFINED_GAIN, min(share * compute_excess(simpler), REFINED_MOST_GAIN))


def has_far_smaller_error(law_candidate: FittedCandidate, effect_candidate: FittedCandidate) -> bool:
    """Whether a law outside the catalogue replaces a named effect: its excess error is at most the share
    `LAW_REPLACES_RATIO` of the effect's, and its mean log rms error on the held-out samples, if there are any, is lower
    by more than `NOISE_ACCURACY`. The second condition rejects a law that is the effect's formula in another form."""
    law_error, effect_error = (
        float(np.mean(np.log(candidate.score.test))) for candidate in (law_candidate, effect_candidate)
    )
    if np.isfinite(law_error) and law_error >= effect_error - NOISE_ACCURACY:
        return False
    return compute_excess(law_candidate) <= LAW_REPLACES_RATIO * compute_excess(effect_candidate)
