"""Score of a bank of laws: shares of right and wrong answers, each with its 95 % interval.

Cases with a concealed law count for naming only where its effect is detectable (`outcome.DETECTABLE`). False alarms are
counted on devices without a missing effect, and on decoys: devices with an effect of the catalogue or a linear mode.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.evaluation.blind_test.confidence_intervals import Figure, share, statistic
from analysis.evaluation.laws.law_outcome import LawOutcome


@dataclass(frozen=True, slots=True)
class LawScore:
    """Figures of a bank of laws with their intervals, and the outcomes that count as misses."""

    figures: tuple[Figure, ...]
    misses: tuple[LawOutcome, ...]


def law_score(outcomes: Sequence[LawOutcome]) -> LawScore:
    """Score of a bank: rates over cases with a law, without a missing effect and with decoys, and the median processor
    time (s)."""
    laws = [case for case in outcomes if case.truth is not None]
    detectable = [case for case in laws if case.detectable]
    nulls = [case for case in outcomes if case.kind == "nothing"]
    decoys = [case for case in outcomes if case.kind in ("decoy", "mode")]
    with_names = [case for case in detectable if case.named]
    figures = (
        share("laws that show", laws, lambda case: case.detectable),
        share("of these a law is named", detectable, lambda case: bool(case.named)),
        share("a law is named or a candidate", detectable, lambda case: bool(case.laws)),
        share("structure right, named or a candidate", detectable, lambda case: case.structured),
        share("structure right and named", detectable, lambda case: bool(case.named) and case.structured),
        share("function within 5 % where it was visited", detectable, lambda case: case.close),
        share("function within 5 % on louder commands", detectable, lambda case: case.close_louder),
        share("wrong law explained, of laws that show", detectable, lambda case: case.wrongly_explained),
        share("wrong law explained, of laws named", with_names, lambda case: case.wrongly_explained),
        share("a name of the catalogue explained instead", detectable, _is_explained_by_other_effect),
        share("a law named where nothing is missing", nulls, lambda case: case.false_law),
        share("a law named on decoys", decoys, lambda case: case.false_law),
        statistic("median processor seconds, laws", [case.seconds for case in laws], np.median),
        statistic("median processor seconds, nothing missing", [case.seconds for case in nulls], np.median),
    )
    return LawScore(figures, tuple(case for case in outcomes if case.missed))


def _is_explained_by_other_effect(outcome: LawOutcome) -> bool:
    """Whether the verdict is "explained" by effects of the catalogue, without a law."""
    return outcome.verdict == "explained" and bool(outcome.names) and not outcome.named
