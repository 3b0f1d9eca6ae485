"""Write the result of a blind test of laws (`prove_laws`): devices with concealed laws outside the effect catalogue.

`write_law_proof` writes into the folder of the test: `proof.json` (all figures) and `proof.csv` (one row per case).
`write_law_table` writes figures and misses as small CSV tables that can be kept under version control.
`format_law_lines` and `summarise_law_blind_test` return the result as text for the terminal and as JSON values. A miss
is a case with a wrong answer (`LawOutcome.is_wrong`).
"""

import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from analysis.evaluation.blind_test.wording import format_figure
from analysis.evaluation.laws.law_outcome import LawOutcome
from equalizer.laws.law import Law
from study.evaluation.bank.laws.prove_laws import LawBlindTest
from study.evaluation.bank.sealed_bank import count_unanswered_cases, describe_unanswered_cases
from study.evaluation.bank.write_proof import format_code_line, read_answering_commit, write_document, write_figures
from study.store.disk.provenance import anonymise_arguments


@dataclass(frozen=True, slots=True)
class LawRow:
    """A case of the test as a row of proof.csv and of the table of misses; the fields are the columns, in order."""

    number: int
    """Number of the case in the bank, from 0."""
    seed: int
    """Seed of its device."""
    kind: str
    """law, nothing, decoy (an effect of the catalogue) or mode (a linear mode)."""
    concealed: str
    """Name of the concealed law or effect."""
    at: str
    """Axes of the law; without a law, the axes of the case."""
    numbers: str
    """Parameters of the law as name=value, separated by blanks."""
    shows: bool
    """Whether the concealed law or effect is detectable."""
    verdict: str
    """Verdict of the diagnosis."""
    named: str
    """Laws that the diagnosis names."""
    names: str
    """Effects of the catalogue that the diagnosis names."""
    candidates: str
    """Laws that the diagnosis lists as candidates without naming them."""
    structure: bool
    """Whether place, axis, variables and memory of the laws in the answer (named, else candidates) are right."""
    error: float | None
    """Relative error of the law in the answer, in the visited range; None (here and below): unknown or infinite."""
    louder: float | None
    """Relative error of the law at a higher level than recorded."""
    retuned: float | None
    """Rms error of the re-tuned model over the noise's rms, in the worst channel."""
    after: float | None
    """Rms error of the model with the named effects over the noise's rms, in the worst channel."""
    seconds: float | None
    """Processor time of the diagnosis (s)."""
    miss: bool
    """Whether the answer is wrong."""


def write_law_proof(result: LawBlindTest) -> None:
    """Write `proof.json` and `proof.csv` into the folder of the test, replacing earlier ones. Raises StudyError where
    one cannot be written."""
    document = {
        **_collect_shared_fields(result),
        "commit": read_answering_commit(result.folder.path, result.engines),
        "command": " ".join(anonymise_arguments(sys.argv)),
    }
    write_document(result.folder.path, document, [_make_row(outcome) for outcome in result.outcomes], LawRow)


def write_law_table(path: Path, result: LawBlindTest) -> None:
    """Write the figures as a CSV table at `path`, and the misses as a second one, whose name ends in -misses. Raises
    StudyError where one cannot be written."""
    header_lines = [
        f"# {len(result.outcomes)} cases of laws, seeds {result.plan.seed} to "
        f"{result.plan.seed + result.plan.cases - 1}",
        format_code_line(result.folder.path, result.engines),
        f"# seal of the labels {result.seal}",
    ]
    misses = [_make_row(miss) for miss in result.score.misses]
    write_figures(path, header_lines, result.score.figures, misses, LawRow)


def format_law_lines(result: LawBlindTest) -> Iterator[str]:
    """Yield lines for the terminal: the number of misses, each miss, each figure, remarks on cases without an answer
    and on several versions of the diagnosis, the seal of the labels, and the folder."""
    yield f"{len(result.score.misses)} misses in {len(result.outcomes)} cases"
    for miss in result.score.misses:
        truth = miss.kind if miss.truth is None else miss.truth.formula
        yield f"  {miss.number:5d} {miss.concealed or 'nothing'} ({truth}): {_format_answer(miss)}"
    yield ""
    for figure in result.score.figures:
        yield f"{figure.name:52s} {format_figure(figure)}"
    yield from describe_unanswered_cases(result.outcomes)
    if len(result.engines) > 1:
        yield (
            f"The answers come from {len(result.engines)} versions of the diagnosis: run the bank again, so that all "
            "figures are of one version."
        )
    yield f"Seal of the labels (SHA-256 of labels.sha256): {result.seal}"
    yield f"Everything is in {result.folder.path}"


def summarise_law_blind_test(result: LawBlindTest) -> dict[str, Any]:
    """Summarise the result as JSON values."""
    summary = {"folder": str(result.folder.path), "unanswered": count_unanswered_cases(result.outcomes)}
    return summary | _collect_shared_fields(result)


def _collect_shared_fields(result: LawBlindTest) -> dict[str, Any]:
    """Collect the fields that `proof.json` and the summary share."""
    return {
        "of": "laws",
        "seed": result.plan.seed,
        "cases": len(result.outcomes),
        "brief": result.plan.brief,
        "seal": result.seal,
        "engines": list(result.engines),
        "figures": [asdict(figure) for figure in result.score.figures],
        "misses": [miss.number for miss in result.score.misses],
    }


def _format_answer(outcome: LawOutcome) -> str:
    """Format the answer as text: verdict, effects, laws or candidates, and the error of the law in percent."""
    laws = " and ".join(_format_law(law) for law in outcome.laws)
    candidate_prefix = "" if outcome.named or not outcome.candidates else "candidate "
    effect_names = ", ".join(outcome.names)
    error_text = f", {100 * outcome.errors[0]:.3g} % off" if outcome.errors else ""
    return (
        f"{outcome.verdict}: {effect_names}{' and ' if effect_names and laws else ''}{candidate_prefix}"
        f"{laws or ('' if effect_names else 'no law')}{error_text}"
    )


def _format_law(law: Law) -> str:
    """Format a law as place, axis and formula."""
    return f"{law.acts_on} {law.axis} = {law.text}"


def _make_row(outcome: LawOutcome) -> LawRow:
    """Convert the outcome of a case to a row; lists are joined to text."""
    parameters = {} if outcome.truth is None else outcome.truth.numbers
    law_error, louder_error = outcome.errors or (None, None)
    return LawRow(
        outcome.number, outcome.seed, outcome.kind, outcome.concealed,
        " ".join(outcome.axes if outcome.truth is None else outcome.truth.axes),
        " ".join(f"{name}={value:.4g}" for name, value in parameters.items()), outcome.detectable, outcome.verdict,
        " and ".join(map(_format_law, outcome.named)), " ".join(outcome.names),
        " and ".join(map(_format_law, outcome.candidates)), outcome.structured, _round(law_error), _round(louder_error),
        _round(outcome.compute_worst_error("retuned")), _round(outcome.compute_worst_error("after")),
        _round(outcome.seconds), outcome.is_wrong,
    )  # fmt: skip


def _round(value: float | None) -> float | None:
    """Round to four decimals; None for None, NaN and +infinity."""
    return None if value is None or value != value or value == float("inf") else round(value, 4)
