"""Summary of a blind test (`hapteq prove`) for the terminal and as JSON: misses and failed controls first, then the
shares with their intervals. `study.cli.prove` writes both; `write_proof` takes `list_remarks`."""

import math
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


def format_blind_test(result: BlindTest) -> Iterator[str]:
    """Lines for the terminal: every miss, the controls, each share with its 95 % interval, the expected calibration
    error of the probabilities, remarks, the seal of the labels."""
    score = result.score
    yield f"{len(score.misses)} misses in {len(result.outcomes)} cases"
    for miss in score.misses:
        strength = describe_strengths(miss)
        concealed = f"{describe_concealed(miss)}{f' at {strength}' if strength else ''}"
        yield f"  {miss.number:5d} {miss.kind}, {miss.bank}: {concealed} -> {describe_answer(miss)}"
    yield from format_controls(result)
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


def format_controls(result: BlindTest) -> Iterator[str]:
    """Lines with the number of controls that held (were answered as expected), and each failed control with its
    answers."""
    if result.controls:
        yield f"{sum(outcome.held for outcome in result.controls)} of {len(result.controls)} controls held"
    for control in result.controls:
        if not control.held:
            yield f"  {control.name}: {', then '.join(control.said)}"


def list_remarks(result: BlindTest) -> Iterator[str]:
    """Sentences on what limits this blind test: cases that were left out or have no answer, answers by several versions
    of the code."""
    if result.omitted_cases:
        yield (
            f"{result.omitted_cases} cases of the second physics engine were left out: MuJoCo is not installed "
            "(pip install 'hapteq[prove]')."
        )
    if unanswered_count := count_unanswered_cases(result):
        subject = "1 case has no answer" if unanswered_count == 1 else f"{unanswered_count} cases have no answer"
        yield (
            f"{subject}, because the processes were killed or took too long: counted as failed diagnoses. Run the same "
            "command again to repeat them."
        )
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


def count_unanswered_cases(result: BlindTest) -> int:
    """Number of cases whose process died or was killed at every attempt: they have no duration, whereas a diagnosis
    that failed by itself has a duration."""
    return sum(outcome.diagnosis is None and math.isnan(outcome.seconds) for outcome in result.outcomes)


def summarise_blind_test(result: BlindTest) -> dict[str, Any]:
    """The summary as JSON values; of each share its value, 95 % interval and number of cases."""
    return {
        "folder": str(result.folder.path),
        "cases": len(result.outcomes),
        "left_out": result.omitted_cases,
        "unanswered": count_unanswered_cases(result),
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
