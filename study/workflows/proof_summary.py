"""What a proof amounts to, for the terminal: misses first."""

from collections.abc import Iterator
from typing import Any

from analysis.proof.outcome import Outcome
from analysis.proof.share import Figure
from study.workflows.prove import Proof


def proof_lines(proof: Proof) -> Iterator[str]:
    score = proof.score
    yield f"{len(score.misses)} misses in {len(proof.outcomes)} cases"
    for one in score.misses:
        yield f"  {miss_line(one)}"
    yield ""
    for figure in score.figures:
        yield f"{figure.name:52s} {figure_text(figure)}"
    error = score.calibration.error
    if error is not None:
        low, high = score.calibration.low or 0.0, score.calibration.high or 0.0
        yield f"{'expected calibration error':52s} {error:.3f} [{low:.3f}, {high:.3f}]"
    yield ""
    if proof.left_out:
        yield (
            f"{proof.left_out} cases of the second physics engine were left out: MuJoCo is not installed "
            "(pip install 'hapteq[prove]')."
        )
    if len(proof.engines) > 1:
        yield f"The answers come from {len(proof.engines)} versions of the diagnosis: run the bank anew for a figure."
    yield f"Seal of the labels (SHA-256 of labels.sha256): {proof.seal}"
    yield f"Everything is in {proof.folder.path}"


def figure_text(figure: Figure) -> str:
    if figure.value is None or figure.low is None or figure.high is None:
        return "none drawn"
    if figure.hits is None:
        return f"{figure.value:.3g} [{figure.low:.3g}, {figure.high:.3g}], of {figure.of}"
    low, high = 100 * figure.low, 100 * figure.high
    return f"{100 * figure.value:5.1f} % [{low:.0f}, {high:.0f}], {figure.hits} of {figure.of}"


def miss_line(one: Outcome) -> str:
    true = " + ".join(f"{c.effect}{f' of {c.axis}' if c.axis else ''}" for c in one.concealed) or "nothing"
    said = " + ".join(f"{e.effect}{f' of {e.axis}' if e.axis else ''} ({e.probability:.2f})" for e in one.named)
    strength = ", ".join(f"{value:.2f}" for value in one.strengths)
    strength = f" at {strength}" if strength else ""
    return f"{one.number:5d} {one.kind}/{one.bank}: {true}{strength} -> {one.verdict}{f': {said}' if said else ''}"


def summary(proof: Proof) -> dict[str, Any]:
    return {
        "folder": str(proof.folder.path),
        "cases": len(proof.outcomes),
        "left_out": proof.left_out,
        "seal": proof.seal,
        "engines": list(proof.engines),
        "figures": {
            figure.name: {"value": figure.value, "ci95": [figure.low, figure.high], "of": figure.of}
            for figure in proof.score.figures
        },
        "expected_calibration_error": proof.score.calibration.error,
        "misses": [one.number for one in proof.score.misses],
    }
