"""Summary of a blind test of the diagnosis (`hapteq prove`), as lines for the terminal and as JSON values.

A blind test diagnoses a bank of simulated cases with concealed effects, whose labels are sealed (hashed) beforehand. A
miss is a case with a wrong answer; a control is an altered input for which the expected answer is known.
"""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from analysis.evaluation.blind_test.wording import (
    describe_answer,
    describe_concealed,
    describe_strengths,
    format_figure,
)
from study.evaluation.bank.prove import BlindTest
from study.evaluation.bank.sealed_bank import count_unanswered_cases, describe_unanswered_cases


def format_blind_test(result: BlindTest) -> Iterator[str]:
    """Format the summary as lines for the terminal: misses, number of controls that were answered as expected and the
    others with their answers, figures with their 95 % confidence intervals, the expected calibration error of the
    probabilities where it is known, remarks, the seal of the labels, the folder."""
    score = result.score
    yield f"{len(score.misses)} misses in {len(result.outcomes)} cases"
    for miss in score.misses:
        strength = describe_strengths(miss)
        concealed = f"{describe_concealed(miss)}{f' at {strength}' if strength else ''}"
        yield f"  {miss.number:5d} {miss.kind}, {miss.bank}: {concealed} -> {describe_answer(miss)}"
    if result.controls:
        yield f"{sum(outcome.held for outcome in result.controls)} of {len(result.controls)} controls held"
    for control in result.controls:
        if not control.held:
            yield f"  {control.name}: {', then '.join(control.said)}"
    yield ""
    for figure in score.figures:
        yield f"{figure.name:52s} {format_figure(figure)}"
    calibration_error = score.calibration.error
    if calibration_error is not None:
        low, high = score.calibration.low or 0.0, score.calibration.high or 0.0
        yield f"{'expected calibration error':52s} {calibration_error:.3f} [{low:.3f}, {high:.3f}]"
    yield ""
    yield from list_remarks(result)
    yield f"Seal of the labels (SHA-256 of labels.sha256): {result.seal}"
    yield f"Everything is in {result.folder.path}"


def list_remarks(result: BlindTest) -> Iterator[str]:
    """List the limitations of this blind test as sentences: cases that were left out or have no answer, answers of
    several versions of the code."""
    if result.omitted_cases:
        yield (
            f"{result.omitted_cases} cases of the second physics engine were left out: MuJoCo is not installed "
            "(pip install 'hapteq[prove]')."
        )
    yield from describe_unanswered_cases(result.outcomes)
    if set(result.other_engines) - set(result.engines):
        yield (
            "Follow-ups and controls were answered by another version of the diagnosis "
            f"({', '.join(result.other_engines)})."
        )
    if len(result.engines) > 1:
        yield (
            f"The answers come from {len(result.engines)} versions of the diagnosis: run the bank again, so that all "
            "are of one version."
        )


def summarise_blind_test(result: BlindTest) -> dict[str, Any]:
    """Summarise the blind test as JSON values; each figure with its value, 95 % confidence interval and number of
    cases."""
    return {
        "folder": str(result.folder.path),
        "cases": len(result.outcomes),
        "left_out": result.omitted_cases,
        "unanswered": count_unanswered_cases(result.outcomes),
        "seal": result.seal,
        "engines": list(result.engines),
        "figures": {
            figure.name: {"value": figure.value, "ci95": [figure.low, figure.high], "of": figure.of}
            for figure in result.score.figures
        },
        "expected_calibration_error": result.score.calibration.error,
        "followed": [asdict(follow_up) for follow_up in result.follow_ups],
        "controls": {control.name: control.held for control in result.controls},
        "misses": [miss.number for miss in result.score.misses],
    }
