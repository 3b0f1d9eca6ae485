"""A finished search, with a law that has no name where no catalogue name stands, or where the law is far better."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.discovery.as_effect import laws_of
from analysis.diagnosis.discovery.discover import Discovered, discover
from analysis.diagnosis.discovery.proof import beats, failed
from analysis.diagnosis.search.determined import determined
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.rivalry import Arena, Contender
from analysis.diagnosis.search.search import Searched
from analysis.diagnosis.search.verdict import judge
from analysis.diagnosis.settings import NAMED_ERROR, NOISE_ALONE, SEALED_ALONE_ERROR
from analysis.diagnosis.types import Patience, Progress


def with_laws(searched: Searched, progress: Progress, patient: Patience) -> Searched:
    """The same search where it needs no law, or where none is found that is better than what it names; a law that is
    not proved is a remark, and no more."""
    arena, known = searched.arena, searched.found
    if not _wanted(searched) or not patient():
        return searched
    found = discover(arena, known, progress, patient)
    if found is None or not _gains(found.found) or not _beats_names(arena, searched, found):
        return searched
    reasons = failed(found, arena.whole.records)
    checked = determined(arena, found.found, patient)
    if len(checked.steps) < len(found.found.steps):
        reasons = (*reasons, "these recordings leave its numbers as good as open")
    judged = judge(checked)
    sealed = float(np.nanmax(checked.after.standing.test, initial=0.0))
    if sealed > NAMED_ERROR:
        reasons = (*reasons, f"on what was kept for the test it leaves {sealed:.3g} times the noise")
    if not judged.named:
        reasons = (*reasons, "what was kept for the test does not bear it out")
    if reasons:
        return replace(searched, remarks=(*searched.remarks, _candidate(arena, found, reasons)))
    return Searched(arena, checked, judged, errors=None if checked.errors is None else checked.errors[1])


def _wanted(searched: Searched) -> bool:
    """Only whole simulations prove a law; where noise alone is left, there is none to be found."""
    arena, found = searched.arena, searched.found
    if arena.measure.name != "free simulation" or arena.sound is not None or arena.certain or found.ended_early:
        return False
    left = found.after if searched.judged.named else found.retuned
    sealed = float(np.nanmax(left.standing.test, initial=0.0))
    return found.statistic is None and (left.standing.seen > NOISE_ALONE or sealed > SEALED_ALONE_ERROR)


def _gains(found: Explanation) -> bool:
    """On sealed samples, in the mean over the channels."""
    before, after = _sealed(found.retuned), _sealed(found.after)
    return not (np.isfinite(before) and after >= before)


def _sealed(of: Contender) -> float:
    return float(np.mean(np.log(of.standing.test)))


def _beats_names(arena: Arena, searched: Searched, found: Discovered) -> bool:
    """What is named, and the best that was not."""
    known = searched.found
    rivals = [known.after] if known.steps else []
    if known.rounds and known.rounds[0]:
        rivals.append(arena.confirmed(known.rounds[0][0]))
    return all(beats(found.found.after, rival) for rival in rivals)


def _candidate(arena: Arena, found: Discovered, reasons: tuple[str, ...]) -> str:
    """A sentence."""
    after, retuned = found.found.after, found.found.retuned
    laws = [law for law in laws_of(after.fitted.hypothesis) if law is not None]
    said = " and ".join(f"F{law.axis} = {law.text} {arena.tuning.model.system.force}" for law in laws)
    less = float(np.exp(_sealed(after) - _sealed(retuned)))
    gain = f", which leaves {100 * less:.3g} % of the re-tuned model's error on held-out data" if less < 1 else ""
    return (
        f"A law without a name is a candidate, and no more: {said}{gain}. Why it is not confirmed: "
        f"{'; '.join(dict.fromkeys(reasons))}."
    )
