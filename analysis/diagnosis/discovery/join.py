"""A finished search, with a law that has no name where no catalogue name stands, or where the law is far better."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.discovery.as_effect import laws_of
from analysis.diagnosis.discovery.discover import Discovered, discover
from analysis.diagnosis.discovery.proof import beats, failed
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.identifiability import identified
from analysis.diagnosis.search.search import Searched
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.verdict import judge
from analysis.diagnosis.settings import NAMED_ERROR, NOISE_ALONE, SEALED_ALONE_ERROR
from analysis.diagnosis.types import Progress, TimeBudget


def with_laws(searched: Searched, progress: Progress, time_left: TimeBudget) -> Searched:
    """The same search where it needs no law, or where none is found that is better than what it names; a law that is
    not proved is a remark, and no more."""
    context, known = searched.context, searched.found
    if not _wanted(searched) or not time_left():
        return searched
    found = discover(context, known, progress, time_left)
    if found is None or not _gains(found.found) or not _beats_names(context, searched, found):
        return searched
    reasons = failed(found, context.whole.records)
    checked = identified(context, found.found, time_left)
    if len(checked.steps) < len(found.found.steps):
        reasons = (*reasons, "these recordings leave its numbers as good as open")
    judged = judge(checked)
    sealed = float(np.nanmax(checked.after.score.test, initial=0.0))
    if sealed > NAMED_ERROR:
        reasons = (*reasons, f"on what was kept for the test it leaves {sealed:.3g} times the noise")
    if not judged.named:
        reasons = (*reasons, "what was kept for the test does not bear it out")
    if reasons:
        return replace(searched, remarks=(*searched.remarks, _candidate(context, found, reasons)))
    return Searched(context, checked, judged, errors=None if checked.errors is None else checked.errors[1])


def _wanted(searched: Searched) -> bool:
    """Only whole simulations prove a law; where noise alone is left, there is none to be found."""
    context, found = searched.context, searched.found
    if context.measure.name != "free simulation" or context.sound is not None or context.certain or found.ended_early:
        return False
    left = found.after if searched.judged.named else found.retuned
    sealed = float(np.nanmax(left.score.test, initial=0.0))
    return found.statistic is None and (left.score.worst_channel > NOISE_ALONE or sealed > SEALED_ALONE_ERROR)


def _gains(found: Explanation) -> bool:
    """On sealed samples, in the mean over the channels."""
    before, after = _sealed(found.retuned), _sealed(found.after)
    return not (np.isfinite(before) and after >= before)


def _sealed(of: FittedCandidate) -> float:
    return float(np.mean(np.log(of.score.test)))


def _beats_names(context: SearchContext, searched: Searched, found: Discovered) -> bool:
    """What is named, and the best that was not."""
    known = searched.found
    rivals = [known.after] if known.steps else []
    if known.rounds and known.rounds[0]:
        rivals.append(context.confirmed(known.rounds[0][0]))
    return all(beats(found.found.after, rival) for rival in rivals)


def _candidate(context: SearchContext, found: Discovered, reasons: tuple[str, ...]) -> str:
    """A sentence."""
    after, retuned = found.found.after, found.found.retuned
    laws = [law for law in laws_of(after.fitted.hypothesis) if law is not None]
    said = " and ".join(f"F{law.axis} = {law.text} {context.tuning.model.system.force}" for law in laws)
    less = float(np.exp(_sealed(after) - _sealed(retuned)))
    gain = f", which leaves {100 * less:.3g} % of the re-tuned model's error on held-out data" if less < 1 else ""
    return (
        f"A law without a name is a candidate, and no more: {said}{gain}. Why it is not confirmed: "
        f"{'; '.join(dict.fromkeys(reasons))}."
    )
