"""Writes the results of a blind test of laws (`prove_laws`), in which laws outside the catalogue of effects are
concealed.

`write_laws` writes into the folder of the test: `proof.json` (all figures) and `proof.csv` (one row per case).
`write_law_table` writes figures and misses as small CSV tables that can be kept under version control. `law_lines` and
`law_summary` give the result as text for the terminal and as JSON.
"""

import json
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from analysis.evaluation.blind_test.wording import figure_text
from analysis.evaluation.laws.law_outcome import LawOutcome
from equalizer.laws.law import Law
from study.evaluation.bank.laws.prove_laws import LawBlindTest
from study.evaluation.bank.write_proof import FigureRow, commit
from study.store.disk.csv_rows import rows_to_csv
from study.store.disk.json_document import write_json
from study.store.disk.provenance import command_line, gather_provenance
from study.store.disk.text_file import write_text

FORMAT, VERSION = "hapteq-proof", 1
"""Name and version of the format of `proof.json`."""
DOCUMENT, TABLE = "proof.json", "proof.csv"
"""Names of the files in the folder of the test."""


@dataclass(frozen=True, slots=True)
class LawRow:
    """A case of the bank of laws as a row of proof.csv and of the table of misses."""

    number: int
    seed: int
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
    named: str
    """Laws that the diagnosis names."""
    names: str
    """Effects of the catalogue that the diagnosis names."""
    candidates: str
    """Laws that the diagnosis gives as candidates only."""
    structure: bool
    """Whether place, axis, variables and memory of the found laws are right."""
    error: float | None
    """Relative error of the found law in the visited range; None where it is unknown or infinite, as below."""
    louder: float | None
    """Relative error of the found law at a higher level."""
    retuned: float | None
    """Rms error of the re-tuned model over the noise's rms, in the worst channel."""
    after: float | None
    """The same ratio for the model with the effects that were found."""
    seconds: float | None
    """Processor time of the diagnosis (s)."""
    miss: bool


def write_laws(done: LawBlindTest) -> None:
    """Write document and table, replacing earlier ones. Raises StudyError."""
    document = {
        **_facts(done),
        "commit": commit(),
        "command": " ".join(command_line(sys.argv)),
    }
    write_json(done.folder.path / DOCUMENT, FORMAT, VERSION, document, gather_provenance(), overwrite=True)
    rows = [_row(each) for each in done.outcomes]
    write_text(done.folder.path / TABLE, rows_to_csv(rows, LawRow), overwrite=True)


def write_law_table(path: Path, done: LawBlindTest) -> None:
    """Write the figures as a small table at `path`, and the misses in a second table with the suffix -misses. Raises
    StudyError."""
    figures = [FigureRow(each.name, each.value, each.low, each.high, each.of) for each in done.score.figures]
    lines = [
        f"# {len(done.outcomes)} cases of laws, seeds {done.plan.seed} to {done.plan.seed + done.plan.cases - 1}",
        f"# commit {commit()}, code of the diagnosis {' '.join(done.engines)}",
        f"# seal of the labels {done.seal}",
    ]
    write_text(path, "\n".join(lines) + "\n" + rows_to_csv(figures, FigureRow), overwrite=True)
    misses = [_row(each) for each in done.score.misses]
    write_text(path.with_name(f"{path.stem}-misses{path.suffix}"), rows_to_csv(misses, LawRow), overwrite=True)


def law_lines(done: LawBlindTest) -> Iterator[str]:
    """Lines for the terminal: each miss, each figure, the seal of the labels."""
    yield f"{len(done.score.misses)} misses in {len(done.outcomes)} cases"
    for miss in done.score.misses:
        truth = miss.kind if miss.truth is None else miss.truth.formula
        yield f"  {miss.number:5d} {miss.concealed or 'nothing'} ({truth}): {_answer_text(miss)}"
    yield ""
    for figure in done.score.figures:
        yield f"{figure.name:52s} {figure_text(figure)}"
    if len(done.engines) > 1:
        yield (
            f"The answers come from {len(done.engines)} versions of the diagnosis: run the bank again, so that all "
            "figures are of one version."
        )
    yield f"Seal of the labels (SHA-256 of labels.sha256): {done.seal}"
    yield f"Everything is in {done.folder.path}"


def law_summary(done: LawBlindTest) -> str:
    """Result as JSON text."""
    return json.dumps({"folder": str(done.folder.path), **_facts(done)}, indent=2)


def _facts(done: LawBlindTest) -> dict[str, Any]:
    """Values that the document and the summary share."""
    return {
        "of": "laws",
        "seed": done.plan.seed,
        "cases": len(done.outcomes),
        "brief": done.plan.brief,
        "seal": done.seal,
        "engines": list(done.engines),
        "figures": [asdict(figure) for figure in done.score.figures],
        "misses": [miss.number for miss in done.score.misses],
    }


def _answer_text(of: LawOutcome) -> str:
    """The answer in words: verdict, effects, laws or candidates, and the error of the law in percent."""
    laws = " and ".join(_law_text(law) for law in of.laws)
    how = "" if of.named or not of.candidates else "candidate "
    names = ", ".join(of.names)
    near = f", {100 * of.errors[0]:.3g} % off" if of.errors else ""
    return f"{of.verdict}: {names}{' and ' if names and laws else ''}{how}{laws or ('' if names else 'no law')}{near}"


def _law_text(law: Law) -> str:
    return f"{law.acts_on} {law.axis} = {law.text}"


def _row(of: LawOutcome) -> LawRow:
    numbers = {} if of.truth is None else of.truth.numbers
    error, louder = of.errors or (None, None)
    return LawRow(
        of.number, of.seed, of.kind, of.concealed, " ".join(of.axes if of.truth is None else of.truth.axes),
        " ".join(f"{name}={value:.4g}" for name, value in numbers.items()), of.detectable, of.verdict,
        " and ".join(map(_law_text, of.named)), " ".join(of.names), " and ".join(map(_law_text, of.candidates)),
        of.structured, _short(error), _short(louder), _short(of.left("retuned")), _short(of.left("after")),
        _short(of.seconds), of.missed,
    )  # fmt: skip


def _short(value: float | None) -> float | None:
    """The value with four decimals; None for NaN and infinity."""
    return None if value is None or value != value or value == float("inf") else round(value, 4)
