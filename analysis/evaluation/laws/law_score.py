"""Score of a blind test of law discovery: shares of correct and false answers, each with its 95 % confidence interval.

A bank is a set of simulated recordings, some with a concealed force law; the program must discover the law. Cases count
for discovery only where the law is detectable (`outcome.DETECTABLE_ERROR`). False alarms are counted on devices without
a missing effect, and on decoys: devices with an effect of the catalogue or a linear mode."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate, compute_share, compute_statistic
from analysis.evaluation.laws.law_outcome import LawOutcome


@dataclass(frozen=True, slots=True)
class LawScore:
    """Figures of a bank of laws with their intervals, and the outcomes that count as wrong (`LawOutcome.is_wrong`)."""

    figures: tuple[IntervalEstimate, ...]
    misses: tuple[LawOutcome, ...]


def compute_law_score(outcomes: Sequence[LawOutcome]) -> LawScore:
    """Compute the score of a bank: shares over the cases with a law, those where it is detectable, those without a
    missing effect, and decoys; and the median processor time (s) of a diagnosis."""
    law_cases = [case for case in outcomes if case.truth is not None]
    detectable_cases = [case for case in law_cases if case.detectable]
    null_cases = [case for case in outcomes if case.kind == "nothing"]
    decoy_cases = [case for case in outcomes if case.kind in ("decoy", "mode")]
    named_cases = [case for case in detectable_cases if case.named]
    figures = (
        compute_share("laws that show", law_cases, lambda case: case.detectable),
        compute_share("of these a law is named", detectable_cases, lambda case: bool(case.named)),
        compute_share("a law is named or a candidate", detectable_cases, lambda case: bool(case.laws)),
        compute_share("structure right, named or a candidate", detectable_cases, lambda case: case.structured),
        compute_share("structure right and named", detectable_cases, lambda case: bool(case.named) and case.structured),
        compute_share("function within 5 % where it was visited", detectable_cases, lambda case: case.close),
        compute_share("function within 5 % on louder commands", detectable_cases, lambda case: case.close_louder),
        compute_share("wrong law explained, of laws that show", detectable_cases, lambda case: case.wrongly_explained),
        compute_share("wrong law explained, of laws named", named_cases, lambda case: case.wrongly_explained),
        compute_share("a name of the catalogue explained instead", detectable_cases, _is_explained_by_other_effect),
        compute_share("a law named where nothing is missing", null_cases, lambda case: case.false_law),
        compute_share("a law named on decoys", decoy_cases, lambda case: case.false_law),
        compute_statistic("median processor seconds, laws", [case.seconds for case in law_cases], np.median),
        compute_statistic(
            "median processor seconds, nothing missing", [case.seconds for case in null_cases], np.median
        ),
    )
    return LawScore(figures, tuple(case for case in outcomes if case.is_wrong))


def _is_explained_by_other_effect(outcome: LawOutcome) -> bool:
    """Whether the verdict is "explained" by effects of the catalogue, without a law."""
    return outcome.verdict == "explained" and bool(outcome.names) and not outcome.named
