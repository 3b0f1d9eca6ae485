"""Summary of a blind test for the terminal, misses first."""

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from analysis.evaluation.blind_test.wording import answer_text, concealed_text, figure_text, strength_text
from study.evaluation.bank.prove import BlindTest


def proof_lines(proof: BlindTest) -> Iterator[str]:
    """Figures, misses and controls as terminal lines."""
    score = proof.score
    yield f"{len(score.misses)} misses in {len(proof.outcomes)} cases"
    for miss in score.misses:
        strength = strength_text(miss)
        drawn = f"{concealed_text(miss)}{f' at {strength}' if strength else ''}"
        yield f"  {miss.number:5d} {miss.kind}, {miss.bank}: {drawn} -> {answer_text(miss)}"
    yield from control_lines(proof)
    yield ""
    for figure in score.figures:
        yield f"{figure.name:52s} {figure_text(figure)}"
    error = score.calibration.error
    if error is not None:
        low, high = score.calibration.low or 0.0, score.calibration.high or 0.0
        yield f"{'expected calibration error':52s} {error:.3f} [{low:.3f}, {high:.3f}]"
    yield ""
    yield from remarks(proof)
    yield f"Seal of the labels (SHA-256 of labels.sha256): {proof.seal}"
    yield f"Everything is in {proof.folder.path}"


def control_lines(proof: BlindTest) -> Iterator[str]:
    """Result of the controls; failed ones are listed one by one."""
    if proof.controls:
        yield f"{sum(each.held for each in proof.controls)} of {len(proof.controls)} controls held"
    for control in proof.controls:
        if not control.held:
            yield f"  {control.name}: {', then '.join(control.said)}"


def remarks(proof: BlindTest) -> Iterator[str]:
    """What limits this blind test: cases left out or unanswered, or answers from several versions of the code."""
    if proof.left_out:
        yield (
            f"{proof.left_out} cases of the second physics engine were left out: MuJoCo is not installed "
            "(pip install 'hapteq[prove]')."
        )
    if died := unanswered(proof):
        cases = "1 case has no answer" if died == 1 else f"{died} cases have no answer"
        yield (
            f"{cases}, because the processes were killed or took too long: counted as failed diagnoses. Run the same "
            "command again, which asks anew."
        )
    if set(proof.beside) - set(proof.engines):
        yield f"Follow-ups and controls were answered by another version of the diagnosis ({', '.join(proof.beside)})."
    if len(proof.engines) > 1:
        yield f"The answers come from {len(proof.engines)} versions of the diagnosis: run the bank anew for a figure."


def unanswered(proof: BlindTest) -> int:
    """Number of cases whose process died each time: a diagnosis that failed by itself says how long it took."""
    return sum(each.diagnosis is None and math.isnan(each.seconds) for each in proof.outcomes)


def summary(proof: BlindTest) -> dict[str, Any]:
    """The summary as a JSON-serialisable mapping."""
    return {
        "folder": str(proof.folder.path),
        "cases": len(proof.outcomes),
        "left_out": proof.left_out,
        "unanswered": unanswered(proof),
        "seal": proof.seal,
        "engines": list(proof.engines),
        "figures": {
            figure.name: {"value": figure.value, "ci95": [figure.low, figure.high], "of": figure.of}
            for figure in proof.score.figures
        },
        "expected_calibration_error": proof.score.calibration.error,
        "followed": [asdict(each) for each in proof.followed],
        "controls": {control.name: control.held for control in proof.controls},
        "misses": [miss.number for miss in proof.score.misses],
    }
