"""Parsimony: of explanations about as good, few numbers, a small re-tuning and an unrefined law are preferred."""

from collections.abc import Sequence

from analysis.diagnosis.search.families import DRY_FRICTION
from analysis.diagnosis.search.rivalry import Contender
from analysis.diagnosis.search.same_within_errors import excess, inseparable
from analysis.diagnosis.settings import REFINED_FRICTION_SHARE, REFINED_GAIN, REFINED_MOST_GAIN, REFINED_SHARE


def plainest_first(contenders: Sequence[Contender]) -> tuple[Contender, ...]:
    """contenders: by their errors, the best first. The same, with the preferred contender moved to the front."""
    if not contenders:
        return ()
    chosen = contenders[0]
    for other in contenders[1:]:
        if _is_plainer(other, chosen) and _good_enough(other, chosen):
            chosen = other
    return (chosen, *(contender for contender in contenders if contender is not chosen))


def _is_plainer(plain: Contender, other: Contender) -> bool:
    return only_refines(other, plain) or (_price(plain) < _price(other) and not only_refines(plain, other))


def _price(contender: Contender) -> float:
    """Akaike's information criterion (1974): two per number, and the squared deviations from the calibration."""
    deviations = contender.fitted.deviations
    return 2.0 * len(contender.fitted.hypothesis.point) + float(deviations @ deviations)


def only_refines(other: Contender, plain: Contender) -> bool:
    """Whether the other's last effect contains the plain one's as a special case, at the same place."""
    return _contained(plain, other)


def both_stand(named: Contender, other: Contender) -> bool:
    """Whether the other is inseparable from the named contender, and no refinement of it."""
    return inseparable(named, other) and not only_refines(other, named)


def _contained(contender: Contender, other: Contender) -> bool:
    plain, refined = contender.fitted.hypothesis.claims[-1], other.fitted.hypothesis.claims[-1]
    return plain.effect.name in refined.effect.simpler and set(plain.sites) <= set(refined.sites)


def _good_enough(plain: Contender, refined: Contender) -> bool:
    if not _contained(plain, refined):
        return inseparable(refined, plain)
    gained = plain.standing.chosen_by - refined.standing.chosen_by
    rubs = plain.newest in DRY_FRICTION
    share = REFINED_FRICTION_SHARE if rubs else REFINED_SHARE
    return gained <= max(REFINED_GAIN, min(share * excess(plain), REFINED_MOST_GAIN))
