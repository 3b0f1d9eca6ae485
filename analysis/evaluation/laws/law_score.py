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
    laws = [each for each in outcomes if each.truth is not None]
    shown = [each for each in laws if each.detectable]
    nulls = [each for each in outcomes if each.kind == "nothing"]
    others = [each for each in outcomes if each.kind in ("decoy", "mode")]
    with_names = [each for each in shown if each.named]
    figures = (
        share("laws that show", laws, lambda each: each.detectable),
        share("of these a law is named", shown, lambda each: bool(each.named)),
        share("a law is named or a candidate", shown, lambda each: bool(each.laws)),
        share("structure right, named or a candidate", shown, lambda each: each.structured),
        share("structure right and named", shown, lambda each: bool(each.named) and each.structured),
        share("function within 5 % where it was visited", shown, lambda each: each.close),
        share("function within 5 % on louder commands", shown, lambda each: each.close_louder),
        share("wrong law explained, of laws that show", shown, lambda each: each.wrongly_explained),
        share("wrong law explained, of laws named", with_names, lambda each: each.wrongly_explained),
        share("a name of the catalogue explained instead", shown, _is_explained_by_other_effect),
        share("a law named where nothing is missing", nulls, lambda each: each.false_law),
        share("a law named on decoys", others, lambda each: each.false_law),
        statistic("median processor seconds, laws", [each.seconds for each in laws], np.median),
        statistic("median processor seconds, nothing missing", [each.seconds for each in nulls], np.median),
    )
    return LawScore(figures, tuple(each for each in outcomes if each.missed))


def _is_explained_by_other_effect(outcome: LawOutcome) -> bool:
    """Whether the verdict is "explained" by effects of the catalogue, without a law."""
    return outcome.verdict == "explained" and bool(outcome.names) and not outcome.named
