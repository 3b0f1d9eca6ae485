"""Summary of a blind test (`hapteq prove`) for the terminal and as JSON: misses and failed controls first, then the
shares with their intervals."""

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from analysis.evaluation.blind_test.wording import answer_text, describe_concealed, figure_text, strength_text
from study.evaluation.bank.prove import BlindTest


def blind_test_lines(done: BlindTest) -> Iterator[str]:
    """Lines for the terminal: every miss, the controls, each share with its 95 % interval, the expected calibration
    error of the probabilities, remarks, the seal of the labels."""
    score = done.score
    yield f"{len(score.misses)} misses in {len(done.outcomes)} cases"
    for miss in score.misses:
        strength = strength_text(miss)
        drawn = f"{describe_concealed(miss)}{f' at {strength}' if strength else ''}"
        yield f"  {miss.number:5d} {miss.kind}, {miss.bank}: {drawn} -> {answer_text(miss)}"
    yield from control_lines(done)
    yield ""
    for figure in score.figures:
        yield f"{figure.name:52s} {figure_text(figure)}"
    error = score.calibration.error
    if error is not None:
        low, high = score.calibration.low or 0.0, score.calibration.high or 0.0
        yield f"{'expected calibration error':52s} {error:.3f} [{low:.3f}, {high:.3f}]"
    yield ""
    yield from remarks(done)
    yield f"Seal of the labels (SHA-256 of labels.sha256): {done.seal}"
    yield f"Everything is in {done.folder.path}"


def control_lines(done: BlindTest) -> Iterator[str]:
    """Number of controls that held, and each failed control with the answers to it."""
    if done.controls:
        yield f"{sum(each.held for each in done.controls)} of {len(done.controls)} controls held"
    for control in done.controls:
        if not control.held:
            yield f"  {control.name}: {', then '.join(control.said)}"


def remarks(done: BlindTest) -> Iterator[str]:
    """Sentences on what limits this blind test: cases that were left out or have no answer, answers by several versions
    of the code."""
    if done.left_out:
        yield (
            f"{done.left_out} cases of the second physics engine were left out: MuJoCo is not installed "
            "(pip install 'hapteq[prove]')."
        )
    if died := unanswered(done):
        cases = "1 case has no answer" if died == 1 else f"{died} cases have no answer"
        yield (
            f"{cases}, because the processes were killed or took too long: counted as failed diagnoses. Run the same "
            "command again to repeat them."
        )
    if set(done.beside) - set(done.engines):
        yield f"Follow-ups and controls were answered by another version of the diagnosis ({', '.join(done.beside)})."
    if len(done.engines) > 1:
        yield (
            f"The answers come from {len(done.engines)} versions of the diagnosis: run the bank again, so that all "
            "are of one version."
        )


def unanswered(done: BlindTest) -> int:
    """Number of cases whose process died or was killed at every attempt: they have no duration, whereas a diagnosis
    that failed by itself has a duration."""
    return sum(each.diagnosis is None and math.isnan(each.seconds) for each in done.outcomes)


def summary(done: BlindTest) -> dict[str, Any]:
    """The summary as JSON values; of each share its value, 95 % interval and number of cases."""
    return {
        "folder": str(done.folder.path),
        "cases": len(done.outcomes),
        "left_out": done.left_out,
        "unanswered": unanswered(done),
        "seal": done.seal,
        "engines": list(done.engines),
        "figures": {
            figure.name: {"value": figure.value, "ci95": [figure.low, figure.high], "of": figure.of}
            for figure in done.score.figures
        },
        "expected_calibration_error": done.score.calibration.error,
        "followed": [asdict(each) for each in done.followed],
        "controls": {control.name: control.held for control in done.controls},
        "misses": [miss.number for miss in done.score.misses],
    }
